#!/usr/bin/env bash
# packages.sh LIST...: installs the Debian packages of the lists that are missing; asks no network if none is.
set -euo pipefail

# Installed packages and what they provide: nodejs from elsewhere than Debian has npm in it.
present=$({ dpkg-query -W -f '${db:Status-Status} ${Package}, ${Provides}\n' 2>/dev/null || true; } |
    sed -n 's/^installed //p' | tr ',' '\n' | sed 's/^ *//; s/ .*//')
missing=()
while read -r name _; do
    case "$name" in '' | '#'*) continue ;; esac
    grep -qxF -- "$name" <<<"$present" || missing+=("$name")
done < <(cat "$@")
[ ${#missing[@]} -gt 0 ] || exit 0

if ! command -v apt-get >/dev/null; then
    echo "These Debian 12 packages are needed, and there is no apt-get here: ${missing[*]}" >&2
    exit 1
fi
as_root=()
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || {
        echo "Run this as root, or install sudo, or have these installed: ${missing[*]}" >&2
        exit 1
    }
    as_root=(sudo)
fi
echo "Installing ${missing[*]}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if ! { "${as_root[@]}" apt-get update -qq &&
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
    tail -n 20 "$log" >&2
    echo "apt-get could not install them" >&2
    exit 1
fi
