#!/usr/bin/env python3
"""Drop tests over HTTP: kept as they were sent, evaluated, proposed as a revision and confirmed; what a material comes to for a pair."""

import http.client
import json
import math
import os
import random
import re
import sqlite3
import sys
import threading
import time
import xml.etree.ElementTree as xml
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import access  # noqa: E402
import asking  # noqa: E402
import program  # noqa: E402

SPONGE = "/v1/materials/sponge"


def near(value, wanted, within=1e-9):
    return abs(value - wanted) <= within * abs(wanted)


def drops(restitutions, contact_time=0.025, **more):
    """Drops from 2 cm and higher that rebound by these restitutions."""
    made = [{"drop_height": 0.02 + 0.01 * i, "rebound_height": e * e * (0.02 + 0.01 * i), "contact_time": contact_time}
            for i, e in enumerate(restitutions)]
    return {"impactor": "steel ball, 30 mm", "impactor_mass": 0.11, "base": "fixed", "gravity": 0, "drops": made, **more}


def post(daemon, test, target=SPONGE, **options):
    return daemon.request("POST", f"{target}/measurements", json=test, **options)


def test_a_measurement_is_kept_as_it_was_sent_and_evaluated():
    """POST answers 201 and what it comes to; GET shows the same test, to the number, and so does the list without readings."""
    body = drops([0.6, 0.61, 0.62], temperature=21.5, date="2026-11-20", instrument="ruler", person="A. Lab", source="doi:10/x")
    with program.daemon() as daemon:
        made = post(daemon, {**body, "comment": "first"})
        assert made.status == 201 and made.headers["location"] == f"{SPONGE}/measurements/1", made
        document = made.json()
        assert document["test"] == body and document["comment"] == "first" and document["author"] is None, document
        assert near(document["evaluation"]["restitution"]["mean"], 0.61), document
        assert near(document["evaluation"]["contact_time"]["mean"], 0.025), document
        shown = daemon.get(f"{SPONGE}/measurements/1")
        assert shown.json() == document, shown
        listed = daemon.get(f"{SPONGE}/measurements").json()
        assert listed["count"] == 1 and listed["measurements"][0]["drops"] == 3, listed
        assert "drops" not in listed["measurements"][0]["test"], listed
        assert listed["measurements"][0]["test"]["person"] == "A. Lab", listed
        trail = daemon.get(f"{SPONGE}/history").json()["history"][0]
        assert trail["action"] == "measure" and trail["measurement"] == 1 and trail["why"] == "first", trail
        for method in ("PUT", "PATCH", "DELETE"):
            assert daemon.request(method, f"{SPONGE}/measurements/1").status in (405, 501)
        assert daemon.get(f"{SPONGE}/measurements/1").json() == document


def test_a_dry_run_keeps_nothing():
    """?dry_run=1 shows the evaluation; there is no measurement and no entry in the trail afterwards."""
    with program.daemon() as daemon:
        version = daemon.get(SPONGE).json()["version"]
        shown = daemon.request("POST", f"{SPONGE}/measurements?dry_run=1", json=drops([0.6, 0.7]))
        assert shown.status == 200 and shown.json()["dry_run"] is True, shown
        assert near(shown.json()["evaluation"]["restitution"]["mean"], 0.65), shown
        assert daemon.get(f"{SPONGE}/measurements").json()["measurements"] == []
        assert daemon.get(SPONGE).json()["version"] == version


