#!/usr/bin/env python3
"""web/client/impactd.py as Python users meet it: installed by pip from a daemon, with and without NumPy, pandas and Matplotlib."""

import ast
import contextlib
import io
import json
import os
import pickle
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time
import traceback
import unittest.mock
import warnings
import zipfile

import matplotlib
import numpy
import pandas

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from access import token  # noqa: E402
from asking import endless  # noqa: E402
from client import fake, raw, say  # noqa: E402
from program import until  # noqa: E402

sys.path.insert(0, os.path.join(program.SOURCE, "web", "client"))
sys.dont_write_bytecode = True
import impactd  # noqa: E402

matplotlib.use("agg")
CLEARANCE = "dampers.0.clearance"
WHEEL = f"impactd-{impactd.__version__}-py3-none-any.whl"


@contextlib.contextmanager
def laboratory(*arguments):
    with program.daemon(*arguments) as daemon, impactd.connect(daemon.url) as lab:
        yield lab


def without(*names):
    """As if these packages were not installed."""
    return unittest.mock.patch.dict(sys.modules, dict.fromkeys(names))


def refused(call, *arguments, **options):
    """The Problem that a call raises."""
    try:
        call(*arguments, **options)
    except impactd.Problem as problem:
        return problem
    raise AssertionError(f"{call} raised no Problem")


def short(name="paper_free_sponge", **members):
    return {**program.scene(name), "duration": 2, **members}


def test_pip_installs_the_wheel_from_the_daemon_alone():
    """`pip install URL/client/WHEEL` into a clean environment works, also by --find-links and --index-url, and asks no other host."""
    with tempfile.TemporaryDirectory() as folder, program.daemon() as daemon, fake(say(502)) as (proxy, seen):
        environment = {name: value for name, value in os.environ.items() if not name.startswith(("PIP_", "PYTHON"))}
        environment.update(PIP_CONFIG_FILE=os.devnull, PIP_DISABLE_PIP_VERSION_CHECK="1", PIP_NO_CACHE_DIR="1", http_proxy=proxy,
                           https_proxy=proxy, no_proxy="127.0.0.1", HOME=folder)
        subprocess.run([sys.executable, "-m", "venv", f"{folder}/venv"], check=True, env=environment)
        python = f"{folder}/venv/bin/python"

        def install(*arguments):
            done = subprocess.run([python, "-m", "pip", "install", "--force-reinstall", "--no-deps", *arguments],
                                  capture_output=True, text=True, env=environment, check=False)
            assert done.returncode == 0, done

        install("--index-url", f"{daemon.url}/client", "impactd")
        install("--no-index", "--find-links", f"{daemon.url}/client/", f"impactd=={impactd.__version__}")
        install(f"{daemon.url}/client/{WHEEL}")
        code = "import impactd, sys; r = impactd.connect().run('paper_free_sponge'); print(impactd.__file__, r.summary['impacts'], type(r.time))"
        done = subprocess.run([python, "-c", code], capture_output=True, text=True, check=True,
                              env={**environment, "IMPACTD_SERVER": daemon.url})
        file, impacts, kind = done.stdout.split(" ", 2)
        assert file.startswith(folder) and impacts == "22" and "list" in kind, done  # a clean environment has no NumPy
        assert not seen, seen


def test_the_wheel_is_the_file_and_always_the_same():
    """Two daemons serve the same bytes; every digest in RECORD holds; the module is the served file; /client lists both."""
    bodies = []
    for _ in range(2):
        with program.daemon() as daemon:
            whole = daemon.get(f"/client/{WHEEL}")
            same = daemon.get(f"/client/{WHEEL}", headers={"If-None-Match": whole.headers["etag"]})
            assert same.status == 304 and same.body == b"", same
            bodies.append(whole.body)
            served = daemon.get("/client/impactd.py")
            page = daemon.get("/client").body.decode()
            assert daemon.get("/client/").headers["location"] == "/client"
            assert daemon.get("/client/impactd-9.9.9-py3-none-any.whl").status == daemon.get("/client/none.py").status == 404
            assert daemon.get("/version").json()["version"] == impactd.__version__
    assert bodies[0] == bodies[1]
    with open(impactd.__file__, "rb") as file:
        source = file.read()
    assert served.body == source and served.headers["content-type"] == "text/x-python; charset=utf-8", served
    assert f'href="/client/{WHEEL}"' in page and 'href="/client/impactd.py"' in page, page
    ast.parse(source, feature_version=(3, 9))
    with tempfile.NamedTemporaryFile() as file:
        file.write(bodies[0])
        file.flush()
        with zipfile.ZipFile(file.name) as wheel:
            assert wheel.testzip() is None and wheel.read("impactd.py") == source


