#!/usr/bin/env python3
"""The order of each solver with a step, as observed: error of the displacement against the step, as an envelope.

    /usr/bin/python3 tests/bench/order.py --build build        # prints the table of README.md
    /usr/bin/python3 tests/bench/order.py --all                # and every envelope that it comes from

How deep a step happens to end in a stop is chance, so each point is the largest error of neighbouring steps, from H/n to 2/3 of
that, H being the sample interval. The order is the slope of a line through the logarithms of what lies above rounding."""

import argparse
import json
import math
import os
import subprocess
import tempfile

import numpy

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
STRUCTURE = {"mass": 1.35, "stiffness": 865, "damping": 1.092}
SPONGE, ALUMINIUM = ({"restitution": 0.61, "contact_time": 0.025}, {"restitution": 0.46, "contact_time": 0.0003})
FREE = {"kind": "free", "displacement": 0.015}
SCENES = {
    "no contact, free": (None, FREE, 1),
    "no contact, sine base": (None, {"kind": "sine", "frequency": 3, "amplitude": 1}, 1),
    "no contact, random base": (None, {"kind": "random", "band": [0, 15], "rms": 1, "rate": 100}, 1),
    "one contact, sponge": (SPONGE, FREE, 0.1),
    "one contact, aluminium": (ALUMINIUM, FREE, 0.1),
}
SOLVERS = ("precise", "rk4", "newmark")
INTERVAL = 0.01  # between samples [s]
NEIGHBOURS = 16
ROUNDING = 1e-12  # errors below say nothing of the method


def displacement(build, folder, scene, accuracy):
    """The samples of one run, or None where the step is too long for the solver."""
    path, target = os.path.join(folder, "scene.json"), os.path.join(folder, "out.npy")
    with open(path, "w", encoding="utf-8") as file:
        json.dump(scene | {"accuracy": accuracy}, file)
    run = subprocess.run([os.path.join(build, "impactd"), "run", path, "-o", target], capture_output=True, check=False)
    return numpy.load(target)[:, 1] if run.returncode == 0 else None


def envelope(build, folder, name, solver):
    """[(step, largest error of its neighbours)], the longest step first."""
    buffer, excitation, duration = SCENES[name]
    scene = {"structure": STRUCTURE, "excitation": excitation, "duration": duration, "sample_rate": 1 / INTERVAL,
             "output": {"channels": ["displacement"], "psd": None}}
    if buffer is not None:
        scene["dampers"] = [{"mass": 0.1107, "clearance": 0.015, "buffer": buffer}]
    exact = displacement(build, folder, scene, {"solver": "exact"})
    points = []
    # Of aluminium's 0.3 ms every step is to be a small part.
    for parts in [2**k for k in ((9, 10, 11, 12, 13, 14) if buffer is ALUMINIUM else (4, 5, 6, 7, 8, 9))]:
        worst = 0
        for n in (parts + parts * k // (2 * NEIGHBOURS) for k in range(NEIGHBOURS)):
            found = displacement(build, folder, scene, {"solver": solver, "step": INTERVAL / n})
            if found is None:
                worst = math.nan
                break
            worst = max(worst, numpy.max(numpy.abs(found - exact)) / numpy.max(numpy.abs(exact)))
        points.append((INTERVAL / parts, worst))
    return points


def order(points):
    told = [(math.log(step), math.log(error)) for step, error in points if error > ROUNDING]
    if len(told) < 2:
        return "exact"
    return f"{numpy.polyfit(*zip(*told), 1)[0]:.2f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(SOURCE, "build"))
    parser.add_argument("--all", action="store_true", help="print the envelopes too")
    arguments = parser.parse_args()
    print("| | " + " | ".join(f"`{solver}`" for solver in SOLVERS) + " |")
    print("|---" * (len(SOLVERS) + 1) + "|")
    with tempfile.TemporaryDirectory() as folder:
        for name in SCENES:
            envelopes = [envelope(arguments.build, folder, name, solver) for solver in SOLVERS]
            print(f"| {name} | " + " | ".join(order(points) for points in envelopes) + " |")
            for solver, points in zip(SOLVERS, envelopes):
                if arguments.all:
                    print(f"    {solver:8}" + "  ".join(f"{step:.1e}: {error:.1e}" for step, error in points))


if __name__ == "__main__":
    main()
