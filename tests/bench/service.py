#!/usr/bin/env python3
"""What the service costs beside what it could cost: each figure is a ratio within one run, the median over rounds.

    tests/bench/service.py --build build [PART...]     parts: cached post npy cliff drip jobs acknowledge; all without

Peers are nginx (a static file of the same size, as many headers) and the core alone. Needs the Debian packages nginx-light and wrk.
CPU is what the kernel counts for the server's processes. Nothing else should run meanwhile.
"""
import argparse
import http.client
import itertools
import json
import os
import re
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from daemon import Daemon  # noqa: E402

TICK = os.sysconf("SC_CLK_TCK")
TOKEN = "0123456789abcdef" * 4  # means nothing where no token is asked for; see guard()
SECONDS, ROUNDS = 3, 5

NGINX = """
worker_processes {workers}; pid {folder}/pid; error_log {folder}/errors; daemon off; user root;
events {{ worker_connections 4096; }}
http {{
    access_log off; sendfile on; tcp_nopush on; tcp_nodelay on; keepalive_requests 1000000000; default_type application/json;
    open_file_cache max=100; client_body_temp_path {folder}/body; proxy_temp_path {folder}/p; fastcgi_temp_path {folder}/f;
    uwsgi_temp_path {folder}/u; scgi_temp_path {folder}/s; client_body_buffer_size 64k;
    server {{
        listen 127.0.0.1:{port}; root {folder}/files;
        add_header X-Content-Type-Options nosniff; add_header X-Request-Id $request_id;
        add_header Content-Security-Policy "default-src 'none'; frame-ancestors 'none'";
        add_header Cache-Control "private, max-age=31536000, immutable"; add_header Vary Accept-Encoding;
        location /post {{ error_page 405 =200 $uri; }}
    }}
}}
"""


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def cpu_seconds(pids):
    total = 0
    for pid in pids:
        with open(f"/proc/{pid}/stat") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        total += int(fields[11]) + int(fields[12])
    return total / TICK


class Nginx:
    def __init__(self, files):
        self.folder = tempfile.mkdtemp(prefix="impactd-nginx-")
        os.chmod(self.folder, 0o755)
        os.mkdir(os.path.join(self.folder, "files"))
        for name, content in files.items():
            with open(os.path.join(self.folder, "files", name), "wb") as file:
                file.write(content)
        self.port = free_port()
        path = os.path.join(self.folder, "nginx.conf")
        with open(path, "w") as file:
            file.write(NGINX.format(workers=os.cpu_count(), folder=self.folder, port=self.port))
        self.process = subprocess.Popen(["/usr/sbin/nginx", "-c", path], stderr=subprocess.DEVNULL)
        for _ in range(100):
            with socket.socket() as one:
                if one.connect_ex(("127.0.0.1", self.port)) == 0:
                    break
            time.sleep(0.05)

    def pids(self):
        with open(f"/proc/{self.process.pid}/task/{self.process.pid}/children") as file:
            return [int(pid) for pid in file.read().split()]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


LUA_POST = 'wrk.method = "POST"\nwrk.headers["Content-Type"] = "application/json"\n'


def wrk(port, path, connections, pids, script=None, seconds=SECONDS, headers=()):
    """Requests a second and CPU microseconds a request of the server."""
    command = ["wrk", "-t1", f"-c{connections}", f"-d{seconds}s", "--timeout", "30s",
               "-H", f"Authorization: Bearer {TOKEN}"]
    for header in headers:
        command += ["-H", header]
    if script:
        command += ["-s", script]
    before = cpu_seconds(pids)
    text = subprocess.run(command + [f"http://127.0.0.1:{port}{path}"], check=True, capture_output=True, text=True).stdout
    took = cpu_seconds(pids) - before
    count = int(re.search(r"(\d+) requests in", text).group(1))
    wrong = re.search(r"Non-2xx or 3xx responses: (\d+)", text)
    assert wrong is None, text
    return float(re.search(r"Requests/sec:\s*([\d.]+)", text).group(1)), 1e6 * took / max(count, 1)


def rivals(name, ours, theirs, rounds=ROUNDS):
    """Turn by turn, so that a noisy neighbour meets both."""
    rates, costs, own, other = [], [], [], []
    for _ in range(rounds):
        a, b = ours(), theirs()
        rates.append(a[0] / b[0])
        costs.append(a[1] / b[1] if b[1] > 0 else float("nan"))
        own.append(a)
        other.append(b)
    middle = statistics.median
    print(f"{name}: {middle(rates):.2f} of nginx's rate ({middle(x[0] for x in own):.0f} to {middle(x[0] for x in other):.0f} /s), "
          f"{middle(costs):.2f} of its CPU a request ({middle(x[1] for x in own):.1f} to {middle(x[1] for x in other):.1f} us)",
          flush=True)


