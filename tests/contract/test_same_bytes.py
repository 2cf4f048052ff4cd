#!/usr/bin/env python3
"""Equal scenes, equal bytes: cached or not, before and after a restart, however many workers, with or without daemon."""

import concurrent.futures
import hashlib
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

PARTS = ("series.json", "series.csv", "series.npy", "psd.json", "psd.csv", "impacts.json", "impacts.csv",
         "energy.json")


def parts(daemon, job):
    """The bytes of every part of a job's result."""
    found = {}
    for part in PARTS:
        reply = daemon.get(f"/v1/results/{job['result']}/{part}")
        assert reply.status == 200 and reply.body, (part, reply)
        found[part] = reply.body
    return found


def sixteen():
    """Sixteen scenes that differ in kind and in numbers."""
    scenes = []
    for i, name in enumerate(["paper_free_sponge", "paper_free_aluminium", "paper_free_impulse_sponge",
                              "paper_random_sponge", "paper_random_aluminium", "paper_sine_aluminium",
                              "record_inline", "all_keys"]):
        for k in range(2):
            scene = program.scene(name)
            scene["duration"] = 10 + 3 * k
            scene["dampers"][0]["clearance"] = 0.015 + 0.0001 * (2 * i + k)
            scenes.append(scene)
    return scenes


def test_second_answer_is_cached():
    """The same scene twice: "cached" is true, the result's id and all its bytes are the same, also in other words."""
    scene = program.scene("paper_free_sponge")
    other = {"sample_rate": 1e3, "duration": 10.0, "title": "the same in other words",
             "excitation": {"displacement": 15e-3, "kind": "free", "velocity": 0},
             "dampers": [{"buffer": "sponge@1", "offset": -0.0, "clearance": 0.015, "mass": 0.1107}],
             "contact": {"separation": "zero_penetration", "model": "auto"},
             "structure": {"kind": "sdof", "damping": 1.092, "stiffness": 865.0, "mass": 1.35}}
    with program.daemon() as daemon:
        first = program.finished(daemon, scene)
        assert first["cached"] is False
        bytes_of_first = parts(daemon, first)
        for again in (scene, other):
            reply = daemon.submit(again)
            assert reply.status == 200, reply
            second = reply.json()
            assert second["cached"] is True and second["result"] == first["result"], second
            assert second["id"] != first["id"]
            assert parts(daemon, second) == bytes_of_first
        changed = program.finished(daemon, {**scene, "duration": 10.001})
        assert changed["result"] != first["result"] and changed["cached"] is False
    code, out, errors = program.run("run", "-", text=json.dumps(scene))
    assert code == 0 and json.loads(out)["result"] == first["result"], errors


def test_bytes_outlive_a_restart():
    """After a restart the same scene is known, and its series, computed anew, has the same bytes."""
    folder = tempfile.mkdtemp(prefix="impactd-")
    try:
        scene = program.scene("paper_random_sponge")
        with program.daemon(data=folder) as daemon:
            first = program.finished(daemon, scene)
            before = parts(daemon, first)
        with program.daemon(data=folder) as daemon:
            again = program.finished(daemon, scene)
            assert again["cached"] is True and again["result"] == first["result"], again
            assert parts(daemon, again) == before
            assert again["summary"] == first["summary"] and again["plan"] == first["plan"]
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def test_any_number_of_workers_gives_the_same_bytes():
    """16 different scenes at once give the same bytes with 1, 2 and 8 workers."""
    digests = {}
    for workers in (1, 2, 8):
        with program.daemon("--workers", str(workers)) as daemon:
            with concurrent.futures.ThreadPoolExecutor(16) as pool:
                jobs = list(pool.map(lambda scene, to=daemon: program.finished(to, scene), sixteen()))
            assert len({job["result"] for job in jobs}) == 16
            assert not any(job["cached"] for job in jobs)
            digests[workers] = [
                (job["result"], json.dumps(job["summary"]),
                 {part: hashlib.sha256(body).hexdigest() for part, body in parts(daemon, job).items()})
                for job in jobs]
    assert digests[1] == digests[2], "2 workers differ from 1"
    assert digests[1] == digests[8], "8 workers differ from 1"


def test_the_core_fuses_no_operation():
    """The core's library has no fused multiplication and addition, which not every processor has.

    gcc 12 fuses complex products in vectors where the target has such instructions, whatever -ffp-contract says."""
    if platform.machine() != "x86_64":
        return
    listing = subprocess.run(["objdump", "-d", "--no-show-raw-insn", os.path.join(program.build, "libimpactd_core.a")],
                             stdout=subprocess.PIPE, text=True, check=True).stdout
    assert "vmulpd" in listing, "vectors are not compiled as they were"
    fused = [line for line in listing.splitlines() if "\tvfm" in line or "\tvfnm" in line]
    assert not fused, fused[:5]


if __name__ == "__main__":
    program.main(globals())
