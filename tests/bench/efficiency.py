#!/usr/bin/env python3
"""efficiency.py: how much of a large cluster's time a sweep uses, simulated from what was measured.

The chunks are cut as server/jobs/study.c cuts those of a sweep. Slurm starts tasks at a rate and with a delay that were
measured with a real one (2 busy cores: a cluster's is not slower); the daemon takes files one by one, as bench_slurm.py
measures it. Scenes differ in cost: chunks, being strided, vary little. Prints a table and judges 1e8 scenes on 96 slots."""

import heapq
import math
import random
import sys

CHUNKS_MAX, CHUNK_ROWS, CHUNKS_PER_SLOT, CHUNK_SECONDS = 4096, 1 << 16, 4, 120
# Of Slurm: tasks started in a second, the delay of a start [s]: as it comes, and told to schedule at once.
RATES = {"Slurm as it comes": (2.9, 2.97), "told to schedule at once": (13.4, 0.97)}
# [s]: a task's own start, a row's way into the database, the daemon's look at the folder.
START, ROW, SCAN = 0.15, 1.5e-6, 2.0
# Up to so many points the daemon validates before the first task; how long one takes [s].
VALIDATED, VALIDATION = 10**6, 1e-5
DEVIATION = 0.03  # of the time of a chunk


def count_chunks(scenes, slots, seconds):
    """study_count_chunks."""
    chunks = min(math.ceil(seconds / CHUNK_SECONDS), CHUNKS_MAX)
    chunks = max(chunks, math.ceil(scenes / CHUNK_ROWS), CHUNKS_PER_SLOT * slots)
    return min(math.ceil(chunks / slots) * slots, scenes)


def simulate(scenes, slots, scene, rate, delay, seed=1):
    """(chunks, efficiency): the share of the slots' time that is spent in scenes."""
    chance = random.Random(seed)
    chunks = count_chunks(scenes, slots, scenes * scene)
    costs = [scenes / chunks * scene * chance.gauss(1, DEVIATION) for _ in range(chunks)]
    begun = scenes * VALIDATION if scenes <= VALIDATED else 0.0
    free = [begun] * slots  # when each slot is
    started = taken = begun  # the last start, the end of the last file's way into the database
    for cost in costs:
        started = max(heapq.heappop(free) + delay, started + 1 / rate)
        end = started + START + cost
        heapq.heappush(free, end)
        taken = max(taken, end) + scenes / chunks * ROW
    wall = max(max(free) + SCAN, taken)
    return chunks, sum(costs) / (slots * wall)


def main():
    least = 1.0
    print(f"{'scenes':>8} {'slots':>6} {'chunks':>7} {'efficiency':>11}  scheduler")
    for name, (rate, delay) in RATES.items():
        for scenes in (10**6, 10**7, 10**8):
            for slots in (24, 96, 384):
                chunks, share = simulate(scenes, slots, 1e-3, rate, delay)
                print(f"{scenes:8.0e} {slots:6d} {chunks:7d} {share:11.1%}  {name}")
                if scenes == 10**8 and slots == 96:
                    least = min(least, share)
    print(f"1e8 scenes of 1 ms on 96 slots: {least:.1%} of their time is spent in scenes, at least; 90 % is promised")
    return 0 if least >= 0.9 else 1


if __name__ == "__main__":
    sys.exit(main())
