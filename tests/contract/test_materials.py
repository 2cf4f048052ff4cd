#!/usr/bin/env python3
"""The lab's materials over HTTP: added, revised, reviewed, reverted, found, compared, and who may do what."""

import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from access import bearer, token  # noqa: E402
from asking import problem  # noqa: E402
from program import until  # noqa: E402

FELT = {"name": "Felt", "kind": "Textile", "thickness": 0.004, "restitution": 0.3, "restitution_deviation": 0.02, "contact_time": 0.02,
        "least_speed": 0.2, "most_speed": 0.8, "impactor": "steel ball, 30 mm", "impactor_mass": 0.11, "base": "fixed",
        "source": "notebook 7, page 12", "tags": ["lab", "soft"]}
TABLE = [{"approach_speed": 0.1, "restitution": 0.5, "contact_time": 0.01}, {"approach_speed": 0.9, "restitution": 0.42, "contact_time": 0.006}]
LIMIT = 1 << 24
ANY = {"If-Match": "*"}


def without(document, *names):
    return {name: value for name, value in document.items() if name not in names}


def add(daemon, slug, **changes):
    reply = daemon.request("POST", "/v1/materials", json={"slug": slug, **FELT, **changes})
    assert reply.status == 201, reply
    return reply


def revise(daemon, slug, tag="*", **changes):
    return daemon.request("POST", f"/v1/materials/{slug}/revisions", json={**FELT, "comment": "measured anew", **changes},
                          headers={"If-Match": tag})


def review(daemon, name, status="approved", tag="*", **options):
    return daemon.request("POST", f"/v1/materials/{name}/review", json={"status": status, "reason": "looked at"},
                          headers={"If-Match": tag, **options.pop("headers", {})}, **options)


def pages(daemon, target, member):
    """All items of a list, page by page."""
    found = []
    while target:
        reply = daemon.get(target)
        assert reply.status == 200, reply
        found.append(reply.json()[member])
        link = reply.headers.get("link", "")
        target = link[link.index("<") + 1:link.index(">")] if 'rel="next"' in link else None
    return found


def test_the_life_of_a_material():
    """Added as a draft, revised, approved, superseded, deprecated, reverted: the head follows, and each step is told whole."""
    with program.daemon() as daemon:
        made = add(daemon, "felt", comment="for the new stop")
        first = made.json()
        assert made.headers["location"] == "/v1/materials/felt@1" and made.headers["etag"] == '"felt@1-1"', made.headers
        assert {name: first[name] for name in FELT} == FELT and first["comment"] == "for the new stop", first
        assert (first["slug"], first["revision"], first["latest"], first["version"], first["status"]) == ("felt", 1, 1, 1, "draft")
        assert first["author"] is None and first["review"] is None and first["reverts"] is None and first["notes"] is None, first
        shown = daemon.get("/v1/materials/felt")
        assert shown.json() == first and shown.headers["etag"] == '"felt@1-1"', shown.headers
        assert daemon.get("/v1/materials/felt@1").body == shown.body
        problem(daemon.request("POST", "/v1/materials", json={"slug": "felt", **FELT}), 409)

        second = revise(daemon, "felt", '"felt@1-1"', restitution=0.35, tags=["lab"])
        assert second.status == 201 and second.headers["location"] == "/v1/materials/felt@2", second
        assert second.headers["etag"] == '"felt@2-2"' and second.json()["restitution"] == 0.35
        assert daemon.get("/v1/materials/felt").json()["revision"] == 2, "the newest draft is the head while none is approved"
        approved = review(daemon, "felt@1", "approved", second.headers["etag"])
        assert approved.status == 200 and approved.headers["etag"] == '"felt@1-3"', approved
        assert without(approved.json()["review"], "created") == {"status": "approved", "reason": "looked at", "reviewer": None,
                                                                 "self_approved": True}, approved.json()
        came = daemon.get("/v1/materials/sponge@1").json()["review"]
        assert came["reviewer"] == "impactd" and came["self_approved"] is False, came
        assert daemon.get("/v1/materials/felt").json()["revision"] == 1, "what is approved is the head"
        problem(review(daemon, "felt@1"), 409)
        assert review(daemon, "felt@2").json()["status"] == "approved"
        assert daemon.get("/v1/materials/felt").json()["revision"] == 2
        gone = review(daemon, "felt@2", "deprecated").json()
        assert gone["status"] == "deprecated" and gone["review"]["self_approved"] is False, gone
        assert daemon.get("/v1/materials/felt").json()["revision"] == 1
        back = daemon.request("POST", "/v1/materials/felt/revert", json={"to": 2, "comment": "it was right"}, headers=ANY)
        assert back.status == 201 and back.headers["location"] == "/v1/materials/felt@3", back
        again = back.json()
        own = ("revision", "latest", "version", "status", "author", "comment", "reverts", "created", "review", "links")
        assert again["reverts"] == 2 and again["status"] == "draft" and again["comment"] == "it was right", again
        assert without(again, *own) == without(daemon.get("/v1/materials/felt@2").json(), *own)
        for name in ("felt@1", "felt@3"):
            assert review(daemon, name, "deprecated").status == 200
        assert "deprecated" in problem(daemon.get("/v1/materials/felt"), 404)["detail"]
        listed = {m["slug"]: m for m in daemon.get("/v1/materials").json()["materials"]}
        assert (listed["felt"]["revision"], listed["felt"]["status"]) == (3, "deprecated"), listed["felt"]

        steps = daemon.get("/v1/materials/felt/history").json()
        assert [(step["version"], step["action"], step["revision"]) for step in steps["history"]] == [
            (8, "deprecate", 3), (7, "deprecate", 1), (6, "revert", 3), (5, "deprecate", 2), (4, "approve", 2), (3, "approve", 1),
            (2, "revise", 2), (1, "create", 1)], steps
        assert steps["history"][-1]["why"] == "for the new stop" and steps["history"][2]["why"] == "it was right", steps
        assert [m["revision"] for m in daemon.get("/v1/materials/felt/revisions").json()["revisions"]] == [3, 2, 1]


