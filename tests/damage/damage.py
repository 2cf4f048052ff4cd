#!/usr/bin/env python3
"""Damaged databases: whatever the disk makes of the file, an answer is right or a problem, and the daemon does not end.

    tests/damage/damage.py --build build [--copies 300] [--seed 1]

A database with some of everything is copied, damaged at a seeded place and served: every target is read. An answer of 200 is
the one that was given before the damage. A damaged WAL may hold an earlier state, which then has other ETags. `impactd check-db` finds what readers found. contract/test_damage.py is the short version.
"""
import argparse
import collections
import json
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

OPTIONS = ("--workers", "2")
PAGE = 16384
REFUSED = (404, 409, 410, 500, 503)


def fill(folder, with_wal):
    """Some of everything; the targets that are read later."""
    targets = []
    with program.Daemon(program.build, *OPTIONS, data=folder) as daemon:
        def ask(method, target, document, etag=None):
            reply = daemon.request(method, target, json=document, headers={"If-Match": etag} if etag else {})
            assert reply.status in (200, 201), (target, reply)
            return reply.json()

        for number in range(6):
            scene = program.scene(("paper_free_sponge", "paper_random_sponge", "paper_sine_aluminium")[number % 3])
            scene.update(duration=2, title=f"run {number}", labels=[f"lab={number}"])
            scene["dampers"][0]["clearance"] = 0.01 + 0.001 * number
            if number == 1:  # costs more to compute than to read, so that its series is stored
                scene["accuracy"] = {"solver": "rk4", "step": 1e-4}
            if number == 3:
                scene["study"] = {"kind": "sweep", "axes": [{"pointer": "/dampers/0/clearance", "from": 0.01, "to": 0.02, "count": 30}]}
            job = program.finished(daemon, scene)
            place = f"/v1/results/{job['result']}"
            targets += [f"/v1/jobs/{job['id']}", f"/v1/jobs/{job['id']}/scene", place, place + "/series.csv", place + "/manifest"]
            targets += [place + "/table.csv"] if number == 3 else [place + "/impacts.csv", place + "/psd.csv", place + "/energy.csv"]
        for name in ("quake", "shake", "tremor"):
            chance = random.Random(name)
            ask("POST", "/v1/records", {"name": name, "interval": 0.01, "notes": name, "samples": [chance.uniform(-2, 2) for _ in range(500)]})
            targets += [f"/v1/records/{name}", f"/v1/records/{name}/samples.csv"]
        for number, slug in enumerate(("felt", "cork")):
            ask("POST", "/v1/materials", {"slug": slug, "name": slug.title(), "source": "lab", "comment": "first",
                                          "restitution": 0.4 + 0.1 * number, "contact_time": 0.02})
            place = f"/v1/materials/{slug}"
            ask("POST", place + "/measurements", {"drops": [{"contact_time": 0.01 + 0.01 * number}], "notes": slug, "comment": "a drop"},
                daemon.get(place).headers["etag"])
            ask("POST", place + "@1/review", {"status": "approved", "reason": "measured"}, daemon.get(place).headers["etag"])
            targets += [place, place + "@1", place + "/revisions", place + "/history", place + "/measurements", place + "/measurements/1"]
        targets += [f"/v1/materials/{slug}" for slug in ("sponge", "soft_rubber", "hard_rubber", "hard_acrylic", "aluminium")]
        targets += ["/v1/materials", "/v1/materials.json", "/v1/records", "/v1/jobs"]
        if with_wal:
            daemon.kill()
        else:
            daemon.stop()
    return targets


def read(daemon, target):
    reply = daemon.get(target, timeout=30)
    return reply.status, reply.headers.get("etag"), reply.headers.get("content-type"), reply.body


def expected(folder, targets):
    """What is right, of a copy: a daemon that starts changes the files."""
    with tempfile.TemporaryDirectory() as copy:
        shutil.copytree(folder, copy, dirs_exist_ok=True)
        with program.daemon(*OPTIONS, data=copy) as daemon:
            right = {target: read(daemon, target) for target in targets}
            assert all(answer[0] == 200 for answer in right.values()), [one for one in right.items() if one[1][0] != 200]
            return right


# Damage: each changes the files of a folder, and returns what it did.

def overwrite(path, offset, data):
    with open(path, "r+b") as file:
        file.seek(offset)
        file.write(data)