def test_a_proposal_is_confirmed_as_it_is():
    """GET proposal, POST its revision under its ETag: 201, and scenes that name it run with the measured numbers."""
    with program.daemon() as daemon:
        post(daemon, drops([0.5, 0.52, 0.54], contact_time=0.02))
        post(daemon, drops([0.56], contact_time=0.021))
        asked = daemon.get(f"{SPONGE}/proposal")
        proposal = asked.json()
        revision = proposal["revision"]
        assert near(revision["restitution"], 0.53) and near(revision["contact_time"], 0.02025), revision
        assert revision["name"] == "Sponge" and revision["measurements"] == [1, 2] and "table" not in revision, revision
        confirmed = daemon.request("POST", proposal["links"]["confirm"], json=revision, headers={"If-Match": asked.headers["etag"]})
        assert confirmed.status == 201 and confirmed.json()["revision"] == 2, confirmed
        again = daemon.request("POST", proposal["links"]["confirm"], json=revision, headers={"If-Match": asked.headers["etag"]})
        asking.problem(again, 412)
        scene = asking.sponge()
        scene["dampers"][0]["buffer"] = "sponge@2"
        job = program.finished(daemon, scene)
        derived = job["plan"]["derived"][0]
        assert derived["material"] == "sponge@2" and near(derived["restitution"], 0.53) and near(derived["contact_time"], 0.02025), derived
        one = daemon.get(f"{SPONGE}/proposal?measurements=2").json()
        assert one["measurements"] == [2] and near(one["revision"]["restitution"], 0.56), one
        table = daemon.get(f"{SPONGE}/proposal?as=table")
        rows = table.json()["revision"]["table"]
        assert len(rows) == 3 and near(rows[0]["restitution"], 0.53), rows
        confirmed = daemon.request("POST", f"{SPONGE}/revisions", json=table.json()["revision"], headers={"If-Match": table.headers["etag"]})
        assert confirmed.status == 201 and len(confirmed.json()["table"]) == 3, confirmed


def test_what_cannot_be_proposed_is_told():
    """No restitution, no second speed: the evaluation is shown, the revision is null and why says so."""
    with program.daemon() as daemon:
        asking.problem(daemon.get(f"{SPONGE}/proposal"), 404)
        post(daemon, {"drops": [{"contact_time": 0.02}]})
        post(daemon, drops([0.6]))
        answer = daemon.get(f"{SPONGE}/proposal?measurements=1").json()
        assert answer["revision"] is None and "restitution" in answer["why"] and answer["evaluation"]["rows"], answer
        answer = daemon.get(f"{SPONGE}/proposal?measurements=2&as=table").json()
        assert answer["revision"] is None and "two approach speeds" in answer["why"], answer
        for query in ("measurements=1,1", "measurements=", "measurements=1,", "measurements=x", "as=tables", "separation=zero", "foo=1",
                      "measurements=" + ",".join(str(i) for i in range(1, 500))):
            reply = daemon.get(f"{SPONGE}/proposal?{query}")
            asking.problem(reply, 404 if query.endswith("499") else 400)
        asking.problem(daemon.get(f"{SPONGE}/proposal?measurements=3"), 404)
        asking.problem(daemon.get("/v1/materials/none/proposal"), 404)
        asking.problem(daemon.get(f"{SPONGE}/proposal.pdf"), 404)
        asking.problem(daemon.get(f"{SPONGE}/measurements/0"), 404)
        asking.problem(daemon.get(f"{SPONGE}/measurements/x"), 404)


