#!/usr/bin/env python3
"""Fragility: uploaded ground motions at rising intensities, the limits exceeded and their distributions.

schema/examples/with_records has scenes that name records, which have to be uploaded first; it is no part of what the
daemon serves as examples."""

import csv
import io
import json
import math
import os
import random
import sys
import xml.etree.ElementTree

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from asking import problem  # noqa: E402

SANITIZED = "nightly"
METRICS = ["peak_displacement", "rms_displacement", "peak_acceleration", "rms_acceleration", "impacts",
           "peak_contact_force", "peak_storey_drift", "peak_base_shear"]


def quake(seed, count=800, interval=0.02):
    """Filtered noise that swells and fades."""
    chance, samples, state = random.Random(seed), [], 0
    for i in range(count):
        state = 0.7 * state + chance.gauss(0, 1)
        samples.append(state * math.sin(math.pi * i / count) ** 2)
    return {"name": f"quake_{seed}", "interval": interval, "samples": samples}


def uploaded(daemon, count=6):
    for seed in range(1, count + 1):
        assert daemon.request("POST", "/v1/records", json=quake(seed)).status == 201


def example(**members):
    with open(os.path.join(program.EXAMPLES, "with_records", "fragility.json"), encoding="utf-8") as file:
        scene = json.load(file)
    scene["study"].update(members)
    return scene


def test_the_example_runs_and_its_answer_follows_from_its_curves():
    """A curve for each record, fractiles and first exceedances; csv, npz and the chart have the same numbers."""
    with program.daemon() as daemon:
        uploaded(daemon)
        job = program.finished(daemon, example())
        base = f"/v1/results/{job['result']}/fragility"
        answer = daemon.get(base + ".json").json()
        assert answer["kind"] == "fragility" and answer["runs"] == 72 and answer["failed"] == 0, answer["failures"]
        assert answer["intensity"] == {"measure": None, "period": 0.45, "damping_ratio": 0.02}
        assert [curve["record"] for curve in answer["curves"]] == [f"quake_{i}" for i in range(1, 7)]
        for curve in answer["curves"]:
            assert [point["level"] for point in curve["points"]] == list(range(1, 13))
            spectrum = daemon.get(f"/v1/records/{curve['record']}/spectrum.json?damping_ratio=0.02&from=0.45&to=1&points=2")
            assert abs(curve["intensity"] / spectrum.json()["pseudo_acceleration"]["values"][0] - 1) < 1e-12
        for limit in answer["limits"]:
            values = numpy.array([[point["metrics"][limit["metric"]] for point in curve["points"]] for curve in answer["curves"]])
            assert limit["exceeded"] == (values > limit["value"]).any(axis=1).sum() >= 4, limit
            first = [numpy.argmax(row > limit["value"]) + 1 for row in values if (row > limit["value"]).any()]
            assert min(first) - 1 <= limit["median"] <= max(first) and 0 < limit["dispersion"] < 1.5, limit
            for name in ("median", "dispersion"):
                low, high = limit[name + "_interval_95"]
                assert low < limit[name] < high, limit
            rows = [row for row in answer["fractiles"] if row["metric"] == limit["metric"]]
            assert [row["level"] for row in rows] == list(range(1, 13)) and all(row["count"] == 6 for row in rows)
            assert numpy.allclose([[row[name] for name in ("p16", "p50", "p84")] for row in rows],
                                  numpy.quantile(values, (0.16, 0.5, 0.84), axis=0).T, rtol=1e-12)
        table = list(csv.reader(io.StringIO(daemon.get(base + ".csv").body.decode())))
        assert table[0][:3] == ["record", "level [m/s^2]", "peak_displacement [m]"] and len(table) == 73, table[0]
        assert table[14][0] == "quake_2" and float(table[14][1]) == 2
        point = answer["curves"][1]["points"][1]["metrics"]
        assert [float(cell) for cell in table[14][2:]] == [point[name] for name in METRICS]
        arrays = numpy.load(io.BytesIO(daemon.get(base + ".npz").body))
        assert arrays["peak_base_shear"][13] == point["peak_base_shear"] and len(arrays["level"]) == 72
        chart = xml.etree.ElementTree.fromstring(daemon.get(base + ".svg").body)
        texts = " ".join(chart.itertext())
        assert "pseudo-acceleration at 0.45 s" in texts and "peak_storey_drift above 0.015 m" in texts, texts


