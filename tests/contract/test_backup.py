#!/usr/bin/env python3
"""impactd backup: one file with all that was answered before, whatever the daemon does meanwhile; or nothing."""

import contextlib
import json
import os
import shutil
import signal
import sqlite3
import stat
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from asking import endless  # noqa: E402
from disk import fill, small_disk  # noqa: E402

SANITIZED = "nightly"
ASYNC = {"Prefer": "respond-async"}


def backup(path, data, *arguments):
    """Runs it; the code and what it says."""
    code, out, errors = program.run("backup", path, "--data", data, *arguments)
    return code, out + errors


def scene(number):
    made = program.scene("paper_free_sponge")
    made["dampers"][0]["clearance"] = 0.01 + 1e-7 * number
    made["duration"] = 1
    return made


@contextlib.contextmanager
def restored(path):
    """A daemon on a folder that holds the copy alone, as the help says."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(path, os.path.join(folder, "impactd.db"))
        with program.daemon(data=folder) as daemon:
            yield daemon


def big(data, size=96):
    """Puts so many MiB beside the daemon's tables."""
    connection = sqlite3.connect(os.path.join(data, "impactd.db"))
    connection.execute("CREATE TABLE ballast (body BLOB)")
    for _ in range(size):
        connection.execute("INSERT INTO ballast VALUES (randomblob(1048576))")
        connection.commit()
    connection.close()


def test_a_copy_holds_everything():
    """With the daemon running and without it: jobs, results and materials are the same from the copy."""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as data:
        paths = [os.path.join(folder, name) for name in ("running.db", "stopped.db")]
        with program.daemon(data=data) as daemon:
            jobs = [program.finished(daemon, program.scene(name))
                    for name in ("paper_free_sponge", "contact_table", "compare_sponge")]
            targets = ["/v1/materials", "/v1/materials/sponge"]
            targets += [f"/v1/results/{job['result']}{part}" for job in jobs for part in ("", "/impacts.json")]
            before = [daemon.get(target).body for target in targets]
            code, said = backup(paths[0], data)
            assert code == 0 and said == (f"{paths[0]}: {os.path.getsize(paths[0])} bytes, checked; "
                                          "3 jobs, 3 results, 5 materials\n"), (code, said)
        assert backup(paths[1], data)[0] == 0
        assert sorted(os.listdir(folder)) == ["running.db", "stopped.db"]
        for path in paths:
            assert stat.S_IMODE(os.stat(path).st_mode) == 0o600
            with restored(path) as daemon:
                assert [daemon.get(target).body for target in targets] == before
                assert all(daemon.get(f"/v1/jobs/{job['id']}").json()["result"] == job["result"] for job in jobs)


def test_every_job_that_was_answered_before_is_in_it():
    """Backups under new jobs, known answers and keyed ones from four clients: nothing acknowledged before is missing."""
    answered, stop, faults = [], threading.Event(), []

    def ask(daemon, first):
        number = first
        try:
            while not stop.is_set():
                number += 4
                # Three known answers to one that is computed, some of them under keys.
                headers = {"Idempotency-Key": f"k{number}"} if number % 5 == 0 else ASYNC if number % 7 == 0 else None
                reply = daemon.submit(scene(number if number % 16 < 4 else first), headers=headers)
                assert reply.status in (200, 202), reply
                answered.append(reply.json()["id"])
        except Exception as fault:  # noqa: BLE001 - told below
            faults.append(fault)

    copies = []
    with tempfile.TemporaryDirectory() as folder, program.daemon() as daemon:
        threads = [threading.Thread(target=ask, args=(daemon, first)) for first in range(4)]
        for thread in threads:
            thread.start()
        try:
            for number in range(8):
                wanted = len(answered) + 40
                while len(answered) < wanted and not faults:
                    time.sleep(0.01)
                known = list(answered)
                path = os.path.join(folder, f"{number}.db")
                code, said = backup(path, daemon.data)
                assert code == 0, (code, said)
                copies.append((path, known))
        finally:
            stop.set()
            for thread in threads:
                thread.join()
        assert not faults, faults
        for path, known in copies:
            connection = sqlite3.connect(path)
            assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
            assert connection.execute("PRAGMA journal_mode").fetchone() == ("delete",), "it needs no files beside it"
            held = {row[0] for row in connection.execute("SELECT id FROM jobs")}
            connection.close()
            missing = set(known) - held
            assert not missing, (path, len(missing), len(known))
        assert len(copies[-1][1]) >= 320
        with restored(copies[-1][0]) as second:
            for job in copies[-1][1][-100:]:
                assert second.finished(job)["status"] == "successful"


