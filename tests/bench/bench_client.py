#!/usr/bin/env python3
"""How fast submit and gather of the Python client run many scenes, beside the daemon's own rate.

    /usr/bin/python3 tests/bench/bench_client.py --build build [--scenes 100] [--rounds 7]

Each round runs as many scenes of some 30 ms of CPU through `lab.submit` and `lab.gather`, and other ones by one process
of curl with 32 connections, which is as fast as the daemon itself. The rounds alternate; the last line is the
ratio of the medians. The client's CPU time per scene is what it takes from a daemon on the same machine."""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

sys.path.insert(0, os.path.join(program.SOURCE, "web", "client"))
import impactd  # noqa: E402


def scenes(first, count):
    """Scenes of one cost, each another one: the method of Runge and Kutta, 25,000 steps, and a second run for the error."""
    return [{**program.scene("paper_free_sponge"), "accuracy": {"solver": "rk4", "step": 4e-4},
             "excitation": {"kind": "free", "displacement": 0.015 + 1e-9 * (first + i)}} for i in range(count)]


def by_client(lab, documents):
    """Scenes per second, the client's CPU time of a scene [s], the workers' time of a scene [s]."""
    began, cpu = time.monotonic(), time.process_time()
    found = list(lab.gather(lab.submit(documents)))
    seconds, cpu = time.monotonic() - began, time.process_time() - cpu
    assert len({r.id for r in found}) == len(documents)
    return len(documents) / seconds, cpu / len(documents), statistics.mean(r._job["timing"]["run"] for r in found)


def by_curl(url, documents, folder):
    """Scenes per second."""
    with open(os.path.join(folder, "requests"), "w", encoding="utf-8") as file:
        for i, document in enumerate(documents):
            path = os.path.join(folder, str(i))
            with open(path, "w", encoding="utf-8") as body:
                json.dump(document, body)
            file.write(f'{"next" if i else ""}\nurl = "{url}/v1/jobs"\njson = "@{path}"\nheader = "Prefer: wait=30"\n'
                       f'header = "Idempotency-Key: {os.path.basename(folder)}-{i}"\noutput = "{path}.answer"\nfail\n')
    began = time.monotonic()
    subprocess.run(["curl", "--parallel", "--parallel-immediate", "--parallel-max", "32", "--no-progress-meter", "-K", os.path.join(folder, "requests")], check=True)
    seconds = time.monotonic() - began
    for i in range(len(documents)):
        with open(os.path.join(folder, f"{i}.answer"), encoding="utf-8") as file:
            assert json.load(file)["status"] == "successful"
    return len(documents) / seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=7)
    arguments = parser.parse_args()
    program.build = arguments.build
    client, curl, count = [], [], arguments.scenes
    with program.daemon() as daemon, impactd.connect(daemon.url) as lab:
        for k in range(arguments.rounds):
            client.append(by_client(lab, scenes(2 * k * count, count)))
            with tempfile.TemporaryDirectory() as folder:
                curl.append(by_curl(daemon.url, scenes((2 * k + 1) * count, count), folder))
            print(f"round {k + 1}: client {client[-1][0]:.1f} scenes/s, curl {curl[-1]:.1f} scenes/s", flush=True)
    cpu, run = (statistics.median(one[i] for one in client) for i in (1, 2))
    print(f"{count} scenes of {1e3 * run:.1f} ms each, {os.cpu_count()} processors; the client uses {1e3 * cpu:.2f} ms of CPU for one")
    print(f"client / curl: {statistics.median(one[0] for one in client) / statistics.median(curl):.3f}")


if __name__ == "__main__":
    main()
