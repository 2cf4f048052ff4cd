#!/usr/bin/env python3
"""The study sensitivity: closed forms, slopes by differences, drawn runs; its formats, limits and equal bytes."""

import csv
import io
import json
import math
import os
import sys
import tempfile
import xml.etree.ElementTree

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

SANITIZED = "nightly"
SVG = "{http://www.w3.org/2000/svg}"
STATISTICS = ["peak_displacement", "rms_displacement", "peak_acceleration", "rms_acceleration", "impacts",
              "peak_contact_force"]


def study(duration=2, **members):
    """A short free vibration of the sponge with a sensitivity study."""
    return {**program.scene("paper_free_sponge"), "duration": duration, "study": {"kind": "sensitivity", **members}}


def made(scene):
    """The study's answer by the command."""
    code, out, errors = program.run("study", "-", text=json.dumps(scene))
    assert code == 0, errors
    return json.loads(out)


def summary(scene, **buffer):
    """The summary of the scene alone with other numbers of its buffer."""
    alone = {name: value for name, value in scene.items() if name != "study"}
    alone["dampers"] = [{**alone["dampers"][0], "buffer": {"restitution": 0.61, "contact_time": 0.025, **buffer}}]
    code, out, errors = program.run("run", "-", text=json.dumps(alone))
    assert code == 0, errors
    return json.loads(out)["summary"]


def close(a, b, within=1e-9):
    return numpy.allclose(a, b, rtol=within, atol=1e-13)


def test_closed_forms_are_the_papers():
    """k_b and c_b by e, T_c and masses, stop by stop; and the deviations that follow of the stated ones."""
    answer = made(study(restitution_deviation=0.15, contact_time_deviation=0.1, runs=2))
    log_e, masses = math.log(0.61), 0.1107 / 1.35
    assert [(one["damper"], one["side"]) for one in answer["contact"]] == [(1, "left"), (1, "right")]
    for stop in answer["contact"]:
        by_e = 2 * log_e / (math.pi ** 2 + log_e ** 2)
        assert close(stop["stiffness_by_restitution"], by_e) and stop["stiffness_by_contact_time"] == -2
        assert close(stop["damping_by_restitution"], 1 / log_e) and stop["damping_by_contact_time"] == -1
        assert close(stop["by_damper_mass"], 1 / (1 + masses)) and close(stop["by_structure_mass"], masses / (1 + masses))
        assert close(stop["stiffness_deviation"], math.hypot(0.15 * by_e, 0.2))
        assert close(stop["damping_deviation"], math.hypot(0.15 / log_e, 0.1))
    zero_force = made({**study(), "contact": {"separation": "zero_force"}})["contact"][0]
    assert abs(zero_force["stiffness_by_restitution"]) > 0.1 and close(zero_force["damping_by_restitution"], 1 / log_e)


def test_slopes_are_central_differences():
    """Every slope is that of two runs by hand; where steps agree it is settled."""
    scene = study()
    answer = made(scene)
    rows = {row["parameter"]: row for row in answer["response"]}
    assert list(rows) == ["restitution", "contact_time", "mass", "clearance"]
    for parameter, value in (("restitution", 0.61), ("contact_time", 0.025)):
        row = rows[parameter]
        assert row["steps"] == [0.01, 0.005, 0.0025] and row["why"] is None
        quotients = []
        for step in row["steps"]:
            low, high = (summary(scene, **{parameter: value * (1 + sign * step)}) for sign in (-1, 1))
            quotients.append({name: (high[name] - low[name]) / answer["summary"][name] / (2 * step) for name in STATISTICS})
        for slope in row["slopes"]:
            three = [one[slope["metric"]] for one in quotients]
            assert close(slope["derivative"], three[1], 1e-7), (parameter, slope, three)
            assert close(slope["spread"], max(three) - min(three), 1e-6), (parameter, slope, three)
            settled = slope["spread"] <= max(0.1 * max(abs(x) for x in three), 1e-3)
            assert slope["is_settled"] == settled, (parameter, slope)
    assert answer["runs"] == 0 and answer["statistics"] == [] and answer["table"] == []


