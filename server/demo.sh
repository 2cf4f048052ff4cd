#!/usr/bin/env bash
# Builds impactd, starts it, submits the paper's scene with curl and shows the answer; serves until Ctrl-C.
# --once: stops by itself. On a bare Debian 12 it first installs what is missing (as root or with sudo).
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
scene=$here/schema/examples/paper_free_sponge.json

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
while (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; do port=$((port + 1)); done
[ "$port" = 8080 ] || echo "Port 8080 is taken, so this one serves on $port"
url=http://127.0.0.1:$port

work=$(mktemp -d)
daemon=
finish() {
    trap - EXIT INT TERM
    if [ -n "$daemon" ]; then
        kill -TERM "$daemon" 2>/dev/null || true
        wait "$daemon" 2>/dev/null || true
    fi
    rm -rf "$work"
}
trap finish EXIT
trap 'finish; exit 130' INT TERM

"$here/build/impactd" serve --listen "127.0.0.1:$port" >"$work/out" 2>&1 &
daemon=$!
for _ in $(seq 100); do
    curl -fsS "$url/health/ready" >/dev/null 2>&1 && break
    if ! kill -0 "$daemon" 2>/dev/null; then
        cat "$work/out" >&2
        echo "the daemon did not start (its data folder can be set by IMPACTD_DATA)" >&2
        exit 1
    fi
    sleep 0.1
done

curl -fsS -H 'Content-Type: application/json' --data-binary @"$scene" "$url/v1/jobs" >"$work/job"
if [ "$(jq -r .status "$work/job")" != successful ]; then
    jq . "$work/job" >&2
    exit 1
fi
result=$url$(jq -r .links.result "$work/job")
curl -fsS "$result/impacts.json" >"$work/impacts"
curl -fsS "$result/psd.json" >"$work/psd"

echo
jq -r '"\(.title // "The scene"): \(.status)\(if .cached then ", known from an earlier run" else "" end)"' "$work/job"
echo
jq -r '.plan.derived[] | [.side, .material, .restitution, .contact_time, .stiffness, .damping] | @tsv' "$work/job" |
    awk -F '\t' '{ printf "  %-5s stop: %s, e = %s, T_c = %s s  ->  k_b = %.2f N/m, c_b = %.4f N s/m\n", $1, $2, $3, $4, $5, $6 }'
echo
printf '  %-20s %-6s %15s %17s %15s\n' 'impact starts [s]' side 'approach [m/s]' 'separation [m/s]' 'peak force [N]'
jq -r '.impacts[:5][] | [.start, .side, .approach_speed, .separation_speed, .peak_force] | @tsv' "$work/impacts" |
    awk -F '\t' '{ printf "  %-20.16g %-6s %15.6f %17.6f %15.6f\n", $1, $2, $3, $4, $5 }'
jq -r 'if .count > 5 then "  ... \(.count - 5) more" else empty end' "$work/impacts"
echo
jq -r '.summary | to_entries[] | select(.value != null) | [.key, .value] | @tsv' "$work/job" |
    awk -F '\t' '{ printf "  %-28s %.9g\n", $1, $2 }'
echo
echo "  PSD of the mean acceleration, where it is largest:"
jq -r '[.frequency.values, .channels.mean_acceleration.values] | transpose | sort_by(-.[1])[:3] | sort_by(.[0])[] | @tsv' \
    "$work/psd" | awk -F '\t' '{ printf "  %8.4f Hz  %.6g (m/s^2)^2/Hz\n", $1, $2 }'
echo
echo "$url"
echo "curl -H 'Content-Type: application/json' --data-binary @$scene $url/v1/jobs"

$once && exit 0
echo
echo "Serving until Ctrl-C"
wait "$daemon"
