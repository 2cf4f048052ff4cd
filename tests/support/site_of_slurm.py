"""A Slurm with a shared folder and a data folder, for tests of studies on a cluster: what threads answer, what the cluster
answers, and that nothing is left behind."""

import contextlib
import functools
import hashlib
import json
import math
import os
import random
import shutil
import tempfile

import program
from daemon import Daemon
from slurm import Slurm, until

ASYNC = {"Prefer": "respond-async"}


def sweep(points=120, duration=3):
    return {**program.scene("paper_free_sponge"), "duration": duration, "study": {"kind": "sweep", "axes": [
        {"pointer": "/dampers/0/clearance", "from": 0.005, "to": 0.03, "count": points}]}}


def slow_sweep(points=12):
    """Each member takes some tenths of a second."""
    made = sweep(points)
    made.update(duration=8, sample_rate=100, accuracy={"solver": "rk4", "step": 1e-5})
    return made


def ensemble(runs=60, **members):
    return {**program.scene("paper_random_sponge"), "duration": 5, "study": {"kind": "ensemble", "runs": runs, **members}}


def quake(seed, count=400):
    chance = random.Random(seed)
    samples = [chance.gauss(0, 1) * math.sin(math.pi * i / count) ** 2 for i in range(count)]
    return {"name": f"quake_{seed}", "interval": 0.02, "samples": samples}


def fragility():
    with open(os.path.join(program.EXAMPLES, "with_records", "fragility.json"), encoding="utf-8") as file:
        scene = json.load(file)
    scene["study"].update(records=["quake_1", "quake_2"])
    return scene


def answer(daemon, job, kind):
    """The study of a finished job, in bytes."""
    assert job["status"] == "successful", job
    names = ["table.json", "table.csv"] if kind == "sweep" else [kind + ".json", kind + ".csv"]
    replies = [daemon.get(f"/v1/results/{job['result']}/{name}") for name in names]
    assert {reply.status for reply in replies} == {200}, replies
    return [reply.body for reply in replies]


@functools.lru_cache(maxsize=None)
def threads_answer(text):
    with program.daemon() as daemon:
        upload(daemon)
        scene = json.loads(text)
        return answer(daemon, daemon.finished(daemon.submit(scene, headers=ASYNC).json()["id"], 300), scene["study"]["kind"])


def wanted(scene):
    """What a daemon without a cluster answers."""
    return threads_answer(json.dumps(scene, sort_keys=True))


def tasks_of(call):
    """The tasks of a call of sbatch: of --array=0,1,7."""
    (tasks,) = [word[8:] for word in call.split() if word.startswith("--array=")]
    return [int(task) for task in tasks.split(",")]


def upload(daemon):
    for seed in (1, 2):
        assert daemon.request("POST", "/v1/records", json=quake(seed)).status in (200, 201)


def all_are_sent(cluster):
    return cluster["chunks"] > 0 and cluster["running"] + cluster["queued"] == cluster["chunks"]


