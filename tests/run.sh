#!/usr/bin/env bash
# What a commit has to pass: the release build with truth tests, unit tests of the core and the tests of the program, and
# the build with address and undefined-behaviour sanitizers with all unit tests and those of hostile input. --quick: the
# release build only, with all unit tests. tests/nightly.sh runs everything else.
# On a bare Debian 12 it first installs what is missing (as root or with sudo). The last line counts.
#
# The release build comes first and is tested while the other is made, at the lowest priority. Two tests run at a time;
# ctest takes both places, and the browser tests have no other beside them. Each test states its CPU time (without that
# of daemons and browsers that end by themselves).
set -uo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
cd "$here" || exit 1

presets=(release debug)
case "${1-}" in
'') ;;
--quick) presets=(release) ;;
*)
    echo "usage: tests/run.sh [--quick]" >&2
    exit 2
    ;;
esac

server/packages.sh server/packages.txt tests/packages.txt || exit 1

export ASAN_OPTIONS=detect_leaks=1 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
# Debian's python3, which has the packages, whatever else is in PATH.
python=/usr/bin/python3
passed=0
failed=0
work=$(mktemp -d)
builder=                           # the process of the build that is being made
declare -A made                    # by preset: yes, no
declare -A running log began       # by process: "PRESET TEST", its output, when it began
cpu_total=0
finish() {
    [ -z "$builder" ] || kill -- "-$builder" 2>/dev/null
    [ ${#running[@]} -eq 0 ] || kill "${!running[@]}" 2>/dev/null
    rm -rf "$work"
}
trap finish EXIT
trap 'exit 130' INT TERM

# The tests in their order, each "PRESET TEST" where the test is ctest or a file. Those of hostile input run against the
# instrumented program as well. Tests that mostly wait come first, as they take no place.
judge=tests/contract/test_traffic.py
mapfile -t commits < <(grep -L '^NIGHTLY = True' tests/contract/test_*.py)
files() { grep -l "$@" "${commits[@]}"; }
queue=()
mapfile -t -O 0 queue < <(
    echo release tests/browser/test_browser.py
    files '^WAITS = True' | sed 's/^/release /'
    files '^WAITS = True' | xargs grep -l '^SANITIZED = True' | sed 's/^/debug /'
    printf '%s ctest\n' "${presets[@]}"
    files -L '^WAITS = True' | grep -vxF "$judge" | sed 's/^/release /'
    printf 'release %s\n' "$judge" tests/truth/test_*.py
    files '^SANITIZED = True' | xargs grep -L '^WAITS = True' | sed 's/^/debug /'
)
for at in "${!queue[@]}"; do [[ " ${presets[*]} " == *" ${queue[at]% *} "* ]] || unset "queue[at]"; done

# What the program's tests say to daemons is recorded; the judge of that begins when all was said.
is_recorded() { [[ $1 == "release tests/contract/"* && $1 != *" $judge" ]]; }
unsaid=0
for one in "${queue[@]}"; do ! is_recorded "$one" || unsaid=$((unsaid + 1)); done

# Builds a preset with this niceness. A session of its own, as some kernels share out time by sessions first.
make_build() {
    # The instrumented build runs the unit tests of the server; benchmarks are for tests/nightly.sh.
    local target=all
    [ "$1" != release ] || [ ${#presets[@]} -eq 1 ] || target=tests_commit
    setsid nice -n "$2" bash -c 'echo "$1" >/proc/self/autogroup
        cmake --preset "$0" -DIMPACTD_TESTS=ON && cmake --build --preset "$0" --target "$2"
        code=$?
        times >"$3"
        exit "$code"' "$1" "$2" "$target" "$work/$1.times" >"$work/$1" 2>&1 &
    builder=$!
}

# FILE of bash's `times`: CPU seconds of all children.
cpu() {
    awk 'NR == 2 { for (i = 1; i <= 2; i++) { split($i, part, /[ms]/); sum += 60 * part[1] + part[2] } }
         END { printf "%.1f\n", sum }' "$1" 2>/dev/null || echo 0
}

# PRESET CODE
build_ended() {
    builder=
    if [ "$2" -eq 0 ]; then
        made[$1]=yes
        local seconds
        seconds=$(cpu "$work/$1.times")
        cpu_total=$(awk "BEGIN { print $cpu_total + $seconds }")
        echo "== $1 is built (at $SECONDS s, $seconds s of CPU)"
        return
    fi
    made[$1]=no
    tail -n 60 "$work/$1"
    echo "FAIL  the $1 build"
    failed=$((failed + 1))
    for at in "${!queue[@]}"; do [ "${queue[at]% *}" != "$1" ] || unset "queue[at]"; done
}

is_ready() { [ "${made[${1% *}]-}" = yes ] && { [ "$1" != "release $judge" ] || [ "$unsaid" -eq 0 ]; }; }

# How many of the two places a test takes.
places() {
    case "$1" in
    *" ctest") echo 2 ;;
    *" tests/browser/"*) echo 3 ;;
    *) if grep -q '^WAITS = True' "${1#* }"; then echo 0; else echo 1; fi ;;
    esac
}

# PRESET TEST, in place of this process.
run() {
    local folder=build
    [ "$1" = release ] || folder=build-$1
    if [ "$2" = ctest ]; then
        # The longest ones of the core run in the release build alone; tests/nightly.sh has them instrumented too.
        local left_out=(-E '^unit/core/(solve/test_(time_stepping|sustained_contact|frame_trust)|study/test_(tradeoff|calibrate))\.c$')
        [ "$1" != release ] || left_out=()
        [ "$1" != release ] || [[ " ${presets[*]} " != *" debug "* ]] || left_out=(-E '^unit/server/')
        exec ctest --preset "$1" "${left_out[@]}" -j "$(nproc)"
    fi
    if is_recorded "$*" || [ "$2" = "$judge" ]; then export IMPACTD_RECORD=$work/said; fi
    exec "$python" "$2" --build "$folder"
}

# PRESET TEST FILE: runs it and writes its CPU time.
run_measured() {
    run "$1" "$2" &
    # shellcheck disable=SC2064
    trap "kill $! 2>/dev/null" TERM
    wait $!
    local code=$?
    times >"$3"
    exit "$code"
}

used=0
# Begins what has a place. Who finds none keeps those behind from it; who is not ready does not.
begin() {
    local at one count
    for at in "${!queue[@]}"; do
        one=${queue[at]}
        is_ready "$one" || continue
        count=$(places "$one")
        [ "$used" -eq 0 ] || [ $((used + count)) -le 2 ] || return
        unset "queue[at]"
        used=$((used + count))
        local said=$work/said.$at
        # shellcheck disable=SC2086
        run_measured $one "$said.times" >"$said" 2>&1 &
        running[$!]=$one log[$!]=$said began[$!]=$SECONDS
    done
}

# PROCESS CODE: prints its output and adds its count.
test_ended() {
    local one=${running[$1]} said=${log[$1]} good=0 bad=0 all seconds
    unset "running[$1]"
    used=$((used - $(places "$one")))
    ! is_recorded "$one" || unsaid=$((unsaid - 1))
    seconds=$(cpu "$said.times")
    cpu_total=$(awk "BEGIN { print $cpu_total + $seconds }")
    echo "-- ${one#* } (${one% *}, from ${began[$1]} to $SECONDS s, $seconds s of CPU)"
    if [[ $one == *" ctest" ]]; then
        # "100% tests passed, 0 tests failed out of 27"
        if read -r bad all < <(sed -n 's/.*tests passed, \([0-9]*\) tests\{0,1\} failed out of \([0-9]*\).*/\1 \2/p' "$said"); then
            good=$((all - bad))
            [ "$bad" -eq 0 ] || cat "$said"
            echo "$good programs passed, $bad failed"
        else
            cat "$said"
            echo "FAIL  ctest found no tests in ${one% *}"
            bad=1
        fi
    else
        cat "$said"
        # "tests/contract/test_includes.py: 3 passed, 0 failed"; a file that counts nothing is one test.
        if ! read -r good bad < <(sed -n '$s/.*: \([0-9]*\) passed, \([0-9]*\) failed.*/\1 \2/p' "$said"); then
            if [ "$2" -eq 0 ]; then
                good=1 bad=0
            else
                good=0 bad=1
                echo "FAIL  ${one#* }"
            fi
        fi
    fi
    if [ "$2" -ne 0 ] && [ "$bad" -eq 0 ]; then
        echo "FAIL  ${one#* } counts no failure and ends with $2"
        bad=1
    fi
    passed=$((passed + good))
    failed=$((failed + bad))
    [ "$bad" -eq 0 ] || { echo "-- ${one#* } (${one% *})" && grep -E 'FAIL|\*\*\*(Failed|Exception|Timeout)' "$said"; } >>"$work/failures"
}

making=0
while true; do
    if [ -z "$builder" ] && [ "$making" -lt ${#presets[@]} ]; then
        make_build "${presets[making]}" $((making == 0 ? 0 : 19))
        making=$((making + 1))
    fi
    begin
    [ -n "$builder" ] || [ ${#running[@]} -gt 0 ] || break
    wait -n -p ended $builder "${!running[@]}"
    code=$?
    if [ "$ended" = "$builder" ]; then build_ended "${presets[making - 1]}" "$code"; else test_ended "$ended" "$code"; fi
done

echo
[ ! -f "$work/failures" ] || cat "$work/failures"
echo "took $SECONDS s, $cpu_total s of CPU"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