def test_a_run_has_channels_impacts_spectrum_and_energy():
    """The paper's sponge gives the README's numbers, as arrays and frames with the packages and as lists without."""
    with laboratory() as lab:
        for missing in ((), ("numpy", "pandas", "matplotlib")):
            with without(*missing):
                r = lab.run("paper_free_sponge")
                assert r.summary["impacts"] == len(r.impacts) == 22 and abs(r.summary["rms_displacement"] - 0.0025838755) < 1e-9
                assert len(r.time) == len(r.displacement) == 10001 and r.time[10000] == 10 and r["displacement"][0] == 0.015
                assert max(abs(x) for x in r.displacement) == r.summary["peak_displacement"] and r.units["displacement"] == "m"
                first = r.impacts[0] if missing else r.impacts.iloc[0]
                assert abs(first["start"] - 0.0416214) < 1e-6 and first["side"] == "right"
                frequency, density = r.psd("mean_acceleration")
                assert len(frequency) == len(density) == 2049 and abs(frequency[1] - 1000 / 4096) < 1e-12 and 0.1 < max(density) < 10
                assert abs(r.energy["initial"] - 0.5 * 865 * 0.015 ** 2) < 1e-12
                assert abs(r.plan["derived"][0]["stiffness"] - 1655.6190925) < 1e-6 and r.scene["contact"]["separation"] == "zero_penetration"
                assert r.warnings[0]["pointer"] == "/dampers/0/buffer"
                window = r.series("displacement", start=1, end=2)
                assert len(window) == 1001 and list(window[0] if missing else window.columns) == ["time", "displacement"]
                assert len(r.impact(1)) > 100
                page = r._repr_html_()
                assert "22" in page and "data:image/svg+xml;base64," in page and "<svg" not in page
                assert isinstance(r.time, list) == isinstance(r.impacts, list) == bool(missing)
        r = lab.run("paper_free_sponge")
        assert list(r.frame.columns) == ["time", *r.channels] and r.frame.attrs["units"]["time"] == "s"
        assert isinstance(r.displacement, numpy.ndarray) and isinstance(r.impacts, pandas.DataFrame)
        with without("pandas"):
            assert "pip install pandas" in str(raised(ImportError, lambda: r.frame))
        assert len(r.plot().axes) == 5
        with without("matplotlib", "matplotlib.pyplot"):
            assert "pip install matplotlib" in str(raised(ImportError, r.plot))
        assert "did you mean 'displacement'" in str(raised(AttributeError, lambda: r.displacment))
        raised(KeyError, lambda: r["contact_force_2"])
        raised(KeyError, r.psd, "velocity")


def raised(kind, call, *arguments):
    try:
        call(*arguments)
    except kind as error:
        return error
    raise AssertionError(f"no {kind.__name__} was raised")


def test_overrides_reach_the_scene():
    """Dotted paths, JSON Pointers and plain names change the scene that is sent; the given one stays; unknown paths raise."""
    with laboratory() as lab, tempfile.TemporaryDirectory() as folder:
        given = program.scene("paper_free_sponge")
        kept = json.dumps(given)
        sent = lab.scene(given, **{CLEARANCE: 0.01, "/excitation/displacement": 0.02, "contact.model": "impulse", "accuracy.solver": "exact"},
                         duration=1)
        assert sent["dampers"][0]["clearance"] == 0.01 and sent["excitation"]["displacement"] == 0.02 and sent["duration"] == 1
        assert sent["contact"] == {"model": "impulse"} and sent["accuracy"] == {"solver": "exact"} and json.dumps(given) == kept
        path = os.path.join(folder, "scene.json")
        with open(path, "w", encoding="utf-8") as file:
            json.dump(given, file)
        r = lab.run(path, **{CLEARANCE: 0.01})
        assert r.scene["dampers"][0]["clearance"] == 0.01 and lab.run(r).cached and lab.run(r.scene).id == r.id
        for wrong, pointer in (("dampers.1.clearance", "/dampers/1"), ("damper.0.mass", "/damper"), ("dampers.0.clearnce", "/dampers/0/clearnce"),
                               ("dampers.0.buffer.restitution", "/dampers/0/buffer/restitution"), ("/structure/mas", "/structure/mas")):
            problem = refused(lab.run, given, **{wrong: 1})
            assert problem.status == 422 and problem.faults[0].pointer == pointer, problem
        assert refused(lab.run, "paper_free_spong").status == 404
        raised(FileNotFoundError, lab.run, "none.json")


def test_problems_have_all_their_places():
    """A refused scene is a Problem with status, type and every fault; printing it shows them; a failed job is one, too."""
    with laboratory() as lab:
        problem = refused(lab.run, {"structure": {"mass": -1}, "structur": 3})
        assert problem.status == 422 and problem.type == "/problems/invalid-scene", problem
        places = {fault.pointer: fault for fault in problem.faults}
        assert {"/structure/mass", "/structur", "/duration", "/sample_rate", "/structure/stiffness"} <= set(places), places
        assert places["/structur"].did_you_mean == "structure" and places["/structure/mass"].value == -1
        text = str(problem)
        assert all(f"  {pointer}: " in text for pointer in places) and 'did you mean "structure"' in text, text
        steps = short("paper_free_aluminium", accuracy={"solver": "rk4", "step": 0.001})
        failed = refused(lab.run, steps)
        assert failed.job.status == "failed" and failed.detail, failed
        assert refused(lab.job, "j-00000000").status == 404
    gone = raised(ConnectionError, impactd.connect, lab.url)
    assert "impactd serve" in str(gone) and lab.url in str(gone)


