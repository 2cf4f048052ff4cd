#!/usr/bin/env python3
"""bench_slurm.py [--scenes N] [--build DIR]: a sweep of N scenes through a real Slurm of three virtual nodes on this machine.

Prints the wall time, what a chunk costs beyond its scenes and what the daemon uses for each row: the numbers that
efficiency.py takes."""

import argparse
import contextlib
import os
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from daemon import Daemon  # noqa: E402
from site_of_slurm import ASYNC, sweep  # noqa: E402
from slurm import Slurm, until  # noqa: E402


def measure(scenes, duration):
    scene = sweep(scenes, duration)
    with Slurm() as slurm, tempfile.TemporaryDirectory() as shared, \
            Daemon(program.build, *slurm.options(shared, 1), "--max-points", str(scenes), "--max-study-seconds", "1e9",
                   environment=slurm.environment) as daemon:
        began, used = time.monotonic(), program.cpu_of(daemon.process.pid)
        job = daemon.submit(scene, headers=ASYNC).json()
        shown, largest, begun = {}, 0, None
        while job["status"] in ("accepted", "running"):
            time.sleep(0.5)
            job = daemon.get(f"/v1/jobs/{job['id']}").json()
            shown = job.get("cluster") or shown
            if shown and begun is None:  # each point was validated
                begun = program.cpu_of(daemon.process.pid)
            for folder, _, names in os.walk(shared):
                for name in names if folder.endswith("chunks") else ():
                    try:
                        largest = max(largest, os.path.getsize(os.path.join(folder, name)))
                    except OSError:
                        pass
        assert job["status"] == "successful", job
        wall, ended = time.monotonic() - began, program.cpu_of(daemon.process.pid)
        table = daemon.get(f"/v1/results/{job['result']}/table.json").json()
        assert table["done"] == scenes and table["failed"] == 0, table["failed"]
        print(f"{scenes} scenes in {shown['chunks']} chunks: {wall:.1f} s; the daemon {begun - used:.1f} s of CPU to begin, "
              f"{ended - begun:.1f} s or {1e6 * (ended - begun) / scenes:.2f} us a row to take them; a chunk's file {largest / 1e6:.1f} MB")


def measure_start(chunks=60):
    """What a task costs that has one scene: CPU of its worker, and wall time of all."""
    with Slurm() as slurm, tempfile.TemporaryDirectory() as shared, \
            Daemon(program.build, *slurm.options(shared, 1), environment=slurm.environment) as daemon:
        slurm.drain()
        job = daemon.submit(sweep(12), headers=ASYNC).json()
        until(lambda: daemon.get(f"/v1/jobs/{job['id']}").json().get("cluster", {}).get("queued"), "nothing is queued")
        (name,) = os.listdir(shared)
        before = os.times()
        for _ in range(chunks):
            subprocess.run([program.impactd(), "chunk", os.path.join(shared, name), "0"], check=True)
            with contextlib.suppress(FileNotFoundError):  # the daemon was faster
                os.remove(os.path.join(shared, name, "chunks", "0"))
        after = os.times()
        worker = (after.children_user + after.children_system - before.children_user - before.children_system) / chunks
        slurm.resume()
        began = time.monotonic()
        while daemon.get(f"/v1/jobs/{job['id']}").json()["status"] == "running":
            time.sleep(0.1)
        wall = time.monotonic() - began
        print(f"a chunk of one scene: {1e3 * worker:.1f} ms of CPU; 12 of them on 3 slots {wall:.1f} s, {wall / 4:.2f} s each")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--scenes", type=int, default=1000000)
    parser.add_argument("--duration", type=float, default=3, help="of a scene [s]")
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    measure_start()
    measure(arguments.scenes, arguments.duration)


if __name__ == "__main__":
    main()
