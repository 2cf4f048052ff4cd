"""The clients of mixed.py: what each asks, and which answers are right. Not how often, nor what that costs the daemon."""
import collections
import json
import multiprocessing
import random
import socket
import struct
import time
import traceback

KEPT = 16  # results that are asked for again and again
FORMATS = ("json", "csv", "npy", "npz", "mat")


def scene(number=None):
    found = {"structure": {"mass": 1.35, "stiffness": 865, "damping": 1.092},
             "dampers": [{"mass": 0.1107, "clearance": 0.015, "buffer": "sponge"}],
             "excitation": {"kind": "free", "displacement": 0.015}, "duration": 2, "sample_rate": 500}
    if number is not None:
        found["excitation"]["displacement"] = 0.01 + 1e-9 * number
    return found


def slow(number):
    """Long enough to be left alone, nothing to keep, and soon over where nobody gets round to cancelling it."""
    return {**scene(number), "duration": 20, "output": {"channels": [], "psd": None},
            "accuracy": {"solver": "rk4", "step": 1e-5}}


class Place:
    """Where the daemon is, and in which of its lives; shared by all processes."""

    def __init__(self, port):
        self.shared = multiprocessing.RawArray("i", [port, 1])  # no lock: clients are killed

    def port(self):
        """Waits while the daemon is away."""
        end = time.monotonic() + 120
        while self.shared[0] == 0 and time.monotonic() < end:
            time.sleep(0.01)
        return self.shared[0]

    def life(self):
        return self.shared[1]

    def ends(self):
        """Called before the daemon ends: what fails from here on may fail of that."""
        self.shared[1] += 1
        self.shared[0] = 0

    def begins(self, port):
        self.shared[0] = port


class Line:
    """One connection, kept as long as the server keeps it."""

    def __init__(self, place):
        self.place, self.socket, self.rest = place, None, b""

    def send(self, method, target, body=None, headers="", share=1.0):
        """Sends the request, or a share of it."""
        data = json.dumps(body).encode() if isinstance(body, dict) else body or b""
        more = f"Content-Type: application/json\r\nContent-Length: {len(data)}\r\n" if body is not None else ""
        text = f"{method} {target} HTTP/1.1\r\nHost: localhost\r\n{headers}{more}\r\n".encode() + data
        if self.socket is None:
            self.socket = socket.create_connection(("127.0.0.1", self.place.port()), timeout=20)
            self.rest = b""
        self.socket.sendall(text[:round(share * len(text))])

    def ask(self, method, target, body=None, headers=""):
        for attempt in range(3):
            try:
                self.send(method, target, body, headers)
                return self.answer(method)
            except (ConnectionError, EOFError):
                # A connection that was idle too long may be closed under us: once more on a new one.
                self.close()
                if attempt == 2:
                    raise
        return None

    def answer(self, method):
        while b"\r\n\r\n" not in self.rest:
            self.more()
        head, self.rest = self.rest.split(b"\r\n\r\n", 1)
        lines = head.decode("latin-1").lower().split("\r\n")
        code = int(lines[0].split()[1])
        fields = dict(line.split(": ", 1) for line in lines[1:])
        body = b""
        if method == "HEAD" or code in (204, 304):
            pass
        elif fields.get("transfer-encoding") == "chunked":
            while True:
                size = int(self.take_line(), 16)
                body += self.take(size)
                self.take_line()
                if size == 0:
                    break
        else:
            body = self.take(int(fields.get("content-length", 0)))
        if fields.get("connection") == "close":
            self.close()
        return code, fields, body

    def take(self, size):
        while len(self.rest) < size:
            self.more()
        data, self.rest = self.rest[:size], self.rest[size:]
        return data

    def take_line(self):
        while b"\r\n" not in self.rest:
            self.more()
        line, self.rest = self.rest.split(b"\r\n", 1)
        return line

    def more(self):
        data = self.socket.recv(1 << 18)
        if not data:
            raise EOFError
        self.rest += data

    def close(self, reset=False):
        if self.socket is not None:
            if reset:
                self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self.socket.close()
        self.socket = None