def test_every_study_has_a_table_and_a_best_row():
    """All nine studies by their short forms: a table with units, a chart, best() and best_scene() where there is one."""
    with laboratory() as lab:
        s = lab.sweep(short(), {CLEARANCE: numpy.linspace(0.005, 0.025, 3), "dampers.0.buffer": ["sponge", "aluminium"]},
                      metrics=["rms_displacement", "impacts"])
        assert len(s.table) == 6 and s.table_units[CLEARANCE] == "m" and list(s.table["dampers.0.buffer"])[:2] == ["sponge@1", "aluminium@1"]
        assert s.best()["rms_displacement"] == min(s.frame["rms_displacement"]) and s.best("impacts", "maximize")["impacts"] == max(s.table["impacts"])
        assert lab.run(s.best_scene()).summary["rms_displacement"] == s.best()["rms_displacement"]
        with without("pandas", "numpy"):
            assert isinstance(s.table, list) and s.table[0]["dampers.0.buffer"] == "sponge@1" and "pip install pandas" in str(raised(ImportError, lambda: s.frame))
        raised(KeyError, s.best, "rms_displacment")
        tied = lab.sweep(short(dampers=[{"mass": 0.1, "clearance": 0.01, "left_buffer": "sponge", "right_buffer": "sponge"}]),
                         {("dampers.0.left_buffer", "dampers.0.right_buffer"): ["sponge", "hard_rubber"]})
        assert len(tied.table) == 2 and tied.scene["study"]["axes"][0]["pointers"] == ["/dampers/0/left_buffer", "/dampers/0/right_buffer"]
        e = lab.ensemble("paper_random_sponge", runs=4, duration=2)
        assert list(e.table["seed"]) == [1, 2, 3, 4] and e.answer["statistics"] and e.scene["duration"] == 2
        drawn = lab.ensemble(short(), 4, {CLEARANCE: {"distribution": "uniform", "from": 0.01, "to": 0.02}})
        assert drawn.table[CLEARANCE].between(0.01, 0.02).all()
        o = lab.optimize(short(), {CLEARANCE: (0.002, 0.06)}, "rms_displacement", {"peak_contact_force": (None, 100)}, max_candidates=8)
        assert len(o.table) == 8 and o.best()["feasible"] and 0.002 <= o.best()[CLEARANCE] <= 0.06
        assert lab.run(o.best_scene()).summary["rms_displacement"] == o.best()["rms_displacement"]
        most = lab.optimize(short(), {CLEARANCE: [0.01, 0.02]}, {"impacts": "maximize"})
        assert most.best()["impacts"] == max(most.table["impacts"])
        never = lab.optimize(short(), {CLEARANCE: [0.01, 0.02]}, "impacts", {"peak_displacement": (1, None)})
        assert "peak_displacement" in str(refused(never.best))
        motion = lab.run(short())
        c = lab.calibrate(short(), {"dampers.0.buffer.restitution": (0.3, 0.9)},
                          [{"channel": "displacement", "samples": motion.displacement, "interval": 0.001}], starts=2,
                          **{"dampers.0.buffer": {"restitution": 0.5, "contact_time": 0.025}})
        assert abs(c.best()["dampers.0.buffer.restitution"] - 0.61) < 1e-3 and len(c.table) == 1
        r = lab.response("response_sponge", {"excitation.frequency": (3, 5, 3)}, direction="up", settle_cycles=20)
        assert list(r.table["value"]) == [3, 4, 5]
        lab.upload("shake", numpy.sin(numpy.arange(100)), interval=0.02, source="a test", processing="none")
        still = {name: value for name, value in short("no_damper").items() if name != "excitation"}
        f = lab.fragility(still, ["shake"], (1, 2, 2), {"peak_displacement": 0.01})
        assert list(f.table["level"]) == [1, 2] and f.answer["limits"][0]["value"] == 0.01
        m = lab.compare(short(), ["impulse", "spring_damper"])
        n = lab.sensitivity(short(), parameters=["clearance"])
        t = lab.tradeoff(short(), solvers=["exact", "rk4"])
        assert list(m.table["model"]) == ["spring_damper", "impulse"] and "rk4" in list(t.table["solver"]) and len(n.table)
        for study in (s, e, drawn, o, c, r, f, m, n, t):
            assert "data:image/svg+xml" in study._repr_html_() and study.summary and study.kind in study.document["scene"]["study"]["kind"]
        assert len(s.plot("rms_displacement").axes) == 1 and r.plot().axes
        again = lab.result(s.id[:12])
        assert isinstance(again, impactd.Study) and again.best() == s.best()


