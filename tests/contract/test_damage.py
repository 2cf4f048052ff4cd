#!/usr/bin/env python3
"""Damaged databases: answers are right or problems, and the daemon does not end. The long run is tests/damage/damage.py."""

import contextlib
import http.client
import os
import shutil
import sqlite3
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "damage"))
import damage  # noqa: E402
import program  # noqa: E402

SANITIZED = "nightly"

# Internal faults are declared for no operation: what is answered here is not judged by test_traffic.py.
os.environ.pop("IMPACTD_RECORD", None)


def test_damaged_bytes_pages_and_logs_give_right_answers_or_problems():
    """10 copies damaged at seeded places: no other number under an ETag, no end of the daemon, and check-db finds what readers found."""
    faults, counts = damage.run(10, 1)
    assert not faults, faults[0]
    assert damage.has_tried(counts), counts


def entry_of(folder, index, key, other):
    """The index leads from the key of a row to the row of another one."""
    path = os.path.join(folder, "impactd.db")
    connection = sqlite3.connect(path)
    (root,) = connection.execute("SELECT rootpage FROM sqlite_schema WHERE name = ?", [index]).fetchone()
    connection.close()
    with open(path, "rb") as file:
        data = bytearray(file.read())
    start = (root - 1) * damage.PAGE
    ends = [data.index(text.encode(), start, start + damage.PAGE) + len(text) for text in (key, other)]
    data[ends[0]] = data[ends[1]]  # the row's number follows its key
    with open(path, "wb") as file:
        file.write(data)


def test_an_index_that_leads_to_another_row_is_damage():
    """A job, a result, a record and a material whose entries lead to the row of another: 500, not the other's numbers; check-db names it."""
    with tempfile.TemporaryDirectory() as base:
        whole = os.path.join(base, "whole")
        targets = damage.fill(whole, False)
        # Not the first row, whose number takes no byte.
        results = [target.split("/")[3] for target in targets if target.endswith("/manifest")][1:3]
        connection = sqlite3.connect(os.path.join(whole, "impactd.db"))
        jobs = [row[0] for row in connection.execute("SELECT id FROM jobs ORDER BY number LIMIT 2 OFFSET 1")]
        connection.close()
        cases = [("sqlite_autoindex_results_1", results[0], results[1], f"/v1/results/{results[0]}"),
                 ("sqlite_autoindex_results_1", results[0], results[1], f"/v1/results/{results[0]}/impacts.json"),
                 ("sqlite_autoindex_jobs_1", jobs[0], jobs[1], f"/v1/jobs/{jobs[0]}"),
                 ("sqlite_autoindex_jobs_1", jobs[0], jobs[1], f"/v1/jobs/{jobs[0]}/scene"),
                 ("sqlite_autoindex_records_1", "shake", "tremor", "/v1/records/shake"),
                 ("sqlite_autoindex_records_1", "shake", "tremor", "/v1/records/shake/samples.csv"),
                 ("sqlite_autoindex_materials_1", "felt", "cork", "/v1/materials/felt"),
                 ("sqlite_autoindex_materials_1", "felt", "cork", "/v1/materials/felt/measurements/1"),
                 ("sqlite_autoindex_materials_1", "felt", "cork", "/v1/materials/felt/measurements")]
        for index, key, other, target in cases:
            folder = os.path.join(base, "copy")
            shutil.copytree(whole, folder)
            entry_of(folder, index, key, other)
            with program.daemon(data=folder) as daemon:
                reply = daemon.get(target)
                assert reply.status == 500 and "damaged" in reply.json()["detail"], (index, reply)
                assert "etag" not in reply.headers, reply
            code, said, _ = program.run("check-db", "--data", folder)
            assert code == 1 and index in said, (code, said)
            shutil.rmtree(folder)


def test_an_entry_without_a_name_does_not_end_the_daemon():
    """The first entry of the index of materials is in the free part of its page, where it has no columns."""
    with tempfile.TemporaryDirectory() as folder:
        targets = damage.fill(folder, False)
        path = os.path.join(folder, "impactd.db")
        connection = sqlite3.connect(path)
        (root,) = connection.execute("SELECT rootpage FROM sqlite_schema WHERE name = 'sqlite_autoindex_materials_1'").fetchone()
        connection.close()
        damage.overwrite(path, (root - 1) * damage.PAGE + 8, b"\x08\x00")
        with program.daemon(data=folder) as daemon:
            codes = {daemon.get(target).status for target in targets}
            assert {200, 500} <= codes <= {200, 404, 500}, codes
        assert program.run("check-db", "--data", folder)[0] == 1


