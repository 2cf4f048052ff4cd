#!/usr/bin/env python3
"""An optimisation as its user meets it: the answer in all formats, and the best scene, which runs to the same numbers."""

import io
import os
import sys
import xml.etree.ElementTree as tree
import zipfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402


def asked(**study):
    return {**program.scene("paper_free_sponge"), "duration": 2, "study": {
        "kind": "optimize",
        "variables": [{"pointer": "/dampers/0/clearance", "from": 0.005, "to": 0.04},
                      {"pointer": "/dampers/0/buffer", "values": ["sponge", "aluminium"]}],
        "objectives": [{"metric": "rms_displacement"}], "max_candidates": 20, **study}}


def test_variables_that_set_the_same_member_or_no_physics_are_refused():
    """A buffer beside its restitution, the duration, a range beyond all numbers: 422 at the variable."""
    scene = program.scene("optimize_clearance")
    with program.daemon() as daemon:
        for variables, place in (
                ([{"pointer": "/dampers/0/buffer/restitution", "from": 0.3, "to": 0.8},
                  {"pointer": "/dampers/0/buffer", "values": ["sponge", "aluminium"]}], "/study/variables/1/pointer"),
                ([{"pointer": "/duration", "from": 1, "to": 2}], "/study/variables/0/pointer"),
                ([{"pointer": "/dampers/0/offset", "from": -1e308, "to": 1e308}], "/study/variables/0")):
            reply = daemon.submit({**scene, "study": {**scene["study"], "variables": variables}})
            assert reply.status == 422 and place in {one["pointer"] for one in reply.json()["errors"]}, reply


def test_the_best_scene_is_one_request_away_and_has_the_reported_numbers():
    with program.daemon() as daemon:
        result = program.finished(daemon, asked())["result"]
        answer = daemon.get(f"/v1/results/{result}/optimum.json").json()
        assert answer["kind"] == "optimize" and answer["result"] == result and "scene" in answer
        assert answer["candidates"] == len(answer["history"]) == 20 and answer["runs"] == 22
        best = answer["best"]
        assert best["feasible"] and [value["pointer"] for value in best["values"]] == ["/dampers/0/clearance", "/dampers/0/buffer"]
        scene = daemon.get(f"/v1/results/{result}/optimum/scene").json()
        assert "study" not in scene and scene["dampers"][0]["clearance"] == best["values"][0]["value"]
        assert scene["dampers"][0]["buffer"]["material"] == best["values"][1]["value"]
        summary = program.finished(daemon, scene)["summary"]
        assert summary["rms_displacement"] == best["objectives"][0]["value"] == best["metrics"]["rms_displacement"]
        assert answer["undamped"]["metrics"]["rms_displacement"] > answer["given"]["metrics"]["rms_displacement"]

        rows = daemon.get(f"/v1/results/{result}/optimum.csv").body.decode().splitlines()
        assert len(rows) == 21 and rows[0].startswith("index,/dampers/0/clearance"), rows[0]
        archive = zipfile.ZipFile(io.BytesIO(daemon.get(f"/v1/results/{result}/optimum.npz").body))
        assert "index.npy" in archive.namelist(), archive.namelist()
        assert tree.fromstring(daemon.get(f"/v1/results/{result}/optimum.svg").body).tag.endswith("svg")


def test_the_command_prints_the_gain_and_the_values_of_rivals_and_front():
    """What people see names every variable of the best, of its rivals and of the front, and the region."""
    seeds = {**program.scene("paper_random_sponge"), "duration": 2, "study": {**asked()["study"], "over": {"runs": 8}}}
    code, out = program.on_terminal("optimize", scene=seeds)
    assert code == 0, out
    blocks = {block.splitlines()[0]: block.splitlines()[1:] for block in out.split("\n\n")}
    assert blocks["Nearly as good"][0].split()[:2] == ["values", "difference"], out
    assert 0.005 <= float(blocks["Nearly as good"][1].split(",")[0]) <= 0.04, out
    assert [line.split()[0] for line in blocks["Best values"]] == ["variable", "/dampers/0/clearance", "/dampers/0/buffer"], out
    assert blocks["Gain"][0].split()[:2] == ["quantity", "best"], out
    seeds["study"]["objectives"].append({"metric": "peak_contact_force"})
    code, out = program.on_terminal("optimize", scene=seeds)
    assert code == 0 and "\nBest compromises\nvalues " in out, out


def test_two_objectives_and_constraints_that_none_keeps():
    with program.daemon() as daemon:
        both = asked(objectives=[{"metric": "rms_displacement"}, {"metric": "impacts", "goal": "maximize"}])
        result = program.finished(daemon, both)["result"]
        answer = daemon.get(f"/v1/results/{result}/optimum.json").json()
        assert answer["front"] and answer["best"] and not answer["rivals"]
        assert tree.fromstring(daemon.get(f"/v1/results/{result}/optimum.svg").body).tag.endswith("svg")
        none = asked(constraints=[{"metric": "peak_displacement", "max": 0.001}])
        result = program.finished(daemon, none)["result"]
        answer = daemon.get(f"/v1/results/{result}/optimum.json").json()
        assert answer["best"] is None and "peak_displacement" in answer["warnings"][0]["detail"]
        assert daemon.get(f"/v1/results/{result}/optimum/scene").status == 404
        assert tree.fromstring(daemon.get(f"/v1/results/{result}/optimum.svg").body).tag.endswith("svg")


def test_faults_have_the_pointers_of_the_request():
    with program.daemon() as daemon:
        for change, pointer in (({"variables": []}, "/study/variables"),
                                ({"variables": [{"pointer": "/dampers/0/mass", "from": 2, "to": 1}]}, "/study/variables/0"),
                                ({"variables": [{"pointer": "/dampers/0/buffer", "values": ["spunge"]}]}, "/study/variables/0/values/0"),
                                ({"objectives": []}, "/study/objectives"),
                                ({"statistic": "median"}, "/study/statistic"),
                                ({"statistic": "max"}, "/study/statistic"),
                                ({"statistic": {}}, "/study/statistic"),
                                ({"over": {}}, "/study/over"),
                                ({"over": {"records": []}}, "/study/over"),
                                ({"over": {"runs": 4}}, "/study/over/runs"),
                                ({"over": {"records": ["none"]}}, "/study/over/records/0"),
                                ({"max_candidates": 1}, "/study/max_candidates")):
            reply = daemon.submit(asked(**change))
            assert reply.status == 422, (change, reply)
            assert pointer in [fault["pointer"] for fault in reply.json()["errors"]], (pointer, reply.json())


if __name__ == "__main__":
    program.main(globals())