def test_many_jobs_are_submitted_and_gathered():
    """60 scenes through a queue that takes 8: each once, in order or as they finish, with progress; faults by their place."""
    with laboratory("--queue", "8") as lab:
        seeds = range(60)
        scenes = [lab.scene("paper_random_sponge", **{"excitation.seed": seed + 1}, duration=2) for seed in seeds]
        steps = []
        found = list(lab.gather(lab.submit(scenes), ordered=True, progress=lambda done, total: steps.append((done, total))))
        assert [r.scene["excitation"]["seed"] for r in found[:3] + found[-1:]] == [1, 2, 3, 60]
        assert len({r.id for r in found}) == 60 and steps[-1] == (60, 60) and len(steps) == 60
        assert {r.id for r in lab.gather(scenes[:5])} == {r.id for r in found[:5]}
        assert len(lab.jobs(limit=None)) == 65 and len(lab.jobs(limit=10)) == 10  # no job twice, and pages
        problem = refused(lab.submit, scenes[:2] + [{"structure": {"mass": -1}}])
        assert problem.title.startswith("Item 2 of the list") and problem.faults, problem
        unstable = {**program.scene("paper_free_aluminium"), "duration": 1, "accuracy": {"solver": "rk4", "step": 0.001}}
        mixed = list(lab.gather(lab.submit([scenes[0], unstable]), ordered=True, errors="return"))
        assert mixed[0].id == found[0].id and isinstance(mixed[1], impactd.Problem)
        refused(list, lab.gather(lab.submit([unstable])))


def test_jobs_can_be_waited_for_and_cancelled():
    """A timeout leaves the job, cancel ends it, and a loop over gather that is left early cancels where that was asked for."""
    with laboratory() as lab:
        raised(TimeoutError, lambda: lab.run(endless(1), timeout=0.1))
        jobs = lab.submit([endless(2), endless(3), program.scene("paper_free_sponge")])
        for r in lab.gather(jobs, cancel=True):
            assert r.summary["impacts"] == 22
            break
        states = {job.refresh().status for job in jobs}
        assert states == {"dismissed", "successful"}, states
        job = next(lab.job(one) for one in lab.jobs(status="running")["id"])
        assert job.cancel().status == "dismissed" and job.cancel().status == "dismissed"
        problem = refused(job.result)
        assert problem.job is job and problem.type == "/problems/cancelled", problem


def test_interrupts_cancel_where_that_was_asked_for():
    """Ctrl-C in run ends the job on the server with cancel_on_interrupt=True."""
    with program.daemon() as daemon:
        # A shell lets what it runs in the background ignore Ctrl-C.
        code = ("import impactd, json, signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
                "lab = impactd.connect(cancel_on_interrupt=True)\n"
                "print('ready', flush=True); lab.run(json.load(sys.stdin))")
        process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   env={**os.environ, "PYTHONPATH": os.path.dirname(impactd.__file__), "IMPACTD_SERVER": daemon.url})
        assert process.stdout.readline() == "ready\n"
        process.stdin.write(json.dumps(endless()))
        process.stdin.close()
        assert until(lambda: daemon.get("/v1/jobs").json()["jobs"])
        process.send_signal(signal.SIGINT)
        assert process.wait(20) != 0 and "KeyboardInterrupt" in process.stderr.read()
        process.stdout.close()
        process.stderr.close()
        assert until(lambda: daemon.get("/v1/jobs").json()["jobs"][0]["status"] == "dismissed")


def test_requests_are_repeated_where_that_is_safe():
    """429 and 503 with Retry-After and broken connections are repeated, a POST only under its key; other refusals are not."""
    version, job = say(body=b'{"version": "x"}'), say(body=b'{"id": "j-1", "status": "successful", "progress": 100, "study": null, "result": "r-1"}')

    def busy(code):
        return say(code, b'{"title": "busy", "status": %d}' % code, "application/problem+json", Retry_After="0")

    with fake(version, raw(b""), busy(503), busy(429), job) as (url, seen):
        lab = impactd.connect(url, token="t", timeout=5)
        lab.submit({})
        assert [line[0] for line in seen] == ["GET"] + ["POST"] * 4
        assert len({line[2]["Idempotency-Key"] for line in seen[1:]}) == 1 and seen[1][2]["Authorization"] == "Bearer t"
    with fake(version, raw(b""), job) as (url, seen):
        raised(ConnectionError, impactd.connect(url, timeout=5).add_material, "felt", "Felt")  # it could be there twice
        assert len(seen) == 2
    with fake(version, say(503, b"", Retry_After="3600"), job) as (url, seen):
        assert refused(impactd.connect(url, patience=1).submit, {}).status == 503 and len(seen) == 2
    with fake(version, say(404, b"<html>not here</html>", "text/html")) as (url, _):
        assert "not here" in str(refused(impactd.connect(url).material, "sponge"))
    with fake(say(body=b'{"version": "1"}')) as (url, seen):
        lab = impactd.connect(url + "/base/")
        lab.request("GET", "/v1/cache")
        lab.request("GET", "/base/v1/cache")
        lab.request("GET", "http://elsewhere.example/base/v1/cache")  # a link never leads to another host
        assert [line[1] for line in seen] == ["/base/version"] + ["/base/v1/cache"] * 3


