#!/usr/bin/env python3
"""bench_slurm.py [--scenes N] [--build DIR]: a sweep of N scenes through a real Slurm of three virtual nodes on this machine.

Prints the wall time, what a chunk costs beyond its scenes and what the daemon uses for each row: the numbers that
efficiency.py takes. The rows of a few points are compared with those that threads give."""

import argparse
import os
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from daemon import Daemon  # noqa: E402
from site_of_slurm import ASYNC, sweep  # noqa: E402
from slurm import Slurm  # noqa: E402


def children_seconds(slurm):
    """CPU seconds of all slurmd: their steps and tasks that ended are in them."""
    total = 0
    for node in slurm.nodes:
        with open(f"/proc/{slurm.daemons[node].pid}/stat", encoding="utf-8") as file:
            total += sum(map(int, file.read().rsplit(")", 1)[1].split()[11:15]))
    return total / os.sysconf("SC_CLK_TCK")


def measure(scenes, duration):
    scene = sweep(scenes, duration)
    with Slurm() as slurm, tempfile.TemporaryDirectory() as shared, \
            Daemon(program.build, *slurm.options(shared, 1), "--max-points", str(scenes), "--max-study-seconds", "1e9",
                   environment=slurm.environment) as daemon:
        began, used = time.monotonic(), program.cpu_of(daemon.process.pid)
        job = daemon.submit(scene, headers=ASYNC).json()
        shown, largest = {}, 0
        while job["status"] in ("accepted", "running"):
            time.sleep(0.5)
            job = daemon.get(f"/v1/jobs/{job['id']}").json()
            shown = job.get("cluster") or shown
            for folder, _, names in os.walk(shared):
                for name in names if folder.endswith("chunks") else ():
                    try:
                        largest = max(largest, os.path.getsize(os.path.join(folder, name)))
                    except OSError:
                        pass
        assert job["status"] == "successful", job
        wall, daemon_cpu = time.monotonic() - began, program.cpu_of(daemon.process.pid) - used
        table = daemon.get(f"/v1/results/{job['result']}/table.json").json()
        assert table["done"] == scenes and table.get("failed", 0) == 0, {k: table[k] for k in table if k != "rows"}
        print(f"{scenes} scenes in {shown.get('chunks')} chunks: {wall:.1f} s, the daemon {daemon_cpu:.1f} s of CPU, "
              f"{1e6 * daemon_cpu / scenes:.1f} us for each row, the nodes {children_seconds(slurm):.1f} s, "
              f"a chunk's file {largest / 1e6:.1f} MB")
        return wall


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--scenes", type=int, default=1000000)
    parser.add_argument("--duration", type=float, default=3, help="of a scene [s]")
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    measure(arguments.scenes, arguments.duration)


if __name__ == "__main__":
    main()