def test_drawn_runs_are_told_as_numpy_tells_them():
    """Statistics, quantiles and the band of the spectra are those of the runs; each run can be made again."""
    scene = study(restitution_deviation=0.15, contact_time_deviation=0.1, runs=40, seed=3, parameters=["mass"])
    answer = made(scene)
    assert (answer["made"], answer["failed"], len(answer["table"])) == (40, 0, 40) and "log-normal" in answer["distribution"]
    for band in answer["statistics"]:
        values = numpy.array([run["summary"][band["metric"]] for run in answer["table"]], float)
        for name, value in (("mean", values.mean()), ("standard_deviation", values.std(ddof=1)), ("minimum", values.min()),
                            ("q05", numpy.quantile(values, 0.05)), ("median", numpy.median(values)),
                            ("q95", numpy.quantile(values, 0.95)), ("maximum", values.max())):
            assert close(band[name], value), (band, name, value)
        assert band["value"] == answer["summary"][band["metric"]] and band["count"] == 40
    densities = []
    for run in answer["table"]:
        alone = {name: value for name, value in scene.items() if name != "study"}
        alone["output"] = {**alone.get("output", {}), "reduction": False}
        alone["dampers"] = [{**alone["dampers"][0], "buffer": {"restitution": 0.61 * run["restitution"][0],
                                                               "contact_time": 0.025 * run["contact_time"][0]}}]
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "out.json")
            assert program.run("run", "-", "-o", path, text=json.dumps(alone))[0] == 0
            with open(path, encoding="utf-8") as file:
                again = json.load(file)
        assert again["job"]["summary"] == run["summary"], run
        densities.append(again["psd"]["channels"]["mean_acceleration"]["values"])
    (spectrum,) = answer["spectra"]
    assert close(spectrum["mean"], numpy.mean(densities, 0))
    for name, share in (("q05", 0.05), ("median", 0.5), ("q95", 0.95)):
        assert close(spectrum[name], numpy.quantile(densities, share, axis=0)), name


def test_chaos_is_told():
    """Beyond the trust horizon the answer says so, and slopes of it do not settle."""
    scene = {**program.scene("paper_random_aluminium"), "duration": 40, "study": {"kind": "sensitivity"}}
    answer = made(scene)
    assert answer["is_chaotic"] and "rounding alone" in answer["why"]
    slopes = [slope for row in answer["response"] for slope in row["slopes"]]
    assert sum(not slope["is_settled"] for slope in slopes) > len(slopes) / 2, slopes


def test_a_job_makes_the_study_in_all_its_formats():
    """JSON, CSV and SVG by the daemon; the same bytes as by the command, with one worker or four."""
    scene = study(restitution_deviation=0.1, runs=30)
    seen = []
    for workers in ("1", "4"):
        with program.daemon("--workers", workers) as daemon:
            others = [daemon.submit(study(seed=i, contact_time_deviation=0.1, runs=20),
                                    headers={"Prefer": "respond-async"}) for i in range(4)]
            assert all(other.status in (200, 202) for other in others)
            job = program.finished(daemon, scene)
            base = "/v1/results/" + job["result"]
            result = daemon.get(base).json()
            assert daemon.get(base + "/sensitivity.json").json() == {**result["study"], "result": result["id"], "scene": result["scene"]}
            assert result["links"]["sensitivity.csv"] == base + "/sensitivity.csv"
            seen.append([daemon.get(f"{base}/sensitivity.{ending}").body for ending in ("json", "csv", "svg")])
            assert daemon.get(base + "/sensitivity", headers={"Accept": "image/svg+xml"}).body == seen[-1][2]
    assert seen[0] == seen[1]
    code, out, _ = program.run("study", "-", text=json.dumps(scene))
    assert code == 0 and out.encode() == seen[0][0]
    answer = json.loads(out)
    rows = list(csv.DictReader(io.StringIO(seen[0][1].decode())))
    slopes = [(row["parameter"], slope) for row in answer["response"] for slope in row["slopes"]]
    assert len(rows) == 12 + len(slopes) and rows[0]["statistic"] == "stiffness 1 left"
    for row, (parameter, slope) in zip(rows[12:], slopes):
        assert (row["parameter"], row["statistic"]) == (parameter, slope["metric"])
        assert float(row["derivative"]) == slope["derivative"] and row["is_settled"] == str(slope["is_settled"]).lower()
    root = xml.etree.ElementTree.fromstring(seen[0][2])
    texts = [one.text for one in root.iter(SVG + "text")]
    for name in STATISTICS + ["restitution", "contact_time", "mass"]:
        assert name.replace("_", " ") in texts, name
    assert sum((path.get("class") or "").startswith("band") for path in root.iter(SVG + "path")) == 1


def test_given_stiffness_is_a_parameter_itself():
    """Buffers of given stiffness and damping: their slopes are of these, and the answer says why no e and T_c are varied."""
    with program.daemon() as daemon:
        rigid = {**study(), "dampers": [{"mass": 0.1107, "clearance": 0.015, "buffer": {"stiffness": 1655, "damping": 4}}]}
        answer = daemon.submit(rigid, wait=20).json()
        told = daemon.get(f"/v1/results/{answer['result']}/sensitivity.json").json()
        assert [row["parameter"] for row in told["response"]] == ["stiffness", "damping", "mass", "clearance"]
        assert "given themselves" in told["contact"][0]["why"]


if __name__ == "__main__":
    program.main(globals())