def sponge(number=None, duration=10, **more):
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "schema", "examples",
                           "paper_free_sponge.json")) as file:
        scene = json.load(file)
    scene.pop("title", None)
    scene.update(duration=duration, **more)
    if number is not None:
        scene["excitation"]["displacement"] = 0.015 + 1e-9 * number
    return scene


def submit(daemon, scene):
    reply = daemon.request("POST", "/v1/jobs", json=scene)
    assert reply.status == 200, reply
    return reply.json()


def guard(daemon):
    """From now on the daemon asks for a token, which wrk has."""
    global TOKEN
    TOKEN = subprocess.run([daemon.program, "token", "create", "--name", "bench", "--scopes", "read,submit", "--data", daemon.data],
                           check=True, capture_output=True, text=True).stdout.split()[0]


def cached(daemon):
    result = submit(daemon, sponge(output={"channels": [], "psd": None}))["result"]
    path = f"/v1/results/{result}"
    body = daemon.request("GET", path).body
    guard(daemon)
    with Nginx({"r.json": body}) as nginx:
        for connections in (16, 128):
            rivals(f"cached result, {len(body)} B, {connections} connections",
                   lambda: wrk(daemon.port, path, connections, [daemon.process.pid]),
                   lambda: wrk(nginx.port, "/r.json", connections, nginx.pids()))


def script(folder, name, text):
    path = os.path.join(folder, name)
    with open(path, "w") as file:
        file.write(text)
    return path


def post(daemon):
    scene = sponge(output={"channels": [], "psd": None})
    scene["excitation"] = {"kind": "record", "interval": 0.02, "samples": [round(0.01 * i * (-1) ** i, 2) for i in range(230)]}
    text = json.dumps(scene)
    submit(daemon, scene)
    size = len(daemon.request("POST", "/v1/jobs", json=scene).body)
    guard(daemon)
    with tempfile.TemporaryDirectory() as folder, Nginx({"post": b"x" * size}) as nginx:
        lua = script(folder, "post.lua", LUA_POST + f"wrk.body = [==[{text}]==]\n")
        for connections in (16, 64):
            rivals(f"POST of a known scene, {len(text)} B, answer {size} B, {connections} connections",
                   lambda: wrk(daemon.port, "/v1/jobs", connections, [daemon.process.pid], lua),
                   lambda: wrk(nginx.port, "/post", connections, nginx.pids(), lua))


def npy(daemon):
    scene = sponge(duration=24, output={"channels": ["displacement", "velocity", "acceleration", "damper_displacement"]})
    path = f"/v1/results/{submit(daemon, scene)['result']}/series.npy"
    body = daemon.request("GET", path).body
    with Nginx({"s.npy": body}) as nginx:
        rivals(f"npy, {len(body)} B, 16 connections",
               lambda: wrk(daemon.port, path, 16, [daemon.process.pid]),
               lambda: wrk(nginx.port, "/s.npy", 16, nginx.pids()))


def cliff(daemon):
    path = f"/v1/results/{submit(daemon, sponge(output={'channels': [], 'psd': None}))['result']}"
    counts = (64, 120, 127, 128, 129, 255, 256, 257, 384, 512, 768, 1000)
    with Nginx({"r.json": daemon.request("GET", path).body}) as nginx:
        rates = [[statistics.median(wrk(port, target, count, pids, seconds=2)[0] for _ in range(3)) for count in counts]
                 for port, target, pids in ((daemon.port, path, [daemon.process.pid]), (nginx.port, "/r.json", nginx.pids()))]
    print("of the rate at 64 connections (nginx's own): " +
          ", ".join(f"{count}: {a / rates[0][0]:.2f} ({b / rates[1][0]:.2f})"
                    for count, a, b in list(zip(counts, *rates))[1:]), flush=True)


def latencies(port, path, seconds):
    connection = http.client.HTTPConnection("127.0.0.1", port)
    found, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        begin = time.perf_counter()
        connection.request("GET", path)
        connection.getresponse().read()
        found.append(time.perf_counter() - begin)
        time.sleep(0.001)
    found.sort()
    return found[int(0.99 * len(found))]


def drip(daemon, count=500):
    path = f"/v1/results/{submit(daemon, sponge(output={'channels': [], 'psd': None}))['result']}"
    ratios = []
    for _ in range(ROUNDS):
        quiet = latencies(daemon.port, path, 3)
        stop = threading.Event()
        drips = []

        def connect():
            one = socket.create_connection(("127.0.0.1", daemon.port))
            one.setblocking(False)
            one.send(b"GET /version HTTP/1.1\r\nHost: localhost\r\nX-Drip: ")
            return one

        def feed():
            while not stop.is_set():
                for i, one in enumerate(drips):
                    try:
                        one.send(b"x")
                    except OSError:
                        one.close()
                        drips[i] = connect()
                stop.wait(0.25)

        drips += [connect() for _ in range(count)]
        thread = threading.Thread(target=feed)
        thread.start()
        ratios.append(latencies(daemon.port, path, 3) / quiet)
        stop.set()
        thread.join()
        for one in drips:
            one.close()
    print(f"{count} dripping clients: a good client's p99 is {statistics.median(ratios):.2f} times its quiet p99", flush=True)


