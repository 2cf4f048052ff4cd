#!/usr/bin/env python3
"""The README's recipes for scripts run as they stand there, against a daemon."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from asking import endless  # noqa: E402

USUAL = "http://127.0.0.1:8080"


def recipe(language):
    """The one fenced block of that language in the README."""
    with open(os.path.join(program.SOURCE, "README.md"), encoding="utf-8") as file:
        found = re.findall(rf"^```{language}\n(.*?)^```$", file.read(), re.M | re.S)
    assert len(found) == 1, (language, len(found))
    return found[0]


def cook(language, *command, ending):
    """Runs a recipe in a folder with the scene in it; its output, and the numbers of the files it leaves."""
    if shutil.which(command[0]) is None:
        raise program.Skipped(f"{command[0]} is not here")
    with program.daemon() as daemon, tempfile.TemporaryDirectory() as folder:
        shutil.copy(os.path.join(program.EXAMPLES, "paper_free_sponge.json"), os.path.join(folder, "scene.json"))
        path = os.path.join(folder, "recipe" + ending)
        with open(path, "w", encoding="utf-8") as file:
            file.write(recipe(language).replace(USUAL, daemon.url))
        done = subprocess.run([*command, path], cwd=folder, capture_output=True, text=True, timeout=200, check=False,
                              env={**os.environ, "IMPACTD_SERVER": daemon.url, "HOME": folder,
                                   "PATH": program.build + os.pathsep + os.environ["PATH"]})
        assert done.returncode == 0, done
        tables = {name: numpy.loadtxt(os.path.join(folder, name), delimiter=",", skiprows=1)
                  for name in os.listdir(folder) if name.endswith(".csv")}
        result = program.finished(daemon, program.scene("paper_free_sponge"))["result"]
        whole = numpy.loadtxt(daemon.get(f"/v1/results/{result}/series.csv").body.decode().splitlines(),
                              delimiter=",", skiprows=1)
        psd = numpy.loadtxt(daemon.get(f"/v1/results/{result}/psd.csv").body.decode().splitlines(),
                            delimiter=",", skiprows=1)
    return done.stdout, tables, whole, psd


def test_curl():
    """The recipe for curl brings series, spectra and the largest force."""
    out, tables, whole, psd = cook("sh", "sh", "-eu", ending=".sh")
    assert tables["motion.csv"].shape == (2001, 3) and numpy.array_equal(tables["motion.csv"][:, 1], whole[:2001, 1])
    assert numpy.array_equal(tables["psd.csv"], psd)
    assert 5 < float(out.split()[-1]) < 6, out


def test_python():
    """The recipe for Python needs requests and numpy alone and brings series, spectra and five clearances."""
    out, _, whole, psd = cook("python", "/usr/bin/python3", ending=".py")
    lines = out.splitlines()
    assert lines[0] == f"{len(whole)} samples, peak {abs(whole[:, 1]).max()} m", out
    assert lines[1] == f"most power at {psd[numpy.argmax(psd[:, 1]), 0]} Hz", out
    assert len(lines) == 7 and len({line.split()[1] for line in lines[2:]}) == 5, out
    used = set(re.findall(r"^(?:import|from) (\w+)", recipe("python"), re.M))
    assert used == {"io", "numpy", "requests"}, used


def test_octave():
    """The recipe for Octave and MATLAB brings the same series and spectra as arrays."""
    out, tables, whole, psd = cook("octave", "octave-cli", "--no-init-file", "--quiet", ending=".m")
    assert numpy.array_equal(tables["motion.csv"][:, 1], whole[:, 1]) and numpy.array_equal(tables["psd.csv"], psd)
    assert out.splitlines() == [f"{len(whole)} samples, peak {abs(whole[:, 1]).max():g} m, 22 impacts",
                                f"most power at {psd[numpy.argmax(psd[:, 1]), 0]:g} Hz"], out


# Lines that are not for a test: they install, need a certificate or a machine of that name, or go on for minutes.
LEFT_OUT = re.compile(r"demo\.sh|run\.sh|^cmake|^ctest|^systemctl|^man |serve|example\.org|retell\.py|bench/|tests/|"
                      r"^curl --json '\{$")
# Which scene a line is about, where it is not the first one.
SCENES = {"impactd ensemble": "paper_random_sponge", "impactd study": "compare_sponge", "impactd sweep": "sweep_clearance_buffer",
          "impactd optimize": "optimize_clearance", "impactd calibrate": "calibrate_free_sponge", "impactd response": "response_sponge",
          "impactd fragility": "with_records/fragility"}


def lines():
    """The README's lines for a shell, without what is said of them."""
    with open(os.path.join(program.SOURCE, "README.md"), encoding="utf-8") as file:
        text = re.sub(r"^```.*?^```$", "", file.read(), flags=re.M | re.S)
    found = re.findall(r"^    ((?:curl|impactd|\w+=\$\(impactd|[\w./]+\.(?:sh|py)) ?.*?)(?:  +# .*|  +[a-z].*)?$", text, re.M)
    return list(dict.fromkeys(line for line in found if not LEFT_OUT.search(line)))


