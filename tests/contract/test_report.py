#!/usr/bin/env python3
"""What `run` and the studies print on a terminal, and the page that -o report.html writes."""

import html.parser
import json
import os
import re
import sys
import tempfile
import xml.etree.ElementTree as tree

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

SPONGE = os.path.join(program.EXAMPLES, "paper_free_sponge.json")
BRAILLE = re.compile("[\u2801-\u28ff]")
ESCAPE = "\033"


def widest(text):
    return max(len(line) for line in text.split("\n"))


def digits(value):
    return f"{value:.6g}"


def words_of(text):
    return set(re.split(r"[\s,;()]+", text))


def test_run_prints_the_numbers_of_its_json_within_the_terminal():
    """Six digits of the JSON's numbers, the damper's effect in words, charts; no line is wider than the terminal."""
    code, out = program.on_terminal("run", SPONGE)
    job = json.loads(program.run("run", SPONGE)[1])
    summary, found = job["summary"], words_of(out)
    assert code == 0 and widest(out) <= 80 and out.count("\n") <= 48 and ESCAPE not in out, out
    for name in ("peak_displacement", "rms_displacement", "peak_acceleration", "rms_acceleration", "impacts", "peak_contact_force"):
        assert digits(summary[name]) in found, (name, out)
    bare = summary["rms_displacement"] / (1 - summary["rms_displacement_reduction"])
    assert {digits(bare), digits(-100 * summary["rms_displacement_reduction"])} <= found, out
    words = " ".join(out.replace(" \\\n", " ").split())
    assert "The damper lowers the rms displacement by 30.8 %, the rms acceleration by 36.3 %. Unchanged: peak displacement, peak acceleration." in words, out
    derived = job["plan"]["derived"][0]
    assert {digits(derived[name]) for name in ("restitution", "contact_time", "stiffness", "damping")} <= found, out
    assert "sponge@1" in found and "the whole run is predictable" in words and "6 of 22 impacts" in words
    assert len(BRAILLE.findall(out)) > 100 and "displacement [m] over time [s]" in out and "frequency [Hz]" in out
    assert f"Next impactd run {SPONGE} -o report.html" in words
    assert "warning:" not in out


def test_width_colour_and_characters_are_those_of_the_terminal():
    """COLUMNS and the terminal's width are kept, colour and UTF-8 are used where they are wanted alone."""
    sponge = program.scene("paper_free_sponge")
    for columns, most in ((40, 40), (57, 57), (300, 120)):
        assert most - 20 < widest(program.on_terminal("run", scene=sponge, columns=columns)[1]) <= most
    assert widest(program.on_terminal("run", scene=sponge, COLUMNS="60")[1]) <= 60
    coloured = program.on_terminal("run", SPONGE, NO_COLOR="")[1]
    assert ESCAPE in coloured and coloured.count(ESCAPE + "[0m") > 10
    dull = program.on_terminal("run", SPONGE, NO_COLOR="", TERM="dumb")[1]
    assert ESCAPE not in dull and BRAILLE.search(dull)
    plain = program.on_terminal("run", SPONGE, LC_ALL="C")[1]
    assert plain.isascii() and "displacement [m] over time [s]" in plain and plain.count("\n") <= 48


def test_a_pipe_and_json_have_the_document():
    """Without a terminal, or with --json, `run` and the studies print JSON alone."""
    study = {**program.scene("paper_free_sponge"), "duration": 1, "study": {
        "kind": "sweep", "axes": [{"pointer": "/dampers/0/clearance", "from": 0.01, "to": 0.02, "count": 3}]}}
    for words, scene in ((["run"], program.scene("paper_free_sponge")), (["sweep"], study), (["study"], study)):
        piped = json.loads(program.run(*words, "-", text=json.dumps(scene))[1])
        code, out = program.on_terminal(*words, "--json", scene=scene)
        shown = json.loads(out[out.index("{\""):])
        assert code == 0 and piped.keys() == shown.keys() and piped.get("summary") == shown.get("summary"), out
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "out.csv")
        assert program.run("sweep", "-", "-o", path, text=json.dumps(study)) == (0, "", "")
        code, out = program.on_terminal("sweep", "-o", path, scene=study)
        assert code == 0 and f"Wrote {path}" in out and "Next" not in out, out


