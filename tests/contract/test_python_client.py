#!/usr/bin/env python3
"""web/client/impactd.py as Python users meet it: installed by pip from a daemon, with and without NumPy, pandas and Matplotlib."""

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import threading
import unittest.mock
import zipfile

import matplotlib
import numpy
import pandas

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from access import token  # noqa: E402
from asking import endless  # noqa: E402
from client import fake, say  # noqa: E402

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
            bodies.append(daemon.get(f"/client/{WHEEL}").body)
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


if __name__ == "__main__":
    program.main(globals())