def test_a_force_trace_gives_back_what_was_simulated():
    """The contact forces of simulated impacts, sent as traces, give e and T_c of the scene, under both rules."""
    for rule in ("zero_penetration", "zero_force"):
        with program.daemon() as daemon:
            # A free mass before a stop that hardly moves: an isolated pair.
            scene = {"structure": {"mass": 1e6, "stiffness": 1, "damping": 0}, "duration": 0.1, "sample_rate": 20000,
                     "dampers": [{"mass": 0.11, "clearance": 0.00201, "velocity": 0.5,
                                  "buffer": {"restitution": 0.45, "contact_time": 0.006}}],
                     "contact": {"model": "spring_damper", "separation": rule},
                     "output": {"channels": ["contact_force"], "psd": None}}
            job = program.finished(daemon, scene)
            force = daemon.get(job["links"]["result"] + "/series.json?channels=contact_force&from=0&to=0.04").json()["channels"]["contact_force"]["values"]
            noise = random.Random(4)
            noisy = [f + noise.gauss(0, 0.1) for f in force]
            made = post(daemon, {"impactor_mass": 0.11, "base": "fixed", "gravity": 0,
                                 "traces": [{"interval": 1 / 20000, "force": noisy, "approach_speed": 0.5}]},
                        target=SPONGE, timeout=120)
            assert made.status == 201, made
            asked = daemon.get(f"{SPONGE}/proposal?separation={rule}").json()
            revision = asked["revision"]
            assert near(revision["contact_time"], 0.006, 0.02), asked
            assert near(revision["restitution"], 0.45, 0.03), asked
            assert revision["separation"] == rule and revision["least_speed"] == 0.5, revision
            row = asked["evaluation"]["rows"][0]
            assert row["from"] == "trace 1, contact 1" and row["contact_time_by"] == "pulse", row
            seen = row["contact"]
            assert row["trace"] == 1 and len(seen["pulse"]) == 33 and seen["start"] < seen["end"], seen
            assert 0 < seen["crossing_time"] <= 1.05 * row["contact_time"] and 0 <= seen["crossing_shortfall"] < 0.6, seen
            assert row["least_contact_time"] < row["contact_time"] < row["most_contact_time"], row


def test_too_few_samples_give_an_interval_and_no_figure():
    """Three samples in a contact: T_c is null, the interval holds it, and it is said in words."""
    force = [0.0] * 60
    force[30:33] = [50.0, 90.0, 40.0]
    with program.daemon() as daemon:
        shown = daemon.request("POST", f"{SPONGE}/measurements?dry_run=1", json={"traces": [{"interval": 0.001, "force": force}]})
        assert shown.status == 200, shown
        row = shown.json()["evaluation"]["rows"][0]
        assert row["contact_time"] is None and row["note"] and not row["contact_time_counts"], row
        assert 0 < row["least_contact_time"] < row["most_contact_time"] < 0.02, row
        assert any("no trace gives a value" in warning["detail"] for warning in shown.json()["warnings"]), shown.json()["warnings"]


def test_a_contact_has_a_start_an_end_and_a_pulse_or_none_of_them():
    """Where a pulse fits, the contact can be drawn; where none does, or too little is seen of it, what it would be drawn by is null."""
    def trace(samples, before=60):
        return {"interval": 1e-4, "force": [0.0] * before + samples + [0.0] * 300}
    pulse = [80 * math.exp(-0.02 * i) * math.sin(math.pi * i / 40) for i in range(41)]
    cases = (("", trace(pulse)), ("begins during the contact", trace(pulse[12:], before=0)),
             ("only 3 samples are in contact", trace([50.0, 90.0, 40.0])), ("no pulse of the model", trace(([1.0] * 4 + [0.2] * 4) * 5)))
    with program.daemon() as daemon:
        shown = daemon.request("POST", f"{SPONGE}/measurements?dry_run=1", json={"traces": [sent for _, sent in cases]}, timeout=120)
        rows = {row["trace"]: row for row in shown.json()["evaluation"]["rows"]}
        for number, (why, _) in enumerate(cases, 1):
            row, seen = rows[number], rows[number]["contact"]
            assert why in (row["note"] or ""), row
            assert (row["contact_time"] is None) == (why != ""), row
            assert seen["first"] <= seen["last"] and seen["peak"] > 0, seen
            if why:
                assert seen["start"] is None and seen["end"] is None and seen["pulse"] == [], seen
            else:
                assert 0.0055 < seen["start"] < 0.0065 < seen["end"] < 0.011 and len(seen["pulse"]) == 33, seen