class Asker:
    """One client: a connection, dice, and the results and finished jobs that all know."""

    def __init__(self, place, seed, known, first):
        self.line, self.dice, self.number = Line(place), random.Random(seed), first
        self.known = known
        self.acknowledged = {}  # by job: status and result as they were answered last

    def result(self):
        return self.dice.choice(self.known)[0]

    def job(self):
        return self.dice.choice(self.known)[1]

    def get(self, target, headers="", method="GET"):
        return self.line.ask(method, target, headers=headers)

    def post(self, body, headers="", target="/v1/jobs"):
        reply = self.line.ask("POST", target, body, headers)
        if target == "/v1/jobs" and reply[0] in (200, 202):
            job = json.loads(reply[2])
            self.acknowledged[job["id"]] = job["status"], job["result"]
        return reply

    def cancel(self, job):
        reply = self.get(f"/v1/jobs/{job}", method="DELETE")
        if reply[0] == 200:
            self.acknowledged[job] = "dismissed", None
        return reply

    def check(self):
        """How many acknowledged jobs are there still, as they were acknowledged."""
        for job, (status, result) in self.acknowledged.items():
            code, _, body = self.get(f"/v1/jobs/{job}")
            assert code == 200, f"lost: {job} was {status} and is answered {code}"
            now = json.loads(body)
            assert status in ("accepted", "running") or (now["status"], now["result"]) == (status, result), (status, now)
        return len(self.acknowledged)

    def summary(self):
        return self.get(f"/v1/results/{self.result()}", self.dice.choice(["", "Accept-Encoding: gzip\r\n"]))

    def repeated(self):
        return self.post(scene(self.dice.randrange(KEPT)))

    def new(self):
        return self.post(scene(self.number))

    def labelled(self):
        return self.post({**scene(self.number), "title": f"number {self.number}", "labels": ["storm", f"n={self.number}"]})

    def keyed(self):
        """The same key twice: one job."""
        key = f'Idempotency-Key: "{self.number}"\r\n'
        first, second = (self.post(scene(self.number), key) for _ in range(2))
        assert 503 in (first[0], second[0]) or json.loads(first[2])["id"] == json.loads(second[2])["id"]
        return second

    def cancelled(self):
        reply = self.post({**scene(self.number), "duration": 200}, "Prefer: respond-async\r\n")
        return self.cancel(json.loads(reply[2])["id"]) if reply[0] != 503 else reply

    def watched(self):
        """The events of a job from its start to its end."""
        reply = self.post({**scene(self.number), "duration": 20}, "Prefer: respond-async\r\n")
        if reply[0] == 503:
            return reply
        reply = self.get(f"/v1/jobs/{json.loads(reply[2])['id']}/events")
        assert b"event: finished" in reply[2], reply
        return reply

    def left(self):
        """A client that goes away before its answer: of a long job's events, or in the middle of a series."""
        reply = self.post(slow(self.number), "Prefer: respond-async\r\n")
        if reply[0] == 503:
            return reply
        job = json.loads(reply[2])["id"]
        path = f"/v1/jobs/{job}"
        for target in (f"{path}?wait=20", f"{path}/events", f"/v1/results/{self.result()}/series.json"):
            self.line.send("GET", target)
            if "wait" not in target and self.dice.random() < 0.5:
                self.line.more()
            self.line.close()
        return self.cancel(job)

    def cut(self):
        """A client that is gone in the middle of its request, and then asks in whole."""
        self.line.close()
        for share in (self.dice.random(), self.dice.uniform(0.9, 1)):
            self.line.send("POST", "/v1/jobs", scene(self.number), share=share)
            self.line.close(reset=self.dice.random() < 0.5)
        return self.new()

    def deleted(self):
        """A result of its own, computed, deleted and gone."""
        reply = self.post(scene(self.number), "Prefer: wait=30\r\n")
        if reply[0] != 200:
            return reply
        job = json.loads(reply[2])
        del self.acknowledged[job["id"]]
        target = f"/v1/results/{job['result']}"
        reply = self.get(target, method="DELETE")
        assert self.get(target)[0] == (404 if reply[0] in (204, 404) else 200), reply
        return reply

    def window(self):
        start = self.dice.uniform(0, 1.5)
        points = self.dice.choice(["", "&points=7"])
        return self.get(f"/v1/results/{self.result()}/series.{self.dice.choice(FORMATS)}"
                        f"?channels=displacement&from={start:.3f}&to={start + 0.3:.3f}{points}")

    def part(self):
        return self.get(f"/v1/results/{self.result()}/series.npy", "Range: bytes=0-999\r\n")

    def table(self):
        name = self.dice.choice(["psd", "impacts", "energy", "impacts/1/force"])
        return self.get(f"/v1/results/{self.result()}/{name}.{self.dice.choice(FORMATS)}",
                        method=self.dice.choice(["GET", "HEAD"]))

    def bundle(self):
        return self.get(f"/v1/results/{self.result()}/bundle.zip")

    def unchanged(self):
        result = self.result()
        return self.get(f"/v1/results/{result}", f'If-None-Match: "{result}"\r\n')

    def compared(self):
        return self.get(f"/v1/compare?a={self.result()}&b={self.job()}")

    def measured(self):
        body = {"a": self.result(), "channel": "displacement", "align": self.dice.choice(["given", "auto"]),
                "measured": {"samples": [self.dice.gauss(0, 0.01) for _ in range(40)], "interval": 0.01,
                             "quantity": "displacement"}}
        return self.post(body, target="/v1/compare")

    def study(self):
        """A study whose runs are made once for all that ask for it."""
        body = {**scene(self.dice.randrange(KEPT)), "study": {"kind": "compare", "models": ["impulse"]}}
        return self.post(body, "Prefer: wait=30\r\n")

    def explained(self):
        return self.post(scene(self.dice.choice([self.number, self.dice.randrange(KEPT)])), target="/v1/cache/explain")

    def listed(self):
        return self.get("/v1/jobs?limit=5" + self.dice.choice(["", "&label=storm", "&q=number", "&status=dismissed"]))

    def faulty(self):
        return self.post({**scene(), "duration": -1, "structur": {}})

    def no_json(self):
        return self.post(b'{"structure": {"mass": 1, "mass": 2}}')

    def nothing(self):
        return self.get(f"/v1/results/r-{self.number:064x}")

    def dry(self):
        return self.post(scene(self.number), target="/v1/jobs?dry_run=1")

    def foreign(self):
        return self.get("/version", "Host: elsewhere\r\n")

    def operated(self):
        return self.get(self.dice.choice(["/version", "/metrics", "/health/ready", "/v1/cache", "/v1/materials", "/"]))