def studies():
    """Kind, command, scene and words of a summary, in the order that they are printed."""
    free = {**program.scene("paper_free_sponge"), "duration": 2}
    clearance = {"pointer": "/dampers/0/clearance", "from": 0.01, "to": 0.03}
    yield "sweep", {**free, "study": {"kind": "sweep", "axes": [{**clearance, "count": 5}]}}, [
        "5 points", "from 0.01 to 0.03 m (5 values)", "rms displacement [m]", "smallest"]
    yield "sweep", {**free, "study": {"kind": "sweep", "axes": [
        {**clearance, "count": 5}, {"pointer": "/dampers/0/buffer", "values": ["sponge", "aluminium"]}]}}, [
        "10 points", "0.01, aluminium@1"]
    yield "ensemble", {**program.scene("paper_random_sponge"), "duration": 3, "study": {"kind": "ensemble", "runs": 8}}, [
        "8 runs in", "mean", "95 % from", "peak contact force", "frequency [Hz]"]
    yield "optimize", {**free, "study": {"kind": "optimize", "variables": [clearance], "max_candidates": 30, "objectives": [
        {"metric": "rms_displacement"}]}}, [
        "Best rms_displacement of 30 candidates: ", "than as given", "/dampers/0/clearance", "Gain", "candidate"]
    yield "optimize", {**free, "duration": 1, "study": {"kind": "optimize", "max_candidates": 10, "objectives": [{"metric": "impacts"}],
        "variables": [{"pointer": "/dampers/0/clearance", "from": 0.5, "to": 1}]}, "dampers": [{**free["dampers"][0], "clearance": 0.6}]}, [
        "Best impacts of 10 candidates: 0, the same as given."]
    yield "calibrate", program.scene("calibrate_free_sponge"), [
        "Verdict: explained", "/dampers/0/buffer/restitution", "0.6", "yes", "Residuals", "fitted", "measured"]
    yield "response", {**program.scene("response_sponge"), "study": {
        **program.scene("response_sponge")["study"], "axis": {
            "pointer": "/excitation/frequency", "from": 3, "to": 4, "count": 9}}}, [
        "largest peak", "without dampers", "stable and", "over /excitation/frequency [Hz]"]
    yield "study", {**free, "study": {"kind": "compare"}}, ["spring_damper", "impulse", "lankarani_nikravesh", "frequency [Hz]"]
    yield "study", {**free, "study": {"kind": "sensitivity"}}, ["Slopes", "contact time", "k_b [N/m]"]
    yield "tradeoff", {**free, "study": {"kind": "tradeoff", "repeats": 1, "point_steps": 1e6, "solvers": ["exact", "rk4"]}}, [
        "Recommended: exact", "CPU", "CPU time of a run [s]"]


def test_every_study_fits_a_terminal_of_80_columns():
    for kind, scene, words in studies():
        code, out = program.on_terminal(kind, scene=scene)
        assert code == 0 and widest(out) <= 80 and out.count("\n") <= 50, (kind, widest(out), out)
        assert ESCAPE not in out and ("\u2514" in out or scene["study"]["kind"] == "sensitivity"), out
        text = " ".join(out.split())
        at = 0
        for word in words:
            at = text.find(word, at)
            assert at >= 0, (kind, word, out)


class Page(html.parser.HTMLParser):
    """Checks that elements are closed in order and collects texts and addresses."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.texts, self.addresses, self.attributes = [], [], [], [], []
        self.feed(text)
        assert self.open == [], self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [name for name, _ in attrs]
        self.addresses += [value for name, value in attrs if name in ("src", "href", "xlink:href", "action", "data")]
        if tag not in ("meta", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, (tag, self.open)

    def handle_data(self, data):
        self.texts.append(data)


def check_page(path, title):
    """A page that stands alone: no address, no script, whole charts, the title as text."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    page = Page(text)
    assert page.addresses == [] and not {"script", "link", "img", "iframe", "object"} & set(page.tags), page.addresses
    assert not [name for name in page.attributes if name.startswith("on")] and "url(" not in text and "@import" not in text
    assert text.count("http") == text.count("http://www.w3.org/2000/svg"), re.findall("http.{30}", text)
    charts = re.findall(r"<svg.*?</svg>", text, re.S)
    for chart in charts:
        tree.fromstring(chart)
    assert title in page.texts and re.search(r"r-[0-9a-f]{64}", text) and "prefers-color-scheme: dark" in text
    return page, charts


def test_a_gain_over_nothing_has_no_percentage():
    """A change from zero impacts is no percentage; it is said in words."""
    code, out = program.on_terminal(
        "optimize", os.path.join(program.EXAMPLES, "optimize_clearance.json"), "--set", 'study.objectives=[{"metric":"impacts"}]',
        "--set", "dampers.0.clearance=5", "--set", "study.max_candidates=10", "--set", "study.over.runs=4", "--set", "duration=5")
    assert code == 0 and "0 as given." in out and not re.search(r"\b(nan|inf)\b", out), out


def test_reports_are_pages_that_stand_alone():
    """`run` and a study write one valid page with their numbers, charts, impacts, decisions and scene; titles are escaped."""
    title = "<script>alert(\"1 & 2\")</script>"
    scene = {**program.scene("paper_free_sponge"), "title": title}
    study = {**scene, "duration": 1, "study": {"kind": "sweep", "axes": [
        {"pointer": "/dampers/0/clearance", "from": 0.01, "to": 0.02, "count": 3}]}}
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "report.html")
        assert program.run("run", "-", "-o", path, text=json.dumps(scene))[:2] == (0, "")
        page, charts = check_page(path, title)
        assert len(charts) == 4 and page.tags.count("table") == 5, page.tags
        job = json.loads(program.run("run", "-", text=json.dumps(scene))[1])
        impacts = json.loads(program.run("run", "-", "-o", path + ".json", text=json.dumps(scene))[1] or "0")
        assert impacts == 0 and {digits(job["summary"][name]) for name in ("rms_displacement", "peak_acceleration")} <= set(page.texts)
        assert {"spring_damper", "a contact time is given", "Decisions of the plan", "Largest impact, pressing is positive"} <= set(page.texts)
        assert any('"clearance": 0.015' in text and text.count("\n") > 20 for text in page.texts)
        assert program.run("sweep", "-", "-o", path, text=json.dumps(study))[:2] == (0, "")
        page, charts = check_page(path, title)
        assert len(charts) == 1 and "smallest" in page.texts
    code, out = program.on_terminal("run", scene={**scene, "title": "a\033[31m\nb"})
    assert code == 0 and ESCAPE not in out and "a?[31m?b" in out, out


if __name__ == "__main__":
    program.main(globals())