def test_writers_say_what_they_have_seen():
    """Without If-Match 428, with a stale, weak or foreign tag 412 telling the version; any tag of the present version, also packed, and * do."""
    with program.daemon() as daemon:
        add(daemon, "felt")
        writes = (("revisions", {**FELT, "comment": "x"}, 201), ("revert", {"to": 1, "comment": "x"}, 201))
        version = 1
        for path, body, code in writes:
            target = f"/v1/materials/felt/{path}"
            assert f'"felt@{version}-{version}"' in problem(daemon.request("POST", target, json=body), 428)["detail"]
            present = f"{version}-{version}"
            for tag in (f'W/"felt@{present}"', f'"felt@{version}-0"', f'"felt@{present}0"', f"felt@{present}", f'"sponge@{present}"',
                        f'"felt{present}"', f'"felt@{present}x"', '"felt@-1"', '"felt@1-"', '"felt@1-99999999999999999999999"',
                        '"*"', "", '"', '""', "nonsense", f'"elt@{present}"', f'"felt@1-{2 ** 64 + version}"'):
                problem(daemon.request("POST", target, json=body, headers={"If-Match": tag}), 412)
            stale = problem(daemon.request("POST", target, json=body, headers={"If-Match": '"felt@1-77"'}), 412)
            assert f"version {version}" in stale["detail"] and "version 77" in stale["detail"], stale
            for tag in (f'"felt@{present}"', f'"felt@9-{version + 1}"', f'"felt@1-{version + 2}-gz"',
                        f'W/"felt@1-{version + 3}", "sponge@1-2" , "felt@1-{version + 3}"', "*"):
                reply = daemon.request("POST", target, json=body, headers={"If-Match": tag})
                assert reply.status == code, (tag, reply)
                version += 1
        for code, status in ((428, None), (412, '"felt@1-1"')):
            reply = daemon.request("POST", "/v1/materials/felt@1/review", json={"status": "approved", "reason": "x"},
                                   headers={"If-Match": status} if status else {})
            problem(reply, code)
        packed = daemon.get("/v1/materials/felt/revisions", headers={"Accept-Encoding": "gzip"})
        assert packed.headers["etag"].endswith('-gz"'), packed.headers
        assert review(daemon, "felt@1", tag=packed.headers["etag"]).status == 200
        for path in ("wood/revisions", "wood/revert", "wood@1/review", "felt@99/review", "felt@0/review", "felt@x/review"):
            body = {**FELT, "comment": "x"} if "revisions" in path else {"to": 1, "comment": "x"} if "revert" in path else {
                "status": "deprecated", "reason": "x"}
            problem(daemon.request("POST", f"/v1/materials/{path}", json=body, headers=ANY), 404)


