#!/usr/bin/env bash
# tests/run.sh and what it leaves out because it takes hours: the program and the tests as clang compiles them and under the
# thread sanitizer, every Python test against the instrumented program, and the long campaigns of README.md. The last line
# counts.
set -uo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
cd "$here" || exit 1

export ASAN_OPTIONS=detect_leaks=1 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 TSAN_OPTIONS=halt_on_error=1
python=/usr/bin/python3
# gcc's thread sanitizer cannot live with as much address randomisation as some kernels use.
still=()
if setarch "$(uname -m)" -R true 2>/dev/null; then still=(setarch "$(uname -m)" -R); fi
passed=0
failed=0

# COMMAND...
check() {
    local began=$SECONDS
    if "$@"; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "FAIL  $*"
    fi
    echo "-- $* ($((SECONDS - began)) s)"
}

check tests/run.sh

check cmake --preset clang -DIMPACTD_TESTS=ON
check cmake --build --preset clang
check ctest --preset clang -j "$(nproc)"

check cmake --preset tsan -DIMPACTD_TESTS=ON
check cmake --build --preset tsan
check "${still[@]}" ctest --preset tsan -j "$(nproc)"
mapfile -t files < <(grep -l '^THREADED = True' tests/contract/test_*.py)
for file in "${files[@]}"; do check "${still[@]}" "$python" "$file" --build build-tsan; done

mapfile -t files < <(grep -l '^NIGHTLY = True' tests/contract/test_*.py)
for file in "${files[@]}"; do check "$python" "$file" --build build; done
mapfile -t files < <(grep -l '^SANITIZED = "nightly"' tests/contract/test_*.py)
for file in "${files[@]}"; do check "$python" "$file" --build build-debug; done

check build-debug/tests/fuzz_import 300
check build-debug/tests/fuzz_exchange 300

# The table of campaigns: "| `COMMAND` (remarks) | what it proves | time |".
mapfile -t commands < <(sed -n '/^Longer campaigns/,/^To add/s/^| `\([^`]*\)`.*/\1/p' tests/README.md)
for command in "${commands[@]}"; do
    read -ra words <<<"${command%% \[*}"
    [ "${words[0]}" != setarch ] || words=("${still[@]}" "${words[@]:2}")
    check "${words[@]}"
done

echo
echo "took $SECONDS s"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