def test_faults_are_told_all_at_once_and_nothing_is_kept():
    """Bad bodies: 4xx with a pointer for each fault; afterwards there is still no measurement."""
    cases = [
        ({}, ["/drops"]),
        ({"drops": []}, ["/drops"]),
        ({"drops": [{"drop_height": 0, "rebound_height": 0}, {"drop_height": 1, "rebound_height": 2}, {"drop_height": 1}, {}]},
         ["/drops/0/drop_height", "/drops/1/rebound_height", "/drops/2", "/drops/3"]),
        ({"drops": [{"drop_height": 1e400, "rebound_height": 1}]}, None),
        ({"drops": [{"contact_time": -1}], "date": "yesterday", "gravity": -1}, ["/date", "/drops/0/contact_time", "/gravity"]),
        ({"drops": [{"contact_time": 1}] * 1001}, ["/drops"]),
        ({"traces": [{"interval": 1e-4, "force": [0, 1]}] * 101}, ["/traces"]),
        ({"traces": [{"interval": 1e-4, "force": []}]}, ["/traces/0/force"]),
        ({"traces": [{"force": [1, 2, 3]}]}, ["/traces/0/interval"]),
        ({"traces": [{"interval": 1e-4, "force": "loud"}]}, ["/traces/0/force"]),
        ({"traces": [{"interval": 1e-4, "force": [1]}]}, ["/traces/0/force"]),
        ({"drops": [{"contact_time": 1}], "base": "floor", "base_mass": 1}, None),
        ({"drops": [{"contact_time": 1}], "dorps": []}, ["/dorps"]),
        ({"drops": {"contact_time": 1}}, ["/drops"]),
        ([], None),
    ]
    with program.daemon() as daemon:
        for body, pointers in cases:
            for query in ("", "?dry_run=1"):
                reply = daemon.request("POST", f"{SPONGE}/measurements{query}", json=body)
                assert reply.status in (400, 422), (body, reply)
                if pointers is not None:
                    asking.problem(reply, 422, *pointers)
        asking.problem(daemon.request("POST", f"{SPONGE}/measurements", body=b'{"drops": [{"contact_time": NaN}]}',
                                      headers={"Content-Type": "application/json"}), 400)
        asking.problem(post(daemon, drops([0.6]), target="/v1/materials/none"), 404)
        asking.problem(daemon.request("POST", f"{SPONGE}/measurements?dry_run=2", json=drops([0.6])), 400)
        assert daemon.request("POST", f"{SPONGE}/measurements?dry_run=true", json=drops([0.6])).status == 200
        assert daemon.get(f"{SPONGE}/measurements").json()["count"] == 0


def test_large_tests_are_taken():
    """A thousand drops, and a hundred traces of two thousand samples with two contacts each."""
    pulse = [80 * math.exp(-0.02 * i) * math.sin(math.pi * i / 40) for i in range(41)]
    force = [0.0] * 2000
    for at in (300, 1200):
        force[at:at + 41] = pulse
    noisy = [round(f + 0.2 * math.sin(3.7 * i * i), 4) for i, f in enumerate(force)]
    many = drops([0.6 + 0.0001 * (i % 7) for i in range(1000)])
    many["drops"] = [{**drop, "drop_height": 0.5, "rebound_height": 0.18 + 0.00001 * (i % 7)} for i, drop in enumerate(many["drops"])]
    with program.daemon() as daemon:
        made = post(daemon, many)
        assert made.status == 201 and made.json()["evaluation"]["restitution"]["count"] == 1000, made
        made = post(daemon, {"traces": [{"interval": 5e-5, "force": noisy}] * 100}, timeout=300)
        assert made.status == 201, made
        assert len(made.json()["evaluation"]["rows"]) == 200, made
        answer = daemon.get(f"{SPONGE}/proposal", timeout=300).json()
        assert answer["evaluation"]["restitution"]["count"] == 1000, answer["evaluation"]["restitution"]
        assert answer["evaluation"]["contact_time"]["count"] >= 1200, answer["evaluation"]["contact_time"]


