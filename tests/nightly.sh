#!/usr/bin/env bash
# nightly.sh [--quick] [PART...]: what tests/run.sh leaves out because it takes hours; all parts, or those named. --quick
# gives each command the least numbers, to see that it works. On a bare Debian 12 it installs what is missing. The end
# lists each command with its time and the last line it printed, and counts.
#
#   commit      tests/run.sh
#   clang       the program and its tests as clang compiles them, without a warning
#   threads     the thread sanitizer: unit tests of jobs, db and http, requests, 10,000 cancels, SIGHUP, ends and faults; random
#               schedules of the threads
#   sanitized   unit tests and the other tests of the program with the address and undefined-behaviour sanitizers
#   kills       kill -9 amid jobs, sweeps and imports, full disks, power failures, damaged databases
#   cluster     studies through a Slurm of three virtual nodes: what goes wrong there, its cost, its efficiency at 96 slots
#   faults      every allocation and file call of the canonical requests and of commands fails in turn
#   truth       the long campaigns of tests/truth
#   storm       a million requests with killed clients and restarts, 2,000 expensive bodies
#   fuzz        libFuzzer: an hour of inputs for everything that is parsed, and what the kept inputs reach
#   browser     the browser tests with slow computers and late answers
#   coverage    the lines and branches of server/ and core/ that unit and contract tests reach
#   package     the Debian package in an empty Debian 12: install, upgrade, remove, purge
#   bench       the benchmarks
set -uo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
cd "$here" || exit 1

all=(commit clang threads sanitized kills cluster faults truth storm fuzz browser coverage package bench)
is_quick=
[ "${1-}" != --quick ] || { is_quick=1 && shift; }
parts=("${@:-${all[@]}}")
for part in "${parts[@]}"; do
    [[ " ${all[*]} " == *" $part "* ]] || {
        echo "usage: tests/nightly.sh [--quick] [PART...], a PART being one of: ${all[*]}" >&2
        exit 2
    }
done

server/packages.sh server/packages.txt tests/packages.txt || exit 1

export ASAN_OPTIONS=detect_leaks=1 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 TSAN_OPTIONS=halt_on_error=1
python=/usr/bin/python3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# gcc's thread sanitizer needs less address randomisation than some kernels use.
still=()
if setarch "$(uname -m)" -R true 2>/dev/null; then still=(setarch "$(uname -m)" -R); fi
passed=0
failed=0
: >"$work/figures"

# COMMAND...
check() {
    local began=$SECONDS verdict=ok
    echo "-- $*"
    if "$@" 2>&1 | tee "$work/output"; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        verdict=FAIL
    fi
    printf '%-4s %5d s  %s: %s\n' "$verdict" $((SECONDS - began)) "$*" "$(grep -v '^$' "$work/output" | tail -n 1 | cut -c1-120)" |
        tee -a "$work/figures"
    [ $verdict = ok ]
}

# QUICK LONG COMMAND...: checks the command with the numbers LONG, or QUICK.
sized() {
    local numbers=$2
    [ -z "$is_quick" ] || numbers=$1
    # shellcheck disable=SC2086
    check "${@:3}" $numbers
}

# PRESET, once.
build() {
    [ -f "$work/built.$1" ] || { check cmake --preset "$1" -DIMPACTD_TESTS=ON && check cmake --build --preset "$1" && touch "$work/built.$1"; }
}

# PRESET QUICK [COMMAND...]: the C tests of a preset; of these alone that QUICK matches, if it is quick.
ctests() {
    local only=()
    [ -z "$is_quick" ] || only=(-R "$2")
    check "${@:3}" ctest --preset "$1" --no-tests=error -j "$(nproc)" "${only[@]}"
}

# BUILD MARK [COMMAND...]: the Python tests with this mark; the first of them, if it is quick.
marked() {
    local files file
    mapfile -t files < <(grep -l "^$2" tests/contract/test_*.py)
    [ -z "$is_quick" ] || files=("${files[0]}")
    for file in "${files[@]}"; do check "${@:3}" "$python" "$file" --build "$1"; done
}

part_commit() {
    if [ -n "$is_quick" ]; then check tests/run.sh --quick; else check tests/run.sh; fi
}

