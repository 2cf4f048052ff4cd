#!/usr/bin/env python3
"""Very many requests of all sorts: memory and descriptors stay flat after warming up, and nothing is answered 5xx but back-pressure.

    tests/storm/mixed.py --build build [--requests 1000000] [--clients 8]

The suite runs 50,000 of them on the build with address and undefined-behaviour sanitizers (tests/contract/test_storm.py).
"""
import argparse
import json
import multiprocessing
import os
import random
import socket
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from daemon import Daemon  # noqa: E402

KEPT = 16  # results that are asked for again and again


def scene(number=None):
    found = {"structure": {"mass": 1.35, "stiffness": 865, "damping": 1.092},
             "dampers": [{"mass": 0.1107, "clearance": 0.015, "buffer": "sponge"}],
             "excitation": {"kind": "free", "displacement": 0.015}, "duration": 2, "sample_rate": 500}
    if number is not None:
        found["excitation"]["displacement"] = 0.01 + 1e-9 * number
    return found


class Line:
    """One connection, kept as long as the server keeps it."""

    def __init__(self, port):
        self.port, self.socket, self.rest = port, None, b""

    def ask(self, method, target, body=None, headers=""):
        data = json.dumps(body).encode() if isinstance(body, dict) else body or b""
        more = f"Content-Type: application/json\r\nContent-Length: {len(data)}\r\n" if body is not None else ""
        message = f"{method} {target} HTTP/1.1\r\nHost: localhost\r\n{headers}{more}\r\n".encode() + data
        for attempt in range(3):
            try:
                if self.socket is None:
                    self.socket = socket.create_connection(("127.0.0.1", self.port), timeout=60)
                    self.rest = b""
                self.socket.sendall(message)
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


def one(line, dice, results, number):
    """Asks one thing and says what it was, with the code and those that are right for it."""
    result = dice.choice(results)
    kind = dice.randrange(100)
    if kind < 35:
        return "result", line.ask("GET", f"/v1/results/{result}", headers=dice.choice(["", "Accept-Encoding: gzip\r\n"])), {200}
    if kind < 45:
        return "known", line.ask("POST", "/v1/jobs", scene(dice.randrange(KEPT))), {200, 202, 503}
    if kind < 60:
        return "new", line.ask("POST", "/v1/jobs", scene(number)), {200, 202, 503}
    if kind < 63:
        reply = line.ask("POST", "/v1/jobs", {**scene(number), "duration": 200}, "Prefer: respond-async\r\n")
        if reply[0] not in (200, 202):
            return "to cancel", reply, {503}
        return "cancel", line.ask("DELETE", "/v1/jobs/" + json.loads(reply[2])["id"]), {200, 409}
    if kind < 70:
        start = dice.uniform(0, 1.5)
        return "window", line.ask("GET", f"/v1/results/{result}/series.{dice.choice(['json', 'csv', 'npy'])}"
                                  f"?channels=displacement&from={start:.3f}&to={start + 0.3:.3f}"), {200, 503}
    if kind < 74:
        return "npy", line.ask("GET", f"/v1/results/{result}/series.npy", headers="Range: bytes=0-999\r\n"), {206, 503}
    if kind < 78:
        return "psd", line.ask("GET", f"/v1/results/{result}/psd.json"), {200}
    if kind < 82:
        return "impacts", line.ask("HEAD", f"/v1/results/{result}/impacts.json"), {200}
    if kind < 85:
        return "not modified", line.ask("GET", f"/v1/results/{result}", headers=f'If-None-Match: "{result}"\r\n'), {304}
    if kind < 88:
        return "list", line.ask("GET", "/v1/jobs?limit=5"), {200}
    if kind < 91:
        return "faulty", line.ask("POST", "/v1/jobs", {**scene(), "duration": -1, "structur": {}}), {422}
    if kind < 93:
        return "no json", line.ask("POST", "/v1/jobs", b'{"structure": {"mass": 1, "mass": 2}}'), {400}
    if kind < 95:
        return "nothing", line.ask("GET", f"/v1/results/r-{number:064x}"), {404}
    if kind < 97:
        return "dry run", line.ask("POST", "/v1/jobs?dry_run=1", scene(number)), {200}
    if kind < 98:
        return "foreign", line.ask("GET", "/version", headers="Host: elsewhere\r\n"), {400}
    return "version", line.ask("GET", "/version"), {200}


def client(port, seed, requests, results, first, told):
    line, dice = Line(port), random.Random(seed)
    codes = {}
    for i in range(requests):
        what, reply, right = one(line, dice, results, first + i)
        codes[what, reply[0]] = codes.get((what, reply[0]), 0) + 1
        if reply[0] not in right:
            told.put(("wrong", what, reply[0], reply[2][:500]))
            return
    line.close()
    told.put(("done", codes))


def resident(pid):
    """Anonymous memory: pages of the database are the kernel's to take back."""
    with open(f"/proc/{pid}/status") as file:
        return next(int(line.split()[1]) * 1024 for line in file if line.startswith("RssAnon"))


def descriptors(pid):
    return len(os.listdir(f"/proc/{pid}/fd"))


def storm(daemon, requests, clients, seed=1, rounds=10):
    """Returns resident bytes and descriptors after each round, and how many of what were answered how."""
    line = Line(daemon.port)
    results = []
    for number in range(KEPT):
        code, _, body = line.ask("POST", "/v1/jobs", scene(number), "Prefer: wait=30\r\n")
        assert code == 200, (code, body)
        results.append(json.loads(body)["result"])
    line.close()
    memory, files, codes = [], [], {}
    each = requests // rounds // clients
    for turn in range(rounds):
        told = multiprocessing.Queue()
        workers = [multiprocessing.Process(target=client, args=(daemon.port, seed * 1000 + turn * clients + i, each, results,
                                                                1000 + (turn * clients + i) * each, told))
                   for i in range(clients)]
        for worker in workers:
            worker.start()
        for _ in workers:
            word = told.get(timeout=1800)
            assert word[0] == "done", word
            for key, count in word[1].items():
                codes[key] = codes.get(key, 0) + count
        for worker in workers:
            worker.join()
        time.sleep(0.5)
        memory.append(resident(daemon.process.pid))
        files.append(descriptors(daemon.process.pid))
    return memory, files, codes


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", default="build")
    parser.add_argument("--requests", type=int, default=1000000)
    parser.add_argument("--clients", type=int, default=8)
    arguments = parser.parse_args()
    with Daemon(arguments.build, "--cache-bytes", str(16 << 20)) as daemon:
        begin = time.monotonic()
        memory, files, codes = storm(daemon, arguments.requests, arguments.clients)
        took = time.monotonic() - begin
    for (what, code), count in sorted(codes.items()):
        print(f"{what:14} {code}  {count}")
    print("resident [MiB] after each tenth:", [round(one / 2**20, 1) for one in memory])
    print("descriptors after each tenth:   ", files)
    print(f"{sum(codes.values())} requests in {took:.0f} s")
    grown = memory[-1] - memory[2]
    assert grown < 8 << 20, f"{grown} bytes more than after three tenths"
    assert files[-1] <= files[2] + 2, files


if __name__ == "__main__":
    main()