# Ready texts: what the client computes is missing to the server.
COUNTED = """
local before, behind = "{head}" .. [==[{before}]==], [==[{behind}]==]
local number = {first}
request = function()
    number = number + 1
    return before .. number .. behind
end
"""


numbers = itertools.count(1000000000 + int(time.time()) % 100000 * 1000, 10000000)


def counted(folder, scene):
    """A script that sends the scene with another number in the place of 424242 each time."""
    first = next(numbers)
    before, behind = json.dumps(scene).split("424242")
    size = len(before) + len(str(first)) + len(behind)
    head = (f"POST /v1/jobs HTTP/1.1\\r\\nHost: localhost\\r\\nAuthorization: Bearer {TOKEN}\\r\\n"
            f"Content-Type: application/json\\r\\nContent-Length: {size}\\r\\n\\r\\n")
    return script(folder, "counted.lua", COUNTED.format(head=head, before=before, behind=behind, first=first))


def core_rate(build, scene):
    """Runs a second of the core alone, on all processors, and CPU microseconds a run."""
    text = subprocess.run([os.path.join(build, "tests", "bench_core"), json.dumps(scene), str(os.cpu_count()), str(SECONDS)],
                          check=True, capture_output=True, text=True).stdout
    return float(text.split()[0]), float(text.split()[1])


def idle_scene():
    """One that computes next to nothing."""
    scene = sponge(duration=0.002, output={"channels": [], "psd": None, "impacts": False}, dampers=[])
    scene["excitation"]["displacement"] = 0.0010424242
    return scene


def jobs(daemon, build):
    quiet = {"channels": [], "psd": None, "impacts": False}
    free = sponge(output=quiet)
    free["excitation"]["displacement"] = 0.0150424242
    shaken = sponge(duration=60, output=quiet)
    shaken["excitation"] = {"kind": "random", "band": [0.5, 25], "rms": 2, "seed": 424242}
    idle = idle_scene()
    pids = [daemon.process.pid]
    with tempfile.TemporaryDirectory() as folder:
        def rate(scene):
            return wrk(daemon.port, "/v1/jobs", 64, pids, counted(folder, scene))

        ratios, costs, rates, beside = [], [], [], []
        for _ in range(ROUNDS):
            new, none = rate(free), rate(idle)
            ratios.append(new[0] / none[0])
            rates.append(new[0])
            beside.append(none[0])
            costs.append(new[1])
        core = core_rate(build, free)
        print(f"new jobs, free sponge 10 s, summary only, 64 clients: {statistics.median(ratios):.2f} of what is acknowledged "
              f"without computing ({statistics.median(rates):.0f} to {statistics.median(beside):.0f} /s); "
              f"{statistics.median(costs):.0f} us of CPU a job, the core's {core[1]:.0f}", flush=True)
        ratios, costs, rates = [], [], []
        for _ in range(ROUNDS):
            alone = core_rate(build, shaken)
            new = rate(shaken)
            ratios.append(new[0] / alone[0])
            costs.append(new[1])
            rates.append(new[0])
        print(f"new jobs, random sponge 60 s, summary only, 64 clients: {statistics.median(ratios):.2f} of the core alone "
              f"({statistics.median(rates):.0f} to {alone[0]:.0f} /s); {statistics.median(costs):.0f} us of CPU a job, the "
              f"core's {alone[1]:.0f}", flush=True)


def fsync_us(folder):
    path = os.path.join(folder, "fsync")
    times = []
    with open(path, "wb", buffering=0) as file:
        for _ in range(200):
            file.write(b"x" * 4096)
            begin = time.perf_counter()
            os.fdatasync(file.fileno())
            times.append(time.perf_counter() - begin)
    os.unlink(path)
    return 1e6 * statistics.median(times)


def acknowledge(daemon):
    scene = idle_scene()
    with tempfile.TemporaryDirectory() as folder:
        ratios, rates = [], []
        for _ in range(ROUNDS):
            many, one = [wrk(daemon.port, "/v1/jobs", connections, [daemon.process.pid], counted(folder, scene))[0]
                         for connections in (64, 1)]
            ratios.append(many / one)
            rates.append(many)
    print(f"durable acknowledgements, 64 clients: {statistics.median(rates):.0f} /s, {statistics.median(ratios):.1f} times one "
          f"client's, whose every job is a commit; fdatasync of the disk {fsync_us(daemon.data):.0f} us", flush=True)


PARTS = ["cached", "post", "npy", "cliff", "drip", "jobs", "acknowledge"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", default="build")
    parser.add_argument("parts", nargs="*", metavar="PART")
    arguments = parser.parse_args()
    for part in arguments.parts or PARTS:
        with Daemon(arguments.build, "--queue", "100000") as daemon:
            globals()[part](daemon, *([arguments.build] if part == "jobs" else []))


if __name__ == "__main__":
    main()