def test_more_than_can_be_taken_is_told():
    """A body over the limit: 413; more readings than are evaluated at a time: 422, and fewer measurements go."""
    many = {"gravity": 0, "drops": [{"approach_speed": 1, "rebound_speed": 0.5}] * 1000}
    with program.daemon() as daemon:
        large = daemon.request("POST", f"{SPONGE}/measurements", body=b" " * (1 << 24) + b"x", headers={"Content-Type": "application/json"})
        asking.problem(large, 413)
        asking.problem(daemon.request("POST", f"{SPONGE}/measurements", body=b"{}", headers={"Content-Type": "text/csv"}), 415)
        for _ in range(21):
            assert post(daemon, many).status == 201
        for target in ("proposal", "proposal.json"):
            assert "fewer measurements" in asking.problem(daemon.get(f"{SPONGE}/{target}"), 422)["detail"]
        silence = json.dumps({"traces": [{"interval": 1e-6, "force": [0] * 600000}]})
        for _ in range(2):
            made = post(daemon, None, body=silence, headers={"Content-Type": "application/json"}, timeout=120)
            assert made.status == 201, made
        assert daemon.get(f"{SPONGE}/proposal?measurements=22,23", timeout=120).status == 200
        test = {"traces": [{"interval": 1e-6, "force": [0] * 600000}] * 2}
        for query in ("", "?dry_run=1"):
            reply = daemon.request("POST", f"{SPONGE}/measurements{query}", json=test, timeout=120)
            assert "must have at most 1048576 samples in all, have 1200000" in json.dumps(asking.problem(reply, 422, "/traces"))
        kept = {"materials": [{"slug": "sponge", "measurements": [{"comment": "two", "test": test}]}]}
        asking.problem(daemon.request("POST", "/v1/materials/import", json=kept, timeout=120), 422)
        some = daemon.get(f"{SPONGE}/proposal?measurements=1,2").json()
        assert some["evaluation"]["restitution"]["count"] == 2000, some["evaluation"]["restitution"]


def test_what_is_kept_is_shown_whatever_it_comes_to():
    """A kept trace that cannot be evaluated: 200 with the test, evaluation null, why among the warnings, and no ETag; lists have it."""
    test = {"notes": "kept before", "drops": [{"contact_time": 0.01}] * 3, "traces": [{"interval": 1e-4, "force": [1, 2]}]}
    one = (1).to_bytes(8, sys.byteorder)
    checks = b"".join(zlib.crc32(value).to_bytes(4, sys.byteorder) for value in (one, b"", b"c", one, json.dumps(test).encode()))
    with program.daemon() as daemon:
        with sqlite3.connect(os.path.join(daemon.data, "impactd.db")) as connection:
            connection.execute("INSERT INTO material_measurements (material, measurement, comment, created_unix_ms, drops, traces, head, document, checks) "
                               "SELECT number, 1, 'c', 1, 3, 1, '{\"notes\": \"kept before\"}', ?, ? FROM materials WHERE slug = 'sponge'",
                               [json.dumps(test), checks])
        connection.close()
        shown = daemon.get(f"{SPONGE}/measurements/1")
        assert shown.status == 200 and shown.json()["test"] == test and shown.json()["evaluation"] is None, shown
        assert "it is not evaluated: " in shown.json()["warnings"][0]["detail"] and "etag" not in shown.headers, shown
        brief = daemon.get(f"{SPONGE}/measurements").json()["measurements"][0]
        assert (brief["drops"], brief["traces"], brief["test"]) == (3, 1, {"notes": "kept before"}), brief
        asking.problem(daemon.get(f"{SPONGE}/proposal"), 422)


def test_what_was_measured_is_not_asked_twice():
    """GET of a measurement has an ETag that outlives revisions: 304 under it, another tag under another rule."""
    with program.daemon() as daemon:
        post(daemon, drops([0.6]))
        post(daemon, drops([0.7]))
        target = f"{SPONGE}/measurements/1"
        tag = daemon.get(target).headers["etag"]
        assert daemon.get(target, headers={"If-None-Match": tag}).status == 304
        assert daemon.get(f"{SPONGE}/measurements/2", headers={"If-None-Match": tag}).status == 200
        assert daemon.get(f"{target}?separation=zero_force", headers={"If-None-Match": tag}).status == 200
        asking.problem(daemon.get(f"{SPONGE}/measurements/3", headers={"If-None-Match": "*"}), 404)
        asking.problem(post(daemon, drops([0.6]), headers={"If-Match": tag}), 412)


