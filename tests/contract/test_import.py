#!/usr/bin/env python3
"""impactd import: ground motions in their layouts become excitations that run; bad files are named."""

import json
import os
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

SANITIZED = True
RECORDS = os.path.join(program.SOURCE, "..", "shared", "data", "records")
G = 9.80665
HEADER = ("PEER STRONG MOTION DATABASE RECORD\nSOMEWHERE, STATION 7, 090\n"
          "ACCELERATION TIME HISTORY IN UNITS OF G\nNPTS= 4, DT= .01000 SEC\n")
# What else must be said, layout, samples, interval, peak in the file's unit and its size in m/s^2.
PUBLISHED = {
    "elcentro1940_array9_180_IELC180.AT2": ((), "at2", 4000, 0.01, 0.312881, G),
    "elcentro1940_RSN6_I-ELC180_NGA2.AT2": ((), "at2", 5372, 0.01, 0.280795, G),
    "elcentro1940_NS_peknold.AT2": ((), "at2", 1559, 0.02, 0.318820, G),
    "elcentro1940_NS_peknold_nonstandard_header.at2": ((), "at2", 1559, 0.02, 0.318820, G),
    "elcentro1940_NS_peknold_8F10.5.dat":
        (("--interval", "0.02", "--unit", "g"), "columns", 1559, 0.02, 0.318820, G),
    "northridge1994_castaic_090_time_accel.dat": ((), "time_acceleration", 3989, 0.01, 0.5683, G),
    "northridge1994_arleta_360_ARL360.AT2": ((), "at2", 2000, 0.02, 0.308057, G),
    "capemendocino1992_riodell_270_RIO270.AT2": ((), "at2", 1800, 0.02, 0.385420, G),
    "aqaba1995_hadera_NS_lowercase_dt.AT2": ((), "at2", 12000, 0.005, 0.013655, G),
    "tabas1978_FN_one_column_dt0.02.txt":
        (("--interval", "0.02", "--unit", "g"), "one_column", 2500, 0.02, 0.899949, G),
    "kobe1995_nishiakashi_NIS090.AT2": ((), "at2_value_first", 4096, 0.01, 0.502749, G),
    "eqsig_test_motion_dt0p01.txt": (("--unit", "m/s^2"), "count_line", 4684, 0.01, 1.41, 1),
}


def imported(text, *arguments):
    code, out, errors = program.run("import", "-", *arguments, text=text)
    assert code == 0, errors
    return json.loads(out), errors


def test_published_records_have_their_counts_and_peaks():
    """The twelve published files have the counts, intervals and peaks of their list, without a doubt."""
    if not os.path.isdir(RECORDS):
        raise program.Skipped("the published records are not here")
    for name, (arguments, layout, count, interval, peak, unit) in PUBLISHED.items():
        code, out, errors = program.run("import", os.path.join(RECORDS, name), *arguments)
        assert code == 0, errors
        excitation = json.loads(out)
        assert excitation["kind"] == "record" and excitation["interval"] == interval, (name, excitation)
        assert len(excitation["samples"]) == count, (name, len(excitation["samples"]))
        largest = max(map(abs, excitation["samples"])) / unit
        assert abs(largest - peak) <= 5.01e-7, (name, largest)
        assert f": {layout}, {count} samples" in errors and "warning" not in errors, errors


def test_an_import_runs_in_a_scene():
    """What is printed is an excitation as it stands, and -o writes the same."""
    excitation, errors = imported(HEADER + " .1 -.2\n .3 -.1\n")
    assert "at2, 4 samples, interval 0.01 s, duration 0.03 s; unit g" in errors, errors
    assert "peak 2.94199 m/s^2 (0.3 g) at 0.02 s" in errors, errors
    assert excitation["source"].startswith("standard input: PEER STRONG MOTION"), excitation
    scene = program.scene("record_inline")
    scene["excitation"] = excitation
    code, out, errors = program.run("run", "-", text=json.dumps(scene))
    assert code == 0, errors
    with tempfile.TemporaryDirectory() as folder:
        path, target = os.path.join(folder, "motion.AT2"), os.path.join(folder, "motion.json")
        with open(path, "w", encoding="utf-8") as file:
            file.write(HEADER + " .1 -.2\n .3 -.1\n")
        code, out, _ = program.run("import", path, "-o", target)
        assert code == 0 and out == ""
        with open(target, encoding="utf-8") as file:
            written = json.load(file)
        assert written.pop("source").startswith("motion.AT2: PEER")
        excitation.pop("source")
        assert written == excitation


def test_the_source_changes_no_result():
    """Equal motions from different files are one result."""
    scene = program.scene("record_inline")
    results = []
    for source in ("here", "there"):
        scene["excitation"]["source"] = source
        code, out, errors = program.run("check", "-", "--json", text=json.dumps(scene))
        assert code == 0, errors
        results.append(json.loads(out)["result"])
    assert results[0] == results[1]


def test_doubts_are_told():
    """A unit that is taken, another one than the file's, a drift, a size: warnings on stderr."""
    _, errors = imported("NPTS= 2, DT= 1\n1 -1\n")
    assert "warning: the file states no unit, g is assumed" in errors, errors
    _, errors = imported(HEADER + "1 -1 2 -2\n", "--unit", "m/s^2")
    assert "warning: the file states g, m/s^2 is used" in errors, errors
    _, errors = imported(HEADER + "1 -1 2 -2\n", "--scale", "10")
    assert "more than 5 g" in errors, errors
    _, errors = imported(HEADER + ".1 -.1 .3 .1\n")
    assert "baseline" in errors, errors


def test_bad_files_are_named():
    """Line and column, the value and what would be right; exit code 3, 4 where there is no file."""
    for text, arguments, expected in [
            (HEADER + " .1 -.2\n .3\n", (), "-: line 4: must state how many values follow: states 4, but 3 follow"),
            (HEADER + " .1 -.2\n .3-.1\n", (), "line 6, column 2: must be one number; these have run together"),
            (HEADER + " .1 -.2\n *** -.1\n", (), "line 6, column 2: must be a number; stars"),
            ("1\n2\n", ("--unit", "g"), "line 1: must state the interval"),
            ("1\n2\n", ("--interval", "1"), "line 1: must state the unit"),
            ("\0\0", (), "byte 0x00"),
            ("", (), "line 1: must hold a line of numbers"),
            (HEADER + ".1 -.1 .3 .1\n", ("--scale", "1e308"), "must leave every sample finite")]:
        code, out, errors = program.run("import", "-", *arguments, text=text)
        assert code == 3 and out == "" and expected.replace("-: ", "standard input: ") in errors, (text, errors)
    code, _, errors = program.run("import", "/nowhere/motion.AT2")
    assert code == 4 and "cannot be read" in errors
    code, _, errors = program.run("import", "/dev/zero")
    assert code == 3 and "larger than" in errors
    for arguments in ((), ("a", "b"), ("-", "--unit", "ft/s^2"), ("-", "--interval", "0")):
        code, _, errors = program.run("import", *arguments)
        assert code == 2 and "impactd help import" in errors, errors


if __name__ == "__main__":
    program.main(globals())
