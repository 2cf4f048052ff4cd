#!/usr/bin/env python3
"""GET /metrics is strict Prometheus text, and its numbers are those of what the test did."""

import math
import os
import re
import sys
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

NAME = r"[a-zA-Z_:][a-zA-Z0-9_:]*"
LABEL = r'[a-zA-Z_][a-zA-Z0-9_]*="(?:[^"\\\n]|\\["\\n])*"'
NUMBER = r"[+-]?(?:\d+(?:\.\d+)?(?:[eE][+-]?\d+)?|Inf)|NaN"
SUFFIXES = {"histogram": ("_bucket", "_sum", "_count"), "counter": ("",), "gauge": ("",)}


def parse(text):
    """{(name, labels): value} of a whole exposition; raises at the first line that is not as the format has it."""
    assert text.endswith("\n"), "the last line does not end"
    samples, helped, types, family = {}, set(), {}, None
    for number, line in enumerate(text.split("\n")[:-1], 1):
        where = f"line {number}: {line!r}"
        if line.startswith("# HELP "):
            found = re.fullmatch(rf"# HELP ({NAME}) (\S.*)", line)
            assert found and found[1] not in helped, where
            helped.add(found[1])
            family = found[1]
        elif line.startswith("# TYPE "):
            found = re.fullmatch(rf"# TYPE ({NAME}) (counter|gauge|histogram)", line)
            assert found and found[1] == family and found[1] not in types, where
            types[found[1]] = found[2]
        else:
            found = re.fullmatch(rf"({NAME})(?:\{{({LABEL}(?:,{LABEL})*)\}})? ({NUMBER})", line)
            assert found, where
            assert found[1] in [family + suffix for suffix in SUFFIXES[types[family]]], f"{where}: not of {family}"
            labels = tuple(sorted(re.findall(r'([a-zA-Z_][a-zA-Z0-9_]*)="((?:[^"\\]|\\.)*)"', found[2] or "")))
            assert len({name for name, _ in labels}) == len(labels), where
            assert (found[1], labels) not in samples, f"{where}: stands twice"
            samples[found[1], labels] = float(found[3].replace("Inf", "inf"))
            if types[family] == "counter":
                assert family.endswith("_total") and samples[found[1], labels] >= 0, where
    assert helped == set(types), helped ^ set(types)
    for name, kind in types.items():
        if kind == "histogram":
            check_histogram(name, samples)
    return samples


def check_histogram(name, samples):
    """Buckets rise to +Inf, which is the count; there is a sum."""
    series = {}
    for (sample, labels), value in samples.items():
        if sample == name + "_bucket":
            edge = float(dict(labels)["le"].replace("Inf", "inf"))
            series.setdefault(tuple(one for one in labels if one[0] != "le"), []).append((edge, value))
    for labels, buckets in series.items():
        assert buckets == sorted(buckets) and [v for _, v in buckets] == sorted(v for _, v in buckets), (name, buckets)
        assert math.isinf(buckets[-1][0]) and buckets[-1][1] == samples[name + "_count", labels], (name, labels)
        assert samples[name + "_sum", labels] >= 0


def metrics(daemon):
    reply = daemon.get("/metrics")
    assert reply.status == 200 and reply.headers["content-type"] == "text/plain; version=0.0.4; charset=utf-8", reply
    return parse(reply.body.decode())


def value(samples, name, **labels):
    return samples.get((name, tuple(sorted(labels.items()))), 0.0)


def test_the_parser_refuses_what_prometheus_would():
    """Planted faults: samples without a family, wrong suffixes, doubles, bad escapes, falling buckets."""
    good = "# HELP a_total x\n# TYPE a_total counter\na_total{b=\"c\\\\\"} 1\n"
    assert parse(good) == {("a_total", (("b", "c\\\\"),)): 1.0}
    for bad in (good[:-1], good + good, good.replace("a_total{", "b_total{"), good.replace(" 1\n", " one\n"),
                good.replace("\\\\", "\\x"), good.replace("counter", "meter"), good.replace('b="c', 'b=c"'),
                good.replace("a_total", "a"), good + "a_total{b=\"c\\\\\"} 2\n", good.replace("# HELP a_total x\n", ""),
                "# HELP h x\n# TYPE h histogram\nh_bucket{le=\"1\"} 2\nh_bucket{le=\"+Inf\"} 1\nh_sum 1\nh_count 1\n",
                "# HELP h x\n# TYPE h histogram\nh_bucket{le=\"1\"} 2\nh_sum 1\nh_count 2\n"):
        try:
            parse(bad)
        except (AssertionError, KeyError, TypeError):
            continue
        raise AssertionError(f"taken: {bad!r}")