def test_long_traces_do_not_keep_the_daemon():
    """While a trace of hundreds of contacts is evaluated others are answered, and SIGTERM ends the daemon in its time."""
    pulse = [80 * math.exp(-0.0008 * i) * math.sin(math.pi * i / 600) for i in range(601)]
    noise = random.Random(2)
    force = [round(noise.gauss(0, 0.8), 2) for _ in range(1000)] * 1000
    for at in range(250, len(force) - 700, 1100):
        force[at:at + 601] = [round(a + b, 2) for a, b in zip(force[at:at + 601], pulse)]
    body = json.dumps({"gravity": 0, "traces": [{"interval": 1e-6, "force": force}]})
    answers = []

    def ask():
        try:
            answers.append(post(daemon, None, body=body, headers={"Content-Type": "application/json"}, timeout=300).status)
        except (OSError, http.client.HTTPException):
            answers.append(None)

    with program.daemon() as daemon:
        asked = threading.Thread(target=ask)
        asked.start()
        for _ in range(100):
            assert daemon.get(SPONGE).status == 200
            time.sleep(0.02)
    # That the daemon ended within its time is what program.daemon() asserts.
    asked.join(60)
    assert answers in ([201], [422], [503], [None]), answers


def test_measurements_come_in_pages():
    """Newest first, Link to the next page, each once."""
    with program.daemon() as daemon:
        for i in range(5):
            assert post(daemon, drops([0.6], notes=f"n{i}")).status == 201
        seen, target = [], f"{SPONGE}/measurements?limit=2"
        while target:
            page = daemon.get(target)
            seen += [one["measurement"] for one in page.json()["measurements"]]
            found = re.search(r"<([^>]*)>; rel=\"next\"", page.headers.get("link", ""))
            target = found[1] if found else None
        assert seen == [5, 4, 3, 2, 1], seen
        asking.problem(daemon.get(f"{SPONGE}/measurements?limit=0"), 400)


def test_writers_that_have_seen_an_older_state_are_told():
    """If-Match is honoured where it is sent: 412 where the material has changed, 201 with its tag, and without it."""
    with program.daemon() as daemon:
        tag = daemon.get(SPONGE).headers["etag"]
        made = post(daemon, drops([0.6]), headers={"If-Match": tag})
        assert made.status == 201 and made.headers["etag"] == daemon.get(SPONGE).headers["etag"] != tag, made
        asking.problem(post(daemon, drops([0.6]), headers={"If-Match": tag}), 412)
        assert post(daemon, drops([0.6])).status == 201
        assert daemon.get(f"{SPONGE}/measurements").json()["count"] == 2


def test_only_those_who_may_write_materials_measure():
    """With tokens POST needs the scope materials, also dry; the author is the token's name."""
    with program.daemon() as daemon:
        reader = access.bearer(access.token(daemon.data, "reader", "read,submit"))
        writer = access.bearer(access.token(daemon.data, "writer", "read,materials"))
        assert program.until(lambda: daemon.get(SPONGE).status == 401)
        asking.problem(post(daemon, drops([0.6])), 401)
        for query in ("", "?dry_run=1"):
            asking.problem(daemon.request("POST", f"{SPONGE}/measurements{query}", json=drops([0.6]), headers=reader), 403)
        made = post(daemon, drops([0.6]), headers=writer)
        assert made.status == 201 and made.json()["author"] == "writer", made
        assert daemon.get(f"{SPONGE}/measurements/1", headers=reader).json()["author"] == "writer"
        assert daemon.get(f"{SPONGE}/derived?damper_mass=0.1", headers=reader).status == 200


