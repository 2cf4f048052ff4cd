#!/usr/bin/env python3
"""What all studies owe alike: exit codes of their commands, an end at once, progress, faults at their places."""

import csv
import io
import json
import math
import os
import re
import signal
import subprocess
import sys
import tempfile
import time

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

SANITIZED = "nightly"
RANDOM, FREE = (os.path.join(program.EXAMPLES, f"paper_{kind}_sponge.json") for kind in ("random", "free"))
ABSENT = object()
QUICK = {  # kind: scene, its duration, members of a quick study
    "ensemble": ("paper_random_sponge", 5, {"runs": 12}),
    "tradeoff": ("paper_free_sponge", 10, {"repeats": 1, "point_steps": 1e6}),
    "sensitivity": ("paper_free_sponge", 2, {}),
}
LONG = {
    "ensemble": ({"duration": 100}, {"runs": 5000}),
    "tradeoff": ({}, {"repeats": 25, "point_steps": 2e7}),
    "sensitivity": ({"duration": 200}, {"contact_time_deviation": 0.1, "runs": 2000, "parameters": ["mass"]}),
}


def study(kind, changes=None, /, **members):
    """A scene with a quick study, with other members of both; ABSENT is left out."""
    name, duration, quick = QUICK[kind]
    whole = {"kind": kind, **quick, **members}
    return {**program.scene(name), "duration": duration, **(changes or {}),
            "study": {key: value for key, value in whole.items() if value is not ABSENT}}


def test_faults_have_their_exit_codes():
    """2 for wrong words, 3 for a scene or study with faults, 4 for a missing file, 1 for what cannot be written."""
    for arguments, code, expected in [
            (("ensemble",), 2, "takes one scene"),
            (("ensemble", RANDOM, "-o", "out.npy"), 2, "one of .json, .csv, .npz, .svg"),
            (("ensemble", RANDOM, "-o", ".svg"), 2, "one of .json, .csv, .npz, .svg"),
            (("ensemble", RANDOM, "--metric", "impact"), 2, "did you mean impacts?"),
            (("ensemble", RANDOM, "--run", "1"), 2, "did you mean --runs?"),
            (("ensemble", RANDOM, "--runs", "1"), 3, "/study/runs: must be within [2, 10000]"),
            (("ensemble", RANDOM, "--target", "0"), 3, "/study/target: must be above 0"),
            (("ensemble", RANDOM, "--first-seed", "9007199254740991"), 3, "/study/first_seed: must be at most"),
            (("ensemble", FREE), 3, "/excitation/kind must be random, is free"),
            (("ensemble", RANDOM, "-o", "/nonexistent/out.svg"), 1, "cannot be written"),
            (("ensemble", "/nonexistent.json"), 4, "cannot be read"),
            (("optimize", FREE), 3, "/study/variables: is required"),
            (("response", os.path.join(program.EXAMPLES, "optimize_clearance.json")), 3, "is optimize, not response: `impactd study` makes it"),
            (("tradeoff",), 2, "takes one scene"),
            (("tradeoff", FREE, "-o", "out.csv"), 2, ".svg"),
            (("tradeoff", FREE, "--metric", "pds"), 2, "did you mean psd?"),
            (("tradeoff", FREE, "--eror", "1"), 2, "did you mean --error?"),
            (("tradeoff", FREE, "--error", "-1"), 3, "/study/error: must be at least 0"),
            (("tradeoff", FREE, "--repeats", "0"), 3, "/study/repeats: must be within [1, 1000]"),
            (("tradeoff", FREE, "--solver", "rk5"), 3, 'did you mean "rk4"?'),
            (("tradeoff", FREE, "-o", "/nonexistent/out.svg"), 1, "cannot be written"),
            (("tradeoff", "/nonexistent.json"), 4, "cannot be read")]:
        done, out, errors = program.run(*arguments)
        assert done == code and expected in errors and out == "", (arguments, done, out, errors)
    for kind in ("ensemble", "tradeoff"):
        code, _, errors = program.run("run", "-", text=json.dumps(study(kind)))
        assert code == 3 and "`impactd study` makes it" in errors, (code, errors)
        code, out, _ = program.run("check", "-", text=json.dumps(study(kind)))
        assert code == 0 and json.loads(out)["scene"]["study"]["kind"] == kind, out
    code, out, _ = program.run("tradeoff", "--help")
    assert code == 0 and out.splitlines()[4].strip().startswith("impactd tradeoff scene.json"), out


