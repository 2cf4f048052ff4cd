"""A made-up laboratory's materials, as documents and tables. Not the daemon."""
import csv
import io
import json
import random

CSV, JSON = {"Content-Type": "text/csv"}, {"Content-Type": "application/json"}
# What breaks tables: commas, quotes, ends of lines, blanks, formulas, letters beyond ASCII, a table within.
ODD = ["plain", "a, b", 'say "so"', "two\nlines", "two\r\nlines", "=1+1", "+SUM(A1)", "@x", "-1", " blank ", "\tt",
       "Gummi, weich: 40 °Sh", "橡胶", "😀", "''", '""', ",", "\n", "null", "a\\b", "/etc", "\u0001\u001f", "1,5", ";"]


def test_of(draw):
    """A drop test: heights, speeds or a force trace."""
    kind = draw.randrange(3)
    test = {"impactor": "steel ball", "impactor_mass": 0.11, "base": draw.choice(["fixed", "free"]),
            "date": "2026-11-%02d" % draw.randint(1, 28), "notes": draw.choice(ODD) + "x", "temperature": draw.uniform(-20, 40)}
    if test["base"] == "free":
        test["base_mass"] = 3.0
    if kind == 0:
        test["drops"] = [{"drop_height": 0.05, "rebound_height": 0.05 * draw.uniform(0.1, 0.9) ** 2}
                         for _ in range(draw.randint(1, 6))]
    elif kind == 1:
        test["drops"] = [{"approach_speed": 0.5, "rebound_speed": 0.5 * draw.uniform(0.1, 0.6), "contact_time": draw.uniform(1e-4, 3e-2)}
                         for _ in range(draw.randint(1, 6))]
        if test["base"] == "free":
            test["drops"][0]["note"] = draw.choice(ODD)
    else:
        test["traces"] = [{"interval": 1e-4, "force": [draw.gauss(0, 0.01) for _ in range(50)], "approach_speed": 0.3}]
    return test


def revision_of(draw, number, measurements):
    said = {"revision": number, "name": draw.choice(ODD) + "x", "source": draw.choice(ODD) + "x",
            "author": draw.choice([None, "anna", "bert"]), "comment": draw.choice(ODD),
            "created": "2023-%02d-%02dT%02d:%02d:%02d.%03dZ" % (draw.randint(1, 12), draw.randint(1, 28), draw.randrange(24),
                                                              draw.randrange(60), draw.randrange(60), draw.randrange(1000))}
    for name in ("hardness", "supplier", "notes"):
        if draw.random() < 0.7:
            said[name] = draw.choice(ODD + [""])
    if draw.random() < 0.5:
        said["kind"] = draw.choice(["foam", "rubber"])
    if draw.random() < 0.5:
        said["tags"] = ["%s%d" % (draw.choice(ODD), i) for i in range(draw.randint(1, 4))]
    if draw.random() < 0.4:
        said["table"] = [{"approach_speed": 0.1 * (i + 1), "restitution": draw.random(), "contact_time": draw.uniform(1e-4, 1e-2)}
                         for i in range(draw.randint(2, 5))]
    else:
        said.update(restitution=draw.random(), contact_time=draw.uniform(1e-4, 3e-2), contact_time_deviation=draw.uniform(0, 1e-5))
    if draw.random() < 0.5:
        said.update(least_speed=0.15, most_speed=draw.uniform(0.2, 2), least_temperature=-5.5, impactor_mass=0.11,
                    base="fixed", separation="zero_force", thickness=draw.choice([0.01, 1e-9, 1e22, 0.1 + 0.2]))
    if measurements and draw.random() < 0.5:
        said["measurements"] = [draw.randint(1, measurements)]
    if draw.random() < 0.6:
        said["reviews"] = [{"status": "approved", "reason": draw.choice(ODD) + "x", "reviewer": "carl", "created": said["created"]}]
        if draw.random() < 0.3:
            said["reviews"].append({"status": "deprecated", "reason": "worn", "reviewer": None, "created": "2024-01-01T00:00:00.000Z"})
    return said


def material_of(draw, slug, revisions=None):
    tests = draw.randint(0, 3)
    material = {"slug": slug, "revisions": [], "measurements": []}
    for number in range(1, tests + 1):
        material["measurements"].append({"measurement": number, "author": draw.choice([None, "anna"]), "comment": draw.choice(ODD),
                                         "created": "2024-02-%02dT00:00:00.000Z" % number, "test": test_of(draw)})
    for number in range(1, (revisions or draw.randint(1, 4)) + 1):
        material["revisions"].append(revision_of(draw, number, tests))
    if len(material["revisions"]) > 2 and revisions is None:
        again = {**{k: v for k, v in material["revisions"][0].items() if k != "reviews"}, "revision": len(material["revisions"]) + 1,
                 "reverts": 1}
        material["revisions"].append(again)
    return material


def laboratory(seed, count=20, **options):
    draw = random.Random(seed)
    return {"format": "impactd-materials", "version": 1,
            "materials": [material_of(draw, "lab_%03d" % i, **options) for i in range(count)]}


def records(table):
    """The table's rows as lists of cells, the header first."""
    return list(csv.reader(io.StringIO(table.decode(), newline="")))


def table_of(rows, end="\r\n"):
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator=end).writerows(rows)
    return text.getvalue().encode()


def bring(daemon, body, dry=False, headers=None, **options):
    """Imports a document (dict, or its bytes) or a table (bytes that begin otherwise)."""
    if isinstance(body, dict):
        body = json.dumps(body).encode()
    kind = JSON if body.lstrip()[:1] == b"{" else CSV
    return daemon.request("POST", "/v1/materials/import" + ("?dry_run=1" if dry else ""), body=body,
                          headers={**kind, **(headers or {})}, **options)


def export(daemon, kind="json", headers=None):
    reply = daemon.get("/v1/materials." + kind, headers=headers)
    assert reply.status == 200, reply
    return reply.body