part_clang() {
    build clang
    ctests clang ^unit/core/base
}

part_threads() {
    build tsan
    ctests tsan ^unit/server/http "${still[@]}"
    marked build-tsan 'THREADED = True' "${still[@]}"
    sized 200 10000 "${still[@]}" "$python" tests/storm/cancel_storm.py --build build-tsan
    # Jobs, cancels, deletions, SIGHUP, evictions and ends at once, then also failing allocations and file calls. 600 s
    local how
    for how in --free --faults; do sized '--schedules 20' '--schedules 1000' "${still[@]}" "$python" tests/threads/schedules.py --build build-tsan "$how"; done
    # The same under random schedules: one thread runs at a time, by priorities that a seed decides. 1000 s
    build release
    sized '--schedules 40' '--schedules 10000' "$python" tests/threads/schedules.py --build build
    sized '--schedules 40' '--schedules 2000' "$python" tests/threads/schedules.py --build build --mix tables
}

part_sanitized() {
    build debug
    ctests debug ^unit/core/base
    marked build-debug 'SANITIZED = "nightly"'
}

part_kills() {
    build release
    local file
    for file in exchange_kill full_disk sweep_kill kill; do
        check "$python" "tests/contract/test_$file.py" --build build
        [ -z "$is_quick" ] || [ "$file" = exchange_kill ] || break
    done
    # What was acknowledged is there after each of many kills, also during starts. 900 s
    sized '--cycles 20' '--cycles 1000' "$python" tests/storm/kills.py --build build
    # What is acknowledged is on the disk, whichever of the writes that were not synced are there too. 120 s
    sized '--states 20 --scenes 5 --daemons 2' '--states 1500 --scenes 60 --daemons 100' "$python" tests/power/power.py --build build
    # Damaged bytes, pages, indices and logs: right answers or problems, no end of the daemon. 100 s
    sized '--copies 10' '--copies 500' "$python" tests/damage/damage.py --build build
}

part_cluster() {
    build release
    # Dead daemons and nodes, wrong files, full disks, a Slurm that refuses, errs or is away. 900 s
    sized killed_before '' "$python" tests/contract/test_slurm_drills.py --build build
    # 1e6 scenes end to end. 900 s
    sized '--scenes 3000' '--scenes 1000000 --duration 10' "$python" tests/bench/bench_slurm.py --build build
    check "$python" tests/bench/efficiency.py
}

part_faults() {
    build release
    build debug
    local kind
    # Every N, once and from N on. 1800 s
    for kind in allocations EIO ENOSPC short; do sized '--stride 100' '--stride 1' "$python" tests/faults/inject.py --build build "$kind"; done
    # The sanitizer looks for leaks at the end of each server. 600 s
    sized '--stride 200' '--stride 7' "$python" tests/faults/inject.py --build build-debug allocations
    # Starts, copies and checks: every file call, every call stack of allocations; of their 150,000 allocations each 397th. 8000 s
    for kind in EIO ENOSPC short; do sized '--stride 50' '--stride 1' "$python" tests/faults/commands.py --build build "$kind"; done
    for kind in build build-debug; do sized '--stride 200' '--stride 1' "$python" tests/faults/commands.py --build $kind stacks; done
    sized '--stride 5000' '--stride 397' "$python" tests/faults/commands.py --build build allocations
}

