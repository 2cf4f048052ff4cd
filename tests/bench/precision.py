#!/usr/bin/env python3
"""Error against CPU time of our solvers and of other libraries: measured, as a table, and as the chart of the guide.

    /usr/bin/python3 tests/bench/precision.py --build build --measure tests/bench/epyc_7003/precision.csv    # two minutes of CPU
    /usr/bin/python3 tests/bench/precision.py tests/bench/epyc_7003/precision.csv                            # the table
    /usr/bin/python3 tests/bench/precision.py tests/bench/epyc_7003/precision.csv --svg web/guide/precision.svg

Measured are the paper's free vibrations over 10 s with 5 channels at 1 kHz: by `bench_peers curve` (our solvers, GSL, CVODE)
and here by SciPy's solve_ivp with DOP853, whose events are the touches and the ends of contacts. The error is that of the
displacement over its largest value, against quad precision (bench_peers at every sample, SciPy at those of tests/truth)."""

import argparse
import csv
import json
import math
import os
import subprocess
import sys
import time

import numpy

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path[:0] = [os.path.join(SOURCE, "tests", "paper"), os.path.join(SOURCE, "tests", "support")]
from chart import Panel  # noqa: E402

SCENES = {"free sponge, 10 s": "free_sponge", "free aluminium, 10 s": "free_aluminium"}
SERIES = {  # name: colour, dash, label
    "exact": ("#c0392b", "", "exact"),
    "precise": ("#1f5fa8", "", "precise (the paper's scheme)"),
    "rk4": ("#2e8b57", "", "rk4"),
    "newmark": ("#7a4ea3", "", "newmark"),
    "adaptive": ("#b8860b", "", "adaptive"),
    "GSL rk8pd": ("#555", ' stroke-dasharray="5 3"', "GSL rk8pd"),
    "CVODE BDF, plain": ("#d1641b", ' stroke-dasharray="5 3"', "SUNDIALS CVODE"),
    "SciPy DOP853": ("#0e8a8a", ' stroke-dasharray="5 3"', "SciPy DOP853"),
}


def scipy_run(scene, tolerance):
    """Displacement at 1 kHz by solve_ivp, restarted at every touch and at every end of a contact."""
    from scipy.integrate import solve_ivp
    structure, damper = scene["structure"], scene["dampers"][0]
    mass, free = structure["mass"], damper["mass"]
    e, contact_time, half = *damper["buffer"].values(), damper["clearance"] / 2
    m_e = mass * free / (mass + free)
    damping = -2 * m_e * math.log(e) / contact_time
    stiffness = m_e * (math.pi**2 + math.log(e)**2) / contact_time**2
    state = {"stop": 0}

    def slopes(_, y):
        x, v, r, s = y
        push = stiffness * (r - state["stop"] * half) + damping * s if state["stop"] else 0.0
        a = (-structure["stiffness"] * x - structure["damping"] * v + push) / mass
        return v, a, s, -push / free - a

    def event(of, direction):
        of.terminal, of.direction = True, direction
        return of

    touches = [event(lambda _, y: y[2] - half, 1), event(lambda _, y: y[2] + half, -1)]
    ends = {1: [event(lambda _, y: y[2] - half, -1)], -1: [event(lambda _, y: y[2] + half, 1)]}
    times = numpy.arange(round(scene["duration"] * 1000) + 1) / 1000
    x, t, y = numpy.empty(len(times)), 0.0, [scene["excitation"]["displacement"], 0.0, 0.0, 0.0]
    done = 0
    while done < len(times):
        step = solve_ivp(slopes, (t, times[-1]), y, "DOP853", t_eval=times[done:], rtol=tolerance, atol=tolerance * 1e-3,
                         max_step=contact_time / 4 if state["stop"] else math.inf,
                         events=ends[state["stop"]] if state["stop"] else touches)
        if step.status < 0:
            raise RuntimeError(step.message)
        count = len(step.t)
        x[done:done + count] = step.y[0] if count else []
        done += count
        if step.status == 0:
            break
        which = next(i for i, found in enumerate(step.t_events) if len(found))
        t, y = step.t_events[which][0], step.y_events[which][0]
        state["stop"] = 0 if state["stop"] else (1, -1)[which]
        # Exactly on the stop: solve_ivp takes an event at the start of a step for none.
        y[2] = half if y[2] > 0 else -half
    return x