def test_the_chart_shows_every_reading():
    """SVG with a dot for each reading that counts, a ring about an outlier, a cross for what is excluded, texts escaped."""
    body = drops([0.6, 0.61, 0.62, 0.605, 0.615, 0.2])
    body["drops"].append({"drop_height": 0.03, "rebound_height": 0.02, "excluded": "<script>alert(1)</script> & co"})
    with program.daemon() as daemon:
        post(daemon, body)
        chart = daemon.get(f"{SPONGE}/proposal.svg")
        assert chart.status == 200 and chart.headers["content-type"] == "image/svg+xml", chart
        page = xml.fromstring(chart.body)
        classes = [element.get("class") for element in page.iter() if element.get("class")]
        assert classes.count("mark s0") == 12 and classes.count("cross") == 1 and sum("ring" in name for name in classes) == 1, classes
        assert b"<script>" not in chart.body
        assert daemon.get(f"{SPONGE}/proposal", headers={"Accept": "image/svg+xml"}).body == chart.body
        asking.problem(daemon.get(f"{SPONGE}/proposal", headers={"Accept": "text/plain"}), 406)


def test_figures_for_a_pair_are_those_of_the_plan():
    """derived tells the k_b and c_b that a scene of that pair runs with, under both rules, and with uncertainty where there is any."""
    with program.daemon() as daemon:
        figures = daemon.get(f"{SPONGE}/derived?damper_mass=0.1107&structure_mass=1.35").json()
        for contact in figures["contacts"]:
            scene = asking.sponge()
            scene["contact"] = {"model": "spring_damper", "separation": contact["separation"]}
            plan = program.finished(daemon, scene)["plan"]["derived"][0]
            for name in ("stiffness", "damping", "damping_ratio"):
                assert near(contact[name]["value"], plan[name], 1e-12), (contact, plan)
                assert contact[name]["uncertainty"] is None, contact
        assert {contact["separation"] for contact in figures["contacts"]} == {"zero_penetration", "zero_force"}
        assert any("test are unknown" in warning["detail"] for warning in figures["warnings"]), figures
        for target in (SPONGE, f"{SPONGE}@1"):
            asking.problem(daemon.get(f"{target}/derived?damper_mass=0.1&identified_for=rig"), 422, "/identified_for")
        post(daemon, drops([0.59, 0.61, 0.63]))
        asked = daemon.get(f"{SPONGE}/proposal")
        revision = {**asked.json()["revision"], "contact_time_deviation": 0.0005}
        assert daemon.request("POST", f"{SPONGE}/revisions", json=revision, headers={"If-Match": asked.headers["etag"]}).status == 201
        figures = daemon.get(f"{SPONGE}@2/derived?damper_mass=0.22&structure_mass=0.22&separation=zero_penetration").json()
        contact, = figures["contacts"]
        assert near(figures["effective_mass"], 0.11) and figures["test_mass"] == 0.11 and figures["warnings"] == [], figures
        log_e = math.log(0.61)
        wanted = contact["damping"]["value"] * math.hypot(0.02 / 0.61 / log_e, 0.0005 / 0.025)
        assert near(contact["damping"]["uncertainty"], wanted, 1e-6), (contact, wanted)
        rig = daemon.get(f"{SPONGE}@2/derived?damper_mass=0.22&identified_for=rig&separation=zero_penetration").json()
        assert near(rig["contacts"][0]["stiffness"]["value"], contact["stiffness"]["value"], 1e-12), rig
        assert rig["contacts"][0]["restitution"]["value"] > 0.65 and rig["structure_mass"] is None, rig


def test_bad_questions_about_a_pair_are_told():
    """Masses that are missing, no numbers or out of range, unknown names: 400; unknown materials and revisions: 404."""
    with program.daemon() as daemon:
        for query in ("", "damper_mass=", "damper_mass=0", "damper_mass=-1", "damper_mass=nan", "damper_mass=1e99", "damper_mass=1&structure_mass=x",
                      "damper_mass=1&identified_for=me", "damper_mass=1&separation=both", "damper_mass=1&mass=2"):
            asking.problem(daemon.get(f"{SPONGE}/derived?{query}"), 400)
        for target in ("/v1/materials/none", f"{SPONGE}@9", f"{SPONGE}@x"):
            asking.problem(daemon.get(f"{target}/derived?damper_mass=1"), 404)


if __name__ == "__main__":
    program.main(globals())
