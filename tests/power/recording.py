"""A daemon under recorder.c, what is asked of it, and what it acknowledged when.

An acknowledgement is what has to be there from one place of the record on: rows of the database, or a target with its
bytes. It ends where a later request that changes the same thing begins."""

import os
import random
import signal
import sqlite3
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

ASYNC = {"Prefer": "respond-async"}
OPTIONS = ("--workers", "2", "--store-bytes", str(1 << 20))

# What is acknowledged, by kind: all columns but those that later reads or other requests may change.
JOB_ACCEPTED = "SELECT id, created_unix_ms, idempotency_key, request, client FROM jobs WHERE id = ?"
JOB_NOTES = "SELECT id, title, labels FROM jobs WHERE id = ?"
JOB_ENDED = ("SELECT id, state, result, is_cached, created_unix_ms, started_unix_ms, finished_unix_ms, queued, run, total, problem, warnings, "
             "study, scene FROM jobs WHERE id = ?")
RESULT = "SELECT * FROM results WHERE id = ?"
SWEEP = "SELECT s.*, c.* FROM sweeps s JOIN sweep_chunks c ON c.sweep = s.number WHERE s.result = ? ORDER BY chunk"
RECORD = "SELECT * FROM records JOIN record_samples USING (number) WHERE name = ?"
REVISIONS = "SELECT r.* FROM material_revisions r JOIN materials m ON m.number = r.material WHERE m.slug = ? ORDER BY r.number"
REVIEWS = "SELECT r.* FROM material_reviews r JOIN materials m ON m.number = r.material WHERE m.slug = ? ORDER BY r.number"
MEASUREMENTS = "SELECT r.* FROM material_measurements r JOIN materials m ON m.number = r.material WHERE m.slug = ? ORDER BY r.number"
TRAIL = "SELECT r.* FROM material_trail r JOIN materials m ON m.number = r.material WHERE m.slug = ? ORDER BY r.number"
TOKEN = "SELECT name, digest, scopes, created_unix_ms, expires_unix_ms, revoked_unix_ms FROM tokens WHERE name = ?"


class Acknowledged:
    def __init__(self, begin, what, key, value):
        self.begin, self.end = begin, None
        self.what, self.key, self.value = what, key, value  # SQL, its parameter and the rows; or "GET", target and answer

    def holds(self, place):
        return self.begin <= place and (self.end is None or place < self.end)


def rows(connection, sql, key):
    return connection.execute(sql, [key]).fetchall()