def test_every_format_that_a_help_names_is_written():
    """Each extension of -o in the help of a study's command makes a file of that format, in one call with the table for people."""
    examples = {"optimize": "optimize_clearance", "calibrate": "calibrate_free_sponge", "response": "response_sponge",
                "fragility": "with_records/fragility", "ensemble": "ensemble_inputs", "sweep": "sweep_clearance_buffer",
                "study": "sensitivity_sponge"}
    starts = {"json": b"{", "csv": b"", "npz": b"PK", "npy": b"\x93NUMPY", "mat": b"MATLAB", "svg": b"<svg"}
    small = {"optimize": {"max_candidates": 10, "over": {"runs": 8}}, "ensemble": {"runs": 8}, "calibrate": {"starts": 1},
             "response": {"axis": {"pointer": "/excitation/frequency", "from": 3, "to": 3.5, "count": 5}}}
    for kind, name in examples.items():
        scene = program.scene(name)
        scene["study"].update(small.get(kind, {}))
        _, out, _ = program.run("help", kind)
        extensions = sorted(set(re.findall(r"[.](json|csv|npy|npz|mat|svg)\b", out.replace("scene.json", ""))))
        assert {"json", "csv", "svg"} <= set(extensions), (kind, out)
        with tempfile.TemporaryDirectory() as folder:
            arguments = [kind, "-"]
            for record in scene["study"].get("records", []):
                path = os.path.join(folder, record + ".txt")
                with open(path, "w", encoding="utf-8") as file:
                    file.writelines(f"{i / 50} {math.sin(i)}\n" for i in range(100))
                arguments += ["--unit", "g", "--record", path]
            paths = {extension: os.path.join(folder, "out." + extension) for extension in extensions}
            for path in paths.values():
                arguments += ["-o", path]
            code, _, errors = program.run(*arguments, text=json.dumps(scene))
            assert code == 0, (kind, errors)
            contents = {extension: open(path, "rb").read() for extension, path in paths.items()}
        for extension, content in contents.items():
            assert content.startswith(starts[extension]) and len(content) > 40, (kind, extension, content[:40])
        rows = list(csv.reader(io.StringIO(contents["csv"].decode())))
        assert {len(row) for row in rows} == {len(rows[0])} and not re.search(r'"""|null|None', contents["csv"].decode()), (kind, rows)
        with numpy.load(io.BytesIO(contents["npz"])) as arrays:
            assert {len(arrays[column]) for column in arrays.files} == {len(rows) - 1}, kind
            assert len(arrays.files) == len(rows[0]), (kind, arrays.files)


def test_an_interrupt_stops_at_once():
    """Ctrl-C ends a long study, which would take minutes, with exit code 130, and leaves no file."""
    for kind, changes, members in (("ensemble", {"duration": 100}, {"runs": 10000}),
                                   ("tradeoff", {}, {"repeats": 200, "point_steps": 2e7})):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "scene.json")
            with open(path, "w", encoding="utf-8") as file:
                json.dump(study(kind, changes, **members), file)
            process = subprocess.Popen([program.impactd(), kind, path, "-o", os.path.join(folder, "out.svg")],
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            time.sleep(1)
            assert process.poll() is None, process.communicate()
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=30)
            assert process.returncode == 130, process.returncode
            assert os.listdir(folder) == ["scene.json"]


def test_progress_and_cancel():
    """A long study tells its progress and can be dismissed; nothing of it is kept and the worker is free again."""
    for kind, (changes, members) in LONG.items():
        with program.daemon("--workers", "1") as daemon:
            job = daemon.submit(study(kind, changes, **members), headers={"Prefer": "respond-async"}).json()
            seen, end = [0], time.monotonic() + 120
            while len(set(seen)) < 4:
                assert time.monotonic() < end, seen
                shown = daemon.get("/v1/jobs/" + job["id"]).json()
                assert shown["status"] in ("accepted", "running"), (kind, shown)
                assert shown["progress"] >= seen[-1], (kind, seen, shown["progress"])
                seen.append(shown["progress"])
                time.sleep(0.02)
            gone = daemon.request("DELETE", "/v1/jobs/" + job["id"]).json()
            assert gone["status"] == "dismissed" and gone["result"] is None
            program.finished(daemon, program.scene("paper_free_sponge"))
            while daemon.get("/health/ready").json().get("running"):  # a worker counts as running for a moment after its answer
                assert time.monotonic() < end


