#!/usr/bin/env bash
# Builds impactd, starts it, runs the paper's scene and shows its motion; serves until Ctrl-C.
# --once: stops by itself. On a bare Debian 12 it first installs what is missing (as root or with sudo).
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
scene=$here/schema/examples/paper_free_sponge.json
impactd=$here/build/impactd

once=false
case "${1-}" in
'') ;;
--once) once=true ;;
*)
    echo "usage: server/demo.sh [--once]" >&2
    exit 2
    ;;
esac

"$here/server/packages.sh" "$here/server/packages.txt"

echo "Building"
mkdir -p "$here/build"
if ! (cd "$here" && cmake --preset release -DIMPACTD_TESTS=OFF && cmake --build --preset release --target impactd) \
    >"$here/build/demo.log" 2>&1; then
    tail -n 40 "$here/build/demo.log" >&2
    echo "the build failed; all of its output is in build/demo.log" >&2
    exit 1
fi

port=8080
is_open() { (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; }
while is_open; do port=$((port + 1)); done
export IMPACTD_SERVER=http://127.0.0.1:$port

log=$(mktemp)
daemon=
finish() {
    trap - EXIT INT TERM
    if [ -n "$daemon" ]; then
        kill -TERM "$daemon" 2>/dev/null || true
        wait "$daemon" 2>/dev/null || true
    fi
    rm -f "$log"
}
trap finish EXIT
trap 'finish; exit 130' INT TERM

"$impactd" serve --listen "127.0.0.1:$port" >"$log" 2>&1 &
daemon=$!
until is_open; do
    if ! kill -0 "$daemon" 2>/dev/null; then
        cat "$log" >&2
        echo "the server did not start (IMPACTD_DATA sets its data folder)" >&2
        exit 1
    fi
    sleep 0.1
done
job=$("$impactd" submit "$scene" --wait 60)

# `impactd run` draws on a terminal only; where there is none, script is one.
echo
export LC_ALL=C.UTF-8
if [ -t 1 ]; then
    "$impactd" run "$scene"
else
    COLUMNS=80 TERM=dumb script -qec "$(printf '%q ' "$impactd" run "$scene")" /dev/null </dev/null | tr -d '\r'
fi

echo
echo "Dashboard  $IMPACTD_SERVER/"
echo "This run   $IMPACTD_SERVER/#/jobs/$job"
echo "Guide      $IMPACTD_SERVER/guide/"
$once && exit 0
echo
echo "Serving until Ctrl-C"
wait "$daemon"