# Of so many, what is asked, and the answers that are right.
MIX = [
    (300, Asker.summary, {200}),
    (90, Asker.repeated, {200, 202, 503}),
    (110, Asker.new, {200, 202, 503}),
    (30, Asker.labelled, {200, 202, 503}),
    (20, Asker.keyed, {200, 202, 503}),
    (30, Asker.cancelled, {200, 409, 503}),
    (20, Asker.watched, {200, 503}),
    (5, Asker.left, {200, 409, 503}),
    (10, Asker.cut, {200, 202, 503}),
    (20, Asker.deleted, {202, 204, 503}),
    (70, Asker.window, {200, 503}),
    (30, Asker.part, {206, 503}),
    (60, Asker.table, {200, 503}),
    (5, Asker.bundle, {200, 503}),
    (30, Asker.unchanged, {304}),
    (15, Asker.compared, {200, 503}),
    (10, Asker.measured, {200, 503}),
    (5, Asker.study, {200, 503}),
    (10, Asker.explained, {200}),
    (30, Asker.listed, {200}),
    (30, Asker.faulty, {422}),
    (10, Asker.no_json, {400}),
    (20, Asker.nothing, {404}),
    (20, Asker.dry, {200}),
    (10, Asker.foreign, {400}),
    (20, Asker.operated, {200}),
]
WEIGHTS = [weight for weight, _, _ in MIX]


def client(place, seed, requests, known, first, told):
    """Asks as many things, and reports how many were answered how, and what was acknowledged, or the first wrong answer."""
    asker = Asker(place, seed, known, first)
    codes, checked, life = collections.Counter(), 0, place.life()
    for _ in range(requests):
        _, ask, right = asker.dice.choices(MIX, WEIGHTS)[0]
        try:
            reply = ask(asker)
        except (ConnectionError, EOFError):
            if place.life() == life:
                told.put(("wrong", ask.__name__, traceback.format_exc()))
                return
            asker.line.close()
            reply = None
        except Exception:  # noqa: BLE001 - whatever it was, the storm has failed
            told.put(("wrong", ask.__name__, traceback.format_exc()))
            return
        asker.number += 1
        code = reply[0] if reply is not None else "interrupted"
        codes[ask.__name__, code] += 1
        # What was not answered before the daemon ended was asked again: what is deleted may be gone by then.
        if code not in right and (place.life() == life or code not in ("interrupted", 503, 404 if ask is Asker.deleted else 503)):
            told.put(("wrong", ask.__name__, code, reply[2][:500]))
            return
        if place.life() != life:
            try:
                checked += asker.check()
            except Exception:  # noqa: BLE001
                told.put(("wrong", "check", traceback.format_exc()))
                return
            life = place.life()
    asker.line.close()
    told.put(("done", codes, list(asker.acknowledged), checked))
