#!/bin/sh
# The browser tests drive Chromium, the store tests also run on PostgreSQL (they are skipped without it). On Debian and
# Ubuntu both come from the distribution; elsewhere say what is missing.
set -eu
if ! ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1 && ! command -v initdb >/dev/null 2>&1; then
    if command -v apt-get >/dev/null 2>&1; then
        root=""
        [ "$(id -u)" = 0 ] || root="sudo -n"
        { $root apt-get update -qq && $root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq postgresql >/dev/null; } ||
            echo "PostgreSQL could not be installed: the store is tested on SQLite only" >&2
    fi
fi
command -v chromium >/dev/null 2>&1 && exit 0
if command -v apt-get >/dev/null 2>&1; then
    as_root=""
    [ "$(id -u)" = 0 ] || as_root="sudo -n"
    if $as_root apt-get update -qq && $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq chromium >/dev/null; then
        exit 0
    fi
fi
echo "Chromium is needed by the browser tests: install the package 'chromium' so that it is on PATH" >&2
exit 1
