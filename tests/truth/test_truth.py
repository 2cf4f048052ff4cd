#!/usr/bin/env python3
"""Every scene with an answer in quad precision, through `impactd run` and through the daemon."""

import json
import os
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

HERE = os.path.dirname(os.path.abspath(__file__))
FACTOR, FLOOR = 20, 1e-12  # of double_error; what counts as equal in any case
SLIGHT = 1e-9              # of the largest approach speed: how many of those there are is rounding's choice
RESIDUAL = 1e-9            # of the largest energy
FIRST_IMPACT, FIRST_IMPACT_ERROR = 0.0416214083419515, 1e-13  # [s]
SCENES = 13
FIRST = 21                 # truths in the first second: later on errors have grown to the motion's own size
# Settings, error allowed there, and how often the stated error may be missed: across contacts it is chance.
STEPPING = {
    "precise": ({"step": 1e-5}, 0.03, 3),
    "rk4": ({"step": 1e-5}, 0.03, 3),
    "newmark": ({"step": 1e-5}, 0.03, 3),
    "adaptive": ({"tolerance": 1e-12}, 1e-8, 1.5),
}


def cases():
    with open(os.path.join(HERE, "record.json"), encoding="utf-8") as file:
        record = json.load(file)
    for name in sorted(os.listdir(HERE)):
        if not name.endswith(".json") or name == "record.json":
            continue
        with open(os.path.join(HERE, name), encoding="utf-8") as file:
            truth = json.load(file)
        if truth["scene"]["excitation"].get("samples") == "record.json":
            truth["scene"]["excitation"]["samples"] = record
        truth["impacts"] = [dict(zip(truth["impact_columns"], row)) for row in truth["impacts"]]
        yield name[:-5], truth


def above(impacts):
    """The impacts that are compared."""
    most = max(one["approach_speed"] or 0 for one in impacts)
    return [one for one in impacts if (one["approach_speed"] or 0) > SLIGHT * most]


def compare(truth, series, impacts):
    """Measured over allowed for each quantity; raises where the ledgers are not of the same events."""
    step = round(truth["interval"] * series["sample_rate"])
    values = series["channels"]["displacement"]["values"]
    assert len(values) == series["count"] == (len(truth["displacement"]) - 1) * step + 1
    assert impacts["count"] == sum(one["kind"] == "impact" for one in impacts["impacts"])
    ours, theirs = above(impacts["impacts"]), above(truth["impacts"])
    assert len(ours) == len(theirs), f"{len(ours)} impacts, true are {len(theirs)}"
    for one, true in zip(ours, theirs):
        assert (one["kind"], one["side"]) == ("impact", true["side"]), (one, true)
        assert (one["end"] is None) == (true["end"] is None), (one, true)
        assert (one["separation_speed"] is None) == (true["separation_speed"] is None), (one, true)
    peak = "impulse" if "impulse" in truth["impact_columns"] else "peak_force"

    def worst(key):
        return max((abs(one[key] - true[key]) for one, true in zip(ours, theirs) if true[key] is not None),
                   default=0)

    def largest(*keys):
        return max(true[key] for true in theirs for key in keys if true[key] is not None)

    errors = {
        "displacement": max(abs(a - b) for a, b in zip(values[::step], truth["displacement"]))
                        / max(map(abs, truth["displacement"])),
        "start_times_speed": max(abs(one["start"] - true["start"]) * true["approach_speed"]
                                 for one, true in zip(ours, theirs)),
        "speed": max(worst("approach_speed"), worst("separation_speed"))
                 / largest("approach_speed", "separation_speed"),
        "peak": worst(peak) / largest(peak),
    }
    return {key: error / max(FACTOR * truth["double_error"][key], FLOOR) for key, error in errors.items()}


