#!/usr/bin/env python3
"""One result in every format, read back by NumPy, scipy.io and Octave: the same bits. Windows, ranges and conditions
hold for all of them; an impact's detail meets the ledger; the bundle explains itself."""

import io
import json
import os
import random
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree
import zipfile

import numpy as np
import scipy.io

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

FORMATS = ("json", "csv", "npy", "npz", "mat")
BINARY = ("npy", "npz", "mat")
SVG = "{http://www.w3.org/2000/svg}"
AXES = {"series": "time", "psd": "frequency", "force": "time"}


def same(a, b):
    """Bit by bit; one NaN is as good as another."""
    a, b = np.ascontiguousarray(a, dtype=np.float64).ravel(), np.ascontiguousarray(b, dtype=np.float64).ravel()
    return a.shape == b.shape and (np.where(np.isnan(a), np.nan, a).tobytes()
                                   == np.where(np.isnan(b), np.nan, b).tobytes())


def get(daemon, path, **options):
    reply = daemon.request("GET", path, **options)
    assert reply.status == 200, (path, reply)
    return reply


def csv_columns(body):
    """{name: numbers} and the units in the header."""
    lines = body.decode().splitlines()
    names = [name.partition(" [") for name in lines[0].split(",")]
    rows = np.array([[float(cell or "nan") for cell in line.split(",")] for line in lines[1:]]).reshape(-1, len(names))
    return {name: rows[:, i] for i, (name, _, _) in enumerate(names)}


def mat_columns(body):
    read = scipy.io.loadmat(io.BytesIO(body))
    for name, value in read.items():
        assert name.startswith("__") or value.shape[1] == 1, (name, value.shape)
    return {name: value[:, 0] for name, value in read.items() if not name.startswith("__")}


def npz_columns(body):
    with np.load(io.BytesIO(body)) as archive:
        return {name: archive[name] for name in archive}


def json_columns(document, axis):
    columns = {}
    if axis in document:
        columns[axis] = document[axis]["values"]
    else:
        step = document.get("bucket", 1)
        first = round(document["start"] * document["sample_rate"])
        columns[axis] = (first + step * np.arange(document["count"])) / document["sample_rate"]
    for name, channel in document["channels"].items():
        if "values" in channel:
            columns[name] = channel["values"]
        else:
            columns[name + "_min"], columns[name + "_max"] = channel["min"], channel["max"]
    return columns


def octave(files):
    """{file: {name: column}} as Octave reads them, through its own binary writer."""
    if shutil.which("octave-cli") is None:
        raise program.Skipped("Octave is not here")
    with tempfile.TemporaryDirectory() as folder:
        script = ""
        for i, body in enumerate(files):
            with open(os.path.join(folder, f"{i}.mat"), "wb") as file:
                file.write(body)
            script += f"""
x = load('{folder}/{i}.mat'); names = fieldnames(x);
for k = 1:numel(names)
  f = fopen(sprintf('{folder}/{i}.%s.bin', names{{k}}), 'w'); fwrite(f, x.(names{{k}}), 'double'); fclose(f);
end
"""
        # Octave may stumble while it leaves; what counts is what it wrote.
        subprocess.run(["octave-cli", "--no-gui", "--norc", "--quiet", "--eval", script], stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL, timeout=120, check=False)
        read = [{} for _ in files]
        for name in os.listdir(folder):
            if name.endswith(".bin"):
                number, variable, _ = name.split(".")
                read[int(number)][variable] = np.fromfile(os.path.join(folder, name))
        return read


def finished(daemon, scene):
    return "/v1/results/" + program.finished(daemon, scene)["result"]


def bodies(daemon, path, query=""):
    return {form: get(daemon, f"{path}.{form}{query}").body for form in FORMATS}


def agree(read, axis, what):
    """All formats hold the same; returns the columns."""
    columns = json_columns(json.loads(read["json"]), axis)
    for form, other in (("csv", csv_columns(read["csv"])), ("npz", npz_columns(read["npz"])),
                        ("mat", mat_columns(read["mat"]))):
        assert set(other) == set(columns), (what, form, set(other) ^ set(columns))
        for name, values in columns.items():
            assert same(other[name], values), (what, form, name)
    table = np.load(io.BytesIO(read["npy"]))
    order = list(csv_columns(read["csv"]))
    assert order[0] == axis and table.shape == (len(columns[axis]), len(columns)), (what, table.shape)
    for i, name in enumerate(order):
        assert same(table[:, i], columns[name]), (what, "npy", name)
    return columns