class Recording:
    def __init__(self, folder, log, seed):
        self.folder, self.log = folder, log
        self.chance = random.Random(seed)
        self.acknowledged, self.submitted, self.posted = [], [], 0
        self.lock = threading.Lock()
        self.restoring = None  # where a restore began and ended, and the jobs of both databases
        self.token = self.reviewer = None
        self.daemon = None
        recorder = os.path.join(program.build, "tests", "librecorder.so")
        self.environment = {"IMPACTD_WRITES": log, "IMPACTD_WRITES_OF": folder, "LD_PRELOAD": recorder}

    def place(self):
        return os.path.getsize(self.log)

    # The database is read by another process, which sees what the daemon has committed.
    def acknowledge(self, place, what, key, value=None):
        if value is None:
            connection = sqlite3.connect(os.path.join(self.folder, "impactd.db"), timeout=30)
            value = rows(connection, what, key)
            connection.close()
        with self.lock:
            self.acknowledged.append(Acknowledged(place, what, key, value))

    def retire(self, what, key):
        place = self.place()
        with self.lock:
            for one in self.acknowledged:
                if one.what == what and one.key == key and one.end is None:
                    one.end = place

    def ask(self, method, target, codes=(200, 201, 202, 204), **more):
        # Nobody approves a revision of their own.
        token = self.reviewer if target.endswith("/review") else self.token
        headers = {"Authorization": f"Bearer {token}", **more.pop("headers", {})}
        reply = self.daemon.request(method, target, headers=headers, **more)
        assert reply.status in codes, (method, target, reply)
        return reply

    def get(self, target):
        """What is served now is served later too."""
        reply = self.ask("GET", target)
        self.acknowledge(self.place(), "GET", target, (reply.status, reply.headers.get("etag"), reply.body))
        return reply

    def command(self, *arguments):
        done = subprocess.run([program.impactd(), *arguments, "--data", self.folder], capture_output=True, text=True, timeout=60,
                              env={**os.environ, **self.environment}, check=False)
        assert done.returncode == 0, (arguments, done)
        return done.stdout.strip()

    def start(self):
        self.daemon = program.Daemon(program.build, *OPTIONS, data=self.folder, environment=self.environment)
        self.daemon.start()

    def stop(self, with_signal):
        if with_signal == signal.SIGTERM:
            assert self.daemon.stop(60)[0] == 0, self.daemon.stderr()
        else:
            self.daemon.kill()
        assert self.place() == os.path.getsize(self.log)

    # The requests.

    def submit(self, scene, headers=None, **more):
        with self.lock:
            self.posted += 1
        reply = self.ask("POST", "/v1/jobs", json={**scene, **more}, headers=headers or {})
        place, job = self.place(), reply.json()
        with self.lock:
            self.submitted.append(job["id"])
        self.acknowledge(place, JOB_ACCEPTED, job["id"])
        self.acknowledge(place, JOB_NOTES, job["id"])
        return self.ended(job, place) if job["status"] == "successful" else job

    def ended(self, job, place):
        self.acknowledge(place, JOB_ENDED, job["id"])
        self.acknowledge(place, RESULT, job["result"])
        return job

    def wait(self, job):
        if job["status"] == "successful":
            return job
        while (job := self.ask("GET", f"/v1/jobs/{job['id']}?wait=20").json())["status"] in ("accepted", "running"):
            pass
        assert job["status"] == "successful", job
        return self.ended(job, self.place())

    def scene(self, number):
        scene = program.scene("paper_free_sponge")
        scene.update(duration=1, output={"channels": ["displacement"], "psd": None})
        scene["dampers"][0]["clearance"] = 0.012 + 1e-6 * number
        return scene

    def run_scene(self, number):
        kind = number % 4
        if kind == 0:
            job = self.submit(self.scene(number), {"Idempotency-Key": f"key {number}", **ASYNC}, title=f"run {number}", labels=["power"])
        else:
            job = self.submit(self.scene(number if kind < 3 else 1), ASYNC if kind == 1 else {"Prefer": "wait=20"})
        job = self.wait(job)
        targets = [f"/v1/results/{job['result']}{part}" for part in ("", "/impacts.csv", "/series.csv")]
        for target in targets:
            self.get(target)
        if number % 8 == 4:
            self.retire(JOB_NOTES, job["id"])
            self.ask("PATCH", f"/v1/jobs/{job['id']}", json={"title": f"changed {number}"})
            self.acknowledge(self.place(), JOB_NOTES, job["id"])
        if number % 16 == 13:
            # The result is deleted with its only job.
            gone = [(what, job["id"]) for what in (JOB_NOTES, JOB_ENDED, JOB_ACCEPTED)] + [(RESULT, job["result"])]
            for what, key in gone + [("GET", target) for target in targets]:
                self.retire(what, key)
            self.ask("DELETE", f"/v1/jobs/{job['id']}?purge=true")
            for what, key in gone:
                self.acknowledge(self.place(), what, key, [])

    def run_sweep(self, number):
        scene = {**self.scene(number), "study": {"kind": "sweep", "axes": [
            {"pointer": "/dampers/0/buffer", "values": ["sponge", "aluminium"]},
            {"pointer": "/dampers/0/clearance", "from": 0.005, "to": 0.03 + 1e-6 * number, "count": 20}]}}
        job = self.wait(self.submit(scene, ASYNC))
        self.acknowledge(self.place(), SWEEP, job["result"])
        self.get(f"/v1/results/{job['result']}/table.csv")

    def run_record(self, number):
        name = f"quake-{number}"
        samples = [self.chance.uniform(-3, 3) for _ in range(400)]
        self.ask("POST", "/v1/records", json={"name": name, "interval": 0.01, "samples": samples})
        self.acknowledge(self.place(), RECORD, name)
        self.get(f"/v1/records/{name}/samples.csv")
        if number % 2:
            self.retire(RECORD, name)
            self.retire("GET", f"/v1/records/{name}/samples.csv")
            self.ask("DELETE", f"/v1/records/{name}")
            self.acknowledge(self.place(), RECORD, name, [])

    def change_material(self, slug, kinds, method, target, document):
        headers = {}
        if kinds != (REVISIONS,):
            headers["If-Match"] = self.ask("GET", f"/v1/materials/{slug}").headers["etag"]
        for what in (*kinds, TRAIL):
            self.retire(what, slug)
        self.ask(method, target, json=document, headers=headers)
        for what in (*kinds, TRAIL):
            self.acknowledge(self.place(), what, slug)

    def run_material(self, number):
        slug = f"felt{number}"
        felt = {"slug": slug, "name": f"Felt {number}", "source": "lab", "restitution": 0.5, "contact_time": 0.02, "comment": "first"}
        self.change_material(slug, (REVISIONS,), "POST", "/v1/materials", felt)
        target = f"/v1/materials/{slug}@1/derived?damper_mass=0.1&structure_mass=1"
        self.get(target)
        self.retire("GET", target)
        self.change_material(slug, (REVIEWS,), "POST", f"/v1/materials/{slug}@1/review", {"status": "approved", "reason": "measured"})
        self.change_material(slug, (MEASUREMENTS,), "POST", f"/v1/materials/{slug}/measurements", {"drops": [{"contact_time": 0.01}], "comment": "a drop"})
        self.get(f"/v1/materials/{slug}/measurements/1")
        felt = {key: value for key, value in felt.items() if key != "slug"}
        self.change_material(slug, (REVISIONS, REVIEWS), "POST", f"/v1/materials/{slug}/revisions", {**felt, "restitution": 0.6})

    def run_token(self, number):
        name = f"lab{number}"
        self.command("token", "create", "--name", name, "--scopes", "read")
        self.acknowledge(self.place(), TOKEN, name)
        if number % 2:
            self.retire(TOKEN, name)
            self.command("token", "revoke", name)
            self.acknowledge(self.place(), TOKEN, name)

    def life(self, first, count, with_signal):
        """A daemon from its start to its end, with `count` scenes and a few of all else; two clients, so that commits are shared."""
        self.start()
        others = [self.run_sweep, self.run_record, self.run_material, self.run_token, self.run_record]
        tasks = [(self.run_scene, number) for number in range(first, first + count)]
        tasks += [(other, first + number) for number, other in enumerate(others * max(1, count // 40))]
        self.chance.shuffle(tasks)
        with ThreadPoolExecutor(2) as pool:
            for done in [pool.submit(task, number) for task, number in tasks]:
                done.result()
        # Jobs that no one waits for are unfinished at the end.
        for number in range(4):
            self.submit({**self.scene(first + number), "duration": 900, "output": {"channels": [], "psd": None, "impacts": False}}, ASYNC)
        self.stop(with_signal)

    def jobs(self):
        # After a daemon's end all is in the one file; opened otherwise, SQLite would make the others, unrecorded.
        connection = sqlite3.connect(f"file:{os.path.join(self.folder, 'impactd.db')}?mode=ro&immutable=1", uri=True)
        found = sorted(row[0] for row in connection.execute("SELECT id FROM jobs"))
        connection.close()
        return found

    def back_up(self):
        """What is acknowledged now is what a restore has to bring back."""
        copied = [one for one in self.acknowledged if one.end is None]
        self.command("backup", os.path.join(self.folder, "copy.db"))
        return copied, self.jobs()

    def restore(self, copied, jobs):
        present, begin = self.jobs(), self.place()
        for one in self.acknowledged:
            one.end = begin if one.end is None else one.end
        self.command("restore", os.path.join(self.folder, "copy.db"), "--force")
        self.restoring = (begin, self.place(), present, jobs)
        self.acknowledged += [Acknowledged(self.place(), one.what, one.key, one.value) for one in copied]


def record(folder, log, scenes, seed):
    """Three daemons after one another in an empty folder, a backup after the first and its restore after the last."""
    recording = Recording(folder, log, seed)
    recording.token, recording.reviewer = (recording.command("token", "create", "--name", name, "--scopes", "admin") for name in ("lab", "reviewer"))
    recording.acknowledge(recording.place(), TOKEN, "reviewer")
    ends = (signal.SIGTERM, signal.SIGKILL, signal.SIGTERM)
    try:
        for number, end in enumerate(ends):
            recording.life(1 + number * scenes, scenes, end)
            copy = recording.back_up() if number == 0 else copy
        recording.restore(*copy)
    finally:
        if recording.daemon is not None:
            recording.daemon.kill()
    return recording
