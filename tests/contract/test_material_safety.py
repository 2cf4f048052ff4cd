#!/usr/bin/env python3
"""What was said of a material stays said: whatever is asked, whoever writes at the same time, whenever the daemon is killed."""

import concurrent.futures
import http.client
import json
import os
import re
import shutil
import sqlite3
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

ROUNDS, KILLS, REVISIONS = 1000, 25, 100
TABLES = ("materials", "material_revisions", "material_reviews", "material_measurements", "material_trail")
FELT = {"name": "Felt", "restitution": 0.3, "contact_time": 0.02, "source": "notebook 7, page 12", "tags": ["lab"]}
DROP = {"impactor": "steel ball, 30 mm", "impactor_mass": 0.11, "base": "fixed", "drops": [{"drop_height": 0.1, "rebound_height": 0.009},
                                                                                          {"drop_height": 0.1, "rebound_height": 0.0091}]}
ANY = {"If-Match": "*"}
# What is told of a revision and may change: its review, and how far its material has come.
STATE = ("status", "review", "latest", "version")


def connect(folder):
    return sqlite3.connect(f"file:{os.path.join(folder, 'impactd.db')}?mode=ro", uri=True)


def kept(folder):
    """All rows of the materials' tables, by table and number."""
    with connect(folder) as connection:
        found = {(table, row[0]): row for table in TABLES for row in connection.execute(f"SELECT * FROM {table}")}
    connection.close()
    return found


def said(daemon, name):
    document = daemon.get(f"/v1/materials/{name}").json()
    return {member: value for member, value in document.items() if member not in STATE}


def add(daemon, slug, **changes):
    reply = daemon.request("POST", "/v1/materials", json={"slug": slug, **FELT, **changes})
    assert reply.status == 201, reply


def revise(daemon, slug, tag="*", **changes):
    return daemon.request("POST", f"/v1/materials/{slug}/revisions", json={**FELT, "comment": "anew", **changes}, headers={"If-Match": tag})


def review(daemon, name, status="approved"):
    return daemon.request("POST", f"/v1/materials/{name}/review", json={"status": status, "reason": "looked at"}, headers=ANY)


def targets():
    """Every pattern of routes.c, with names of what is there in place of its parameters, and places near them."""
    with open(os.path.join(program.SOURCE, "server", "api", "routes.c"), encoding="utf-8") as file:
        patterns = re.findall(r'^\s*\{"[A-Z]+",\s*"([^"]+)",', file.read(), re.M)
    names = {"slug": "felt", "revision": "1", "number": "1", "name": "felt", "format": "json"}
    assert len(set(patterns)) > 50, "routes.c is not read as it is written"
    near = ["/v1/materials/felt@1/measurements/1", "/v1/materials/felt/revisions/1", "/v1/materials/felt@2/revisions", "/v1/materials/felt@1/",
            "/v1/materials/felt/measurements/1/review", "/v1/materials/felt@1%27--", "/v1/materials/felt%401", "/v1/materials/*", "/v1/materials/"]
    return sorted({re.sub(r"\{(\w+)\}", lambda found: names.get(found[1], "1"), pattern) for pattern in patterns} | set(near))


def test_no_request_changes_what_was_said():
    """Every path of the API with every method and bodies meant to do harm: all rows stay as they were, and are told as they were."""
    bodies = [None, {}, {**FELT, "slug": "felt", "comment": "x"}, {**FELT, "comment": "x", "restitution": 0.9},
              {"to": 1, "comment": "x"}, {"status": "deprecated", "reason": "x"}, {**DROP, "comment": "x", "geometry": "another"},
              {"materials": [{"slug": "felt", "revision": 1, **FELT, "restitution": 0.9}], "format": "impactd-materials"},
              {"slug": "felt'; UPDATE material_revisions SET restitution = 0.9; --", **FELT}]
    with program.daemon() as daemon:
        add(daemon, "felt")
        revise(daemon, "felt", restitution=0.35)
        review(daemon, "felt@1")
        measured = daemon.request("POST", "/v1/materials/felt/measurements", json={**DROP, "comment": "first drop"})
        assert measured.status == 201, measured
        names = ["felt@1", "felt@2", "sponge@1", "felt/measurements/1"]
        before, told = kept(daemon.data), {name: said(daemon, name) for name in names}
        asked, taken = 0, 0
        for target in targets():
            for method in ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS", "REPLACE"):
                for body in bodies if method in ("POST", "PUT", "PATCH") else bodies[:1]:
                    reply = daemon.request(method, target, json=body, headers=ANY, timeout=30)
                    assert reply.status < 500 or reply.status == 501, (method, target, body, reply)
                    asked += 1
                    taken += method != "GET" and reply.status in (200, 201, 204)
        for query in ("?q='%20OR%201=1--", "?kind=%27%3BDELETE%20FROM%20materials", "?after=%27", "?e=1;DROP"):
            daemon.get("/v1/materials" + query)
        after = kept(daemon.data)
        assert taken > 3 and len(after) > len(before), "nothing was written, so nothing was tried"
        changed = {key: (row, after.get(key)) for key, row in before.items() if after.get(key) != row}
        assert not changed, changed
        assert {name: said(daemon, name) for name in names} == told
        print(f"      {asked} requests, {taken} of them written, {len(after) - len(before)} rows added, none changed")


