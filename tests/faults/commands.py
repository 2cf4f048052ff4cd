#!/usr/bin/env python3
"""Every allocation or file call of a command fails in turn, once and from then on: it does its work, or says why not and changes nothing.

    tests/faults/commands.py --build build stacks|allocations|EIO|ENOSPC|short [--stride 1] [--processes 4] [COMMAND...]

A command has some 20,000 allocations, but 2,000 to 3,000 distinct call stacks of them: `stacks` fails the first allocation with each.

Starts of the server (with a new database, and with jobs to continue), copies, checks and files of results. After each fault the
database is whole, in its old state or the new one, and the command without a fault succeeds. The suite runs a few of them
(tests/contract/test_faults.py)."""
import contextlib
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import campaign  # noqa: E402
import program  # noqa: E402
from control import KINDS, Control  # noqa: E402

TIMEOUT = 60  # [s]
# What a message says of a fault, and what it does not: no file is called faulty.
WORDS = {"allocations": ("memory",), "stacks": ("memory",), "short": ("",),
         "EIO": ("Input/output error", "I/O error", "cannot open", "could not be opened", "Reading or writing", "did not confirm", "cannot be read"),
         "ENOSPC": ("No space", "no room", "cannot open", "could not be opened", "did not confirm", "cannot be read")}
BLAMES = ("is damaged, or", "must be a certificate", "cannot be used")
# A study in a folder, as a cluster's tasks find it.
SCENE = {"structure": {"kind": "sdof", "mass": 1.35, "stiffness": 865},
         "dampers": [{"mass": 0.1, "clearance": 0.01, "buffer": {"restitution": 0.6, "contact_time": 0.02}}],
         "excitation": {"kind": "random", "band": [0, 15], "rms": 1, "seed": 3}, "duration": 2, "sample_rate": 100,
         "output": {"channels": ["displacement"], "psd": {"channels": ["displacement"], "segment": 64}},
         "study": {"kind": "ensemble", "runs": 7, "inputs": [
             {"pointer": "/dampers/0/mass", "distribution": "uniform", "from": 0.09, "to": 0.11}]}}
LIMITS = {"samples": 1 << 20, "impacts": 5000, "points": 1000, "steps": 1e9, "bytes": 1e9, "document_bytes": 1e9}
STUDY = {"members": 7, "chunks": 3, "is_strided": True, "scene": program.json.dumps(SCENE),
         **{f"limits.{name}": limit for name, limit in LIMITS.items()}}
MOTION = "PEER\nrecord\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= 4, DT= .0200 SEC\n0.1 -0.2 0.3 -0.1\n"


def prepare(folder):
    """What the commands find: a database with results and unfinished jobs, a copy of an earlier state, a ground motion, a scene, a certificate."""
    data = os.path.join(folder, "data")
    scene = program.scene("paper_free_sponge")
    scene["duration"] = 2
    daemon = program.Daemon(program.build, "--workers", "1", data=data)
    daemon.start()
    try:
        assert daemon.submit(scene, wait=20).json()["status"] == "successful"
        engine = daemon.get("/version").json()["engine"]
        code, _, said = program.run("backup", os.path.join(folder, "copy.db"), "--data", data)
        assert code == 0, said
        long = {**scene, "duration": 10, "accuracy": {"solver": "rk4", "step": 1e-4}}
        for number in range(3):
            long["dampers"][0]["clearance"] = 0.012 + 1e-5 * number
            assert daemon.submit(long, headers={"Prefer": "respond-async"}).status == 202
    finally:
        daemon.kill()
    program.certificate(folder)
    os.makedirs(os.path.join(folder, "study", "chunks"))
    for name, text in (("motion.AT2", MOTION), ("scene.json", program.json.dumps(scene)),
                       ("study/study", program.json.dumps({"engine": engine, **STUDY}))):
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(text)


def contents(path, scratch):
    """All rows of a database that is whole; None without a file, {} without tables. The file and its log are left as they are."""
    if not os.path.exists(path):
        return None
    shutil.rmtree(scratch, ignore_errors=True)
    os.mkdir(scratch)
    for ending in ("", "-wal", "-journal"):
        with contextlib.suppress(FileNotFoundError):
            shutil.copy(path + ending, scratch)
    with contextlib.closing(sqlite3.connect(os.path.join(scratch, os.path.basename(path)))) as connection:
        verdict = connection.execute("PRAGMA integrity_check").fetchall()
        assert verdict == [("ok",)], verdict
        tables = [row[0] for row in connection.execute("SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite_%'")]
        return {table: sorted(map(repr, connection.execute(f"SELECT * FROM {table}"))) for table in tables}


def count(rows):
    return {table: len(of) for table, of in (rows or {}).items()}


class Case:
    """A command in a folder of its own; `before` and `after` are the states of the file that it writes."""

    def __init__(self, *arguments, target=None, without=(), codes=(1,)):
        self.arguments, self.target, self.without, self.codes = arguments, target, without, codes

    def reset(self, template, folder):
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(template, folder)
        for name in self.without:
            with contextlib.suppress(FileNotFoundError):
                os.remove(os.path.join(folder, name))

    def state(self, folder):
        """Of the file that the command writes: rows or bytes."""
        path = os.path.join(folder, self.target)
        if self.target.endswith(".db"):
            return contents(path, folder + ".scratch")
        if not os.path.exists(path):
            return None
        with open(path, "rb") as file:
            return file.read()

    def is_allowed(self, state, before, after, has_succeeded):
        return state == after or (not has_succeeded and state == before)

    def line(self, folder):
        return [program.impactd(), *(argument.format(folder) for argument in self.arguments)]

    def run(self, folder, environment):
        """Exit code and what it said."""
        done = subprocess.run(self.line(folder), env=environment, capture_output=True, text=True,
                              timeout=TIMEOUT, check=False)
        return done.returncode, done.stderr