class Site:
    """One study at a time: begin it, disturb it, ends_well."""

    def __init__(self, slurm, shared, poll):
        self.slurm, self.shared = slurm, shared
        os.chmod(shared, 0o700)
        self.data = tempfile.mkdtemp(prefix="impactd-")
        self.options, self.further = slurm.options(shared, poll), []
        self.scene = self.job = self.daemon = None

    def start(self):
        self.daemon = Daemon(program.build, *self.options, *self.further, data=self.data,
                             environment=self.slurm.environment).start()
        upload(self.daemon)
        return self.daemon

    def begin(self, scene):
        """Starts the daemon and submits the scene."""
        if self.daemon is None:
            self.start()
        self.scene = scene
        self.job = self.daemon.submit(scene, headers=ASYNC).json()["id"]

    def queue(self, scene):
        """Submits the scene: all its tasks are queued, and none begins before the gate is opened."""
        self.slurm.close_gate()
        self.begin(scene)
        self.until(all_are_sent)

    def document(self):
        return self.daemon.get(f"/v1/jobs/{self.job}").json()

    def cluster(self):
        return self.document().get("cluster") or {"chunks": 0, "done": 0, "running": 0, "queued": 0, "reason": None}

    def until(self, condition, seconds=90):
        """Waits for condition(cluster)."""
        return until(lambda: condition(self.cluster()), lambda: (self.document(), self.slurm.tasks("--states=all"), self.daemon.stderr()),
                     seconds)

    def until_reason(self, *parts):
        """Waits for a reason that has one of the parts."""
        self.until(lambda cluster: any(part in (cluster["reason"] or "") for part in parts))

    def kill(self):
        self.daemon.kill()
        self.daemon = None

    def name(self):
        """Of the study's folder and of its jobs."""
        (name,) = [entry.name for entry in os.scandir(self.shared) if entry.is_dir()]
        return name

    def spoil(self):
        """Chunks 0 to 4 of 12 are torn, damaged, another chunk's, another study's, away; files of odd names lie beside them."""
        folder = os.path.join(self.shared, self.name(), "chunks")
        files = [os.path.join(folder, str(i)) for i in range(12)]
        with open(files[0], "r+b") as file:
            file.truncate(os.path.getsize(files[0]) // 2)
        with open(files[1], "r+b") as file:
            file.seek(os.path.getsize(files[1]) // 2)
            byte = file.read(1)[0]
            file.seek(-1, os.SEEK_CUR)
            file.write(bytes([byte ^ 4]))
        shutil.copy(files[5], files[2])
        with open(files[3], "r+b") as file:  # whole, and its digest right, but for another study
            body = bytearray(file.read()[:-32])
            body[8] ^= 1
            file.seek(0)
            file.write(bytes(body) + hashlib.sha256(body).digest())
        os.remove(files[4])
        for name in ("4.n1.77.part", ".4", "4x", "-4", "99", "18446744073709551621", " 4", "impactd", "+4"):
            shutil.copy(files[6], os.path.join(folder, name))

    def finished(self, seconds=180):
        until(lambda: self.document()["status"] not in ("accepted", "running"),
              lambda: (self.document(), self.slurm.tasks("--states=all"), self.daemon.stderr()), seconds)
        return answer(self.daemon, self.document(), self.scene["study"]["kind"])

    def is_clean(self):
        """No task is queued or runs, the folder is empty."""
        until(lambda: not self.slurm.tasks() and not [name for name in os.listdir(self.shared) if name != "ballast"],
              lambda: (self.slurm.tasks(), [entry for entry in os.walk(self.shared)]), 30)

    def ends_well(self):
        """The answer is to the byte that of threads, and nothing is left behind."""
        made = self.finished()
        assert made == wanted(self.scene), ("another answer", self.document(), self.daemon.stderr())
        self.is_clean()

    def close(self):
        if self.daemon is not None:
            self.daemon.stop(60)
        shutil.rmtree(self.data, ignore_errors=True)


slurms = {}  # by MaxArraySize, for all tests of a file


def slurm_of(array):
    if array not in slurms:
        slurms[array] = Slurm(array).__enter__()
    return slurms[array]


@contextlib.contextmanager
def site(shared=None, poll=0.3, array=1001):
    """A Site in a Slurm that has nothing to do."""
    slurm = slurm_of(array)
    folder = shared or tempfile.mkdtemp(prefix="impactd-shared-")
    made = Site(slurm, folder, poll)
    try:
        yield made
    finally:
        made.close()
        slurm.unwrap()
        if slurm.is_spoiled:
            slurms.pop(array).__exit__()
        else:
            slurm.restore()
        if shared is None:
            shutil.rmtree(folder, ignore_errors=True)


def main(namespace):
    """program.main, and the Slurms end in any case."""
    try:
        program.main(namespace)
    finally:
        for slurm in slurms.values():
            slurm.__exit__()
