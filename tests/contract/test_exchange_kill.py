#!/usr/bin/env python3
"""kill -9 while materials are brought in: all of a file or nothing of it, and what was answered is there."""

import http.client
import json
import os
import shutil
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from materials import bring, export, laboratory  # noqa: E402

NIGHTLY = True

ROUNDS = 30


def file_of(number, count):
    """A file whose every material names its number, with revisions, reviews and measurements."""
    document = laboratory(number, count, revisions=2)
    for one in document["materials"]:
        one["slug"] = "f%d_%s" % (number, one["slug"])
    return document


def send(daemon, bodies, answered, stopped):
    for number, body in bodies:
        try:
            if bring(daemon, body).status == 200:
                answered.append(number)
        except (OSError, http.client.HTTPException):
            assert stopped.is_set(), "the daemon was gone before it was killed"
            return


def test_a_killed_import_leaves_all_or_nothing():
    """Kills amid imports, 30 of them (6 in an instrumented build): each file is in the database whole, with its trail, or not at all; answered ones are; none is torn."""
    count, rounds = (100, 6) if program.is_sanitized() else (400, ROUNDS)
    files = {number: file_of(number, count) for number in range(6)}
    rows = {number: {kind: sum(len(one[kind]) for one in document["materials"]) for kind in ("revisions", "measurements")}
            for number, document in files.items()}
    bodies = [(number, json.dumps(document).encode()) for number, document in files.items()]
    took, outcomes = None, []
    for kill in range(rounds):
        folder = tempfile.mkdtemp(prefix="impactd-")
        try:
            with program.Daemon(program.build, data=folder) as daemon:
                answered, stopped = [], threading.Event()
                began = time.monotonic()
                sender = threading.Thread(target=send, args=(daemon, bodies, answered, stopped))
                sender.start()
                if took is None:  # how long all of them take here
                    sender.join()
                    took = time.monotonic() - began
                else:
                    time.sleep(took * kill / rounds)
                stopped.set()
                daemon.kill()
                sender.join()
            with program.daemon(data=folder) as daemon:
                there = {}
                for one in json.loads(export(daemon))["materials"]:
                    if one["slug"].startswith("f"):
                        there.setdefault(int(one["slug"][1:].split("_")[0]), []).append(one)
                for number, materials in there.items():
                    assert len(materials) == count, (kill, number, len(materials))
                    assert {kind: sum(len(one.get(kind, [])) for one in materials) for kind in ("revisions", "measurements")} == rows[number]
                    trail = daemon.get("/v1/materials/%s/history" % materials[-1]["slug"]).json()["history"]
                    assert [deed["action"] for deed in trail] == ["import"], trail
                assert set(answered) <= set(there), (answered, sorted(there))
                # What is missing can be brought once more, what is there is the same.
                assert bring(daemon, bodies[0][1]).status == 200
                outcomes.append(len(there))
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    assert len(set(outcomes)) > 1, f"the kills came at no different moments: {outcomes}"
    print(f"      files there after the kills: {outcomes}")


if __name__ == "__main__":
    program.main(globals())