def test_lines():
    """Every other line of the README for a shell runs, one after the other, each with a scene that fits it."""
    kept = lines()
    motion = "A title\nof two lines\nin g\nNPTS= 4, DT= .01 SEC\n 0.1 0.2 -0.1 0.05\n"
    assert len(kept) > 25, kept
    with program.daemon("--max-cpu-seconds", "1000") as daemon, tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "motion.AT2"), "w", encoding="utf-8") as file:
            file.write(motion)
        with open(os.path.join(folder, "measured.csv"), "w", encoding="utf-8") as file:
            file.write("time [s],acceleration [m/s^2]\n" + "".join(f"{0.001 * i:.3f},{0.1 * (i % 7)}\n" for i in range(40)))
        cork = {"slug": "cork", "name": "Cork", "restitution": 0.4, "contact_time": 0.01, "source": "a guess"}
        drops = {"gravity": 0, "drops": [{"drop_height": 0.1, "rebound_height": 0.0001 * height} for height in (158, 161, 164)]}
        revision = {"name": "Sponge", "restitution": 0.6, "contact_time": 0.025, "source": "six drops", "comment": "measured anew"}
        for name, document in (("cork", cork), ("test", drops), ("drops", drops), ("revision", revision)):
            with open(os.path.join(folder, name + ".json"), "w", encoding="utf-8") as file:
                json.dump(document, file)
        with open(os.path.join(folder, "force.csv"), "w", encoding="utf-8") as file:
            file.write("time [s],force [N]\n" + "".join(f"{0.001 * i:.3f},{max(0, numpy.sin(0.3 * i - 3)) if i < 20 else 0:.4f}\n" for i in range(60)))
        one, two = (program.finished(daemon, program.scene(name)) for name in ("paper_free_sponge", "paper_free_aluminium"))
        swept = program.finished(daemon, program.scene("sweep_clearance_buffer"))
        for line in kept:
            name = next((scene for begin, scene in SCENES.items() if line.startswith(begin)), "paper_free_sponge")
            scene = program.scene(name)
            records = re.findall(r"--record (\w+)\.AT2", line)
            if records:
                scene["study"]["records"] = records
            for record in records:
                with open(os.path.join(folder, record + ".AT2"), "w", encoding="utf-8") as file:
                    file.write(motion)
            with open(os.path.join(folder, "scene.json"), "w", encoding="utf-8") as file:
                json.dump({**scene, "duration": min(3, scene["duration"])}, file)
            is_end = re.search(r"cancel|jobs/\$JOB$", line)
            job = daemon.submit(endless(), headers={"Prefer": "respond-async"}).json()["id"] if is_end else one["id"]
            said = re.sub(r"\[\.\.\.\]", str([0.1 * i for i in range(40)]), line).replace("r-…", one["result"])
            said = said.replace(USUAL, daemon.url).replace("localhost:8080", f"localhost:{daemon.port}")
            said = re.sub(r"\bcurl ", "curl -fsS ", said)
            done = subprocess.run(["bash", "-euc", said], cwd=folder, capture_output=True, text=True, timeout=200, check=False,
                                  env={**os.environ, "IMPACTD_SERVER": daemon.url, "HOME": folder, "URL": daemon.url,
                                       "XDG_STATE_HOME": folder, "R": (swept if "points/" in line else one)["result"], "RESULT": two["result"],
                                       "JOB": job, "job": job, "other": two["id"], "PATH": program.build + os.pathsep + os.environ["PATH"]})
            assert done.returncode == 0, (line, said, done)


if __name__ == "__main__":
    program.main(globals())