def test_tokens_and_passwords_stay_secret():
    """A token's line end is removed, a wrong token or an address with a password is refused, and no message shows either."""
    with fake(say(body=b'{"version": "x"}')) as (url, seen):
        lab = impactd.connect(url, " s3cret-token\r\n")
        assert seen[0][2]["Authorization"] == "Bearer s3cret-token" and "s3cret" not in repr(lab)
        assert b"s3cret" not in pickle.dumps(lab)
        with unittest.mock.patch.dict(os.environ, {"IMPACTD_TOKEN": "another"}):
            assert pickle.loads(pickle.dumps(lab))._http.token == "another"
        for wrong in ("s3cret\nX: y", "s3cr\u00e9t", "s3cret token", "s3cret" * 100, b"s3cret"):
            error = raised(ValueError, impactd.connect, url, wrong)
            assert "s3cr" not in "".join(traceback.format_exception(None, error, None)), error
        host = url.split("//")[1]
        for wrong in (f"http://user:s3cret@{host}", f"user:s3cret@{host}", "http://user:s3cret/x@h", f"{url}?key=s3cret", f"{url}#s3cret"):
            error = raised(ValueError, impactd.connect, wrong)
            assert "s3cr" not in "".join(traceback.format_exception(None, error, None)) and "password" in str(error), error
        for wrong in ("", "x\r\ny", "http://h:99999", "ftp://h", "http://[::1", "http://a b"):
            raised(ValueError, impactd._address, wrong)
        assert len(seen) == 1
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for address in ("http://127.0.0.2:1", "http://[::1]:1", "http://localhost", "https://h.example", "http://127.evil.example"):
            impactd._Http(address, "s3cret", None, 1, 1)
    assert [str(one.message) for one in caught] == ["the token is sent to 127.evil.example without encryption; use https"]


def test_mistakes_of_the_caller_are_named():
    """Wrong scenes, indices and documents raise ValueError or TypeError with what is wrong; texts from the server stay on their line."""
    with laboratory() as lab, tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        for wrong in (5, None, b"x", ["paper_free_sponge"]):
            assert "a scene is a dict" in str(raised(TypeError, lab.run, wrong))
        assert "empty string" in str(raised(ValueError, lab.run, "")) and "is empty" in str(raised(ValueError, lab.job, ""))
        for wrong in (0.01, "sponge"):
            assert "are a list" in str(raised(TypeError, lab.sweep, "paper_free_sponge", {CLEARANCE: wrong}))
        assert [r.summary["impacts"] for r in lab.gather("paper_free_sponge")] == [22]
        file.write("root:x:0")
        file.flush()
        assert file.name in str(raised(ValueError, lab.run, file.name))
        for index in ("\u00b2", "\u0660", "-1", "0\n", "9" * 5000):
            assert refused(lab.scene, "paper_free_sponge", **{f"dampers.{index}.clearance": 1}).faults[0].pointer.startswith("/dampers/")
        endless_dict = {}
        endless_dict["a"] = endless_dict
        assert "contains itself" in str(raised(ValueError, lab.run, {"structure": endless_dict}))
        assert "NaN" in str(raised(ValueError, lab.run, {"duration": float("nan")}))
        r = lab.run(short())
        assert "in this result. It has" in str(raised(AttributeError, lambda: r.zzz))
    problem = impactd.Problem({"title": "a\x1b[2J", "detail": "b\u202ec\n", "errors": [{"pointer": "/\x9b", "detail": "d\r"}]})
    assert str(problem) == "a\\x1b[2J (about:blank, status 0)\n  b\\u202ec\\n\n  /\\x9b: d\\r", str(problem)