def scipy_rows():
    for name, case in SCENES.items():
        with open(os.path.join(SOURCE, "tests", "truth", case + ".json"), encoding="utf-8") as file:
            truth = json.load(file)
        known = numpy.array(truth["displacement"])
        for tolerance in (1e-3, 1e-5, 1e-7, 1e-9, 1e-11):
            seconds = math.inf
            for _ in range(3):
                began = time.process_time()
                found = scipy_run(truth["scene"], tolerance)
                seconds = min(seconds, time.process_time() - began)
            error = numpy.abs(found[::round(1000 * truth["interval"])] - known).max() / numpy.abs(known).max()
            yield [name, "SciPy DOP853", "tolerance", f"{tolerance:.0e}", f"{1e3 * seconds:.4g}", f"{error:.2e}"]


def measure(build, path):
    text = subprocess.run([os.path.join(build, "tests", "bench_peers"), "curve"], capture_output=True, text=True, check=True).stdout
    os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
        csv.writer(file, lineterminator="\n").writerows(scipy_rows())


def points_of(rows, scene, solver):
    """(CPU time [ms], error) by rising accuracy asked for."""
    return [(float(row["cpu_ms"]), float(row["error"])) for row in rows if row["scene"] == scene and row["solver"] == solver]


def table(rows):
    """The cheapest run of each solver that keeps an error, in ms of CPU."""
    errors = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
    lines = ["| | " + " | ".join(f"{error:.0e}".replace("e-0", "e-") for error in errors) + " |", "|---" * (len(errors) + 1) + "|"]
    for scene in SCENES:
        for solver, (_, _, label) in SERIES.items():
            costs = [min((cost for cost, error in points_of(rows, scene, solver) if error <= most), default=None) for most in errors]
            cells = " | ".join("not reached" if cost is None else f"{cost:.2g} ms" if cost < 100 else f"{cost:.0f} ms" for cost in costs)
            lines.append(f"| {scene.split(',')[0].split(' ')[1]}, {label} | {cells} |")
    return "\n".join(lines) + "\n"


def draw(rows):
    parts = []
    for i, scene in enumerate(SCENES):
        panel = Panel(480 * i, 0, f"{'Bare aluminium' if 'aluminium' in scene else 'Sponge buffers'}, free vibration of 10 s", (0.02, 1e4), (1e-15, 1), (True, True))
        panel.axes((0.1, 1, 10, 100, 1000, 10000), (1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1), ("CPU time of a run [ms]", "error of the displacement"))
        for solver, (colour, dash, _) in SERIES.items():
            points = points_of(rows, scene, solver)
            panel.line(*zip(*points), colour, dash)
            panel.dots(points, colour)
        cost, error = points_of(rows, scene, "exact")[0]
        x, y = panel.place(cost, error)
        parts += [*panel.parts, f'<circle cx="{x:.1f}" cy="{y:.1f}" r="7" fill="{SERIES["exact"][0]}"/>'
                  f'<text x="{x - 6:.1f}" y="{y - 27:.1f}" font-weight="bold">exact: {cost:.2g} ms, {error:.0e}</text>']
    for i, (colour, dash, label) in enumerate(SERIES.values()):
        x, y = 62 + 225 * (i % 4), 345 + 20 * (i // 4)
        parts.append(f'<path class="line" stroke="{colour}"{dash} d="M{x} {y - 4}h24"/><text x="{x + 30}" y="{y}">{label}</text>')
    body = "\n".join(parts)
    return ('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 960 375" font-family="sans-serif" font-size="12">\n'
            "<title>Error of the displacement against CPU time of eight solvers, with sponge and with bare aluminium</title>\n"
            "<style>.grid{stroke:#ddd}.frame{fill:none;stroke:#333}.line{fill:none;stroke-width:1.4}</style>\n"
            f'<rect width="960" height="375" fill="#fff"/>\n{body}\n</svg>\n')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv", help="the file of measurements")
    parser.add_argument("--build", default=os.path.join(SOURCE, "build"))
    parser.add_argument("--measure", action="store_true", help="measure and write that file first")
    parser.add_argument("--svg", help="draw the chart into this file")
    arguments = parser.parse_args()
    if arguments.measure:
        measure(arguments.build, arguments.csv)
    with open(arguments.csv, encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if arguments.svg:
        with open(arguments.svg, "w", encoding="utf-8") as file:
            file.write(draw(rows))
    print(table(rows), end="")


if __name__ == "__main__":
    main()