def damage_bytes(path, low, high, chance):
    """Some bytes become others, or a bit another one."""
    offset = chance.randrange(low, high)
    with open(path, "rb") as file:
        file.seek(offset)
        there = file.read(chance.choice((1, 1, 1, 4, 16, 512)))
    if len(there) == 1:
        data = bytes([there[0] ^ (1 << chance.randrange(8))])
    else:
        data = chance.choice((bytes(len(there)), chance.randbytes(len(there))))
    overwrite(path, offset, data)
    return f"{len(data)} bytes at {offset}"


def damage_header(folder, chance):
    return damage_bytes(os.path.join(folder, "impactd.db"), 0, 100, chance)


def damage_page(folder, chance):
    path = os.path.join(folder, "impactd.db")
    return damage_bytes(path, 100, os.path.getsize(path), chance)


def damage_page_heads(folder, chance):
    """The head of a page and the places of its cells."""
    path = os.path.join(folder, "impactd.db")
    page = chance.randrange(1, os.path.getsize(path) // PAGE)
    return damage_bytes(path, page * PAGE, page * PAGE + 40, chance)


def damage_swap(folder, chance):
    """A page has the bytes of another one, as after a write that went astray."""
    path = os.path.join(folder, "impactd.db")
    pages = os.path.getsize(path) // PAGE
    source, target = chance.randrange(pages), chance.randrange(1, pages)
    with open(path, "rb") as file:
        file.seek(source * PAGE)
        data = file.read(PAGE)
    overwrite(path, target * PAGE, data)
    return f"page {source + 1} over page {target + 1}"


def damage_cut(folder, chance):
    path = os.path.join(folder, "impactd.db")
    size = chance.randrange(0, os.path.getsize(path))
    os.truncate(path, size)
    return f"cut to {size} bytes"


def damage_wal(folder, chance):
    path = os.path.join(folder, "impactd.db-wal")
    size = os.path.getsize(path)
    if chance.random() < 0.2:
        size = chance.randrange(size)
        os.truncate(path, size)
        return f"cut to {size} bytes"
    return damage_bytes(path, 0, 32 if chance.random() < 0.2 else size, chance)


def varint(data, at):
    """SQLite's: (value, behind it)."""
    value = 0
    for number in range(9):
        value = value << 7 | (data[at + number] & 0x7F)
        if not data[at + number] & 0x80:
            return value, at + number + 1
    return value, at + 9


def damage_index(folder, chance):
    """An entry of an index leads to the row of its neighbour."""
    path = os.path.join(folder, "impactd.db")
    connection = sqlite3.connect(path)
    roots = connection.execute("SELECT name, rootpage FROM sqlite_schema WHERE type = 'index' AND rootpage > 0 ORDER BY rootpage").fetchall()
    connection.close()
    with open(path, "rb") as file:
        data = bytearray(file.read())
    leaves = []
    for name, root in roots:
        start = (root - 1) * PAGE
        count = int.from_bytes(data[start + 3:start + 5], "big")
        if data[start] == 10 and count > 1:
            leaves.append((name, start, count))
    name, start, count = chance.choice(leaves)
    chosen = chance.randrange(count - 1)
    ends = []
    for number in (chosen, chosen + 1):
        cell = start + int.from_bytes(data[start + 8 + 2 * number:start + 10 + 2 * number], "big")
        size, payload = varint(data, cell)
        ends.append(payload + size - 1)  # the last byte of the row's number
    data[ends[0]] = data[ends[1]]
    with open(path, "wb") as file:
        file.write(data)
    return f"{name}, entry {chosen}"


CLOSED = (damage_header, damage_page, damage_page, damage_page_heads, damage_swap, damage_cut, damage_index, damage_index)


def lacks(answer, right, key=None):
    """Whether an answer is the right one without rows that a damaged index no longer leads to, or with marks on damaged ones."""
    if isinstance(answer, dict) and isinstance(right, dict):
        is_marked = answer.get("status") == "failed" and "damaged" in json.dumps(answer.get("problem"))
        return is_marked or all(name == "result_deleted" or (name in right and lacks(value, right[name], name)) for name, value in answer.items())
    if isinstance(answer, list) and isinstance(right, list):
        return all(any(lacks(one, other) for other in right) for one in answer)
    # Without its reviews a revision is a draft.
    return answer == right or answer is None or (key == "count" and answer < right) or (key == "status" and answer == "draft")


def is_right(target, answer, right, is_wal):
    """Whether it may be served: what belongs to a result only whole, of others rows may be missing."""
    status, etag, kind, body = answer
    if status != 200:
        return status in REFUSED and kind == "application/problem+json"
    if answer == right or (is_wal and (etag is None or etag != right[1])):
        return True
    if target.startswith("/v1/results/") and (not target.endswith("/manifest") or etag == right[1]):
        return False
    return "json" in kind and lacks(json.loads(body), json.loads(right[3]))


def read_all(daemon, targets, right, is_wal, counts):
    """The targets that were answered wrongly, and whether any answer was not the right one."""
    wrong, is_found = [], False
    for target in targets:
        answer = read(daemon, target)
        counts["right" if answer == right[target] else "refused" if answer[0] != 200 else "older"] += 1
        is_found = is_found or answer != right[target]
        if not is_right(target, answer, right[target], is_wal):
            wrong.append((target, answer[:3], answer[3][:300], right[target][3][:300]))
    return wrong, is_found


def one_copy(folder, targets, right, damage, chance, is_wal, counts):
    """Damages a copy and reads it; None, or what was wrong."""
    work = tempfile.mkdtemp(prefix="impactd-")
    try:
        copy, second = os.path.join(work, "a"), os.path.join(work, "b")
        shutil.copytree(folder, copy)
        what = f"{damage.__name__}: {damage(copy, chance)}"
        shutil.copytree(copy, second)
        found = False
        daemon = program.Daemon(program.build, *OPTIONS, data=copy)
        try:
            daemon.start()
        except RuntimeError as fault:
            counts["not started"] += 1
            if "impactd serve:" not in str(fault) and "impactd:" not in str(fault):
                return f"{what}: does not start, without a reason: {fault}"
            found = True
        else:
            try:
                wrong, found = read_all(daemon, targets, right, is_wal, counts)
                if wrong:
                    return f"{what}: wrong answers: {wrong[0]} and {len(wrong) - 1} more"
                if not daemon.is_alive():
                    return f"{what}: the daemon ended: {daemon.stderr()[-1000:]}"
                code, _ = daemon.stop(60)
                if code != 0 or program.sanitizer_report(daemon.stderr()):
                    return f"{what}: ended with {code}: {daemon.stderr()[-1000:]}"
            except (OSError, ValueError, subprocess.TimeoutExpired) as fault:
                return f"{what}: {fault!r}; {daemon.is_alive()}: {daemon.stderr()[-1000:]}"
            finally:
                daemon.kill()
        checked = subprocess.run([program.impactd(), "check-db", "--data", second], capture_output=True, text=True, errors="replace", timeout=60, check=False)
        counts["check-db finds it"] += checked.returncode != 0
        if checked.returncode < 0:
            return f"{what}: check-db ended by {signal.Signals(-checked.returncode).name}"
        if found and not is_wal and checked.returncode == 0:
            return f"{what}: readers found damage, check-db did not"
        return None
    finally:
        shutil.rmtree(work, ignore_errors=True)


def run(copies, seed, only=None):
    """Damages that many copies: (faults, counts)."""
    chance, counts, faults = random.Random(seed), collections.Counter(), []
    with tempfile.TemporaryDirectory() as work:
        bases = []
        for name, with_wal in (("closed", False), ("wal", True)):
            folder = os.path.join(work, name)
            targets = fill(folder, with_wal)
            bases.append((folder, targets, expected(folder, targets)))
        for number in range(copies):
            is_wal = number % 5 == 4
            folder, targets, right = bases[is_wal]
            damage = only or (damage_wal if is_wal else CLOSED[(number - number // 5) % len(CLOSED)])
            fault = one_copy(folder, targets, right, damage, chance, is_wal, counts)
            counts[damage.__name__] += 1
            if fault:
                faults.append(f"copy {number}, {fault}")
                print(faults[-1], flush=True)
    return faults, counts


def has_tried(counts):
    """The damage was met, and did not take everything with it."""
    return counts["right"] > 0 and counts["refused"] > 0 and counts["check-db finds it"] > 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--build", required=True)
    parser.add_argument("--copies", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    faults, counts = run(arguments.copies, arguments.seed)
    print(", ".join(f"{count} {name.replace('damage_', '')}" for name, count in counts.items() if name.startswith("damage_")))
    print(f"{arguments.copies} damaged copies: {counts['not started']} not started, with the reason; {counts['right']} answers right, {counts['refused']} "
          f"refused, {counts['older']} of an earlier state or lists with a mark; check-db finds {counts['check-db finds it']}; {len(faults)} wrong")
    sys.exit(0 if not faults and has_tried(counts) else 1)


if __name__ == "__main__":
    main()