def test_answers_of_others_are_one_exception():
    """What is no answer of impactd raises UnexpectedAnswer: no JSON, absent members, endless lists, tables that are cut; problems can be pickled."""
    version = say(body=b'{"version": "1"}')
    job = {"id": "j-1", "status": "failed", "progress": 0, "result": None, "problem": None}
    with fake(version, say(body=b"<html>"), say(body=b"[]"), say(body=b'{"id": 1}'), say(body=b'{"jobs": [1]}'),
              say(body=b'{"jobs": []}', Link='</v1/jobs?limit=100>; rel="next"'), say(body=json.dumps(job).encode()),
              say(body=json.dumps({**job, "status": "dismissed"}).encode())) as (url, _):
        lab = impactd.connect(url, timeout=5)
        for call, text in ((lambda: lab.job("j-1"), "is not JSON: '<html>'"), (lambda: lab.job("j-1"), "has no member 'id'"),
                           (lambda: lab.job("j-1"), "has no member 'status'"), (lab.jobs, "no list 'jobs' of objects"), (lab.jobs, "leads back to itself")):
            assert text in str(raised(impactd.UnexpectedAnswer, call)), text
        for kind in ("internal-error", "cancelled"):
            problem = refused(lab.job("j-1").result)
            assert problem.type == f"/problems/{kind}" and str(pickle.loads(pickle.dumps(problem))) == str(problem), problem
    with fake(version, say(body=b'{"version": "1"}' + b" " * (1 << 20))) as (url, _), unittest.mock.patch.object(impactd, "_MOST", 1 << 16):
        assert "larger than 65536 bytes" in str(raised(impactd.UnexpectedAnswer, impactd.connect(url, timeout=5).examples))
    with fake(version) as (url, _):
        assert "cannot have" in str(raised(ValueError, impactd.connect(url).request, "GET", "/v1/jobs/a b\r\nX: y"))
    running = {**job, "status": "running", "progress": "x"}
    with fake(version, say(422, b'{"title": 5, "detail": {}, "status": "x", "errors": [1, {"pointer": 5, "detail": 7}]}'),
              say(422, b'{"errors": 5}'), say(body=json.dumps({**job, "status": "successful"}).encode()), say(body=json.dumps(running).encode())) as (url, _):
        lab = impactd.connect(url, timeout=5)
        assert [str(refused(lab.job, "j-1")).split()[:3] for _ in range(2)] == [["HTTP", "status", "422"]] * 2
        assert "has no result" in str(raised(impactd.UnexpectedAnswer, lab.job("j-1").result))
        assert "is no number" in str(raised(impactd.UnexpectedAnswer, lambda: lab.job("j-1").progress))


def test_answers_that_are_cut_or_too_slow_are_refused():
    """A body that ends early is no answer, also not as a file; a body that comes in single bytes has an end; short timeouts are kept."""
    def drip(handler):
        handler.wfile.write(b"HTTP/1.1 200 OK\r\nContent-Length: 300\r\n\r\n")
        for _ in range(300):
            handler.wfile.write(b" ")
            time.sleep(0.02)

    def lab(url):
        made = impactd.connect(url, timeout=0.2)
        made._http.is_known = False  # so that nothing is repeated
        return made

    version = say(body=b'{"version": "1"}')
    with fake(version, say(body=b"[1]", length=1000)) as (url, _), tempfile.TemporaryDirectory() as folder:
        cut = lab(url)
        raised(ConnectionError, cut.request, "GET", "/v1/cache")
        raised(ConnectionError, impactd.Result(cut, "r-1").save, f"{folder}/a.csv")
        assert os.listdir(folder) == []
    with fake(version, drip) as (url, _), unittest.mock.patch.object(impactd, "_PATIENCE", 2):
        begin = time.monotonic()
        assert "not complete" in str(raised(ConnectionError, lab(url).request, "GET", "/v1/cache")) and time.monotonic() - begin < 3
    job = {"id": "j-1", "status": "running", "progress": 5, "result": None}
    with fake(version, say(body=json.dumps(job).encode())) as (url, seen):
        slow = impactd.connect(url, timeout=1)
        error = raised(TimeoutError, lambda: slow.run({}, timeout=0.1))
        assert "j-1 is running (5 %) after 0.1 s" in str(error) and seen[1][2]["Prefer"] == "respond-async", (error, seen[1])