def test_every_format_reads_back_to_the_same_bits():
    """Series, windows of them, spectra, one impact: NumPy, scipy.io and JSON read the same doubles."""
    with program.daemon() as daemon:
        for name in ("paper_random_sponge", "frame_two_dampers"):
            base = finished(daemon, program.scene(name))
            agree(bodies(daemon, f"{base}/series"), "time", name)
            agree(bodies(daemon, f"{base}/series", "?from=1.5&to=2.25"), "time", name)
            agree(bodies(daemon, f"{base}/series", "?points=77"), "time", name)
            agree(bodies(daemon, f"{base}/psd"), "frequency", name)
            agree(bodies(daemon, f"{base}/impacts/7/force"), "time", name)


def test_octave_reads_what_numpy_reads():
    """The MAT files of series, psd, impacts, energy and one impact, read by Octave, are what scipy reads."""
    with program.daemon() as daemon:
        base = finished(daemon, program.scene("paper_random_sponge"))
        files = [get(daemon, f"{base}/{part}.mat").body
                 for part in ("series", "psd", "impacts", "energy", "impacts/3/force")]
        for read, body in zip(octave(files), files):
            expected = mat_columns(body)
            assert set(read) == set(expected) and expected, (set(read), set(expected))
            for name, values in expected.items():
                assert same(read[name], values), name


def test_ledgers_are_columns_of_numbers():
    """impacts and energy as csv, npy, npz and mat hold what their JSON holds; kinds and sides are numbers, null is NaN."""
    with program.daemon() as daemon:
        base = finished(daemon, program.scene("contact_hunt_crossley_textbook"))
        impacts = get(daemon, f"{base}/impacts.json").json()["impacts"]
        assert impacts[-1]["end"] is None
        words = {"kind": ["impact", "resting"], "side": ["left", "right"]}
        expected = {name: [np.nan if row[name] is None else words[name].index(row[name]) if name in words else row[name]
                           for row in impacts] for name in impacts[0]}
        table = np.load(io.BytesIO(get(daemon, f"{base}/impacts.npy").body))
        for form, columns in (("npz", npz_columns), ("mat", mat_columns)):
            read = columns(get(daemon, f"{base}/impacts.{form}").body)
            assert list(read) == list(expected), (form, list(read))
            for i, (name, values) in enumerate(expected.items()):
                assert same(read[name], values) and same(table[:, i], values), (form, name)
        header = get(daemon, f"{base}/impacts.csv").body.decode().splitlines()[0]
        assert [name.partition(" [")[0] for name in header.split(",")] == list(expected), header

        energy = get(daemon, f"{base}/energy.json").json()
        assert energy.pop("unit") == "J"
        for read in (csv_columns(get(daemon, f"{base}/energy.csv").body), npz_columns(get(daemon, f"{base}/energy.npz").body),
                     mat_columns(get(daemon, f"{base}/energy.mat").body)):
            assert {name: float(value[0]) for name, value in read.items()} == energy, read
        assert same(np.load(io.BytesIO(get(daemon, f"{base}/energy.npy").body)), list(energy.values()))


def test_a_result_links_to_what_it_has():
    """Every link of a result answers; without psd and ledger none leads there, and asking says why."""
    with program.daemon() as daemon:
        for name, output, without in (("paper_free_sponge", None, ()), ("contact_hunt_crossley_textbook", {"psd": None}, ("psd",)),
                                      ("paper_free_sponge", {"psd": None, "impacts": False}, ("psd", "impacts", "force"))):
            scene = program.scene(name)
            scene = scene if output is None else {**scene, "output": output}
            base = finished(daemon, scene)
            links = get(daemon, base).json()["links"]
            for link, path in links.items():
                assert link.partition(".")[0] not in without, (name, link)
                get(daemon, path.replace("{number}", "1"))
            for part in ("series", "psd", "impacts", "energy"):
                for form in FORMATS:
                    named = part if form == "json" else f"{part}.{form}"
                    assert (named in links) == (part not in without), (name, named)
                    assert named in links or daemon.get(f"{base}/{part}.{form}").status == 404, named
            assert ("force" in links) == ("force" not in without), name


