#!/usr/bin/env python3
"""The paper reproduced: Figures 4 to 13 of Li and Darby as scenes, run by `impactd run`.

Prints a table: what the paper says, what its scenes give, whether that holds. Writes it as figures.txt and figures.json,
with one chart, chart.svg, into --out; these three are committed, and README.md beside it shows the rows marked as brief. A test,
truth/test_paper.py, keeps the firm ones true."""

import argparse
import json
import os

from assumptions import all_open
from chart import draw
from contact import parameters, pulses, sensitivity
from forced import all_forced
from free import all_free
from rows import SEEDS
from scenes import program

HERE = os.path.dirname(os.path.abspath(__file__))
VERDICT = {True: "holds", False: "differs"}


def rounded(value):
    """Seven digits of every number: what the next compiler changes is not worth a difference."""
    if isinstance(value, dict):
        return {key: rounded(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(one) for one in value]
    return float(f"{value:.7g}") if isinstance(value, float) else value


def all_rows(seeds):
    """Everything, in the paper's order of figures, then of sections."""
    forced, sections = all_forced(seeds)
    return [*all_free(), *forced, *pulses(), sensitivity(seeds), sections[0], parameters(), sections[1]]


def table(rows, choices):
    """All of it as text."""
    lines = ["The paper, reproduced (tests/paper/reproduce.py). The paper does not print its experiments: the",
             "comparison is between its two models where it says that both match an experiment. A repeated test is one model",
             "run twice with slightly different initial values. Rows marked * are of motions that amplify rounding.", ""]
    for row in rows:
        name = row["figure"] if row["figure"][0].isalpha() else "Figure " + row["figure"]
        lines += [f"{name}{'' if row['firm'] else ' *'}: {VERDICT[row['holds']]}",
                  f"  the paper   {row['says']}", f"  we get      {row['finds']}", f"  criterion   {row['criterion']}"]
        lines += [f"  note        {row['why']}"] if row["why"] else []
        lines.append("")
    lines += ["Choices that the paper leaves open, the one taken, and how far the models are apart with another",
              "(thirds of octaves, 1-16 / 16-128 Hz; free vibration where no base is named)", ""]
    for entry in choices:
        lines.append(f"{entry['about']}: {entry['taken']}")
        lines += [f"  {other['choice']}: {other['text']}" for other in entry["others"]]
    return "\n".join(lines) + "\n"


def markdown(rows):
    """The README's table."""
    lines = ["| figure | the paper says | we get | |", "|---|---|---|---|"]
    for row in rows:
        if row["brief"]:
            verdict = VERDICT[row["holds"]] + ("" if row["holds"] else ": " + row["why"])
            lines.append(f"| {row['figure']} | {row['says']} | {row['finds']} | {verdict} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default=program.build, help="folder of the build to ask")
    parser.add_argument("--out", default=HERE, help="folder for figures.txt, figures.json and chart.svg")
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    rows = all_rows(SEEDS)
    choices = all_open(SEEDS)
    points = next(row for row in rows if "points" in row["values"])["values"]["points"]
    text = table(rows, choices)
    for name, content in (("figures.txt", text), ("chart.svg", draw(points)),
                          ("figures.json", json.dumps(rounded({"rows": rows, "open": choices}), indent=1) + "\n")):
        with open(os.path.join(arguments.out, name), "w", encoding="utf-8") as file:
            file.write(content)
    print(text + "\n" + markdown(rows), end="")


if __name__ == "__main__":
    main()