def test_a_file_that_is_cut_or_overwritten_while_it_is_read_does_not_end_the_daemon():
    """Answers are right or problems, and the daemon ends when it is asked to."""
    for cut in (True, False):
        with tempfile.TemporaryDirectory() as folder:
            targets = damage.fill(folder, False)
            path = os.path.join(folder, "impactd.db")
            with program.Daemon(program.build, data=folder) as daemon:
                right = {target: daemon.get(target).body for target in targets}
                size = os.path.getsize(path)
                if cut:
                    os.truncate(path, 3 * damage.PAGE)
                else:
                    damage.overwrite(path, damage.PAGE, bytes(size - damage.PAGE))
                for target in targets:
                    reply = daemon.get(target)
                    assert reply.status in damage.REFUSED or reply.body == right[target], (target, reply)
                assert daemon.is_alive(), daemon.stderr()
                daemon.stop(60)


def changed(folder, sql):
    connection = sqlite3.connect(os.path.join(folder, "impactd.db"), isolation_level=None)
    for name, in connection.execute("SELECT name FROM sqlite_schema WHERE type = 'trigger' AND name LIKE '%keep'").fetchall():
        connection.execute(f"DROP TRIGGER {name}")
    connection.execute(sql)
    connection.close()


def test_rows_of_sweeps_measurements_and_audit_entries_have_checksums():
    """A metric of a table, a note in the list of measurements, an engine and an entry's version that changed, and a part of a table that is missing."""
    with tempfile.TemporaryDirectory() as base:
        whole = os.path.join(base, "whole")
        targets = damage.fill(whole, False)
        table = next(target for target in targets if target.endswith("table.csv"))
        result = targets[2]
        cases = [("UPDATE sweep_chunks SET rows = CAST(substr(rows, 1, length(rows) - 1) || x'01' AS BLOB)", table),
                 ("DELETE FROM sweep_chunks", table),
                 ("UPDATE material_measurements SET head = replace(head, 'felt', 'fell')", "/v1/materials/felt/measurements"),
                 ("UPDATE material_measurements SET drops = 7", "/v1/materials/felt/measurements"),
                 ("UPDATE material_trail SET version = 9 WHERE version = 3", "/v1/materials/felt/history"),
                 ("UPDATE results SET engine = 'impactd-9'", result)]
        for sql, target in cases:
            folder = os.path.join(base, "copy")
            shutil.copytree(whole, folder)
            changed(folder, sql)
            with program.daemon(data=folder) as daemon:
                reply = daemon.get(target)
                assert reply.status == 500 and "damaged" in reply.json()["detail"], (sql, reply)
            code, said, _ = program.run("check-db", "--data", folder)
            assert code == 1 or "DELETE" in sql, (sql, said)
            shutil.rmtree(folder)


def test_a_cut_index_of_the_log_loses_nothing():
    """impactd.db-shm is cut while in use, which can end the server: the next one has what was acknowledged, and makes the file anew."""
    with tempfile.TemporaryDirectory() as folder:
        scene, jobs = program.scene("paper_free_sponge"), []
        with program.Daemon(program.build, data=folder) as daemon:
            with contextlib.suppress(OSError, http.client.HTTPException):
                for number in range(20):
                    if number == 10:
                        os.truncate(os.path.join(folder, "impactd.db-shm"), 0)
                    scene["dampers"][0]["clearance"] = 0.012 + 1e-4 * number
                    jobs.append(program.finished(daemon, scene)["id"])
            daemon.kill()
        assert len(jobs) >= 10, jobs
        with program.daemon(data=folder) as daemon:
            assert [daemon.get(f"/v1/jobs/{job}").json()["status"] for job in jobs] == ["successful"] * len(jobs)
        assert program.run("check-db", "--data", folder)[0] == 0


def test_a_manifest_does_not_hide_a_damaged_material():
    """It says that a material is not here only where that is so."""
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder) as daemon:
            job = program.finished(daemon, program.scene("paper_free_sponge"))
        changed(folder, "UPDATE material_revisions SET restitution = 0.9 WHERE restitution = 0.61")
        with program.daemon(data=folder) as daemon:
            reply = daemon.get(f"/v1/results/{job['result']}/manifest")
            assert reply.status == 500 and "damaged" in reply.json()["detail"], reply


if __name__ == "__main__":
    program.main(globals())