def test_what_is_not_changed_is_not_sent_again():
    """304 by tag for a material, a revision, its revisions, history and differences, until something was done to it."""
    with program.daemon() as daemon:
        add(daemon, "felt")
        revise(daemon, "felt")
        paths = [f"/v1/materials/felt{rest}" for rest in ("", "@1", "@2", "/revisions", "/history", "/diff")]
        tags = {path: daemon.get(path).headers["etag"] for path in paths}
        for path, tag in tags.items():
            known = daemon.get(path, headers={"If-None-Match": tag})
            assert known.status == 304 and known.body == b"", (path, known)
        assert review(daemon, "felt@1").status == 200
        for path, tag in tags.items():
            assert daemon.get(path, headers={"If-None-Match": tag}).status == 200, path


def test_all_faults_are_told_with_their_places():
    """Unknown, missing, wrong and empty members of each body, slugs, measurements that are not there: 422, all at once, and nothing is kept."""
    create, why = "/v1/materials", "/v1/materials/felt/revisions"
    cases = [
        (create, {}, ["/slug", "/name", "/restitution", "/source"]),
        (create, {"slug": "import", **FELT}, ["/slug"]), (create, {"slug": "Felt", **FELT}, ["/slug"]), (create, {"slug": "", **FELT}, ["/slug"]),
        (create, {"slug": "a" * 64, **FELT}, ["/slug"]), (create, {"slug": "a@1", **FELT}, ["/slug"]), (create, {"slug": "ä", **FELT}, ["/slug"]),
        (create, {"slug": 7, **FELT}, ["/slug"]), (create, {"slug": "b", **FELT, "comment": "  "}, ["/comment"]),
        (create, {"slug": "b", **FELT, "measurements": [1]}, ["/measurements/0"]),
        (create, {"slug": "b", **FELT, "revision": 4}, ["/revision"]), (create, {"slug": "b", **FELT, "author": "me"}, ["/author"]),
        (create, {"slug": "b", "name": " ", "sorce": "x", "restitution": 1.2, "contact_time": -1, "kind": "", "least_speed": 2, "most_speed": 1,
                  "base_mass": 3, "comment": ""},
         ["/name", "/sorce", "/source", "/restitution", "/contact_time", "/kind", "/most_speed", "/base_mass", "/comment"]),
        (create, {"slug": "b", **FELT, "table": TABLE}, ["/table"]),
        (create, {"slug": "b", "name": "x", "source": "y", "table": TABLE[::-1]}, ["/table/1/approach_speed"]),
        (create, {"slug": "b", "name": "x", "source": "y", "table": [{**TABLE[0], "restitution": -1}, {**TABLE[1], "contact_tim": 1}]},
         ["/table/0/restitution", "/table/1/contact_tim"]),
        (create, {"slug": "b", **FELT, "tags": "a", "name": ["x"], "notes": 4001 * "x"}, ["/tags", "/name", "/notes"]),
        (create, {"slug": "b", **FELT, "tags": ["a", " ", 60 * "b", 61 * "c", 4]}, ["/tags/1", "/tags/3", "/tags/4"]),
        (why, FELT, ["/comment"]), (why, {**FELT, "comment": "\n"}, ["/comment"]), (why, {**FELT, "comment": "x", "slug": "felt"}, ["/slug"]),
        (why, {**FELT, "comment": "x", "measurements": [1, 0.5, 0]}, ["/measurements/0", "/measurements/1", "/measurements/2"]),
        ("/v1/materials/felt/revert", {}, ["/to", "/comment"]), ("/v1/materials/felt/revert", {"to": 2, "comment": ""}, ["/to", "/comment"]),
        ("/v1/materials/felt/revert", {"to": 0, "comment": "x"}, ["/to"]), ("/v1/materials/felt/revert", {"to": 1.5, "comment": "x"}, ["/to"]),
        ("/v1/materials/felt/revert", {"to": 1e300, "comment": "x"}, ["/to"]), ("/v1/materials/felt/revert", {"to": -1, "comment": "x"}, ["/to"]),
        ("/v1/materials/felt@1/review", {}, ["/status", "/reason"]),
        ("/v1/materials/felt@1/review", {"status": "draft", "reason": " "}, ["/status", "/reason"]),
        ("/v1/materials/felt@1/review", {"status": "approved", "reason": "x", "reviewer": "chief"}, ["/reviewer"]),
    ]
    with program.daemon() as daemon:
        add(daemon, "felt")
        before = daemon.get("/v1/materials").body, daemon.get("/v1/materials/felt/history").body
        for path, body, pointers in cases:
            problem(daemon.request("POST", path, json=body, headers=ANY), 422, *pointers)
        told = problem(daemon.request("POST", why, json={**FELT, "comment": "x", "suplier": "y", "thickness": 0}, headers=ANY), 422)
        assert told["title"] == "The revision has 2 faults", told
        by_place = {fault["pointer"]: fault for fault in told["errors"]}
        assert by_place["/suplier"]["did_you_mean"] == "supplier" and by_place["/thickness"]["unit"] == "m", told
        kind = {"Content-Type": "application/json", **ANY}
        for path in (create, why, "/v1/materials/felt/revert", "/v1/materials/felt@1/review"):
            for body in ("", " ", "{", "nul", '{"name": 1, "name": 2}', '{"restitution": NaN}', 33 * "[", b"\xff", b'{"a\x00": 1}'):
                problem(daemon.request("POST", path, body=body, headers=kind), 400)
            for body in ("[]", "7", '"x"', "null", json.dumps([FELT])):
                problem(daemon.request("POST", path, body=body, headers=kind), 422, "")
            problem(daemon.request("POST", path, body="{}", headers={**kind, "Content-Type": "text/plain"}), 415)
            problem(daemon.request("POST", path, body=b" " * LIMIT + b"{}", headers=kind), 413)
            problem(daemon.request("POST", path + "?dry=1", json={}, headers=ANY), 400)
        assert (daemon.get("/v1/materials").body, daemon.get("/v1/materials/felt/history").body) == before


