#!/usr/bin/env python3
"""A stored row whose bytes have changed is answered with 500 and a line in the log, never as if nothing had happened."""

import contextlib
import os
import sqlite3
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

# An internal fault is declared for no operation: what is answered here is not judged by test_traffic.py.
os.environ.pop("IMPACTD_RECORD", None)


@contextlib.contextmanager
def changed(folder, table, column):
    """One value of the table's newest row is another one meanwhile."""
    connection = sqlite3.connect(os.path.join(folder, "impactd.db"), isolation_level=None)
    number, before = connection.execute(f"SELECT number, {column} FROM {table} ORDER BY number DESC").fetchone()
    if isinstance(before, float):
        after = before * 1.5
    elif isinstance(before, int):
        after = before + 1
    elif isinstance(before, bytes):
        after = before[:-1] + bytes([before[-1] ^ 1])
    else:
        after = before.replace("1", "2", 1)
    assert after != before, (table, column)
    try:
        connection.execute(f"UPDATE {table} SET {column} = ? WHERE number = ?", [after, number])
        yield
        connection.execute(f"UPDATE {table} SET {column} = ? WHERE number = ?", [before, number])
    finally:
        connection.close()


def refused(daemon, target, **arguments):
    reply = daemon.get(target, **arguments)
    assert reply.status == 500 and "damaged" in reply.json()["detail"], (target, reply)
    assert "impactd restore" in reply.json()["detail"], reply
    assert "etag" not in reply.headers, reply
    logged = daemon.stderr()
    assert f'path="{target}" code=500' in logged and "is damaged: a stored" in logged, logged


def test_a_changed_result_is_no_answer():
    """Each stored document and number of a result, on every representation, also to who has its ETag; whole again it is served."""
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder) as daemon:
            job = program.finished(daemon, program.scene("paper_free_sponge"))
            place = f"/v1/results/{job['result']}"
            etag = daemon.get(place).headers["etag"]
        for column in ("summary", "plan", "scene", "outcome", "sample_rate"):
            with changed(folder, "results", column), program.daemon(data=folder) as daemon:
                parts = ("", "/bundle.zip") if column != "outcome" else ("/impacts.csv", "/psd.json", "/energy.csv")
                for part in parts:
                    refused(daemon, place + part)
                if column == "scene":
                    refused(daemon, f"/v1/jobs/{job['id']}/scene")
                assert daemon.get("/v1/jobs").status == 200
        with program.daemon(data=folder) as daemon:
            reply = daemon.get(place)
            assert reply.status == 200 and reply.headers["etag"] == etag


def test_a_changed_series_is_computed_anew():
    """A stored series is a copy of what can be computed: where it has changed, the answer is right all the same."""
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder) as daemon:
            # So small steps that it takes longer to compute than to read.
            scene = {**program.scene("paper_random_sponge"), "accuracy": {"solver": "rk4", "step": 1e-4}}
            job = program.finished(daemon, scene)
            place = f"/v1/results/{job['result']}/series.npy"
            before = daemon.get(place).body
        connection = sqlite3.connect(os.path.join(folder, "impactd.db"))
        stored = connection.execute("SELECT count(*) FROM series_bodies").fetchone()[0]
        connection.close()
        assert stored == 1, "the series is stored"
        with changed(folder, "series_bodies", "body"), program.daemon(data=folder) as daemon:
            assert daemon.get(place).body == before


def test_a_changed_record_is_no_answer():
    """Samples that have not their digest: neither shown nor used by a new job."""
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder) as daemon:
            sent = daemon.request("POST", "/v1/records", json={"name": "quake", "interval": 0.01, "samples": [0.5, 1, -1, 0.25] * 50})
            assert sent.status == 201, sent
        connection = sqlite3.connect(os.path.join(folder, "impactd.db"), isolation_level=None)
        connection.execute("DROP TRIGGER record_samples_keep")
        connection.close()
        with changed(folder, "record_samples", "samples"), program.daemon(data=folder) as daemon:
            refused(daemon, "/v1/records/quake/samples.csv")
            scene = program.scene("paper_free_sponge")
            scene["excitation"] = {"kind": "record", "name": "quake"}
            assert daemon.submit(scene).status == 500