# Scenes and seed first.
part_truth() {
    build release
    # Random scenes of 3 s against quad precision: samples, starts, speeds, peaks, the same impacts. 150 s of CPU
    sized '5 6' '700 6' build/tests/truth_test_reference_c
    # Random frames of 1 to 10 storeys with up to 3 dampers against quad precision. 200 s
    sized '12 7' '250 7' build/tests/truth_test_frames_c
    # Frames of 5 to 60 storeys with fewer modes: the predicted error is exceeded in at most 3 % without dampers, 10 % with. 130 s
    sized '40 1' '1000 1' build/tests/truth_test_modes_c
    # Every flight, contact and rest goes on for as long as the ledger says: no impact is missed. 600 s
    sized '200 3' '100000 3' build/tests/truth_test_missed_c
    # Contacts under power laws against SUNDIALS, and the estimate of a tolerance. 400 s
    sized '12 1 v' '300 1 v' build/tests/truth_test_power_c
    # A grid of extremes and as many random scenes from the edges by all solvers: the stated error holds, or the scene is
    # refused, failed or marked, with the reason. The last number: predicted CPU seconds of a scene, at most. 500 s
    sized '60 13 0.04' '10500 13 0.04' build/tests/truth_test_extremes_c
    # trust_horizon against the earliest parting of nine doubles from quad precision; scenes, seconds, seed. 25 s
    sized '2 30 1' '40 30 1' build/tests/truth_test_trust_c
    # The mean of an ensemble under a target against the mean of all its runs; scenes, seed, runs of each. 300 s
    sized '2 3 100' '80 3 100' build/tests/truth_test_ensemble_c
    # Periodic orbits of drawn scenes: stable ones attract, unstable ones repel; orbits, seed. 15 s
    sized '12 7' '600 7' build/tests/truth_test_orbits_c
    # Sobol indices of a function and of a scene with known ones: in 92 to 98 % of the trials the interval holds them. 60 s
    sized '4 1' '500 1000' build/tests/truth_test_sobol_indices_c
    # Force traces: how often the stated interval of T_c holds it, in 92 to 98 % of a cell's trials; trials, seed. 800 s
    sized '4 1' '400 1' build/tests/truth_test_traces_c
    # Calibrations of simulated measurements: intervals hold the true values in 92 to 98 %, undetermined sets are reported;
    # trials, seed. 350 s
    sized '13 7' '520 7' build/tests/truth_test_calibrate_c
}

part_storm() {
    build release
    # Each request is answered as it should be, nothing acknowledged is lost by ends of clients and of the daemon; memory and
    # descriptors are flat within its lives and from one to the next. 1500 s
    sized '--requests 20000 --clients 4 --restarts 2' '--requests 1000000 --clients 8' "$python" tests/storm/mixed.py --build build
    # CPU that goes on after a cancel was answered, median and most, by solver, excitation and study. 300 s
    sized 2 20 "$python" tests/storm/cancel_cpu.py --build build
    # CPU and memory of expensive bodies against what was predicted and what is allowed. 1500 s
    sized 20 2000 "$python" tests/storm/cost.py --build build
    # How long reads take while two clients send such bodies.
    sized 5 60 "$python" tests/storm/reads.py --build build
}

part_fuzz() {
    check server/packages.sh <(printf '%s\n' libclang-rt-dev llvm)
    build fuzz
    # 3600 s
    sized '--seconds 9' '--seconds 3600' "$python" tests/fuzz/fuzz.py --build build-fuzz
}

# How many times slower a page's computer is, and the seed of how long its answers wait.
part_browser() {
    build release
    local pace
    for pace in '--slow 4 --seed 1' '--slow 4 --seed 2' '--slow 8 --seed 3'; do
        # shellcheck disable=SC2086
        sized test_token.mjs '' "$python" tests/browser/test_browser.py --build build $pace
        [ -z "$is_quick" ] || break
    done
}

# 1100 s of CPU.
part_coverage() {
    build coverage
    sized 'run cache' run "$python" tests/coverage.py --build build-coverage
}

part_package() {
    build release
    check server/packages.sh <(printf '%s\n' lintian debootstrap)
    sized lintian '' "$python" tests/contract/test_package.py --build build
}

part_bench() {
    build release
    local bench
    for bench in exact frame power peers summary response encode; do
        if [ -z "$is_quick" ] || [ "$bench" = encode ]; then check build/tests/bench_$bench; fi
    done
    sized '1 5' '1 500' build/tests/bench_cost
    sized '200 2 1' '' build/tests/bench_sweep
    sized '/tmp 0.2 jobs' /tmp build/tests/bench_intake
    sized '2 1000' '' build/tests/bench_optimize
    sized '--scenes 10 --rounds 1' '' "$python" tests/bench/bench_client.py --build build
    # Its peers; nothing else needs them.
    check server/packages.sh <(printf '%s\n' nginx-light wrk)
    sized 'cached' '' "$python" tests/bench/service.py --build build
}

for part in "${parts[@]}"; do "part_$part"; done

echo
cat "$work/figures"
echo "took $SECONDS s"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