def test_cached_answers_are_in_it():
    """Jobs that were answered from the cache just before, by a daemon that runs and by one that was killed, are copied."""
    for is_killed in (False, True):
        with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as data:
            path = os.path.join(folder, "copy.db")
            running = program.Daemon(program.build, data=data)
            running.start()
            try:
                program.finished(running, scene(1))
                known = [running.submit(scene(1)).json()["id"] for _ in range(50)]
                if is_killed:
                    running.kill()
                code, said = backup(path, data)
                assert code == 0, (code, said)
            finally:
                running.kill()
            connection = sqlite3.connect(path)
            rows = connection.execute("SELECT id, state FROM jobs").fetchall()
            connection.close()
            assert set(known) <= {row[0] for row in rows} and len({row[1] for row in rows}) == 1, (len(known), rows)
            with restored(path) as daemon:
                assert daemon.get(f"/v1/jobs/{known[-1]}").json()["status"] == "successful"


def test_unfinished_jobs_are_taken_up_by_the_copy():
    """A job that waited when the copy was made is finished by the daemon on the copy."""
    with tempfile.TemporaryDirectory() as folder, program.daemon("--workers", "1") as daemon:
        first = daemon.submit(endless(), headers=ASYNC).json()["id"]
        second = daemon.submit(scene(1), headers=ASYNC).json()["id"]
        path = os.path.join(folder, "copy.db")
        assert backup(path, daemon.data)[0] == 0
        for job in (first, second):
            daemon.request("DELETE", f"/v1/jobs/{job}")
        with restored(path) as copy:
            assert copy.get(f"/v1/jobs/{first}").json()["status"] in ("accepted", "running")
            assert copy.request("DELETE", f"/v1/jobs/{first}").status == 200
            assert copy.finished(second)["status"] == "successful"


def test_a_file_that_is_there_is_kept():
    """Without --force nothing is written over, with it no file of the daemon's own; places that cannot be are told."""
    with tempfile.TemporaryDirectory() as folder, program.daemon() as daemon:
        path = os.path.join(folder, "copy.db")
        with open(path, "w", encoding="utf-8") as file:
            file.write("mine")
        code, said = backup(path, daemon.data)
        assert code == 1 and "--force" in said, (code, said)
        with open(path, encoding="utf-8") as file:
            assert file.read() == "mine"
        own = os.path.join(daemon.data, "impactd.db")
        link = os.path.join(folder, "link.db")
        os.symlink(own, link)
        hard = os.path.join(daemon.data, "hard.db")
        os.link(own, hard)
        for target in (own, own + "-wal", own + "-shm", own + "-journal", link, hard,
                       os.path.join(daemon.data, "impactd.late"), os.path.join(daemon.data, ".", "impactd.lock")):
            code, said = backup(target, daemon.data, "--force")
            assert code == 1 and "the server's own file" in said, (target, code, said)
        os.unlink(hard)
        for target, expected, words in ((folder, 1, "name a file in it"), ("/dev/null", 1, "not a regular file"),
                                        (os.path.join(folder, "no", "x.db"), 1, "No such file"),
                                        (os.path.join(folder, "n" * 300), 1, "too long")):
            code, said = backup(target, daemon.data)
            assert code == expected and words in said, (target, code, said)
        code, said = backup(path, daemon.data, "--force")
        assert code == 0 and sqlite3.connect(path).execute("SELECT count(*) FROM materials").fetchone() == (5,)
        assert daemon.get("/v1/materials").status == 200
        for arguments in ((), (path, path), ("-",)):
            assert program.run("backup", *arguments, "--data", daemon.data)[0] == 2
        assert backup(os.path.join(folder, "x.db"), os.path.join(folder, "nowhere"))[0] == 4
        assert sorted(os.listdir(folder)) == ["copy.db", "link.db"]