def test_a_changed_material_is_no_answer():
    """A revision, a review and a measurement that differ from their checksums: neither shown, imported over nor used by a new job."""
    felt = {"slug": "felt", "name": "Felt 1", "source": "lab 1", "restitution": 0.5, "contact_time": 0.02, "separation": "zero_penetration",
            "tags": ["lab1"], "comment": "1st"}
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder) as daemon:
            assert daemon.request("POST", "/v1/materials", json=felt).status == 201
            etag = daemon.get("/v1/materials/felt").headers["etag"]
            test = {"drops": [{"contact_time": 0.01}], "notes": "1"}
            sent = daemon.request("POST", "/v1/materials/felt/measurements", json={**test, "comment": "1"}, headers={"if-match": etag})
            assert sent.status == 201, sent
            etag = daemon.get("/v1/materials/felt").headers["etag"]
            daemon.request("POST", "/v1/materials/felt@1/review", json={"status": "approved", "reason": "ok 1"}, headers={"if-match": etag})
            etag = daemon.get("/v1/materials/felt").headers["etag"]
            whole = daemon.get("/v1/materials.json").json()
        connection = sqlite3.connect(os.path.join(folder, "impactd.db"), isolation_level=None)
        for kind in ("revisions", "reviews", "measurements"):
            connection.execute(f"DROP TRIGGER material_{kind}_keep")
        connection.close()
        columns = [("material_revisions", column) for column in ("restitution", "name", "lists", "comment", "separation", "created_unix_ms")]
        for table, column in columns + [("material_reviews", column) for column in ("reason", "revision", "created_unix_ms")]:
            with changed(folder, table, column), program.daemon(data=folder) as daemon:
                for target in ("/v1/materials/felt", "/v1/materials/felt@1", "/v1/materials", "/v1/materials/felt/revisions",
                               "/v1/materials.json"):
                    refused(daemon, target)
                    assert f"table {table} (" in daemon.get(target).json()["detail"]
                again = daemon.request("POST", "/v1/materials/import", json=whole)
                assert again.status == 500, again
                scene = program.scene("paper_free_sponge")
                scene["dampers"][0]["buffer"] = "felt"
                reply = daemon.submit(scene)
                assert reply.status == 500 and "could not be looked up" in reply.json()["detail"], (column, reply)
                assert daemon.get("/v1/materials/sponge").status == 200
        for column in ("document", "comment"):
            with changed(folder, "material_measurements", column), program.daemon(data=folder) as daemon:
                refused(daemon, "/v1/materials/felt/measurements/1")
        with program.daemon(data=folder) as daemon:
            reply = daemon.get("/v1/materials/felt")
            assert reply.status == 200 and reply.headers["etag"] == etag


def test_a_built_in_material_has_checksums():
    """A changed value, and checksums that are missing, empty or cut off, are damage."""
    changes = {"sponge": "restitution = 0.9", "soft_rubber": "checks = NULL", "hard_rubber": "checks = x''", "aluminium": "checks = substr(checks, 1, 100)"}
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder):
            assert check_db(folder)[0] == 0
        connection = sqlite3.connect(os.path.join(folder, "impactd.db"), isolation_level=None)
        connection.execute("DROP TRIGGER material_revisions_keep")
        for slug, change in changes.items():
            connection.execute(f"UPDATE material_revisions SET {change} WHERE material = (SELECT number FROM materials WHERE slug = '{slug}')")
        connection.close()
        with program.daemon(data=folder) as daemon:
            for slug in changes:
                refused(daemon, "/v1/materials/" + slug)


def check_db(folder):
    code, said = program.run("check-db", "--data", folder)[:2]
    return code, said


def test_a_changed_job_is_no_answer():
    """A job whose labels, warnings or times differ from their checksums: 500 with its table and id in place of JSON that cannot be read."""
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder) as daemon:
            scene = program.scene("paper_free_sponge")
            job = program.finished(daemon, {**scene, "title": "run 1", "labels": ["lab=1"]})
            place = f"/v1/jobs/{job['id']}"
        for column in ("labels", "title", "created_unix_ms", "total"):
            with changed(folder, "jobs", column), program.daemon(data=folder) as daemon:
                refused(daemon, place)
                (listed,) = daemon.get("/v1/jobs").json()["jobs"]  # one damaged job does not hide the others
                assert listed["id"] == job["id"] and listed["status"] == "failed", listed
                assert "damaged" in listed["problem"]["detail"] and "labels" not in listed, listed
                assert f"table jobs (id {job['id']})" in daemon.get(place).json()["detail"]
                assert daemon.get(f"/v1/results/{job['result']}").status == 200
        with program.daemon(data=folder) as daemon:
            assert daemon.get(place).json()["labels"] == ["lab=1"]
            kept = {"title": "run 2"}
            assert daemon.request("PATCH", place, json=kept).status == 200
        with program.daemon(data=folder) as daemon:
            shown = daemon.get(place).json()
            assert shown["title"] == "run 2" and shown["labels"] == ["lab=1"], shown
        assert check_db(folder)[0] == 0
        with changed(folder, "jobs", "labels"), program.daemon(data=folder) as daemon:
            assert daemon.request("DELETE", place + "?purge=true").status == 204
            assert daemon.get("/v1/jobs").status == 200


def test_an_unfinished_job_that_changed_fails():
    """It does not prevent the start."""
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder) as daemon:
            job = program.finished(daemon, {**program.scene("paper_free_sponge"), "title": "run 1"})
        connection = sqlite3.connect(os.path.join(folder, "impactd.db"), isolation_level=None)
        connection.execute("UPDATE jobs SET state = 0")
        connection.close()
        with program.daemon(data=folder) as daemon:
            shown = daemon.get(f"/v1/jobs/{job['id']}").json()
            assert shown["status"] == "failed" and "damaged" in shown["problem"]["detail"], shown