class Start(Case):
    """The server: started, and stopped when it listens."""

    def __init__(self, *arguments, **more):
        super().__init__("serve", "--listen", "127.0.0.1:0", "--workers", "1", "--data", "{}/data", *arguments, target="data/impactd.db", **more)

    def is_allowed(self, state, before, after, has_succeeded):
        """Nothing is lost; jobs go on."""
        if not before or not state:
            return state == after or (not has_succeeded and not state)
        lengths, wanted = count(state), count(before)
        return all(lengths[table] >= wanted[table] for table in wanted)

    def run(self, folder, environment):
        with subprocess.Popen(self.line(folder), env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            try:
                if process.stdout.readline():
                    process.send_signal(signal.SIGTERM)
                _, said = process.communicate(timeout=TIMEOUT)
            except subprocess.TimeoutExpired:
                process.kill()
                raise
        return process.returncode, said


CASES = {
    "new": Start(without=("data/impactd.db", "data/impactd.db-wal")),
    "start": Start(),
    "start with TLS": Start("--tls-cert", "{}/cert.pem", "--tls-key", "{}/cert_key.pem", codes=(1, 2)),  # 2: a file that an option names cannot be read
    "backup": Case("backup", "{}/new.db", "--data", "{}/data", target="new.db"),
    "backup over": Case("backup", "{}/copy.db", "--data", "{}/data", "--force", target="copy.db"),
    "restore": Case("restore", "{}/copy.db", "--data", "{}/data", "--force", target="data/impactd.db"),
    "check": Case("check-db", "--data", "{}/data", target="data/impactd.db"),
    "import": Case("import", "{}/motion.AT2", "-o", "{}/motion.json", target="motion.json"),
    "run": Case("run", "{}/scene.json", "-o", "{}/series.npy", target="series.npy"),
    # 74: the folder is full, 75: another attempt may succeed.
    "chunk": Case("chunk", "{}/study", "1", target="study/chunks/1", codes=(1, 74, 75)),
}


class Campaign(campaign.Campaign):
    """Calls or call stacks of one command; what it said is kept."""

    said = ""

    def run(self, name):
        root = tempfile.mkdtemp(prefix="impactd-")
        self.case, self.folder, self.template = CASES[name], os.path.join(root, "work"), os.path.join(root, "template")
        self.plain = dict(os.environ)
        try:
            os.mkdir(self.template)
            prepare(self.template)
            self.case.reset(self.template, self.folder)
            before = self.case.state(self.folder)
            control = Control(self.folder)
            self.faulty = {**os.environ, **control.environment}
            control.arm(0, self.calls, self.error, lists_stacks=self.kind == "stacks")
            code, said = self.case.run(self.folder, self.faulty)
            count_of_calls, _ = control.disarm()
            assert code == 0, (name, code, said)
            after = self.case.state(self.folder)
            # Each is a number of a call and a call stack; 0: any.
            calls = [(1, stack) for stack in control.stacks()] or [(n, 0) for n in range(1, count_of_calls + 1)]
            for permanent in (False, True):
                for n, stack in calls[self.chosen]:
                    self.case.reset(self.template, self.folder)
                    control.arm(n, self.calls, self.error, permanent, stack)
                    where = f"stack {stack:x}" if stack else f"call {n} of {len(calls)}"
                    self.judge(f"{name}, {'from ' if permanent else ''}{where}", control, before, after)
        finally:
            shutil.rmtree(root, ignore_errors=True)

    def judge(self, where, control, before, after):
        try:
            code, said = self.case.run(self.folder, self.faulty)
        except subprocess.TimeoutExpired:
            self.fault("hung", where)
            return
        finally:
            self.disarm(control)
        self.said += said
        if code < 0 or program.sanitizer_report(said):
            self.fault("crashed", f"{where}: {code}: {said[-3000:]}")
        elif code == 0:
            self.outcomes["done"] += 1
        elif code not in self.case.codes or not any(word in said for word in WORDS[self.kind]) or any(words in said for words in BLAMES):
            self.fault("unclear", f"{where}: {code}: {said}")
        else:
            self.outcomes["refused"] += 1
        try:
            state = self.case.state(self.folder)
        except (AssertionError, sqlite3.Error) as reason:
            self.fault("not whole", f"{where}: {reason}")
            return
        if not self.case.is_allowed(state, before, after, code == 0):
            self.fault("partial", f"{where}: {code}: {said}: {count(state) if isinstance(state, dict) else state}")
        code, said = self.case.run(self.folder, self.plain)
        if code != 0 and not (state == after and "is there already" in said):
            self.fault("then failed", f"{where}: {code}: {said}")


if __name__ == "__main__":
    sys.exit(campaign.main(Campaign, __doc__, ["stacks", "allocations", *KINDS], lambda kind: list(CASES), processes=4))