def test_of_two_writers_one_alone_goes_on():
    """Two writers who saw the same head, 1,000 times: one is taken, the other is told 412, reads again, and its words are taken then."""
    with program.daemon() as daemon, concurrent.futures.ThreadPoolExecutor(2) as pool:
        add(daemon, "felt")
        rounds = ROUNDS // 10 if program.is_sanitized() else ROUNDS
        barrier, taken, redone = threading.Barrier(2), 0, 0

        def write(writer, number):
            tag = daemon.get("/v1/materials/felt").headers["etag"]
            barrier.wait(60)  # both have seen the same
            return revise(daemon, "felt", tag, comment=f"writer {writer}, round {number}")

        for number in range(rounds):
            replies = list(pool.map(write, (1, 2), (number, number)))
            assert sorted(reply.status for reply in replies) == [201, 412], replies
            taken += 1
            if number % 10 == 0:
                loser = 1 + [reply.status for reply in replies].index(412)
                tag = daemon.get("/v1/materials/felt").headers["etag"]
                assert revise(daemon, "felt", tag, comment=f"writer {loser}, round {number}").status == 201
                redone += 1
        head = daemon.get("/v1/materials/felt").json()
        assert (head["latest"], head["version"]) == (1 + taken + redone, 1 + taken + redone), head
        with connect(daemon.data) as connection:
            comments = [row[0] for row in connection.execute(
                "SELECT comment FROM material_revisions r JOIN materials m ON m.number = r.material WHERE slug = 'felt' ORDER BY revision")]
        assert len(set(comments)) == len(comments) == 1 + taken + redone
        assert sum(f"writer {writer}, round {number}" in set(comments) for writer in (1, 2) for number in range(0, rounds, 10)) == 2 * redone
        print(f"      {rounds} rounds, {redone} redone")