def test_windows_keep_their_peaks():
    """Decimated windows say so, cover the window, and have exactly its extremes; one bucket for each sample at most."""
    with program.daemon() as daemon:
        base = finished(daemon, program.scene("paper_random_sponge"))
        whole = npz_columns(get(daemon, f"{base}/series.npz").body)
        dice = random.Random(5)
        for _ in range(100):
            first = dice.randrange(len(whole["time"]))
            last = dice.randrange(first, len(whole["time"]))
            points = dice.choice((1, 2, 10, 333, 10**6))
            start, end = (float(whole["time"][i]) for i in (first, last))
            window = f"?from={start!r}&to={end!r}&points={points}"
            answer = get(daemon, f"{base}/series.json{window}&channels=displacement,contact_force").json()
            samples = last - first + 1
            assert answer["samples"] == samples and answer["start"] == start, answer
            assert answer["count"] <= points and answer["bucket"] == -(-samples // points), answer
            for name in ("displacement", "contact_force"):
                values = whole[name][first:last + 1]
                low, high = answer["channels"][name]["min"], answer["channels"][name]["max"]
                assert len(low) == len(high) == answer["count"]
                assert min(low) == values.min() and max(high) == values.max(), (window, name)
        for points in ("0", "-1", "1.5", "x", ""):
            reply = daemon.request("GET", f"{base}/series.json?points={points}")
            assert reply.status == 400 and "points" in reply.json()["detail"], reply


def test_conditions_and_ranges_hold_for_every_format():
    """Strong ETag, 304, HEAD; on binary formats Range, If-Range and 416, also where they are long enough for a stream."""
    with program.daemon() as daemon:
        base = finished(daemon, program.scene("paper_random_sponge"))
        long = program.scene("paper_random_sponge")
        long.update(duration=150)
        paths = [f"{base}/{part}.{form}" for part in ("series", "psd", "impacts", "energy", "impacts/2/force")
                 for form in FORMATS]
        paths += [f"{finished(daemon, long)}/series.{form}" for form in (*FORMATS, "svg")]
        paths += [f"{base}/psd.svg"]
        paths += [f"{base}/bundle.zip"]
        dice = random.Random(6)
        tags = set()
        for path in paths:
            reply = get(daemon, path)
            tag, body = reply.headers["etag"], reply.body
            assert tag.startswith('"') and tag not in tags, (path, tag)
            tags.add(tag)
            assert reply.headers["cache-control"] == ("no-cache" if path.endswith("zip") else
                                                      "private, max-age=31536000, immutable"), reply.headers
            assert get(daemon, path).body == body, path
            again = daemon.request("GET", path, headers={"If-None-Match": tag})
            assert again.status == 304 and again.body == b"" and again.headers["etag"] == tag, again
            head = daemon.request("HEAD", path)
            assert head.status == 200 and head.body == b"" and head.headers["etag"] == tag, head
            if path.rsplit(".", 1)[1] not in (*BINARY, "zip"):
                assert "accept-ranges" not in reply.headers
                continue
            assert reply.headers["accept-ranges"] == "bytes"
            assert int(head.headers["content-length"]) == len(body), (path, head.headers)
            for _ in range(5):
                first = dice.randrange(len(body))
                last = dice.randrange(first, len(body))
                part = daemon.request("GET", path, headers={"Range": f"bytes={first}-{last}"})
                assert part.status == 206 and part.body == body[first:last + 1], (path, first, last, part)
                assert part.headers["content-range"] == f"bytes {first}-{last}/{len(body)}", part.headers
            part = daemon.request("GET", path, headers={"Range": "bytes=-9", "If-Range": tag})
            assert part.status == 206 and part.body == body[-9:], part
            part = daemon.request("GET", path, headers={"Range": "bytes=-9", "If-Range": '"other"'})
            assert part.status == 200 and part.body == body, part
            part = daemon.request("GET", path, headers={"Range": f"bytes={len(body)}-"})
            assert part.status == 416 and part.headers["content-range"] == f"bytes */{len(body)}", part


def test_an_impact_meets_the_ledger():
    """Touch, release, peak and impulse of an impact in detail are the ledger's, for every impact of a result."""
    with program.daemon() as daemon:
        base = finished(daemon, program.scene("paper_free_sponge"))
        impacts = get(daemon, f"{base}/impacts.json").json()["impacts"]
        for number, impact in enumerate(impacts, 1):
            rows = npz_columns(get(daemon, f"{base}/impacts/{number}/force.npz?points=2001").body)
            force, at = rows["contact_force"], rows["time"]
            assert abs(np.abs(force).max() / impact["peak_force"] - 1) < 1e-9, number
            integral = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(at))
            assert impact["end"] is None or abs(integral / impact["impulse"] - 1) < 1e-6, (number, integral)
            assert abs(at[0] - impact["start"]) < 1e-12, number
            assert abs(rows["approach_speed"][0] - impact["approach_speed"]) < 1e-12, number
            if impact["end"] is not None:
                assert abs(at[-1] - impact["end"]) < 1e-12
        assert get(daemon, f"{base}/impacts/1/force.json").json()["count"] in (401, 402)
        for path in ("0", "23", "x", "1x", "-1", "99999999999999999999"):
            reply = daemon.request("GET", f"{base}/impacts/{path}/force.json")
            assert reply.status == 404 and "impacts.json" in reply.json()["detail"], reply
        assert daemon.request("GET", f"{base}/impacts/1/force.json?points=4").status == 400
        base = finished(daemon, program.scene("paper_free_impulse_sponge"))
        reply = daemon.request("GET", f"{base}/impacts/1/force.json")
        assert reply.status == 404 and "impulse" in reply.json()["detail"], reply
        quiet = program.scene("paper_free_sponge")
        quiet["output"] = {"impacts": False}
        reply = daemon.request("GET", f"{finished(daemon, quiet)}/impacts/1/force.json")
        assert reply.status == 404 and "ledger" in reply.json()["detail"], reply