def test_requests_are_counted_by_route_method_and_class():
    """Good, bad, unknown and refused requests each raise their own count, with times and bytes."""
    requests = "impactd_http_requests_total"
    with program.daemon() as daemon:
        before = metrics(daemon)
        for _ in range(7):
            daemon.get("/v1/materials/sponge")
        daemon.get("/v1/materials/none")
        daemon.get("/nowhere")
        daemon.get("/", headers={"Host": "evil"})
        daemon.request("POST", "/v1/jobs", json={})
        after = metrics(daemon)

        def more(name, **labels):
            return value(after, name, **labels) - value(before, name, **labels)

        material = {"route": "/v1/materials/{slug}", "method": "GET"}
        assert more(requests, **material, code="2xx") == 7
        assert more(requests, **material, code="4xx") == 1
        assert more(requests, route="none", method="any", code="4xx") == 2
        assert more(requests, route="/v1/jobs", method="POST", code="4xx") == 1
        assert more(requests, route="/metrics", method="GET", code="2xx") == 1
        assert more("impactd_http_request_duration_seconds_count", **material) == 8
        assert 0 < more("impactd_http_request_duration_seconds_sum", **material) < 60
        assert more("impactd_http_received_bytes_total") == 2
        assert more("impactd_http_sent_bytes_total") > 1000
        assert value(after, "impactd_http_connections") >= 1


def test_jobs_work_and_writes_are_counted():
    """Successful, known, failed and dismissed jobs, the engine's work by solver, SQLite's transactions and rows."""
    slow = dict(program.scene("paper_sine_aluminium"), duration=2e6, sample_rate=10, output={"channels": [], "psd": None})
    with program.daemon("--workers", "1", "--max-impacts", "100000") as daemon:
        scene = program.scene("paper_free_sponge")
        first = program.finished(daemon, scene)
        program.finished(daemon, scene)
        running = daemon.submit(slow, headers={"Prefer": "respond-async"}).json()["id"]
        waiting = daemon.submit(dict(slow, duration=1.9e6), headers={"Prefer": "respond-async"}).json()["id"]
        end = time.monotonic() + 60
        while value(metrics(daemon), "impactd_workers_busy") < 1 and time.monotonic() < end:
            time.sleep(0.05)
        now = metrics(daemon)
        assert value(now, "impactd_workers_busy") == 1 and value(now, "impactd_workers") == 1
        assert value(now, "impactd_queue_length") == 1, value(now, "impactd_queue_length")
        for job in (waiting, running):
            assert daemon.request("DELETE", f"/v1/jobs/{job}").status == 200
        now = metrics(daemon)
        assert value(now, "impactd_jobs_total", state="successful") == 2
        assert value(now, "impactd_jobs_total", state="dismissed") == 2
        assert value(now, "impactd_jobs_total", state="failed") == 0
        assert value(now, "impactd_jobs_known_total") == 1
        assert value(now, "impactd_queue_wait_seconds_count") == 2
        solver = first["plan"]["solver"]
        assert value(now, "impactd_engine_runs_total", solver=solver) == 1
        assert value(now, "impactd_engine_cpu_seconds_total", solver=solver) > 0
        assert value(now, "impactd_engine_work_total", solver=solver, kind="contacts") >= first["summary"]["impacts"] > 0
        assert value(now, "impactd_sqlite_transactions_total") >= 4
        assert value(now, "impactd_sqlite_writes_total") >= 4 and value(now, "impactd_sqlite_rows_total") >= 4
        assert value(now, "impactd_sqlite_errors_total") == 0
        assert value(now, "impactd_sqlite_transaction_seconds_count") == value(now, "impactd_sqlite_transactions_total")
        assert value(now, "impactd_cache_bytes") > 0
        assert value(now, "impactd_cache_misses_total", layer="documents") > 0
        assert value(now, "process_resident_memory_bytes") > 1e6 and value(now, "process_open_fds") > 5
        assert 0 < time.time() - value(now, "process_start_time_seconds") < 3600
        assert value(now, "process_cpu_seconds_total") > 0


def test_counts_are_whole_under_many_clients():
    """16 clients at once: no request is lost from the counts, and no scrape is torn."""
    with program.daemon() as daemon:
        def ask():
            for _ in range(100):
                assert daemon.get("/version").status == 200

        clients = [threading.Thread(target=ask) for _ in range(16)]
        for client in clients:
            client.start()
        while any(client.is_alive() for client in clients):
            metrics(daemon)
            time.sleep(0.05)
        for client in clients:
            client.join()
        now = metrics(daemon)
        assert value(now, "impactd_http_requests_total", route="/version", method="GET", code="2xx") == 1600
        assert value(now, "impactd_http_request_duration_seconds_count", route="/version", method="GET") == 1600


if __name__ == "__main__":
    program.main(globals())