def test_an_ended_job_in_the_index_of_unfinished_ones_stays_as_it_ended():
    """A damaged index says that a job that has ended is unfinished: it is not run again, and check-db finds the index."""
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder) as daemon:
            place = f"/v1/jobs/{program.finished(daemon, program.scene('paper_free_sponge'))['id']}"
            ended = daemon.get(place).json()
        with contextlib.closing(sqlite3.connect(os.path.join(folder, "impactd.db"), isolation_level=None)) as connection:
            written = connection.execute("SELECT sql FROM sqlite_schema WHERE name = 'jobs_unfinished'").fetchone()[0]
            connection.execute("DROP INDEX jobs_unfinished")
            connection.execute(written[:written.index("WHERE")])
            connection.execute("PRAGMA writable_schema = ON")
            connection.execute("UPDATE sqlite_schema SET sql = ? WHERE name = 'jobs_unfinished'", [written])
        for _ in range(2):
            with program.daemon(data=folder) as daemon:
                assert daemon.get(place).json() == ended
        code, said, errors = program.run("check-db", "--data", folder)
        assert code == 1 and "jobs_unfinished" in said + errors, (code, said, errors)


def test_a_changed_summary_is_no_answer():
    """The job and a POST of the same scene are refused with the result's id; after its deletion the scene is computed again."""
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder) as daemon:
            job = program.finished(daemon, program.scene("paper_free_sponge"))
        with changed(folder, "results", "summary"), program.daemon(data=folder) as daemon:
            refused(daemon, f"/v1/jobs/{job['id']}")
            reply = daemon.submit(program.scene("paper_free_sponge"))
            assert reply.status == 500 and f"table results (id {job['result']})" in reply.json()["detail"], reply
            assert daemon.request("DELETE", f"/v1/results/{job['result']}").status == 204
            again = program.finished(daemon, program.scene("paper_free_sponge"))
            assert again["result"] == job["result"] and again["summary"] is not None, again


def test_a_changed_token_gives_no_access():
    """The other tokens do, and the changed one can be revoked."""
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder):
            pass
        made = [program.run("token", "create", name, "--scopes", "read", "--data", folder)[1].split()[0] for name in ("lab0", "lab1")]
        with changed(folder, "tokens", "created_unix_ms"), program.daemon(data=folder) as daemon:
            replies = [daemon.get("/v1/jobs", headers={"authorization": "Bearer " + token}) for token in made]
            assert [reply.status for reply in replies] == [200, 401], replies
            assert "damaged" in program.run("token", "list", "--data", folder)[1]
            code, said = check_db(folder)
            assert code == 1 and "table tokens (number 2, name lab1)" in said, (code, said)
        assert program.run("token", "revoke", "lab1", "--data", folder)[0] == 0
        assert check_db(folder)[0] == 0


def test_check_db_names_every_damaged_row():
    """The command counts the rows of each table; a copy of a damaged database is neither made nor taken."""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as other:
        copy, bad = os.path.join(other, "copy.db"), os.path.join(other, "bad.db")
        with program.daemon(data=folder) as daemon:
            job = program.finished(daemon, {**program.scene("paper_free_sponge"), "labels": ["lab1"]})
            code, said = check_db(folder)
            assert code == 0 and "results" in said and "as they should be" in said, (code, said)
        assert program.run("backup", copy, "--data", folder)[0] == 0
        with changed(folder, "jobs", "labels"):
            code, said = check_db(folder)
            assert code == 1 and f'a stored "labels" of table jobs (number 1, id {job["id"]})' in said, (code, said)
            code, _, said = program.run("backup", bad, "--data", folder)
            assert code == 1 and '"labels" of table jobs' in said and not os.path.exists(bad), (code, said)
        connection = sqlite3.connect(copy, isolation_level=None)
        connection.execute("UPDATE results SET plan = plan || ' '")
        connection.close()
        code, _, said = program.run("restore", copy, "--force", "--data", folder)
        assert code == 1 and '"plan" of table results' in said, (code, said)
        assert check_db(folder)[0] == 0
        connection = sqlite3.connect(os.path.join(folder, "impactd.db"), isolation_level=None)
        connection.execute("INSERT INTO result_uses VALUES ('sponge@1', 99)")
        connection.close()
        code, said = check_db(folder)
        assert code == 1 and "missing row of results" in said, (code, said)
        nothing = os.path.join(other, "nothing")
        assert program.run("check-db", "--data", nothing)[0] == 4 and not os.path.exists(nothing)
        assert program.run("restore", os.path.join(other, "nope.db"), "--data", nothing)[0] == 4 and not os.path.exists(nothing)


if __name__ == "__main__":
    sys.exit(program.main(globals()))