def test_what_is_no_sound_database_is_not_copied():
    """A damaged database, an empty file and another program's are told, and leave nothing."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "copy.db")
        with program.daemon(data=os.path.join(folder, "data")) as daemon:
            for number in range(20):
                program.finished(daemon, scene(number))
            data = daemon.data
        own = os.path.join(data, "impactd.db")
        connection = sqlite3.connect(own)
        root = connection.execute("SELECT rootpage FROM sqlite_schema WHERE name = 'material_trail_of'").fetchone()[0]
        connection.close()
        with open(own, "r+b") as file:
            file.seek(16384 * (root - 1) + 8)
            file.write(b"\xff" * 64)
        code, said = backup(path, data)
        assert code == 1 and "damaged" in said, (code, said)
        for content, words in ((b"", "holds nothing"), (os.urandom(99999), "no database")):
            with open(own, "wb") as file:
                file.write(content)
            code, said = backup(path, data)
            assert code in (1, 4) and words in said, (code, said)
        os.unlink(own)
        other = sqlite3.connect(own)
        other.execute("CREATE TABLE jobs (id)")
        other.commit()
        other.close()
        code, said = backup(path, data)
        assert code == 1 and "another program" in said, (code, said)
        assert os.listdir(folder) == ["data"]


def test_a_full_disk_leaves_nothing():
    """Where the copy finds no room it says how much it takes and how much there is; a copy that was there stays."""
    with small_disk() as folder, program.daemon() as daemon:
        path = os.path.join(folder, "copy.db")
        assert backup(path, daemon.data)[0] == 0
        with open(path, "rb") as file:
            before = file.read()
        big(daemon.data, 64)
        code, said = backup(path, daemon.data, "--force")
        assert code == 1 and "no room" in said and folder in said, (code, said)
        with open(path, "rb") as file:
            assert file.read() == before
        assert os.listdir(folder) == ["copy.db"]
        fill(folder)
        assert "no room" in backup(os.path.join(folder, "other.db"), daemon.data)[1]
        assert sorted(os.listdir(folder)) == ["ballast", "copy.db"]
        assert daemon.submit(scene(1)).status == 200


def test_an_interrupt_leaves_nothing():
    """Ctrl-C while it is copied or checked is exit code 130, and no file stays."""
    with tempfile.TemporaryDirectory() as folder, program.daemon() as daemon:
        big(daemon.data, 200)
        path = os.path.join(folder, "copy.db")
        caught = 0
        for number, moment in enumerate((signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGINT)):
            running = subprocess.Popen([program.impactd(), "backup", path, "--force", "--data", daemon.data],
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            while running.poll() is None:
                sizes = [os.path.getsize(os.path.join(folder, name)) for name in os.listdir(folder) if name != "copy.db"]
                if sizes and max(sizes) > number * (40 << 20):
                    break
            running.send_signal(moment)
            _, errors = running.communicate(timeout=120)
            assert running.returncode in (0, 130), (running.returncode, errors)
            caught += running.returncode == 130
            if running.returncode == 130:
                assert "interrupted" in errors and not os.listdir(folder), (errors, os.listdir(folder))
            else:
                os.unlink(path)
        assert caught >= 2, caught


def test_the_daemon_is_not_held_up():
    """While a large database is copied the daemon answers and stores, and the copy is of the moment it began."""
    with tempfile.TemporaryDirectory() as folder, program.daemon() as daemon:
        big(daemon.data)
        path = os.path.join(folder, "copy.db")
        running = subprocess.Popen([program.impactd(), "backup", path, "--data", daemon.data],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while not os.listdir(folder) and running.poll() is None:
            pass
        during = []
        while running.poll() is None:
            during.append(daemon.submit(scene(100 + len(during))).json()["id"])
        assert running.returncode == 0 and len(during) >= 3, (running.communicate(), len(during))
        connection = sqlite3.connect(path)
        held = [row[0] for row in connection.execute("SELECT id FROM jobs ORDER BY number")]
        connection.close()
        assert held == during[:len(held)], "of one moment"
        running.communicate()
        assert json.loads(daemon.get(f"/v1/jobs/{during[-1]}").body)["status"] == "successful"


def restore(path, data, *arguments):
    """Runs it; the code and what it says."""
    code, out, errors = program.run("restore", path, "--data", data, *arguments)
    return code, out + errors


def test_a_backup_is_restored():
    """Into a missing folder and over a database whose log is not moved in yet; the daemon then has what the backup had, and nothing else."""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as data:
        path = os.path.join(folder, "copy.db")
        running = program.Daemon(program.build, data=data)
        running.start()
        try:
            kept = program.finished(running, scene(1))
            assert backup(path, data)[0] == 0
            later = program.finished(running, scene(2))
            os.kill(running.process.pid, signal.SIGKILL)
            running.process.wait()
        finally:
            running.stop()
        assert os.path.getsize(os.path.join(data, "impactd.db-wal")) > 0
        code, said = restore(path, data)
        assert code == 1 and "has a database already" in said and "--force" in said, (code, said)
        fresh = os.path.join(folder, "new", "data")
        for target, arguments in ((fresh, ()), (data, ("--force",))):
            code, said = restore(path, target, *arguments)
            assert code == 0 and said == (f"{path}: {os.path.getsize(path)} bytes, checked; "
                                          "1 jobs, 1 results, 5 materials\n"), (code, said)
            assert sorted(os.listdir(target)) == ["impactd.db", "impactd.lock"], os.listdir(target)
            assert stat.S_IMODE(os.stat(os.path.join(target, "impactd.db")).st_mode) == 0o600
            with program.daemon(data=target) as daemon:
                assert daemon.get(f"/v1/jobs/{kept['id']}").json()["result"] == kept["result"]
                assert daemon.get(f"/v1/jobs/{later['id']}").status == 404
                assert daemon.get(f"/v1/results/{kept['result']}").status == 200
        assert os.path.exists(path)


def test_what_cannot_be_restored_leaves_the_database():
    """A running daemon, a missing, damaged, foreign, newer and older file, the folder's own database: each is refused in words."""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as data:
        path, bad, own = (os.path.join(folder, "copy.db"), os.path.join(folder, "bad.db"), os.path.join(data, "impactd.db"))
        with program.daemon(data=data) as daemon:
            job = program.finished(daemon, scene(1))
            big(data, 4)
            assert backup(path, data)[0] == 0
            code, said = restore(path, data, "--force")
            assert code == 1 and "another impactd" in said, (code, said)
        with open(own, "rb") as file:
            before = file.read()

        def refused(words, made):
            shutil.copy(path, bad)
            made(bad)
            code, said = restore(bad, data, "--force")
            assert code in (1, 4) and words in said, (words, code, said)
            with open(own, "rb") as file:
                assert file.read() == before
            assert sorted(os.listdir(data)) == ["impactd.db", "impactd.lock"], os.listdir(data)

        def overwrite(target):
            with open(target, "r+b") as file:
                file.seek(os.path.getsize(target) // 2)
                file.write(b"\xff" * 20000)

        def execute(sql):
            def act(target):
                connection = sqlite3.connect(target)
                connection.executescript(sql)
                connection.close()
            return act

        def write(content):
            def act(target):
                with open(target, "wb") as file:
                    file.write(content)
            return act

        refused("cannot be read", os.unlink)
        refused("damaged", overwrite)
        refused("damaged", write(os.urandom(5000)))
        refused("holds nothing", write(b""))
        refused("another program", execute("PRAGMA application_id = 7"))
        refused("newer impactd", execute("PRAGMA user_version = 10"))
        refused("before the first release: there is no column tokens.checks", execute("ALTER TABLE tokens DROP COLUMN checks"))
        refused("must be 1 to 1", execute("PRAGMA user_version = 0"))
        refused("must be 1 to 1", execute("PRAGMA user_version = -3"))
        code, said = restore(own, data, "--force")
        assert code == 1 and "own database" in said, (code, said)
        for arguments in ((), ("-",), (path, path)):
            assert program.run("restore", *arguments, "--data", data)[0] == 2
        with program.daemon(data=data) as daemon:
            assert daemon.get(f"/v1/jobs/{job['id']}").json()["result"] == job["result"]


def test_a_restore_without_room_or_interrupted_leaves_the_database():
    """On a full disk and after a signal the folder has its database of before, alone."""
    with small_disk() as disk, tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as large:
        data, path = os.path.join(disk, "data"), os.path.join(folder, "copy.db")
        with program.daemon(data=large) as daemon:
            big(large, 64)
            assert backup(path, large)[0] == 0
        with program.daemon(data=data) as daemon:
            job = program.finished(daemon, scene(1))
        code, said = restore(path, data, "--force")
        assert code == 1 and "no room" in said, (code, said)
        assert sorted(os.listdir(data)) == ["impactd.db", "impactd.lock"], os.listdir(data)
        with program.daemon(data=data) as daemon:
            assert daemon.get(f"/v1/jobs/{job['id']}").json()["result"] == job["result"]
        for moment in (signal.SIGTERM, signal.SIGKILL):
            running = subprocess.Popen([program.impactd(), "restore", path, "--force", "--data", large],
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            while running.poll() is None and not any("XXXX" not in name and name.startswith("impactd.db.") for name in os.listdir(large)):
                pass
            running.send_signal(moment)
            running.communicate(timeout=120)
            assert running.returncode in (0, 130, -signal.SIGKILL), running.returncode
            assert moment == signal.SIGKILL or sorted(os.listdir(large)) == ["impactd.db", "impactd.lock"], os.listdir(large)
            connection = sqlite3.connect(os.path.join(large, "impactd.db"))
            assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
            assert connection.execute("SELECT count(*) FROM ballast").fetchone() == (64,)
            connection.close()


if __name__ == "__main__":
    program.main(globals())
