#!/bin/sh
# The browser tests drive Chromium. On Debian and Ubuntu it comes from the distribution; elsewhere say what is missing.
set -eu
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