def judge(answer):
    """Compares all scenes as `answer` (scene -> job, series, impacts) gives them; prints the table."""
    columns = ["displacement", "start_times_speed", "speed", "peak"]
    print(f"      {'measured / allowed':26}" + "".join(f"{c:>19}" for c in columns) + f"{'energy residual':>17}")
    faults, count = [], 0
    for name, truth in cases():
        count += 1
        job, series, impacts = answer(truth["scene"])
        try:
            ratios = compare(truth, series, impacts)
        except AssertionError as error:
            faults.append(f"{name}: {error}")
            print(f"      {name:26}  {error}")
            continue
        residual = job["summary"]["energy_residual"]
        print(f"      {name:26}" + "".join(f"{ratios[c]:19.3g}" for c in columns) + f"{residual:17.2g}")
        # "not <=" so that a NaN is a fault.
        faults += [f"{name}: {c} is {ratios[c]:.3g} of what is allowed" for c in columns if not ratios[c] <= 1]
        if not 0 <= residual <= RESIDUAL:
            faults.append(f"{name}: energy residual {residual}, allowed is {RESIDUAL}")
        if truth["scene"]["excitation"]["kind"] == "free":
            error = abs(impacts["impacts"][0]["start"] - FIRST_IMPACT)
            if not error <= FIRST_IMPACT_ERROR:
                faults.append(f"{name}: the first impact is {error:.2g} s off")
    assert count == SCENES, f"{count} scenes instead of {SCENES}"
    assert not faults, "\n" + "\n".join(faults)


def by_program(scene):
    with tempfile.TemporaryDirectory() as folder:
        target = os.path.join(folder, "out.json")
        code, out, errors = program.run("run", "-", "-o", target, text=json.dumps(scene))
        assert code == 0, (code, out, errors)
        with open(target, encoding="utf-8") as file:
            whole = json.load(file)
    return whole["job"], whole["series"], whole["impacts"]


def test_program_tells_the_truth():
    """`impactd run` meets all 13 scenes within 20 times what a plain double run misses."""
    judge(by_program)


def test_daemon_tells_the_truth():
    """The daemon meets all 13 scenes within 20 times what a plain double run misses."""
    with program.daemon() as daemon:
        def by_daemon(scene):
            job = program.finished(daemon, scene)
            result = f"/v1/results/{job['result']}"
            return job, daemon.get(result + "/series.json").json(), daemon.get(result + "/impacts.json").json()

        judge(by_daemon)


def test_solvers_that_step_say_how_far_they_are_off():
    """Each solver that steps meets all 13 scenes within a few times the error it states, and its own allowance."""
    print(f"      {'measured (stated)':26}" + "".join(f"{solver:>22}" for solver in STEPPING))
    faults = []
    for name, truth in cases():
        row = f"      {name:26}"
        for solver, (settings, allowed, times) in STEPPING.items():
            job, series, _ = by_program(dict(truth["scene"], accuracy=dict(settings, solver=solver)))
            step = round(truth["interval"] * series["sample_rate"])
            pairs = list(zip(series["channels"]["displacement"]["values"][::step], truth["displacement"]))
            most = max(abs(true) for _, true in pairs)
            error = max(abs(one - true) for one, true in pairs) / most
            first = max(abs(one - true) for one, true in pairs[:FIRST]) / most
            stated = job["summary"]["error_estimate"]
            row += f"{f'{error:.2g} ({stated:.2g})':>22}"
            if not error <= times * stated:
                faults.append(f"{name} by {solver}: off by {error:.3g}, says {stated:.3g}")
            if not first <= allowed:
                faults.append(f"{name} by {solver}: off by {first:.3g} in its first second, allowed is {allowed}")
        print(row)
    assert not faults, "\n" + "\n".join(faults)


def test_comparison_can_fail():
    """A truth that is moved by twice what is allowed, or has an impact more, is told from the right one."""
    _, truth = next((name, case) for name, case in cases() if name == "free_sponge")

    def answer():
        step = round(truth["interval"] * truth["scene"]["sample_rate"])
        values = [0.0] * ((len(truth["displacement"]) - 1) * step + 1)
        values[::step] = truth["displacement"]
        return ({"sample_rate": 1000, "count": len(values), "channels": {"displacement": {"values": values}}},
                {"count": len(truth["impacts"]), "impacts": [dict(one, kind="impact") for one in truth["impacts"]]})

    series, impacts = answer()
    assert max(compare(truth, series, impacts).values()) == 0
    series["channels"]["displacement"]["values"][500] += 2 * FLOOR * 0.015
    impacts["impacts"][3]["start"] += 2 * FLOOR / impacts["impacts"][3]["approach_speed"]
    impacts["impacts"][4]["separation_speed"] *= 1 + 1e-10
    impacts["impacts"][0]["peak_force"] *= 1 + 1e-11
    found = compare(truth, series, impacts)
    assert min(found.values()) > 1, found
    for change in ({"side": "left"}, {"kind": "resting"}, {"end": None}):
        series, impacts = answer()
        impacts["impacts"][0].update(change)
        try:
            compare(truth, series, impacts)
        except AssertionError:
            continue
        raise AssertionError(f"{change} was not seen")


if __name__ == "__main__":
    program.main(globals())
