#!/bin/sh
# The browser tests drive Chromium, the store's tests a PostgreSQL server that they start themselves. On Debian and
# Ubuntu both come from the distribution; elsewhere say what is missing.
set -eu
missing=""
command -v chromium >/dev/null 2>&1 || missing="chromium"
command -v postgres >/dev/null 2>&1 || ls /usr/lib/postgresql/*/bin/postgres >/dev/null 2>&1 || missing="$missing postgresql"
[ -n "$missing" ] || exit 0
if command -v apt-get >/dev/null 2>&1; then
    as_root=""
    [ "$(id -u)" = 0 ] || as_root="sudo -n"
    # shellcheck disable=SC2086
    if $as_root apt-get update -qq && $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq $missing >/dev/null; then
        exit 0
    fi
fi
echo "the tests need $missing: install from your distribution, so that chromium is on PATH and postgres found" >&2
exit 1
