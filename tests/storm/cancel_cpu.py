#!/usr/bin/env python3
"""What a cancelled job still costs: the daemon's CPU after the DELETE was answered, by kind of job.

    tests/storm/cancel_cpu.py [N] [--build build] [--kind WORD]

Each kind is submitted N times (20) and cancelled at times from 0 to 0.4 s after its start. Printed are the median and
the most CPU in ms, and when that job was cancelled; the end is 1 where one took more than 100 ms, or
where fewer than half were cancelled before their end."""

import argparse
import os
import statistics
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

MOST = 100  # [ms]
CHANNELS = ["displacement", "velocity", "acceleration", "damper_displacement", "base_acceleration"]
RANDOM = "paper_random_sponge"


def scene(name, excitation=None, segment=None, channels=CHANNELS, **changes):
    """An example made as long as is allowed; a study's scene 40 times as long as it is."""
    made = program.scene(name)
    if "study" in made:
        return {**made, "duration": 40 * made["duration"]}
    psd = None if segment is None else {"channels": CHANNELS[:3], "segment": segment}
    made.update({"duration": 30000, "sample_rate": 1000, "output": {"channels": channels, "psd": psd}, **changes})
    made["excitation"].update(excitation or {})
    if made["structure"].get("kind") not in (None, "sdof") or not made.get("dampers"):
        made["output"]["channels"] = ["base_acceleration"] if channels else []
    return made


def frame(storeys):
    return {"kind": "frame", "masses": [100] * storeys, "stiffnesses": [2e5] * storeys, "damping_ratio": 0.02}


def kinds():
    """Every example, and what else takes long in one piece."""
    made = {name: scene(name, duration=1500 if name.startswith("solver") else 30000)
            for name in program.examples()}
    made["random, slow base"] = scene(RANDOM, {"rate": 20, "band": [0.2, 5]})
    made["random, narrow band"] = scene(RANDOM, {"band": [2, 2.01]})
    made["random, no channels"] = scene(RANDOM, channels=[])
    made["random, rk4"] = scene(RANDOM, accuracy={"solver": "rk4", "step": 1e-4}, duration=1500)
    for exponent in (12, 17, 20):
        made[f"PSD, segments of 2^{exponent}"] = scene(RANDOM, segment=1 << exponent, duration=1500, channels=[])
    for storeys in (20, 100):
        made[f"frame, {storeys} storeys"] = scene("frame_modes", structure=frame(storeys), accuracy={"solver": "precise"}, duration=3000,
                                                  sample_rate=100)
        made[f"frame, {storeys} storeys, exact"] = scene("frame_modes", structure=frame(storeys), sample_rate=100,
                                                         accuracy={"solver": "exact"})
    made["sweep of costly points"] = {**scene(RANDOM, duration=3000, channels=[]), "study": {
        "kind": "sweep", "axes": [{"pointer": "/dampers/0/clearance", "from": 0.01, "to": 0.02, "count": 500}]}}
    made["sweep of many frames"] = {**scene("frame_modes", structure=frame(60), channels=[], duration=30), "study": {
        "kind": "sweep", "axes": [{"pointer": "/duration", "from": 30, "to": 40, "count": 4000}]}}
    return made


def used(daemon):
    """CPU of the daemon so far [ms]."""
    return 1e3 * program.cpu_of_threads(daemon.process.pid)


def settled(daemon):
    """The same once nothing goes on."""
    before, quiet = used(daemon), 0
    while quiet < 4:
        time.sleep(0.025)
        now = used(daemon)
        quiet = quiet + 1 if now - before < 1 else 0
        before = now
    return before


def one(daemon, scene, delay, number):
    """CPU after the answer [ms]; None: it had ended before."""
    scene = {**scene, "title": f"cancelled {number}", "duration": scene["duration"] + number / 64}
    reply = daemon.request("POST", "/v1/jobs", json=scene, headers={"Prefer": "respond-async"})
    job = reply.json()
    assert reply.status in (200, 202), reply
    path = f"/v1/jobs/{job['id']}"
    while job["status"] == "accepted":
        time.sleep(0.001)
        job = daemon.request("GET", path).json()
    time.sleep(delay)
    reply = daemon.request("DELETE", path)
    before = used(daemon)
    after = settled(daemon)
    return after - before if reply.status == 200 else None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", nargs="?", type=int, default=20)
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--kind", default="")
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    worst = asked = cancelled = 0
    with program.daemon("--workers", "1") as daemon:
        for kind, scene in kinds().items():
            if arguments.kind not in kind:
                continue
            times = [0.4 * (k / arguments.count) ** 2 for k in range(arguments.count)]
            spent = [(ms, at) for number, at in enumerate(times, 1)
                     if (ms := one(daemon, scene, at, number)) is not None]
            most = max(spent, default=(0, 0))
            worst = max(worst, most[0])
            asked, cancelled = asked + arguments.count, cancelled + len(spent)
            middle = statistics.median(ms for ms, _ in spent) if spent else 0
            print(f"{kind:32} {len(spent):3} cancelled, median {middle:6.1f} ms, most {most[0]:6.1f} ms "
                  f"at {1e3 * most[1]:.0f} ms", flush=True)
    return 0 if worst <= MOST and 2 * cancelled > asked else 1


if __name__ == "__main__":
    sys.exit(main())