def test_one_client_serves_many_threads():
    """Eight threads share a client: every answer is its own, and connections are reused."""
    with laboratory() as lab:
        wrong = []

        def work(k):
            for i in range(5):
                r = lab.run(short(), **{CLEARANCE: 0.01 + 0.001 * k, "dampers.0.mass": 0.1 + 0.01 * i})
                if r.scene["dampers"][0]["clearance"] != 0.01 + 0.001 * k or len(r.time) != 2001:
                    wrong.append((k, i))

        threads = [threading.Thread(target=work, args=(k,)) for k in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert not wrong and len(lab._http.idle) <= 8, (wrong, len(lab._http.idle))


def test_materials_records_and_tokens():
    """Materials are listed, added and measured, ground motions uploaded and read, jobs listed; a token is needed and may be too weak."""
    with tempfile.TemporaryDirectory() as data:
        writer, reader = token(data, "writer", "read,submit,materials"), token(data, "reader", "read")
        with program.daemon(data=data) as daemon:
            assert refused(impactd.connect(daemon.url).materials).status == 401
            assert refused(impactd.connect(daemon.url, reader).run, "paper_free_sponge").status == 403
            with unittest.mock.patch.dict(os.environ, {"IMPACTD_SERVER": daemon.url, "IMPACTD_TOKEN": writer}):
                lab = impactd.connect()
            materials = lab.materials().set_index("slug")
            assert materials.loc["sponge", "contact_time"] == 0.025 and lab.material("sponge@1")["restitution"] == 0.61
            lab.add_material("felt", "Felt, 5 mm", restitution=0.31, contact_time=0.0042, source="own tests")
            test = {"impactor": "steel ball", "impactor_mass": 0.11, "base": "fixed", "drops": [{"drop_height": 0.05, "rebound_height": 0.0048}] * 3}
            assert abs(lab.measure("felt", test, dry_run=True)["evaluation"]["restitution"]["mean"] - 0.31) < 0.01 and lab.measurements("felt") == []
            lab.measure("felt", test)
            assert len(lab.measurements("felt")) == 1
            assert lab.derived("sponge", damper_mass=0.1107, structure_mass=1.35)
            with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
                file.write("0 0\n0.02 1\n0.04 -1\n0.06 0\n")
                file.flush()
                lab.upload("pulse", file.name, unit="m/s^2", source="a test", processing="none")
            times, samples = lab.record_samples("pulse")
            assert list(times) == [0, 0.02, 0.04, 0.06] and list(samples) == [0, 1, -1, 0] and lab.record("pulse")["count"] == 4
            assert list(lab.records()["name"]) == ["pulse"] and refused(lab.upload, "pulse", [1, 2], interval=1).status == 409
            assert lab.run(short("no_damper", excitation={"kind": "record", "name": "pulse"})).summary["peak_displacement"] > 0
            assert lab.check("paper_free_sponge")["cost"]["cpu_seconds"] < 0.1 and "paper_free_sponge" in lab.examples()
            assert lab.jobs(q="no such").empty and len(lab.jobs()) == 1


def test_files_are_whole_or_absent():
    """save() writes what the daemon answers for each extension, and leaves nothing where that fails."""
    with laboratory() as lab, tempfile.TemporaryDirectory() as folder:
        r = lab.run("paper_free_sponge")
        s = lab.sweep(short(), {CLEARANCE: [0.01, 0.02]})
        for result, name, part in ((r, "a.npy", None), (r, "a.csv", "impacts"), (r, "a.zip", None), (r, "a.svg", "psd"), (r, "a.json", None),
                                   (s, "s.csv", None), (s, "s.json", None), (s, "s.npz", None)):
            path = os.path.join(folder, name)
            result.save(path, part)
            assert os.path.getsize(path) > 100 and os.stat(path).st_mode & 0o600 == 0o600
        assert numpy.load(os.path.join(folder, "a.npy")).shape == (10001, 6)
        with open(os.path.join(folder, "a.json"), encoding="utf-8") as file:
            assert set(json.load(file)) == {"job", "series", "impacts", "psd"}
        kept = sorted(os.listdir(folder))
        nowhere = os.path.join(folder, "none", "a.csv")
        assert raised(FileNotFoundError, r.save, nowhere).filename == nowhere
        copy = pickle.loads(pickle.dumps(r))
        assert copy.summary == r.summary and copy.psd()[0][1] == r.psd()[0][1] and len(copy.time) == 10001
        assert refused(r.save, os.path.join(folder, "a.html")).status == 404 and sorted(os.listdir(folder)) == kept


def test_tls_needs_a_known_authority():
    """https works with ca_file alone; without it the message names it."""
    with tempfile.TemporaryDirectory() as folder:
        certificate, key = program.certificate(folder)
        with subprocess.Popen([program.impactd(), "serve", "--listen", "127.0.0.1:0", "--data", folder, "--tls-cert", certificate,
                               "--tls-key", key], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
            try:
                url = process.stdout.readline().split()[-1]
                assert url.startswith("https://127.0.0.1:"), url
                assert "ca_file" in str(raised(ConnectionError, impactd.connect, url))
                assert impactd.connect(url, ca_file=certificate).version["program"] == "impactd"
            finally:
                process.terminate()


def test_the_notebook_gives_the_papers_numbers():
    """The cells of paper_figures.ipynb run, are at most 60 lines without outputs, and reproduce what tests/paper measures."""
    with open(os.path.join(program.SOURCE, "web", "client", "paper_figures.ipynb"), encoding="utf-8") as file:
        notebook = json.load(file)
    assert notebook["nbformat"] == 4 and notebook["metadata"]["kernelspec"]["language"] == "python"
    assert len({cell["id"] for cell in notebook["cells"]}) == len(notebook["cells"])
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells)
    assert sum(1 for cell in cells for line in "".join(cell["source"]).splitlines() if line.strip()) <= 60
    names = {}
    with program.daemon() as daemon, unittest.mock.patch.dict(os.environ, {"IMPACTD_SERVER": daemon.url}), \
            contextlib.redirect_stdout(io.StringIO()) as printed:
        for cell in cells:
            exec("".join(cell["source"]), names)  # pylint: disable=exec-used
    for buffer, (stiffness, damping) in {"sponge": (1650, 4.05), "soft_rubber": (2990, 8.80), "hard_rubber": (65700, 32.5),
                                         "hard_acrylic": (118000, 48.7), "aluminium": (11.9e6, 530)}.items():  # Table I
        assert abs(names["table"][buffer][0] / stiffness - 1) < 0.005 and abs(names["table"][buffer][1] / damping - 1) < 0.005, buffer
    impacts = {key: r.summary["impacts"] for key, r in names["free"].items()}
    assert impacts["sponge", "spring_damper"] == impacts["aluminium", "spring_damper"] == 22 and impacts["sponge", "impulse"] == 30, impacts
    assert abs(names["difference"]["aluminium"] - 0.005) < 0.001 and abs(names["difference"]["sponge"] - 0.706) < 0.001, names["difference"]
    assert len(names["runs"]) == 80 and names["apart"]["aluminium"] < 0.05 and abs(names["apart"]["sponge"] - 16.2) < 0.1, names["apart"]
    hard, soft = names["first"]["aluminium"], names["first"]["sponge"]
    assert round(hard["peak_force"] / soft["peak_force"]) == 77 and round(soft["duration"] / hard["duration"]) == 89
    assert all(0.02 < abs(value) < 0.13 for value in names["change"].values()), names["change"]
    assert "k_b =      1656 N/m" in printed.getvalue()
    matplotlib.pyplot.close("all")


OCTAVE = """
lab = impactd();
r = lab.run('paper_free_sponge');
s = lab.series(r); d = lab.series(r, 'displacement'); t = lab.impacts(r); [f, p] = lab.psd(r); e = lab.energy(r);
assert(r.summary.impacts == 22 && numel(t) == 22 && strcmp(t(1).side, 'right') && abs(t(1).start - 0.0416214) < 1e-6);
assert(numel(s.time) == 10001 && s.time(end) == 10 && max(abs(s.displacement)) == 0.015 && numel(fieldnames(d)) == 2);
assert(numel(f) == 2049 && abs(f(p == max(p)) - 3.66211) < 1e-4 && abs(e.initial - 0.0973125) < 1e-9);
w = lab.run('scene.json', 'dampers.0.clearance', 0.01, '/contact/model', 'impulse', 'duration', 2);
assert(strcmp(w.plan.contact_model, 'impulse') && numel(lab.series(w).time) == 2001);
t = lab.sweep('paper_free_sponge', {'dampers.0.clearance', linspace(0.005, 0.025, 3); 'dampers.0.buffer', {'sponge', 'aluminium'}}, 'duration', 2);
assert(numel(t.rms_displacement) == 6 && t.dampers_0_clearance(end) == 0.025 && strcmp(t.dampers_0_buffer{2}, 'aluminium@1'));
a = lab.study('ensemble', 'paper_random_sponge', struct('runs', 4), 'duration', 2); assert(a.runs == 4);
scene = struct('structure', struct('mass', 1.35, 'stiffness', 865, 'damping', 1.092), 'dampers', ...
    struct('mass', 0.1107, 'clearance', 0.015, 'buffer', 'sponge'), 'excitation', struct('kind', 'free', 'displacement', 0.015), ...
    'duration', 10, 'sample_rate', 1000);
rs = lab.gather(lab.submit({scene, 'paper_free_aluminium'})); assert(rs{1}.summary.impacts == 22 && strcmp(rs{1}.result, r.result));
lab.save(r, 'motion.csv'); lab.save(r, 'all.zip'); assert(size(dlmread('motion.csv', ',', 1, 0), 1) == 10001);
m = lab.materials(); assert(numel(m) == 5 && lab.material('sponge@1').contact_time == 0.025);
try; lab.run('paper_free_sponge', 'dampers.0.clearnce', 1); error('none'); catch e; end
assert(strcmp(e.identifier, 'impactd:problem') && ~isempty(strfind(e.message, '/dampers/0/clearnce: unknown key; did you mean "clearance"?')));
try; lab.run('paper_free_sponge', 'dampers.3.mass', 1); error('none'); catch e; end
assert(strcmp(e.identifier, 'impactd:problem'));
try; impactd('http://127.0.0.1:1'); error('none'); catch e; end
assert(strcmp(e.identifier, 'impactd:connection'));
disp('all is well');
"""


def test_octave_has_the_same_calls():
    """impactd.m in Octave, with a token: run with overrides, series, impacts, psd, sweep, studies, gather, files and faults."""
    with tempfile.TemporaryDirectory() as folder, program.daemon(data=os.path.join(folder, "data")) as daemon:
        for name, text in (("test.m", OCTAVE), ("scene.json", json.dumps(program.scene("paper_free_sponge")))):
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(text)
        os.symlink(os.path.join(program.SOURCE, "web", "client", "impactd.m"), os.path.join(folder, "impactd.m"))
        environment = {**os.environ, "IMPACTD_SERVER": daemon.url, "IMPACTD_TOKEN": token(daemon.data, "octave")}
        done = subprocess.run(["octave-cli", "-q", "--no-init-file", "test.m"], cwd=folder, env=environment, capture_output=True, text=True,
                              timeout=120, check=False)
        assert "all is well" in done.stdout, done
        assert daemon.get("/client/impactd.m").status == daemon.get("/client/paper_figures.ipynb").status == 200

if __name__ == "__main__":
    program.main(globals())