def test_numbers_say_which_measurements_they_were_taken_from():
    """A revision may name the material's own measurements, once there are such; a measurement makes a version too."""
    drop = {"impactor_mass": 0.11, "base": "fixed", "drops": [{"drop_height": 0.1, "rebound_height": 0.009}], "comment": "first"}
    with program.daemon() as daemon:
        add(daemon, "felt")
        assert daemon.request("POST", "/v1/materials/felt/measurements", json=drop).status == 201
        problem(revise(daemon, "felt", '"felt@1-1"', measurements=[1]), 412)
        told = problem(revise(daemon, "felt", measurements=[1, 2]), 422, "/measurements/1")
        assert "1 to 1" in told["errors"][0]["detail"], told
        assert revise(daemon, "felt", '"felt@1-2"', measurements=[1]).json()["measurements"] == [1]
        steps = daemon.get("/v1/materials/felt/history").json()["history"]
        assert [(d["action"], d["revision"], d["measurement"]) for d in steps] == [("revise", 2, None), ("measure", None, 1), ("create", 1, None)]
        problem(revise(daemon, "sponge", measurements=[1]), 422, "/measurements/0")


def test_texts_of_any_kind_come_back_as_they_went():
    """Quotes, line ends, scripts, commands for shells and databases: kept to the letter; tables and tags too."""
    texts = ["Robert'); DROP TABLE materials;--", '"quoted" \\ back', "line\nend\ttab", "Gummi für Stöße, 橡胶 🎾", "$(reboot) `id` %s%n",
             "</script><b>", "=1+1", "a" * 200]
    with program.daemon() as daemon:
        for i, text in enumerate(texts):
            made = add(daemon, f"m{i}", name=text, supplier=text, notes=20 * text, source=text, tags=[text[:60], "x"], comment=text).json()
            assert made["name"] == made["supplier"] == made["source"] == made["comment"] == text and made["tags"][0] == text[:60], made
            assert made["notes"] == 20 * text
        saying = without(FELT, "restitution", "restitution_deviation", "contact_time")
        table = [{**row, "restitution_deviation": 0.01, "contact_time_deviation": 1e-4} for row in TABLE]
        made = daemon.request("POST", "/v1/materials", json={"slug": "t", **saying, "table": table}).json()
        assert made["table"] == table and made["restitution"] is None, made
        for name in ("../felt", "felt%2F..", "felt%00", "'", "m0%20", "M0", 300 * "a"):
            assert daemon.get(f"/v1/materials/{name}").status in (400, 404), name


