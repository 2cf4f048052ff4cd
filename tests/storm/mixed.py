#!/usr/bin/env python3
"""Very many requests of all sorts: memory and descriptors stay flat after warming up, and nothing is answered 5xx but back-pressure.

    tests/storm/mixed.py --build build [--requests 1000000] [--clients 8]

The suite runs 30,000 of them on the build with address and undefined-behaviour sanitizers (tests/contract/test_storm.py).
"""
import argparse
import json
import multiprocessing
import os
import random
import re
import socket
import sys
import time
import traceback

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

KEPT = 16  # results that are asked for again and again
CACHE = 16 << 20  # [B] of the daemon, so that it is full soon
GROWTH = 8 << 20  # [B] that chance may make of it
# Where the address sanitizer keeps its notes on all other addresses, an eighth of them.
SHADOW = range(0x7FFF8000, 0x10007FFF8000)
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


class Line:
    """One connection, kept as long as the server keeps it."""

    def __init__(self, port):
        self.port, self.socket, self.rest = port, None, b""

    def send(self, method, target, body=None, headers=""):
        data = json.dumps(body).encode() if isinstance(body, dict) else body or b""
        more = f"Content-Type: application/json\r\nContent-Length: {len(data)}\r\n" if body is not None else ""
        if self.socket is None:
            self.socket = socket.create_connection(("127.0.0.1", self.port), timeout=20)
            self.rest = b""
        self.socket.sendall(f"{method} {target} HTTP/1.1\r\nHost: localhost\r\n{headers}{more}\r\n".encode() + data)

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

    def close(self):
        if self.socket is not None:
            self.socket.close()
        self.socket = None


class Asker:
    """One client: a connection, dice, and the results and finished jobs that all know."""

    def __init__(self, port, seed, known, first):
        self.line, self.dice, self.number = Line(port), random.Random(seed), first
        self.known = known

    def result(self):
        return self.dice.choice(self.known)[0]

    def job(self):
        return self.dice.choice(self.known)[1]

    def get(self, target, headers="", method="GET"):
        return self.line.ask(method, target, headers=headers)

    def post(self, body, headers="", target="/v1/jobs"):
        return self.line.ask("POST", target, body, headers)

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
        return self.get("/v1/jobs/" + json.loads(reply[2])["id"], method="DELETE") if reply[0] != 503 else reply

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
        path = "/v1/jobs/" + json.loads(reply[2])["id"]
        for target in (f"{path}?wait=20", f"{path}/events", f"/v1/results/{self.result()}/series.json"):
            self.line.send("GET", target)
            if "wait" not in target and self.dice.random() < 0.5:
                self.line.more()
            self.line.close()
        return self.get(path, method="DELETE")

    def deleted(self):
        """A result of its own, computed, deleted and gone."""
        reply = self.post(scene(self.number), "Prefer: wait=30\r\n")
        if reply[0] != 200:
            return reply
        target = f"/v1/results/{json.loads(reply[2])['result']}"
        reply = self.get(target, method="DELETE")
        assert self.get(target)[0] == (404 if reply[0] == 204 else 200), reply
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


def client(port, seed, requests, known, first, told):
    """Asks as many things, and tells how many were answered how, or the first wrong answer."""
    asker = Asker(port, seed, known, first)
    codes = {}
    for _ in range(requests):
        _, ask, right = asker.dice.choices(MIX, WEIGHTS)[0]
        try:
            reply = ask(asker)
        except Exception:  # noqa: BLE001 - whatever it was, the storm has failed
            told.put(("wrong", ask.__name__, traceback.format_exc()))
            return
        asker.number += 1
        key = ask.__name__, reply[0]
        codes[key] = codes.get(key, 0) + 1
        if reply[0] not in right:
            told.put(("wrong", *key, reply[2][:500]))
            return
    asker.line.close()
    told.put(("done", codes))


def resident(pid):
    """Anonymous memory: pages of the database are the kernel's to take back.

    So is not the sanitizer's shadow of such a page, which some kernels allocate when it is read: it grows with the database."""
    total, is_counted = 0, True
    with open(f"/proc/{pid}/smaps") as file:
        for line in file:
            word, rest = line.split(maxsplit=1)
            if not word.endswith(":"):
                is_counted = int(word.split("-")[0], 16) not in SHADOW
            elif word == "Anonymous:" and is_counted:
                total += int(rest.split()[0]) * 1024
    return total


def descriptors(pid):
    return len(os.listdir(f"/proc/{pid}/fd"))


def connected(daemon):
    """How many clients the daemon says are there, with the one who asks."""
    text = daemon.get("/metrics").body.decode()
    return int(float(re.search(r"^impactd_http_connections (\S+)$", text, re.M)[1]))


def storm(daemon, requests, clients, seed=1, rounds=10, told_of=None):
    """Returns resident bytes and descriptors after each round, and how many of what were answered how."""
    line = Line(daemon.port)
    known = []
    for number in range(KEPT):
        code, _, body = line.ask("POST", "/v1/jobs", scene(number), "Prefer: wait=30\r\n")
        assert code == 200, (code, body)
        job = json.loads(body)
        known.append((job["result"], job["id"]))
    line.close()
    memory, files, codes = [], [], {}
    each = requests // rounds // clients
    for turn in range(rounds):
        told = multiprocessing.Queue()
        workers = [multiprocessing.Process(target=client, args=(daemon.port, seed * 1000 + turn * clients + i, each, known,
                                                                1000 + (turn * clients + i) * each, told), daemon=True)
                   for i in range(clients)]
        for worker in workers:
            worker.start()
        for _ in workers:
            word = told.get(timeout=1800)
            assert word[0] == "done", (word, f"the daemon: {daemon.process.poll()}, {daemon.stderr()[-1500:]}")
            for key, count in word[1].items():
                codes[key] = codes.get(key, 0) + count
        for worker in workers:
            worker.join()
        end = time.monotonic() + 10
        while connected(daemon) > 1 and time.monotonic() < end:
            time.sleep(0.05)
        memory.append(resident(daemon.process.pid))
        files.append(descriptors(daemon.process.pid))
        if told_of is not None:
            told_of(f"{(turn + 1) * each * clients} requests: {memory[-1] / 2**20:.1f} MiB, {files[-1]} descriptors")
    return memory, files, codes


def growth(memory, files):
    """Bytes and descriptors in the last three tenths beyond the most in the first four, while caches fill."""
    return sorted(memory[-3:])[1] - max(memory[:4]), max(files[-3:]) - max(files[:4])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--requests", type=int, default=1000000)
    parser.add_argument("--clients", type=int, default=8)
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    with program.daemon("--cache-bytes", str(CACHE)) as daemon:
        begin = time.monotonic()
        memory, files, codes = storm(daemon, arguments.requests, arguments.clients,
                                     told_of=lambda text: print(text, flush=True))
        took = time.monotonic() - begin
    for (what, code), count in sorted(codes.items()):
        print(f"{what:10} {code}  {count}")
    more, opened = growth(memory, files)
    print(f"{sum(codes.values())} requests in {took:.0f} s; {more / 2**20:.1f} MiB and {opened} descriptors more than after warming up")
    return 0 if more < GROWTH and opened <= 2 else 1


if __name__ == "__main__":
    sys.exit(main())
