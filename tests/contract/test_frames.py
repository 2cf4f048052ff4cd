#!/usr/bin/env python3
"""A frame of several storeys and dampers, and a structure by its matrices, from the scene to every result.

The motion itself is judged in tests/truth; here its names, shapes, statistics and modes."""

import copy
import csv
import io
import os
import struct
import sys

import numpy
import scipy.linalg

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402


def series(daemon, result):
    """The series as {name: values}, from its CSV."""
    rows = list(csv.reader(io.StringIO(daemon.get(f"/v1/results/{result}/series.csv").body.decode())))
    numbers = numpy.array(rows[1:], dtype=float)
    return {name.split(" [")[0]: numbers[:, i] for i, name in enumerate(rows[0])}


def dry_run(daemon, scene):
    reply = daemon.request("POST", "/v1/jobs?dry_run=1", json=scene)
    assert reply.status == 200, reply
    return reply.json()


def test_every_storey_and_damper_has_its_channels():
    """Channels carry their numbers in the series, its binary form, the spectra and the units; no bare name is there."""
    with program.daemon() as daemon:
        job = program.finished(daemon, program.scene("frame_two_dampers"))
        columns = series(daemon, job["result"])
        storeys = [f"{name}_{i}" for name in ("displacement", "velocity", "acceleration") for i in (1, 2, 3)]
        dampers = [f"{name}_{i}" for name in ("damper_displacement", "contact_force") for i in (1, 2)]
        assert list(columns) == ["time"] + storeys + dampers, list(columns)
        result = daemon.get(f"/v1/results/{job['result']}").json()
        assert result["channels"] == storeys + dampers, result["channels"]
        assert result["units"]["contact_force_2"] == "N" and result["units"]["velocity_3"] == "m/s", result["units"]
        base = f"/v1/results/{job['result']}"
        assert list(daemon.get(f"{base}/psd.json").json()["channels"]) == ["mean_acceleration_3"]
        raw = daemon.get(f"{base}/series.npy?channels=contact_force_2,displacement_1").body
        numbers = numpy.frombuffer(raw[10 + struct.unpack("<H", raw[8:10])[0]:]).reshape(3, -1)
        assert (numbers[1] == columns["contact_force_2"]).all() and (numbers[2] == columns["displacement_1"]).all()
        reply = daemon.get(f"{base}/series.json?channels=displacement")
        assert reply.status == 404 and "displacement_1, displacement_2" in reply.json()["detail"], reply.body


def test_the_summary_is_of_the_storey_that_moves_most():
    """Peaks and rms values are the largest over storeys and dampers; the ledger names its dampers."""
    with program.daemon() as daemon:
        job = program.finished(daemon, program.scene("frame_two_dampers"))
        columns, summary = series(daemon, job["result"]), job["summary"]
        for name in ("displacement", "acceleration"):
            storeys = numpy.array([columns[f"{name}_{i}"] for i in (1, 2, 3)])
            rms = numpy.sqrt((storeys ** 2).mean(axis=1)).max()
            assert abs(summary[f"rms_{name}"] / rms - 1) < 1e-12, (name, rms, summary)
            assert abs(storeys).max() <= summary[f"peak_{name}"] < 1.1 * abs(storeys).max(), (name, summary)
        x_1, x_2, x_3 = (columns[f"displacement_{i}"] for i in (1, 2, 3))
        drift = max(abs(drifts).max() for drifts in (x_1, x_2 - x_1, x_3 - x_2))
        assert drift * (1 - 1e-12) <= summary["peak_storey_drift"] < 1.1 * drift, summary
        assert summary["peak_base_shear"] > 0.9 * 900000 * abs(x_1).max(), summary
        impacts = daemon.get(f"/v1/results/{job['result']}/impacts.json").json()["impacts"]
        assert {impact["damper"] for impact in impacts} == {1, 2}
        assert max(impact["peak_force"] for impact in impacts) == summary["peak_contact_force"]


def test_the_plan_lists_the_modes():
    """Frequencies and damping ratios are those of the matrices, as SciPy finds them."""
    with program.daemon() as daemon:
        scene = program.scene("matrices")
        plan = dry_run(daemon, scene)["plan"]
        M, K, C = (numpy.array(scene["structure"][name]) for name in ("mass", "stiffness", "damping"))
        squares, shapes = scipy.linalg.eigh(K, M)
        for mode, square, shape in zip(plan["modes"], squares, shapes.T):
            assert abs(mode["frequency"] / (square ** 0.5 / (2 * numpy.pi)) - 1) < 1e-13, (mode, square)
            assert abs(mode["damping_ratio"] / (shape @ C @ shape / (2 * square ** 0.5)) - 1) < 1e-12, mode
        assert len(plan["modes"]) == 2
        m_e = plan["derived"][0]["effective_mass"]
        assert abs(m_e * (1 / 25 + numpy.linalg.inv(M)[0, 0]) - 1) < 1e-14, m_e


def test_equal_scenes_have_one_result():
    """Defaults written out, storeys named, a list in place of 0: the same scene, the same result."""
    with program.daemon() as daemon:
        scene = program.scene("frame_two_dampers")
        named = copy.deepcopy(scene)
        named["dampers"][1]["storey"] = 3
        named["excitation"].update({"displacement": [0, 0, 0], "velocity": 0})
        named["output"] = {"channels": ["usual"], "psd": {"channels": ["mean_acceleration_3"]}}
        first, second = (dry_run(daemon, one) for one in (scene, named))
        assert first["result"] == second["result"], (first["scene"], second["scene"])
        again = dry_run(daemon, first["scene"])
        assert again["result"] == first["result"] and again["scene"] == first["scene"], again["scene"]


if __name__ == "__main__":
    program.main(globals())