def test_a_window_of_the_ledger():
    """from, to, first and limit take out the rows of the whole ledger that meet them, in every format."""
    with program.daemon() as daemon:
        for name in ("paper_free_sponge", "contact_hunt_crossley_textbook", "paper_free_impulse_sponge"):
            base = finished(daemon, program.scene(name))
            whole = get(daemon, f"{base}/impacts.json").json()
            rows = [dict(row, number=number) for number, row in enumerate(whole["impacts"], 1)]
            assert "matching" not in whole and len(rows) > 4
            a, b = rows[2]["start"], rows[-3]["end"]
            for query, start, end, first, limit in (
                    ("first=1", 0, 1e9, 1, 1e9), ("from=0", 0, 1e9, 1, 1e9), (f"from={a!r}&to={b!r}", a, b, 1, 1e9),
                    (f"to={a!r}", 0, a, 1, 1e9), (f"from={b!r}&limit=1", b, 1e9, 1, 1), ("first=3&limit=2", 0, 1e9, 3, 2),
                    (f"from={a!r}&first=4&limit=1000", a, 1e9, 4, 1000), ("from=1e9", 1e9, 1e9, 1, 1e9)):
                met = [row for row in rows if row["start"] <= end and (row["end"] is None or row["end"] >= start)]
                wanted = [row for row in met if row["number"] >= first][:int(limit)]
                part = get(daemon, f"{base}/impacts.json?{query}").json()
                assert part == {"count": whole["count"], "resting": whole["resting"], "impacts": wanted,
                                "matching": len(met)}, (name, query, part)
                numbers = npz_columns(get(daemon, f"{base}/impacts.npz?{query}").body)
                assert same(numbers["start"], [row["start"] for row in wanted]) and "number" not in numbers, (name, query)
                lines = get(daemon, f"{base}/impacts.csv?{query}").body.decode().splitlines()
                assert len(lines) == 1 + len(wanted), (name, query)
            for query in ("from=-1", "from=2&to=1", "limit=0", "first=0", "from=x", "points=3"):
                reply = daemon.request("GET", f"{base}/impacts.json?{query}")
                assert reply.status == 400, (query, reply)