def test_faults_of_a_study_are_told_with_the_scenes():
    """422 with the pointer; what is too long in all is refused before anything runs."""
    bad = {"ensemble": "runs", "tradeoff": "metric"}  # told beside a fault of the scene
    bare, rigid = {"dampers": []}, {"dampers": [{"mass": 0.1107, "clearance": 0.015, "buffer": {"stiffness": 1655, "damping": 4}}]}
    for kind, seconds, rows in [
            ("ensemble", "0.003", [
                ({}, {"kind": "ensembel"}, "/study/kind", "must be one of tradeoff, ensemble"),
                ({}, {"runs": 0}, "/study/runs", "must be within [2, 10000]"),
                ({}, {"seeds": [1, 2]}, "/study/seeds", "unknown key"),
                ({}, {"target": -1}, "/study/target", "must be above 0"),
                ({}, {"metric": "rms"}, "/study/metric", "must be one of peak_displacement"),
                ({}, {"runs": 10000}, "/study", "ask for fewer runs"),
                ({"excitation": program.scene("paper_sine_sponge")["excitation"], "duration": 1}, {}, "/study/kind",
                 "must be random, is sine")]),
            ("tradeoff", "0.03", [
                ({}, {"kind": "trade"}, "/study/kind", "must be one of tradeoff"),
                ({}, {"kind": 5}, "/study/kind", "must be a string"),
                ({}, {"kind": ABSENT}, "/study/kind", "is required, one of tradeoff, ensemble, compare, sensitivity, sweep"),
                ({}, {"metric": "peak"}, "/study/metric", "must be one of displacement"),
                ({}, {"solvers": ["exact", "rk5"]}, "/study/solvers/1", "must be one of exact"),
                ({}, {"eror": 1}, "/study/eror", "unknown key"),
                ({}, {"trial": 0}, "/study/trial", "must be at least 1"),
                ({}, {"repeats": 1000}, "/study", "s of CPU in all, at most 0.3 s are allowed"),
                ({"output": {"psd": None}}, {"metric": "psd"}, "/study/metric", "")]),
            ("sensitivity", "1", [
                ({}, {"runs": 10}, "/study/runs", ""),
                ({}, {"step": 0.5}, "/study/step", ""),
                ({}, {"parameters": ["masss"]}, "/study/parameters/0", ""),
                (bare, {}, "/study/kind", ""),
                (rigid, {"contact_time_deviation": 0.1}, "/study/contact_time_deviation", ""),
                ({}, {"restitution_deviation": -1}, "/study/restitution_deviation", ""),
                ({"duration": 5000}, {"contact_time_deviation": 0.1, "runs": 2000}, "/study", "fewer runs")])]:
        with program.daemon("--max-cpu-seconds", seconds) as daemon:
            for changes, members, pointer, expected in rows:
                reply = daemon.submit(study(kind, changes, **members))
                faults = reply.json()["errors"]
                assert reply.status == 422 and faults[0]["pointer"] == pointer, (kind, members, faults)
                assert (len(faults) == 1 or kind == "sensitivity") and expected in faults[0]["detail"], faults
            if kind in bad:
                structure = {"structure": {**program.scene("paper_free_sponge")["structure"], "mass": -1}}
                found = daemon.submit(study(kind, structure, **{bad[kind]: 1})).json()["errors"]
                assert {fault["pointer"] for fault in found} == {"/study/" + bad[kind], "/structure/mass"}, found


def test_wrong_types_in_a_study():
    """Every member of a study gets a value of every other type: 422 at its place, or a plan."""
    with program.daemon() as daemon:
        for kind, names in (("ensemble", ("kind", "runs", "first_seed", "target", "metric", "inputs", "sampling", "sobol_indices")),
                            ("tradeoff", ("kind", "error", "metric", "repeats", "solvers", "point_steps", "trial"))):
            refused = 0
            for name in names:
                for wrong in (None, True, -1, 1e308, 0.5, "x", [], {}, [[]], ["x", "x"], {"x": 1}):
                    reply = daemon.request("POST", "/v1/jobs?dry_run=1", json=study(kind, **{name: wrong}))
                    assert reply.status in (200, 422), (name, wrong, reply)
                    if reply.status == 422:
                        refused += 1
                        pointers = [fault["pointer"] for fault in reply.json()["errors"]]
                        assert all(p == "/study" or p.startswith("/study/" + name) for p in pointers), (name, wrong, pointers)
            assert refused > 7 * len(names), (kind, refused)
        nothing = daemon.request("POST", "/v1/jobs?dry_run=1", json={**study("tradeoff"), "study": {}})
        assert nothing.status == 422 and [f["pointer"] for f in nothing.json()["errors"]] == ["/study/kind"], nothing
        for wrong in (None, True, 1, "tradeoff", [], [{}]):
            reply = daemon.request("POST", "/v1/jobs?dry_run=1", json={**study("tradeoff"), "study": wrong})
            assert reply.status == 422 and reply.json()["errors"][0]["pointer"] == "/study", (wrong, reply)


if __name__ == "__main__":
    program.main(globals())