def test_lists_are_searched_and_paged():
    """q over all texts, kind, status, ranges of e and T_c (a row of a table is enough), pages by slug; ranges that are none are told."""
    def found(query):
        return [m["slug"] for m in daemon.get("/v1/materials" + query).json()["materials"]]
    with program.daemon() as daemon:
        add(daemon, "felt", notes="Grüner FILZ", supplier="Acme")
        add(daemon, "cork", kind="wood", restitution=0.75, contact_time=0.004)
        saying = without(FELT, "restitution", "restitution_deviation", "contact_time")
        assert daemon.request("POST", "/v1/materials", json={"slug": "gel", **saying, "table": TABLE, "tags": ["blue"]}).status == 201
        review(daemon, "cork@1")
        five = ["aluminium", "hard_acrylic", "hard_rubber", "soft_rubber", "sponge"]
        assert found("") == sorted([*five, "felt", "cork", "gel"])
        for query, expected in (("q=gr%C3%9CNER+filz", ["felt"]), ("q=acme", ["felt"]), ("q=BLUE", ["gel"]), ("q=notebook", ["cork", "felt", "gel"]),
                                ("q=stc.238", five), ("q=rubber", ["hard_rubber", "soft_rubber"]), ("q=lab%0Asoft", []), ("q=", None),
                                ("kind=RUBBER", ["hard_rubber", "soft_rubber"]), ("kind=rubb", []), ("kind=wood&q=felt", ["cork"]),
                                ("status=draft", ["felt", "gel"]), ("status=approved&kind=wood", ["cork"]), ("status=deprecated", []),
                                ("e=0.75", ["cork"]), ("e=0.495..0.505&T_c=..0.01", ["gel"]), ("e=0.495..0.505&T_c=..0.008", []),
                                ("e=..0.35&status=draft", ["felt"]), ("T_c=0.0195..&status=draft", ["felt"]), ("e=.74...76", ["cork"]),
                                ("e=7e-1..7.6e-1&kind=wood", ["cork"]), ("e=0.61&T_c=0.025", ["sponge"])):
            assert found(f"?{query}") == (expected if expected is not None else found("")), query
        for query in ("e=..", "e=1..0", "e=a", "e=0.4-0.5", "e=nan", "e=inf..", "e=0x1", "T_c=1...2..3", "status=good", "limit=0", "limit=1001",
                      "limit=x", "q=" + 201 * "a", "material=felt", "e=" + 100 * "1"):
            problem(daemon.get(f"/v1/materials?{query}"), 400)
        assert "status" in problem(daemon.get("/v1/materials?statu=x"), 400)["detail"]
        for size in (1, 3, 8, 9):
            paged = pages(daemon, f"/v1/materials?limit={size}", "materials")
            assert [m["slug"] for page in paged for m in page] == found("") and all(len(page) <= size for page in paged), size
        assert [m["slug"] for page in pages(daemon, "/v1/materials?q=rubber&limit=1", "materials") for m in page] == ["hard_rubber", "soft_rubber"]
        assert found("?after=gel") == [slug for slug in found("") if slug > "gel"]


def test_differences_history_and_pages():
    """Only the members that differ, with units, between any two revisions; without a choice the newest beside the approved one."""
    with program.daemon() as daemon:
        add(daemon, "felt")
        assert daemon.get("/v1/materials/felt/diff").json()["differences"] == []
        revise(daemon, "felt", restitution=0.31, contact_time=0.021, supplier="Acme")
        saying = without(FELT, "restitution", "restitution_deviation", "contact_time")
        reply = daemon.request("POST", "/v1/materials/felt/revisions", json={**saying, "table": TABLE, "comment": "over speed"}, headers=ANY)
        assert reply.status == 201, reply

        def differ(query=""):
            document = daemon.get("/v1/materials/felt/diff" + query).json()
            assert document["count"] == len(document["differences"])
            return document["from"]["revision"], document["to"]["revision"], {
                d["pointer"]: (d["from"], d["to"], d["unit"]) for d in document["differences"]}
        assert differ("?from=1&to=2") == (1, 2, {"/restitution": (0.3, 0.31, None), "/contact_time": (0.02, 0.021, "s"),
                                                 "/supplier": (None, "Acme", None)})
        assert differ()[:2] == (2, 3) and set(differ()[2]) == {"/restitution", "/restitution_deviation", "/contact_time", "/supplier", "/table"}
        assert [row["approach_speed"] for row in differ()[2]["/table"][1]] == [0.1, 0.9]
        review(daemon, "felt@1")
        assert differ()[:2] == (1, 3) and differ("?to=2")[:2] == (1, 2) and differ("?from=3&to=3") == (3, 3, {})
        for query in ("?from=0", "?to=4", "?from=x", "?from=1.5"):
            problem(daemon.get("/v1/materials/felt/diff" + query), 400)
        for number in range(12):
            revise(daemon, "felt", notes=f"number {number}")
        for size in (1, 4, 15, 16, 100):
            assert [m["revision"] for page in pages(daemon, f"/v1/materials/felt/revisions?limit={size}", "revisions") for m in page] == [
                *range(15, 0, -1)], size
            assert [d["version"] for page in pages(daemon, f"/v1/materials/felt/history?limit={size}", "history") for d in page] == [
                *range(16, 0, -1)], size
        assert daemon.get("/v1/materials/felt/revisions?before=1").json()["revisions"] == []
        for path in ("revisions", "history", "diff", "used-by"):
            problem(daemon.get(f"/v1/materials/wood/{path}"), 404)
            problem(daemon.get(f"/v1/materials/felt/{path}?limitt=1"), 400)


