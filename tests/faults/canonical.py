"""The canonical requests that fault injection repeats: each with what prepares it and the answers that are right without a fault."""
import contextlib
import json
import os
import sqlite3

import asking
import program

JSON = {"Content-Type": "application/json"}
WAIT = {"Prefer": "wait=20"}
EXTRA = {"output": {"channels": ["displacement"], "psd": {"channels": ["displacement"], "segment": 256}}}


def scene(number=0, **changes):
    made = program.scene("paper_free_sponge")
    made.update(duration=2, sample_rate=200, **EXTRA)
    made["dampers"][0]["clearance"] = 0.012 + 1e-7 * number
    made.update(changes)
    return made


def study(number, **fields):
    return scene(number, output={"channels": [], "psd": None}, study=fields)


class Setup:
    """What a daemon has before the requests: two results, a job, a record and measurements."""

    def __init__(self, daemon):
        self.daemon = daemon
        done = [daemon.submit(scene(number), wait=20).json() for number in (-1, -2)]
        self.job, self.a, self.b = done[0]["id"], done[0]["result"], done[1]["result"]
        swept = daemon.submit(study(-1, kind="sweep", metrics=["impacts"], axes=[CLEARANCES]), wait=20).json()
        self.sweep = swept["result"]
        made = daemon.request("POST", "/v1/records", json=record(-1))
        assert made.status == 201, made
        made = daemon.request("POST", "/v1/materials/sponge/measurements", json=DROPS)
        assert made.status == 201, made


CLEARANCES = {"pointer": "/dampers/0/clearance", "from": 0.01, "to": 0.02, "count": 3}
DROPS = {"comment": "x", "drops": [{"drop_height": 0.05, "rebound_height": 0.018}, {"drop_height": 0.05, "rebound_height": 0.019}]}


def record(number):
    return {"name": f"shake_{number}" if number >= 0 else "shake", "interval": 0.02, "samples": [0, 1, -2, 2, -1]}


def get(path, headers=None):
    return lambda setup, number: ("GET", path.format(number=number, **vars(setup)), None, headers or {})


def post(path, make, headers=None, method="POST"):
    """`make` returns the body of the request with a number; the path may name it."""
    return lambda setup, number: (method, path.format(number=number, **vars(setup)), json.dumps(make(number)).replace("{a}", setup.a),
                                  {**JSON, **(headers or {})})


def job(make):
    return post("/v1/jobs", make, WAIT)


def measured(number):
    return {"channel": "displacement", "align": "given",
            "measured": {"samples": [1e-3 * (i % 7) for i in range(40)], "interval": 0.01, "quantity": "displacement"}}


def lab(number):
    test = {"impactor_mass": 0.11, "base": "fixed", "drops": [{"approach_speed": 0.5, "rebound_speed": 0.2, "contact_time": 0.01}]}
    revision = {"revision": 1, "name": "Felt", "source": "here", "restitution": 0.4, "contact_time": 0.01, "comment": "x",
                "author": None, "created": "2024-01-01T00:00:00.000Z"}
    return {"format": "impactd-materials", "version": 1, "materials": [
        {"slug": f"lab{number}_{i}", "revisions": [revision], "measurements": [{"test": test}]} for i in range(3)]}


def motion(number):
    return scene(number, excitation={"kind": "random", "band": [0, 15], "rms": 1, "seed": 1})


def shaken(setup, number):
    """A run on a ground motion of its own, which is not in the cache: it is read and its digest is checked."""
    made = setup.daemon.request("POST", "/v1/records", json={**record(10**7 + number), "samples": [0, number, -2]})
    assert made.status == 201, made
    body = scene(number, excitation={"kind": "record", "name": f"shake_{10**7 + number}"})
    return "POST", "/v1/jobs", json.dumps(body), {**JSON, **WAIT}


def felt(number):
    return {"slug": f"felt{number}", "name": "Felt", "restitution": 0.3, "source": "here", "comment": "x"}


def revision(number):
    return {"name": f"Sponge {number}", "restitution": 0.6, "source": "again", "comment": "measured anew"}


def frame(number):
    made = program.scene("frame_two_dampers")
    made.update(duration=2, output={"channels": [], "psd": None})
    made["dampers"][0]["clearance"] = 0.012 + 1e-7 * number
    return made


def cancelled(setup, number):
    """The cancel of a job that takes long."""
    reply = setup.daemon.submit(asking.endless(number), headers={"Prefer": "respond-async"})
    assert reply.status == 202, reply
    return "DELETE", f"/v1/jobs/{reply.json()['id']}", None, {}


def deleted(setup, number):
    """The deletion of a result of its own."""
    reply = setup.daemon.submit(scene(10**6 + number), wait=20)
    assert reply.status == 200, reply
    return "DELETE", f"/v1/results/{reply.json()['result']}", None, {}