def test_a_long_scene_is_looked_at_beside_the_jobs():
    """Where the run again takes long, the request sleeps; a client that leaves stops it; the daemon ends well meanwhile."""
    with program.daemon() as daemon:
        scene = program.scene("paper_random_sponge")
        scene.update(duration=1000, output={"channels": [], "psd": None})
        base = finished(daemon, scene)
        impact = get(daemon, f"{base}/impacts.json").json()["impacts"][2999]
        rows = npz_columns(get(daemon, f"{base}/impacts/3000/force.npz").body)
        assert abs(np.abs(rows["contact_force"]).max() / impact["peak_force"] - 1) < 1e-9, impact
        # More than may run at once: each gives its place back when its client has gone.
        for number in range(1, 7):
            with socket.create_connection((daemon.host, daemon.port)) as client:
                client.sendall(f"GET {base}/impacts/{number}/force.npz HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
                time.sleep(0.02)
        end = time.monotonic() + 60
        while daemon.request("GET", f"{base}/impacts/8/force.npz").status == 503:
            assert time.monotonic() < end
            time.sleep(0.1)
        client = socket.create_connection((daemon.host, daemon.port))
        client.sendall(f"GET {base}/impacts/9/force.npz HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        time.sleep(0.02)
    client.close()


def test_the_bundle_explains_itself():
    """bundle.zip holds the documents and numbers that the endpoints give, and says how to cite."""
    with program.daemon() as daemon:
        base = finished(daemon, program.scene("paper_free_sponge"))
        archive = zipfile.ZipFile(io.BytesIO(get(daemon, f"{base}/bundle.zip").body))
        assert archive.testzip() is None
        assert archive.namelist() == ["README.txt", "scene.json", "result.json", "manifest.json", "series.npz",
                                      "psd.json", "psd.csv", "impacts.csv"], archive.namelist()
        for name, path in (("result.json", ""), ("manifest.json", "/manifest"), ("series.npz", "/series.npz"),
                           ("psd.json", "/psd.json"), ("psd.csv", "/psd.csv"), ("impacts.csv", "/impacts.csv")):
            assert archive.read(name) == get(daemon, base + path).body, name
        result = get(daemon, base).json()
        assert json.loads(archive.read("scene.json")) == result["scene"]
        text = archive.read("README.txt").decode()
        for words in ("doi:10.1002/stc.238", result["id"], result["engine"], "UNITS"):
            assert words in text, (words, text)
        assert result["links"]["force"] == base + "/impacts/{number}/force.json"
        for name, link in result["links"].items():
            link = link.replace("{number}", "1")
            assert daemon.request("GET", link).status == 200, (name, link)
        bare = program.scene("paper_free_sponge")
        bare["output"] = {"impacts": False, "psd": None}
        names = zipfile.ZipFile(io.BytesIO(get(daemon, finished(daemon, bare) + "/bundle.zip").body)).namelist()
        assert "psd.csv" not in names and "impacts.csv" not in names, names


def test_summary_has_the_reduction_by_the_dampers():
    """output.reduction, by default true where there are dampers: 1 - with over without dampers; nothing else changes."""
    with program.daemon() as daemon:
        names = ("peak_displacement", "rms_displacement", "peak_acceleration", "rms_acceleration", "peak_base_shear")
        scene, bare = program.scene("paper_random_sponge"), program.scene("paper_random_sponge")
        bare["dampers"] = []
        bare["output"] = {"channels": [], "psd": None}
        asked = program.finished(daemon, scene)
        scene["output"] = {**scene.get("output", {}), "reduction": True}
        assert program.finished(daemon, scene)["result"] == asked["result"]
        scene["output"]["reduction"] = False
        plain = program.finished(daemon, scene)
        assert asked["result"] != plain["result"]
        without = program.finished(daemon, bare)["summary"]
        for name in names:
            assert name + "_reduction" not in plain["summary"] and name + "_reduction" not in without
            assert asked["summary"][name] == plain["summary"][name]
            assert asked["summary"][name + "_reduction"] == 1 - plain["summary"][name] / without[name], name
        bare["output"]["reduction"] = True
        assert program.finished(daemon, bare)["summary"] == without
        sweep = {"kind": "sweep", "axes": [{"pointer": "/dampers/0/clearance", "values": [0.005, 0.01]}]}
        assert program.finished(daemon, {**scene, "study": sweep})["status"] == "successful"
        result = get(daemon, "/v1/results/" + asked["result"]).json()
        assert result["scene"]["output"]["reduction"] is True and result["summary"] == asked["summary"]
        rows = npz_columns(get(daemon, f"/v1/results/{asked['result']}/impacts/100/force.npz").body)
        impact = get(daemon, f"/v1/results/{asked['result']}/impacts.json").json()["impacts"][99]
        assert abs(np.abs(rows["contact_force"]).max() / impact["peak_force"] - 1) < 1e-9
        dry = [daemon.request("POST", "/v1/jobs?dry_run=1", json=json_scene).json()["cost"]["cpu_seconds"]
               for json_scene in (program.scene("paper_random_sponge"), scene)]
        assert dry[0] > dry[1], dry


def chart_of(reply):
    """The frames of a chart, top to bottom as (top, height), and the coordinates of each line by its name."""
    assert reply.headers["content-type"] == "image/svg+xml" and len(reply.body) < 400000
    assert reply.headers["content-security-policy"].startswith("default-src 'none'; style-src 'unsafe-inline'; ")
    text = reply.body.decode()
    assert "nan" not in text and "inf" not in text and "<script" not in text and "prefers-color-scheme: dark" in text
    root = xml.etree.ElementTree.fromstring(text)
    frames = [(float(one.get("y")), float(one.get("height"))) for one in root.iter(SVG + "rect") if one.get("class") == "frame"]
    lines = {one.find(SVG + "title").text: np.array(re.findall(r"[ML](\S+?) ([^ML]+)", one.get("d")), dtype=float)
             for one in root.iter(SVG + "path") if one.find(SVG + "title") is not None}
    return root, frames, lines


def test_series_and_spectra_are_drawn():
    """A panel for each unit and a line for each channel, whose extremes are those of the samples; a window of them alone;
    spectra; what has no chart has none."""
    with program.daemon() as daemon:
        scene = program.scene("paper_random_sponge")
        scene["duration"] = 60
        base = finished(daemon, scene)
        for query in ("", "?from=20.5&to=31", "?points=5000"):
            rows = csv_columns(get(daemon, f"{base}/series.csv{query.partition('?points')[0]}").body)
            _, frames, lines = chart_of(get(daemon, f"{base}/series.svg{query}"))
            assert set(lines) == set(rows) - {"time"}, (set(lines), set(rows))
            assert len(frames) == 4 and all(100 < len(line) <= 1600 for line in lines.values())
            alone = [("velocity", 1), ("acceleration", 2), ("contact_force", 3)]
            for name, panel in alone:  # 5 % of the range are free above and below
                top, height = frames[panel]
                span = height / 1.1
                ends = (top + height / 2 - span / 2, top + height / 2 + span / 2)
                assert np.allclose((lines[name][:, 1].min(), lines[name][:, 1].max()), ends, atol=0.11), (query, name)
        _, frames, lines = chart_of(get(daemon, f"{base}/series.svg?channels=contact_force"))
        assert len(frames) == 1 and list(lines) == ["contact_force"]
        root, frames, lines = chart_of(get(daemon, f"{base}/psd.svg"))
        assert len(frames) == 1 and list(lines) == ["mean_acceleration"]
        texts = [one.text for one in root.iter(SVG + "text")]
        assert "mean_acceleration [(m/s^2)^2/Hz]" in texts and "frequency [Hz]" in texts, texts
        for part in ("series", "psd"):
            asked = get(daemon, f"{base}/{part}", headers={"Accept": "image/svg+xml"})
            assert asked.body == get(daemon, f"{base}/{part}.svg").body and "Accept" in asked.headers["vary"]
            refused = daemon.get(f"{base}/{part}.xml")
            assert refused.status == 404 and "json, csv, npy, npz, mat, svg" in refused.json()["detail"]
        for part in ("impacts", "energy", "impacts/1/force"):
            assert daemon.get(f"{base}/{part}.svg").status == 404


def test_the_command_writes_every_format():
    """impactd run -o OUT.{csv,npy,npz,mat,svg} writes what the daemon answers."""
    with program.daemon() as daemon, tempfile.TemporaryDirectory() as folder:
        base = finished(daemon, program.scene("paper_free_sponge"))
        for form in (*FORMATS[1:], "svg"):
            path = os.path.join(folder, "out." + form)
            code, _, errors = program.run("run", os.path.join(program.EXAMPLES, "paper_free_sponge.json"), "-o", path)
            assert code == 0, errors
            with open(path, "rb") as file:
                assert file.read() == get(daemon, f"{base}/series.{form}").body, form


if __name__ == "__main__":
    program.main(globals())