def test_uses_are_counted_and_listed():
    """How many results each revision has, and which, newest first, page by page; deleted ones no more."""
    with program.daemon() as daemon:
        add(daemon, "felt")
        revise(daemon, "felt")
        made = []
        for number in range(5):
            scene = program.scene("paper_free_sponge")
            scene["duration"] = 1
            scene["dampers"][0].update(buffer="felt@1", clearance=0.012 + 1e-4 * number)
            made.append(program.finished(daemon, scene)["result"])
        counts = daemon.get("/v1/materials/felt/used-by").json()
        assert counts["total"] == 5 and [(r["revision"], r["results"]) for r in counts["revisions"]] == [(2, 0), (1, 5)], counts
        for target in ("/v1/materials/felt/used-by?revision=1&limit=2", "/v1/materials/felt@1/used-by?limit=2"):
            paged = pages(daemon, target, "results")
            assert [use["id"] for page in paged for use in page] == made[::-1] and len(paged) == 3, paged
        assert daemon.get("/v1/materials/felt@1/used-by?limit=1").json()["total"] == 5
        assert daemon.get("/v1/materials/felt@2/used-by").json() == {"slug": "felt", "revision": 2, "total": 0, "results": []}
        assert daemon.request("DELETE", f"/v1/results/{made[0]}").status in (200, 204)
        assert daemon.get("/v1/materials/felt@1/used-by").json()["total"] == 4
        for target in ("felt@3/used-by", "felt@0/used-by", "wood/used-by?revision=1", "felt/used-by?revision=3", "felt/used-by?revision=x"):
            problem(daemon.get(f"/v1/materials/{target}"), 404)
        for target in ("felt/used-by?limit=3", "felt@1/used-by?limit=0", "felt@1/used-by?before=x"):
            problem(daemon.get(f"/v1/materials/{target}"), 400)


def test_with_tokens_nobody_approves_their_own():
    """Writing needs the scope materials; names stand with revisions, reviews and the trail; an author's approval is a 403, a colleague's counts."""
    with program.daemon() as daemon:
        add(daemon, "before")
        ann, bob, eve = (bearer(token(daemon.data, name, scopes)) for name, scopes in (
            ("ann", "read,materials"), ("bob", "read,materials"), ("eve", "read,submit")))
        assert until(lambda: daemon.get("/v1/materials").status == 401)
        body = {"slug": "felt", **FELT}
        problem(daemon.request("POST", "/v1/materials", json=body, headers=eve), 403)
        made = daemon.request("POST", "/v1/materials", json=body, headers=ann)
        assert made.status == 201 and made.json()["author"] == "ann", made
        told = problem(review(daemon, "felt@1", headers=ann), 403)
        assert "ann" in told["detail"], told
        assert daemon.get("/v1/materials/felt@1", headers=ann).json()["version"] == 1
        approved = review(daemon, "felt@1", headers=bob).json()["review"]
        assert approved["reviewer"] == "bob" and approved["self_approved"] is False, approved
        assert review(daemon, "felt@1", "deprecated", headers=ann).status == 200, "anybody may warn of their own"
        problem(review(daemon, "felt@1", headers=ann), 403)
        back = daemon.request("POST", "/v1/materials/felt/revert", json={"to": 1, "comment": "x"}, headers={**bob, **ANY}).json()
        assert back["author"] == "bob", back
        problem(review(daemon, "felt@2", headers=bob), 403)
        assert review(daemon, "felt@2", headers=ann).json()["review"]["self_approved"] is False
        assert review(daemon, "before@1", headers=ann).json()["review"]["self_approved"] is False, "its author is not known"
        history = daemon.get("/v1/materials/felt/history", headers=eve).json()["history"]
        assert [(d["action"], d["who"]) for d in history] == [("approve", "ann"), ("revert", "bob"), ("deprecate", "ann"),
                                                              ("approve", "bob"), ("create", "ann")], history


if __name__ == "__main__":
    program.main(globals())