def test_a_run_is_the_scene_with_its_record_at_that_factor():
    """Any point of a curve can be run alone; the number of workers changes no byte."""
    scene = example(records=["quake_3", "quake_1"], levels=[2, 5.5], intensity="pga")
    answers = []
    for workers in ("1", "4"):
        with program.daemon("--workers", workers) as daemon:
            uploaded(daemon, 3)
            job = program.finished(daemon, scene)
            answers.append(daemon.get(f"/v1/results/{job['result']}/fragility.json").body)
            if workers == "4":
                continue
            answer = json.loads(answers[0])
            curve = answer["curves"][0]
            assert curve["intensity"] == max(abs(value) for value in quake(3)["samples"])
            alone = {name: value for name, value in scene.items() if name != "study"}
            alone["excitation"] = {"kind": "record", "name": "quake_3", "scale": 5.5 / curve["intensity"]}
            summary = program.finished(daemon, alone)["summary"]
            assert {name: summary[name] for name in METRICS} == {name: curve["points"][1]["metrics"][name] for name in METRICS}
            assert job["result"] in answers[0].decode() and answer["scene"]["study"]["records"][0]["digest"]
            uses = daemon.get("/v1/records/quake_1").json()["used_by"]
            assert uses["results"] == 1 and daemon.request("DELETE", "/v1/records/quake_1").status == 409, uses
    assert answers[0] == answers[1]


def test_senseless_requests_are_refused_at_their_place():
    """Each fault has its pointer; unknown records are told once."""
    with program.daemon() as daemon:
        uploaded(daemon, 2)
        for members, pointer, words in (
                ({"records": ["quake_1", "quake_9"]}, "/study/records/1", "quake_9"),
                ({"records": "quake_1"}, "/study/records", "must be an array of names"),
                ({"records": ["quake_1", "quake_1"]}, "/study/records/1", "twice"),
                ({"records": []}, "/study/records", "required"),
                ({"levels": [1, 1]}, "/study/levels/1", "rise"),
                ({"levels": [0, 1]}, "/study/levels/0", "above 0"),
                ({"levels": []}, "/study/levels", "required"),
                ({"levels": 3}, "/study/levels", "must be an object or an array of numbers"),
                ({"levels": {"from": 0, "to": 2, "count": 3}}, "/study/levels/from", "above 0"),
                ({"levels": {"from": 1, "to": 2, "count": 6000}}, "/study/levels/count", "within"),
                ({"intensity": "pgv"}, "/study/intensity",
                 "must be one of pga, or an object with period, damping_ratio, is \"pgv\""),
                ({"intensity": {"period": 0.45, "damping_ratio": 1}}, "/study/intensity/damping_ratio", "within"),
                ({"limits": [{"metric": "drift", "value": 1}]}, "/study/limits/0/metric", "peak_storey_drift"),
                ({"limits": [{"metric": "peak_displacement"}]}, "/study/limits/0/value", "required")):
            reply = daemon.submit(example(**{"records": ["quake_1", "quake_2"], **members}))
            faults = reply.json()["errors"]
            assert reply.status == 422 and [fault["pointer"] for fault in faults] == [pointer], (members, faults)
            assert words in faults[0]["detail"] or words in faults[0].get("value", ""), (members, faults)
        plan = daemon.request("POST", "/v1/jobs?dry_run=1", json=example(records=["quake_1", "quake_2"])).json()
        assert plan["scene"]["excitation"]["name"] == "quake_1" and not plan["warnings"], plan["warnings"]
        scene = {**example(records=["quake_1", "quake_2"]), "excitation": {"kind": "sine", "amplitude": 1, "frequency": 2}}
        (fault,) = daemon.submit(scene).json()["errors"]
        assert fault["pointer"] == "/excitation" and "would be replaced by the records" in fault["detail"], fault
        job = program.finished(daemon, example(records=["quake_1", "quake_2"], limits=[{"metric": "impacts", "value": 1e6}]))
        answer = daemon.get(f"/v1/results/{job['result']}/fragility.json").json()
        assert answer["limits"][0]["median"] is None and answer["limits"][0]["median_interval_95"] is None, answer["limits"]
        assert "take higher levels" in answer["warnings"][0]["detail"], answer["warnings"]
        problem(daemon.get(f"/v1/results/{job['result']}/ensemble.json"), 404)


if __name__ == "__main__":
    program.main(globals())