def checkpoint(setup, number):
    """A record, after which SQLite moves its log into the database: the log is as long as it may be."""
    path = os.path.join(setup.daemon.data, "impactd.db")
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("PRAGMA wal_autocheckpoint = 0")
        connection.execute("CREATE TABLE IF NOT EXISTS ballast (number INTEGER PRIMARY KEY, body BLOB)")
        for _ in range(17):
            connection.execute("INSERT OR REPLACE INTO ballast VALUES (1, randomblob(1048576))")
    return REQUESTS["record"][0](setup, 10**6 + number)


def upload(number):
    """A record of 300 kB."""
    return {**record(2 * 10**6 + number), "samples": [i * 37 % 1001 - 500 for i in range(60000)]}


# name: request, the right answers
REQUESTS = {
    "version": (get("/version"), {200}),
    "schemas": (get("/schemas"), {200}),
    "schema": (get("/schemas/scene.schema.json"), {200}),
    "dashboard": (get("/", {"Accept": "text/html"}), {200}),
    "metrics": (get("/metrics"), {200}),
    "job list": (get("/v1/jobs?q=x&limit=5"), {200}),
    "job": (get("/v1/jobs/{job}"), {200}),
    "events": (get("/v1/jobs/{job}/events"), {200}),
    "result": (get("/v1/results/{a}"), {200}),
    "series json": (get("/v1/results/{a}/series.json?from=0.{number:06}"), {200}),
    "series csv": (get("/v1/results/{a}/series.csv", {"Accept-Encoding": "gzip"}), {200}),
    "series npy": (get("/v1/results/{a}/series.npy?points={number}7"), {200}),
    "series mat": (get("/v1/results/{a}/series.mat"), {200}),
    "series svg": (get("/v1/results/{a}/series.svg"), {200}),
    "series range": (get("/v1/results/{a}/series.npy", {"Range": "bytes=0-99"}), {206}),
    "psd": (get("/v1/results/{a}/psd.json"), {200}),
    "impacts": (get("/v1/results/{a}/impacts.csv"), {200}),
    "force": (get("/v1/results/{a}/impacts/1/force.json"), {200}),
    "table": (get("/v1/results/{sweep}/table.csv"), {200}),
    "bundle": (get("/v1/results/{a}/bundle.zip"), {200}),
    "compare": (get("/v1/compare?a={a}&b={b}"), {200}),
    "materials": (get("/v1/materials?q=s"), {200}),
    "page": (get("/v1/materials?limit=2"), {200}),
    "material": (get("/v1/materials/sponge"), {200}),
    "pretty": (get("/v1/materials/sponge?pretty=1"), {200}),
    "history": (get("/v1/materials/sponge/history"), {200}),
    "proposal": (get("/v1/materials/sponge/proposal"), {200}),
    "derived": (get("/v1/materials/sponge/derived?damper_mass=0.11&structure_mass=1.35"), {200}),
    "export": (get("/v1/materials.json"), {200}),
    "export csv": (get("/v1/materials.csv"), {200}),
    "records": (get("/v1/records"), {200}),
    "spectrum": (get("/v1/records/shake/spectrum.json"), {200}),
    "explain": (post("/v1/cache/explain", scene), {200}),
    "dry run": (post("/v1/jobs?dry_run=1", scene), {200}),
    "preview": (post("/v1/preview", scene), {200}),
    "faulty": (post("/v1/jobs", lambda number: scene(number, structur={}, duration=-1)), {422}),
    "compare measured": (post("/v1/compare", lambda number: {"a": "{a}", **measured(number)}), {200}),
    "run": (job(scene), {200}),
    "run random": (job(motion), {200}),
    "run record": (shaken, {200}),
    "run frame": (job(frame), {200}),
    "run adaptive": (job(lambda number: scene(number, accuracy={"solver": "adaptive"})), {200}),
    "sweep": (job(lambda number: study(number, kind="sweep", metrics=["impacts"], axes=[CLEARANCES])), {200}),
    "ensemble": (job(lambda number: study(number, kind="ensemble", runs=4, inputs=[
        {"pointer": "/structure/damping", "distribution": "uniform", "from": 1, "to": 1.2}], metric="impacts")), {200}),
    "optimize": (job(lambda number: study(number, kind="optimize", variables=[
        {"pointer": "/dampers/0/clearance", "from": 0.01, "to": 0.02}], objectives=[{"metric": "rms_displacement"}],
        max_candidates=12)), {200}),
    "rename": (post("/v1/jobs/{job}", lambda number: {"title": f"number {number}"}, method="PATCH"), {200}),
    "cancel": (cancelled, {200}),
    "delete": (deleted, {204}),
    "material put": (post("/v1/materials", felt), {201}),
    "revision": (post("/v1/materials/sponge/revisions", revision, {"If-Match": "*"}), {201}),
    "drop test": (post("/v1/materials/sponge/measurements", lambda number: {**DROPS, "comment": f"test {number}"}), {201}),
    "record": (post("/v1/records", record), {201}),
    "upload": (post("/v1/records", upload), {201}),
    "checkpoint": (checkpoint, {201}),
    "import": (post("/v1/materials/import", lab), {200}),
}