def test_what_a_result_used_stays_after_a_hundred_revisions():
    """Scenes on a named revision keep their canonical form and result, and results the values they were made with, to the byte."""
    def scene(name):
        made = program.scene("paper_free_sponge")
        made["duration"] = 1
        made["dampers"][0]["buffer"] = name
        return made
    with program.daemon() as daemon:
        add(daemon, "felt")
        names = ("felt@1", "felt", "sponge@1")
        checked = {name: daemon.request("POST", "/v1/jobs?dry_run=1", json=scene(name)).json() for name in names}
        assert checked["felt"]["result"] == checked["felt@1"]["result"] and "felt@1" in json.dumps(checked["felt"]["scene"])
        results = [program.finished(daemon, scene(name))["result"] for name in ("felt", "sponge")]
        pages = [f"/v1/results/{result}" for result in results] + [f"/v1/results/{result}/impacts.json" for result in results]
        before = {page: daemon.get(page).body for page in pages}
        derived = [daemon.get(page).json()["plan"]["derived"] for page in pages[:2]]
        for number in range(REVISIONS):
            for slug in ("felt", "sponge"):
                assert revise(daemon, slug, restitution=0.4 + 0.001 * number, contact_time=0.01).status == 201
        for number in (REVISIONS // 2, REVISIONS + 1):
            assert review(daemon, f"felt@{number}").status == 200 and review(daemon, f"sponge@{number}").status == 200
        for name in ("felt@1", "sponge@1"):
            again = daemon.request("POST", "/v1/jobs?dry_run=1", json=scene(name)).json()
            assert again["result"] == checked[name]["result"] and again["scene"] == checked[name]["scene"], again
        moved = daemon.request("POST", "/v1/jobs?dry_run=1", json=scene("felt")).json()
        assert moved["result"] != checked["felt"]["result"] and f"felt@{REVISIONS + 1}" in json.dumps(moved["scene"])
        assert {page: daemon.get(page).body for page in pages} == before
        assert [one[0]["material"] for one in derived] == ["felt@1", "sponge@1"] and [one[0]["restitution"] for one in derived] == [0.3, 0.61]
        for result, value in zip(results, (0.3, 0.61)):
            manifest = daemon.get(f"/v1/results/{result}/manifest").json()
            assert [material["restitution"] for material in manifest["materials"]] == [value], manifest["materials"]


def writer(daemon, number, answers, stopped):
    """Revises and reviews until the daemon is gone; notes what was answered."""
    slug = f"m{number}"
    for turn in range(100000):
        try:
            if turn % 3 == 0:
                reply = revise(daemon, slug, comment=f"turn {turn}")
                revision = reply.json()["revision"]
                answers.append(("revise", slug, revision))
            else:
                status = ("approved", "deprecated")[turn % 3 - 1]
                reply = review(daemon, f"{slug}@{revision}", status)
                answers.append((status[:-1], slug, revision))
            assert reply.status in (200, 201), reply
        except (OSError, http.client.HTTPException, ValueError, KeyError):
            assert stopped.is_set(), "the daemon was gone before it was killed"
            return


def check_whole(folder, answers):
    """Each row has its entry in the trail and each entry its row, entries count from 1, and whatever was answered is there."""
    with tempfile.TemporaryDirectory() as copy:
        for name in os.listdir(folder):
            if name.startswith("impactd.db"):
                shutil.copy(os.path.join(folder, name), copy)
        connection = sqlite3.connect(os.path.join(copy, "impactd.db"))
        try:
            assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
            revisions = connection.execute("SELECT slug, revision, author, comment, r.created_unix_ms FROM material_revisions r JOIN materials m "
                                           "ON m.number = r.material WHERE slug GLOB 'm[0-9]'").fetchall()
            reviews = connection.execute("SELECT slug, revision, substr(status, 1, length(status) - 1), reviewer, reason, v.created_unix_ms FROM "
                                         "material_reviews v JOIN materials m ON m.number = v.material WHERE slug GLOB 'm[0-9]'").fetchall()
            trail = connection.execute("SELECT slug, version, action, revision, who, why, t.created_unix_ms FROM material_trail t JOIN materials m "
                                       "ON m.number = t.material WHERE slug GLOB 'm[0-9]' ORDER BY slug, version").fetchall()
        finally:
            connection.close()
    rows = [(slug, "create" if revision == 1 else "revise", revision, *rest) for slug, revision, *rest in revisions]
    rows += [(slug, action, revision, *rest) for slug, revision, action, *rest in reviews]
    assert sorted(map(str, rows)) == sorted(str((slug, action, *rest)) for slug, _, action, *rest in trail), "a row without its entry"
    for slug in {row[0] for row in rows}:
        assert [entry[1] for entry in trail if entry[0] == slug] == [*range(1, 1 + sum(row[0] == slug for row in rows))]
        numbers = sorted(row[2] for row in rows if row[0] == slug and row[1] in ("create", "revise"))
        assert numbers == [*range(1, 1 + len(numbers))]
    done = {(action, slug, revision) for slug, action, revision, *_ in rows}
    assert set(answers) <= done, set(answers) - done
    return len(rows)


def test_a_kill_leaves_no_half_of_a_review():
    """kill -9 amid revisions and reviews, 25 times: what was answered is there, every row has its entry in the trail, nothing else is."""
    answers = []
    with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
        with program.daemon(data=folder) as daemon:
            for number in range(4):
                add(daemon, f"m{number}")
        for kill in range(KILLS):
            with program.Daemon(program.build, data=folder) as daemon:
                stopped = threading.Event()
                with concurrent.futures.ThreadPoolExecutor(4) as pool:
                    writers = [pool.submit(writer, daemon, number, answers, stopped) for number in range(4)]
                    time.sleep(0.05 + 0.01 * (kill % 10))  # not always at the same moment
                    stopped.set()
                    daemon.kill()
                    for one in writers:
                        one.result()
            count = check_whole(folder, answers)
        with program.daemon(data=folder) as daemon:
            for number in range(4):
                history = daemon.get(f"/v1/materials/m{number}/history?limit=1").json()
                assert history["version"] == history["history"][0]["version"], history
    assert len(answers) > KILLS, answers
    print(f"      {KILLS} kills, {len(answers)} answers, {count} rows")


if __name__ == "__main__":
    program.main(globals())
