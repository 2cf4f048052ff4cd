#!/usr/bin/env bash
# Everything that can be checked: builds with gcc and clang, with address, undefined-behaviour and thread sanitizers,
# unit and contract tests in each (under the last what knows threads alone), truth tests and the tests of the
# program in the release build. --quick: the release build only.
# On a bare Debian 12 it first installs what is missing (as root or with sudo). The last line counts.
set -uo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
cd "$here" || exit 1

presets=(release debug tsan clang)
case "${1-}" in
'') ;;
--quick) presets=(release) ;;
*)
    echo "usage: tests/run.sh [--quick]" >&2
    exit 2
    ;;
esac

server/packages.sh server/packages.txt tests/packages.txt || exit 1

export ASAN_OPTIONS=detect_leaks=1 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 TSAN_OPTIONS=halt_on_error=1
# Debian's python3, which has the packages, whatever else is in PATH.
python=/usr/bin/python3
passed=0
failed=0
log=$(mktemp)
trap 'rm -f "$log"' EXIT

folder() {
    if [ "$1" = release ]; then echo build; else echo "build-$1"; fi
}

# gcc's thread sanitizer cannot live with as much address randomisation as some kernels use.
still=()
if setarch "$(uname -m)" -R true 2>/dev/null; then still=(setarch "$(uname -m)" -R); fi

for preset in "${presets[@]}"; do
    echo "== $preset (at $SECONDS s)"
    if ! { cmake --preset "$preset" -DIMPACTD_TESTS=ON && cmake --build --preset "$preset"; } >"$log" 2>&1; then
        tail -n 60 "$log"
        echo "FAIL  the $preset build"
        failed=$((failed + 1))
        continue
    fi
    runner=()
    [ "$preset" != tsan ] || runner=("${still[@]}")
    "${runner[@]}" ctest --preset "$preset" -j "$(nproc)" >"$log" 2>&1
    # "100% tests passed, 0 tests failed out of 27"
    if read -r wrong all < <(sed -n 's/.*tests passed, \([0-9]*\) tests\{0,1\} failed out of \([0-9]*\).*/\1 \2/p' "$log"); then
        [ "$wrong" -eq 0 ] || cat "$log"
        echo "$((all - wrong)) programs passed, $wrong failed"
        passed=$((passed + all - wrong))
        failed=$((failed + wrong))
    else
        cat "$log"
        echo "FAIL  ctest found no tests in $preset"
        failed=$((failed + 1))
    fi
done

# Python tests that run beside the others: their process by "FILE PRESET", and what they say.
declare -A beside said
begin() {
    [ -z "${beside[$1 $2]-}" ] || return 0
    said[$1 $2]=$(mktemp)
    local target=$record
    local -a runner=()
    [ "$2" = release ] || target=
    [ "$2" != tsan ] || runner=("${still[@]}")
    IMPACTD_RECORD=$target "${runner[@]}" "$python" "$1" --build "$(folder "$2")" >"${said[$1 $2]}" 2>&1 &
    beside[$1 $2]=$!
}

# FILE PRESET: runs one Python test of a build and adds its count.
ask() {
    echo "-- $1 ($2, at $SECONDS s)"
    local code
    local -a runner=()
    if [ -n "${beside[$1 $2]-}" ]; then
        wait "${beside[$1 $2]}"
        code=$?
        mv "${said[$1 $2]}" "$log"
        cat "$log"
    else
        [ "$2" != tsan ] || runner=("${still[@]}")
        "${runner[@]}" "$python" "$1" --build "$(folder "$2")" 2>&1 | tee "$log"
        code=${PIPESTATUS[0]}
    fi
    # "tests/contract/test_includes.py: 3 passed, 0 failed"; a file that counts nothing is one test.
    if read -r good bad < <(sed -n '$s/.*: \([0-9]*\) passed, \([0-9]*\) failed.*/\1 \2/p' "$log"); then
        passed=$((passed + good))
        failed=$((failed + bad))
    elif [ "$code" -eq 0 ]; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "FAIL  $1"
    fi
}

# PRESET FILE...: each in turn while the next one runs beside it.
ask_all() {
    local preset=$1
    shift
    while [ $# -gt 0 ]; do
        [ $# -lt 2 ] || begin "$2" "$preset"
        IMPACTD_RECORD=$record ask "$1" "$preset"
        shift
    done
}

# What they say to daemons is recorded; the judge of that begins when all was said.
judge=tests/contract/test_traffic.py
mapfile -t files < <(printf '%s\n' tests/contract/test_*.py | grep -vxF "$judge")
record=$(mktemp)
while read -r file; do
    begin "$file" release
    [[ " ${presets[*]} " != *" debug "* ]] || ! grep -q '^SANITIZED = True' "$file" || begin "$file" debug
done < <(grep -l '^WAITS = True' tests/contract/test_*.py)
ask_all release "${files[@]}"
begin "$judge" release
said_to_daemons=$record
record=
ask_all release tests/browser/test_*.py tests/truth/test_*.py
ask "$judge" release
rm -f "$said_to_daemons"
# What faces hostile input is asked once more of the instrumented program.
if [[ " ${presets[*]} " == *" debug "* ]]; then
    mapfile -t files < <(grep -l '^SANITIZED = True' tests/contract/test_*.py)
    ask_all debug "${files[@]}"
fi
# And what concerns threads of the one that watches them.
if [[ " ${presets[*]} " == *" tsan "* ]]; then
    mapfile -t files < <(grep -l '^THREADED = True' tests/contract/test_*.py)
    ask_all tsan "${files[@]}"
fi

echo
echo "took $SECONDS s"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
