#!/usr/bin/env python3
"""Error against CPU time of the paper's four scenes: the table of README.md, and charts into a folder.

    /usr/bin/python3 tests/bench/tradeoff.py --build build              # prints the table
    /usr/bin/python3 tests/bench/tradeoff.py --charts tests/bench/epyc_9005
    /usr/bin/python3 tests/bench/tradeoff.py --twice                    # and how far two measurements are apart

The numbers are the program's own (`impactd tradeoff`); this only sets the scenes side by side."""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SCENES = {"paper_free_sponge": "sponge, free, 10 s", "paper_free_aluminium": "aluminium, free, 10 s",
          "paper_random_sponge": "sponge, random, 30 s", "paper_random_aluminium": "aluminium, random, 30 s"}
ROWS = ["exact", "exact, contact impulse", "precise, step 0.001 s", "precise, step 0.0001 s", "precise, step 1e-05 s",
        "rk4, step 0.001 s", "rk4, step 0.0001 s", "rk4, step 1e-05 s", "newmark, step 0.001 s",
        "newmark, step 0.0001 s", "newmark, step 1e-05 s", "adaptive, tolerance 1e-07", "adaptive, tolerance 1e-11",
        "adaptive, tolerance 1e-13"]


def measure(build, folder):
    """The tables of all scenes, by name; charts beside them in the folder."""
    tables = {}
    for name in SCENES:
        path = os.path.join(folder, name + ".json")
        subprocess.run([os.path.join(build, "impactd"), "tradeoff",
                        os.path.join(SOURCE, "schema", "examples", name + ".json"), "-o", path,
                        "-o", os.path.join(folder, f"tradeoff_{name}.svg")], check=True, stdout=subprocess.DEVNULL)
        with open(path, encoding="utf-8") as file:
            tables[name] = {point["name"]: point for point in json.load(file)["points"]}
    return tables


def number(value):
    return f"{value:.1e}".replace("e-0", "e-")


def milliseconds(seconds):
    return f"{1e3 * seconds:.2g} ms" if seconds < 0.1 else f"{1e3 * seconds:.0f} ms"


def cell(point):
    if point is None:
        return ""
    if point["status"] != "measured":
        return "unstable" if "unstable" in point["why"] or "bounds" in point["why"] else point["status"]
    errors = point["errors"]
    return f"{milliseconds(point['cpu_minimum'])}: {number(errors['displacement'])}, {errors['psd']:.1f} dB"


def differences(first, second):
    """Whether the errors are the same, and the largest change of a cost beside that of exact."""
    worst = (0, "")
    for scene, points in first.items():
        for name, point in points.items():
            other = second[scene][name]
            if point["errors"] != other["errors"]:
                sys.exit(f"{scene}, {name}: the errors differ: {point['errors']} {other['errors']}")
            if point["status"] == "measured":
                ratio = (point["cpu_minimum"] / points["exact"]["cpu_minimum"]
                         / (other["cpu_minimum"] / second[scene]["exact"]["cpu_minimum"]))
                worst = max(worst, (max(ratio, 1 / ratio) - 1, f"{scene}, {name}"))
    return worst


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(SOURCE, "build"))
    parser.add_argument("--charts", help="copy the charts to this folder")
    parser.add_argument("--twice", action="store_true", help="measure twice and compare")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        tables = measure(arguments.build, folder)
        if arguments.charts:
            os.makedirs(arguments.charts, exist_ok=True)
            for name in SCENES:
                shutil.copy(os.path.join(folder, f"tradeoff_{name}.svg"), arguments.charts)
        print("| | " + " | ".join(SCENES.values()) + " |\n|---|" + "---|" * len(SCENES))
        for row in ROWS:
            print(f"| {row} | " + " | ".join(cell(tables[name].get(row)) for name in SCENES) + " |")
        if arguments.twice:
            change, where = differences(tables, measure(arguments.build, folder))
            print(f"\nAgain: the same errors, costs beside that of exact within {100 * change:.0f} % ({where})")


if __name__ == "__main__":
    main()
