#!/usr/bin/env python3
"""The command line: exit codes, formats, help, the progress bar, Ctrl-C."""

import json
import os
import pty
import re
import resource
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from asking import endless  # noqa: E402

SANITIZED = "nightly"
SPONGE = os.path.join(program.EXAMPLES, "paper_free_sponge.json")


def test_help_leads_with_examples():
    """--help begins with commands that can be typed, and every command has its page."""
    code, out, errors = program.run("--help")
    assert code == 0 and errors == ""
    lines = [line.strip() for line in out.splitlines() if line.strip()]
    assert lines[1].startswith("impactd serve"), lines[:3]
    assert all(len(line) <= 80 for line in out.splitlines()), out
    for group in ("Run here, without a server", "Run a server", "Jobs of a server", "Data of a server", "Help"):
        assert f"\n{group}\n" in out, group
    for command in ("serve", "run", "check", "tradeoff", "ensemble", "import", "help", "version"):
        assert any(line.startswith(command + " ") for line in lines), command
        pages = [program.run("help", command), program.run(command, "--help"), program.run(command, "-h")]
        assert pages[0] == pages[1] == pages[2], command
        assert pages[0][0] == 0 and "impactd " + command in pages[0][1], command


def test_help_fits_a_terminal_and_a_letter_has_one_meaning():
    """Every line of every help has at most 80 columns, and a letter belongs to the same option in all commands."""
    names = re.findall(r"^  ([\w-]+)  +\S", program.run("--help")[1].split("1000}")[1], re.M)
    assert len(names) > 20, names
    letters = {}
    for name in names:
        text = program.run("help", name)[1]
        long = [line for line in text.splitlines() if len(line) > 80]
        assert not long, (name, long)
        for letter, option in re.findall(r"^  -(\w), (--[\w-]+)", text, re.M):
            assert letters.setdefault(letter, option) == option, (name, letter, option, letters[letter])
    assert letters["o"] == "--output" and letters["w"] == "--wait" and "h" not in letters, letters
    code, _, errors = program.run("run", SPONGE, "-m", "1")
    assert code == 2 and "-m is not an option" in errors, errors


def test_examples_and_citations():
    """examples lists and prints the scenes of the program; cite names the program, its version and the paper."""
    code, out, errors = program.run("examples")
    assert code == 0 and [line.split()[0] for line in out.splitlines()[1:]] == program.examples(), (code, out, errors)
    with open(SPONGE, encoding="utf-8") as file:
        assert program.run("examples", "paper_free_sponge") == (0, file.read(), "")
    code, _, errors = program.run("examples", "paper_fre_sponge")
    assert code == 4 and "did you mean paper_free_sponge?" in errors, errors
    version = program.run("version")[1].split()[1]
    for option in ((), ("--bibtex",)):
        code, out, _ = program.run("cite", *option)
        assert code == 0 and version in out and "10.1002/stc.238" in out and "Darby" in out, out
    assert out.count("{") == out.count("}") and out.count("\n@") == 1, out
    software = out.split("\n}\n")[0]
    assert re.findall(r"^  (\w+) +=", software, re.M) == ["author", "title", "year", "version", "note"], out
    assert f"version = {{{version}}}," in software and "author  = {{" in software, out


def test_set_gives_members_other_values_with_units():
    """--set makes the scene that has these values in its text; a faulty path, value or unit names the option."""
    scene = {**program.scene("paper_free_sponge"), "duration": 5}
    scene["dampers"][0].update(clearance=0.035, buffer="aluminium")
    wanted = json.loads(program.run("check", "-", "--json", text=json.dumps(scene))[1])["result"]
    code, out, errors = program.run("check", SPONGE, "--json", "--set", "dampers.0.clearance=35 mm", "--set",
                                    "/dampers/0/buffer=aluminium", "--set=duration=5000ms")
    assert code == 0 and json.loads(out)["result"] == wanted, errors
    code, out, _ = program.run("check", SPONGE, "--json", "--set", "excitation.kind=sine", "--set", "excitation.frequency=4",
                               "--set", "excitation.amplitude=0.1g", "--set", "structure.mass=1350g", "--set",
                               "structure.damping=null", "--set", "structure.damping_ratio=2%", "--set",
                               'output.channels=["displacement"]', "--set", "output.psd=null", "--set", "title=12")
    scene = json.loads(out)["scene"]
    assert code == 0 and scene["excitation"]["amplitude"] == 0.1 * 9.80665 and scene["structure"]["mass"] == 1.35, scene
    assert scene["structure"]["damping_ratio"] == 0.02 and scene["output"]["channels"] == ["displacement"], scene
    for option, expected in [
            ("dampers.0.clearance=10kg", "--set dampers.0.clearance is a length in m, 10kg is a mass; write 10mm"),
            ("dampers.0.clearence=10mm", "did you mean clearance?"),
            ("dampers.0.buffer.restitution=0.5", 'the scene has "sponge" in place of the object'),
            ("dampers.1.mass=1g", '"1" is none of them'),
            ("duration=ten", "must be a number [s], is ten"),
            ("duration=10h", '"h" is not a unit; write ms, us, s, min'),
            ("contact.model={", "must be JSON, is {"),
            ("duration=", "needs a value"), ("duration", "must be PATH=VALUE")]:
        for command in ("run", "check", "sweep", "ensemble"):
            code, out, errors = program.run(command, SPONGE, "--set", option)
            assert code == 2 and out == "" and expected in errors, (command, option, errors)
    code, _, errors = program.run("run", "-", "--set", "duration=1", text="[1, 2")
    assert code == 3 and "line 1" in errors, errors


def test_vary_makes_a_sweep():
    """--vary is the sweep of these axes, of `run` too; a sweep of the scene keeps its metrics."""
    axes = [{"pointer": "/dampers/0/clearance", "from": 0.005, "to": 0.03, "count": 6},
            {"pointer": "/dampers/0/mass", "from": 0.05, "to": 0.2, "count": 3, "spacing": "logarithmic"},
            {"pointer": "/dampers/0/buffer", "values": ["sponge", "aluminium"]}]
    scene = {**program.scene("paper_free_sponge"), "study": {"kind": "sweep", "axes": axes}}
    wanted = program.run("sweep", "-", "--json", text=json.dumps(scene))[1]
    options = ("--vary", "dampers.0.clearance=5mm:30mm:6", "--vary", "dampers.0.mass=50g:200g:3:log",
               "--vary", "dampers.0.buffer=sponge,aluminium")
    for command in ("run", "sweep"):
        code, out, errors = program.run(command, SPONGE, "--json", *options)
        assert code == 0 and out == wanted and '"points": 36,' in out, (command, errors)
    scene["study"]["metrics"] = ["impacts"]
    code, out, errors = program.run("sweep", "-", "--json", "--vary", "sample_rate=1kHz,2000", text=json.dumps(scene))
    answer = json.loads(out)
    assert code == 0 and "impacts" in answer["columns"] and "peak_displacement" not in answer["columns"] and answer["axes"][0]["values"] == [1000, 2000], answer
    for option, expected in [("duration=1:10", "must be FROM:TO:COUNT"), ("duration=1:10:3:lin", "must be FROM:TO:COUNT"),
                             ("duration=1:10g:3", "10g is a mass"), ("duration=1:10:3s", "a whole number as its COUNT"),
                             ("duration=1:10:300%", "a whole number as its COUNT"), ("duration=0x1:10:3", "\"x1\" is not a unit"),
                             ("duratoin=1:2:3", "did you mean duration?")]:
        code, _, errors = program.run("sweep", SPONGE, "--vary", option)
        assert code == 2 and "--vary " + option.split("=")[0] in errors and expected in errors, (option, errors)


def test_faults_of_an_axis_name_their_option():
    """What the service finds in an axis of --vary is at that option."""
    for option, expected in [("dampers.0.buffer=sponge,nylon", "--vary dampers.0.buffer: no material is called"),
                             ("dampers.0.clearance=-5mm:30mm:3", "--vary dampers.0.clearance: point 0")]:
        code, _, errors = program.run("sweep", SPONGE, "--vary", option)
        assert code == 3 and expected in errors, errors


def test_a_material_of_a_server_is_a_label_of_its_numbers():
    """A scene of a server names a material that is unknown here: its numbers are used, with a warning; without them it is a fault."""
    scene = program.scene("paper_free_sponge")
    scene["dampers"][0]["buffer"] = {"material": "felt@1", "restitution": 0.61, "contact_time": 0.025}
    code, out, errors = program.run("run", "-", "--json", text=json.dumps(scene))
    assert code == 0 and "felt@1 is not a built-in material" in errors and json.loads(out)["summary"]["impacts"] == 22, errors
    scene["dampers"][0]["buffer"] = "felt"
    code, _, errors = program.run("run", "-", text=json.dumps(scene))
    assert code == 3 and "a name with its numbers" in errors, errors


def test_a_number_with_its_unit_in_a_scene_is_explained():
    """A quantity as JSON text is a fault that has the number to write."""
    scene = {**program.scene("paper_free_sponge"), "duration": "500 ms"}
    scene["dampers"][0]["clearance"] = "35 mm"
    scene["dampers"][0]["mass"] = "35 mm"
    code, _, errors = program.run("check", "-", text=json.dumps(scene))
    assert code == 3 and "/duration: must be a number [s], is a string: write 0.5\n" in errors, errors
    assert "/dampers/0/clearance: must be a number [m], is a string: write 0.035\n" in errors, errors
    assert "/dampers/0/mass: must be a number [kg], is a string\n" in errors, errors


def test_usage_faults():
    """Wrong words are exit code 2, told on stderr, with what was probably meant."""
    for arguments, expected in [
            ((), "impactd"),
            (("chekc", SPONGE), "did you mean check?"),
            (("help", "rnu"), "did you mean run?"),
            (("run", SPONGE, "--outptu", "x.csv"), "did you mean --output?"),
            (("run", SPONGE, "-x"), "-x"),
            (("run",), "takes one scene"),
            (("run", SPONGE, SPONGE), "takes one scene"),
            (("run", SPONGE, "-o"), "needs a value"),
            (("run", SPONGE, "-o", "out.xlsx"), ".csv"),
            (("run", SPONGE, "-o", "out"), ".csv"),
            (("check",), "takes one scene"), (("run", SPONGE, "-o", "a.csv", "--output=b.csv"), "--output can be given once"),
            (("check", "--json=maybe", SPONGE), "true or false"),
            (("serve", "--workers", "many"), "--workers"),
            (("serve", "--workers", "100000"), "--workers"),
            (("serve", "--wokers", "2"), "did you mean --workers?"),
            (("version", "x"), "takes no operands")]:
        code, out, errors = program.run(*arguments)
        assert code == 2, (arguments, code, errors)
        assert out == "" and expected in errors, (arguments, out, errors)


def test_settings_come_from_flag_environment_file_and_default():
    """serve --print-config: a flag beats the environment, that the file, that the default; each says so."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "impactd.conf")
        with open(path, "w", encoding="utf-8") as file:
            file.write("# settings\nworkers = 3\nqueue = 30  # jobs\nmax_body = 5000\n")
        environment = {**os.environ, "IMPACTD_QUEUE": "40", "IMPACTD_MAX_BODY": "6000", "IMPACTD_CONFIG": path}
        code, out, errors = program.run("serve", "--max-body", "7000", "--print-config", environment=environment)
        assert code == 0, errors
        for line in ("workers = 3  # file", "queue = 40  # environment", "max_body = 7000  # flag"):
            assert line in out.splitlines(), (line, out)
        assert any(line.startswith("listen = 127.0.0.1:8080") and line.endswith("# default")
                   for line in out.splitlines()), out
        # What is printed is a file of settings: read back, it means the same and starts the daemon.
        printed = os.path.join(folder, "printed.conf")
        with open(printed, "w", encoding="utf-8") as file:
            file.write(out)
        with program.daemon("--config", printed) as daemon:
            assert daemon.request("POST", "/v1/jobs", body=b"[" * 7001,
                                  headers={"Content-Type": "application/json"}).status == 413
        with open(path, "a", encoding="utf-8") as file:
            file.write("wrokers = 4\nnonsense\n")
        code, out, errors = program.run("serve", "--print-config", environment=environment)
        assert code == 2 and f"{path}:5" in errors and "workers" in errors and f"{path}:6" in errors, errors


def is_warned(errors):
    """Whether that is all: late impacts of the paper's scene are slower than any that the paper measured."""
    return errors.count("\n") == 1 and "warning: /dampers/0/buffer: 6 of 22 impacts" in errors


def test_run_prints_the_finished_job():
    """`run` without -o prints the job of the contract, and nothing else; warnings go to the standard error."""
    code, out, errors = program.run("run", SPONGE)
    assert code == 0 and is_warned(errors), (code, errors)
    job = json.loads(out)
    for member in ("id", "status", "progress", "cached", "result", "created", "started", "finished", "problem",
                   "plan", "summary", "warnings", "timing", "links"):
        assert member in job, member
    assert (job["status"], job["progress"], job["cached"], job["problem"]) == ("successful", 100, False, None)
    derived = job["plan"]["derived"][0]
    assert derived["material"] == "sponge@1" and abs(derived["stiffness"] - 1655.6191) < 1e-4, derived
    assert job["summary"]["impacts"] == 22 and abs(job["summary"]["peak_contact_force"] - 5.7175273) < 1e-7
    with open(SPONGE, encoding="utf-8") as file:
        text = file.read()
    for given in (text, "\ufeff" + text):
        code, out, errors = program.run("run", "-", text=given)
        assert code == 0 and json.loads(out)["result"] == job["result"], errors


def test_run_writes_each_format_alike():
    """-o json, csv and npy hold the same samples, bit for bit."""
    with tempfile.TemporaryDirectory() as folder:
        for extension in ("json", "csv", "npy"):
            code, out, errors = program.run("run", SPONGE, "-o", os.path.join(folder, "out." + extension))
            assert (code, out) == (0, "") and is_warned(errors), (extension, code, out, errors)
        assert sorted(os.listdir(folder)) == ["out.csv", "out.json", "out.npy"]
        with open(os.path.join(folder, "out.json"), encoding="utf-8") as file:
            whole = json.load(file)
        assert list(whole) == ["job", "series", "impacts", "psd"]
        channels = whole["series"]["channels"]
        count = whole["series"]["count"]
        assert count == 10001 and list(channels) == ["displacement", "velocity", "acceleration",
                                                     "damper_displacement", "contact_force"]
        assert whole["impacts"]["count"] == len(whole["impacts"]["impacts"]) == 22
        assert whole["psd"]["segment"] == 4096 and len(whole["psd"]["frequency"]["values"]) == 2049
        table = numpy.load(os.path.join(folder, "out.npy"))
        assert table.shape == (count, 6) and table.flags.f_contiguous
        with open(os.path.join(folder, "out.csv"), encoding="utf-8") as file:
            assert file.readline().startswith("time [s],displacement [m],velocity [m/s],")
            text = numpy.array([[float(cell) for cell in line.split(",")] for line in file])
        assert numpy.array_equal(text, table)
        assert numpy.array_equal(table[:, 0], numpy.arange(count) / 1000)
        for column, name in enumerate(channels, 1):
            assert numpy.array_equal(table[:, column], numpy.array(channels[name]["values"])), name


def test_an_output_does_not_replace_an_input():
    """A scene, also by a link or from standard input, and the file of a ground motion stay as they are: exit code 2."""
    with tempfile.TemporaryDirectory() as folder:
        scene, link, motion = (os.path.join(folder, name) for name in ("scene.json", "link.json", "motion.csv"))
        shutil.copy(SPONGE, scene)
        os.symlink("scene.json", link)
        with open(motion, "w", encoding="ascii") as file:
            file.write("0 0\n0.01 1\n0.02 0\n")
        for arguments in (("run", scene, "-o", scene), ("run", scene, "-o", link), ("run", scene, "--record", motion, "--unit", "g", "-o", motion),
                          ("sweep", scene, "--vary", "dampers.0.clearance=5mm:10mm:2", "-o", scene),
                          ("import", motion, "--unit", "g", "-o", motion)):
            code, _, errors = program.run(*arguments)
            assert code == 2 and "it was read as an input" in errors, (arguments, code, errors)
        with open(scene, encoding="utf-8") as file:
            done = subprocess.run([program.impactd(), "run", "-", "-o", scene], stdin=file, capture_output=True, text=True, check=False)
        assert done.returncode == 2 and os.path.getsize(scene) == os.path.getsize(SPONGE), done
        assert os.path.getsize(motion) == 18 and sorted(os.listdir(folder)) == ["link.json", "motion.csv", "scene.json"]


def test_an_output_can_be_replaced_and_is_readable():
    """An earlier file is replaced; the new one has the rights any new file gets; links and pipes stay."""
    with tempfile.TemporaryDirectory() as folder:
        target = os.path.join(folder, "out.csv")
        for _ in range(2):
            assert program.run("run", SPONGE, "-o", target)[0] == 0
        mask = os.umask(0)
        os.umask(mask)
        assert os.stat(target).st_mode & 0o777 == 0o666 & ~mask
        os.mkfifo(os.path.join(folder, "pipe.csv"))
        with subprocess.Popen(["cmp", target, os.path.join(folder, "pipe.csv")]) as reader:
            assert program.run("run", SPONGE, "-o", os.path.join(folder, "pipe.csv"))[0] == 0 and reader.wait(20) == 0
        # A link stays, also a link to a link in another folder and one to a file that is missing.
        os.mkdir(os.path.join(folder, "links"))
        links = [os.path.join(folder, "links", name) for name in ("a.csv", "b.csv", "c.csv")]
        for link, to in zip(links, ("../out.csv", "a.csv", "../new.csv")):
            os.symlink(to, link)
        for link, name in ((links[1], "out.csv"), (links[2], "new.csv")):
            assert program.run("run", SPONGE, "--set", "duration=1", "-o", link)[0] == 0 and os.path.islink(link)
            with open(os.path.join(folder, name), encoding="utf-8") as file:
                assert len(file.readlines()) == 1002, name
        assert all(map(os.path.islink, links))
        assert program.run("examples", "chirp", "-o", "/dev/null") == (0, "", "")
        for name in ("-", "/dev/stdout"):
            assert program.run("examples", "chirp", "-o", name)[1].startswith("{"), name
        code, _, errors = program.run("run", SPONGE, "-o", os.path.join(folder, "none", "out.csv"))
        assert code == 1 and "No such file" in errors, (code, errors)
        assert sorted(os.listdir(folder)) == ["links", "new.csv", "out.csv", "pipe.csv"]


def test_bad_scenes_are_exit_code_3():
    """`run` and `check` tell every fault of a scene on one line each and exit with 3; a missing file is 4."""
    scene = program.scene("paper_free_sponge")
    scene["structure"]["mass"] = -1
    scene["duratoin"] = scene.pop("duration")
    for command in ("run", "check"):
        code, out, errors = program.run(command, "-", text=json.dumps(scene))
        assert code == 3 and out == "", (command, code, out)
        lines = errors.splitlines()
        assert len(lines) == 3, errors
        assert any("/structure/mass: must be above 0 kg, is -1" in line for line in lines), errors
        assert any("/duratoin: " in line and 'did you mean "duration"?' in line for line in lines), errors
        assert any("/duration: " in line for line in lines), errors
        code, _, errors = program.run(command, "/nonexistent/scene.json")
        assert code == 4 and "cannot be read" in errors, (command, code, errors)
        code, _, errors = program.run(command, "-", text='{"structure": ' + " " * (16 << 20) + "{}}")
        assert code == 3 and "larger" in errors, (command, code, errors)


def test_check_shows_the_plan():
    """`check` shows choices, cost, stiffness and damping on a terminal; in a pipe and with --json it is the dry run's shape."""
    code, out = program.on_terminal("check", scene=SPONGE)
    assert code == 0 and "\nNext  impactd run " in out and max(map(len, out.splitlines())) <= 80, out
    for part in ("no faults", "spring_damper", "exact", "sponge@1", "k_b [N/m]", "1655.62", "4.04574", "10001 samples", "MB of memory"):
        assert part in out, (part, out)
    code, out, errors = program.run("check", SPONGE)
    assert code == 0 and errors == "" and program.run("check", SPONGE, "--json")[1] == out
    plan = json.loads(out)
    assert code == 0 and plan["samples"] == 10001 and plan["cost"]["cpu_seconds"] > 0 and plan["cost"]["bytes"] > 0
    assert plan["plan"]["contact_model"] == "spring_damper" and plan["result"].startswith("r-")
    again = program.run("run", "-", text=json.dumps(plan["scene"]))
    assert again[0] == 0 and json.loads(again[1])["result"] == plan["result"], again


def test_a_scene_cannot_command_the_terminal():
    """`check` prints control characters of a title, of a key and of a value as question marks."""
    scene = {**program.scene("paper_free_sponge"), "title": "a\x1b[2Jb\x9bc\nd"}
    code, out = program.on_terminal("check", scene=scene)
    assert code == 0 and out.startswith("a?[2Jb??c?d\n"), (code, out)
    with tempfile.TemporaryDirectory() as folder:
        code, out = program.on_terminal("run", SPONGE, "-o", os.path.join(folder, "\x1b[2Jx.csv"))
        assert code == 0 and "/?[2Jx.csv" in out and "\x1b" not in out, (code, out)
    scene = {**scene, "k\x1b[31m": 1, "contact": {"model": "x\x1b[0m"}}
    code, out, errors = program.run("check", "-", text=json.dumps(scene))
    assert code == 3 and "/k?[31m: unknown key" in errors and "\x1b" not in errors, (code, errors)


def test_what_takes_too_long_is_refused_in_seconds():
    """`run` and `check` refuse what is predicted to take more than 60 s of CPU, or --max-cpu-seconds; a run that was
    predicted too little stops, and says so."""
    slow = {**program.scene("paper_free_sponge"), "duration": 1000, "accuracy": {"solver": "rk4", "step": 1e-7}}
    for command in ("run", "check"):
        code, _, errors = program.run(command, "-", text=json.dumps(slow))
        assert code == 3 and "/accuracy: would take about" in errors, (command, code, errors)
        assert "s of CPU by rk4, at most 60 s are allowed: take longer steps" in errors, (command, errors)
        code, _, errors = program.run(command, "-", "--max-cpu-seconds", "1e-6", text=json.dumps(
            {**program.scene("paper_free_sponge"), "output": {"psd": None}}))
        assert code == 3 and "/duration: would take about" in errors and "at most 1e-06 s" in errors, errors
    study = json.dumps(program.scene("optimize_clearance"))
    code, _, errors = program.run("optimize", "-", "--max-cpu-seconds", "0.1", text=study)
    assert code == 3 and "/study: would take about" in errors and "at most 0.1 s are allowed by --max-cpu" in errors, errors
    often = {"structure": {"mass": 1.9, "stiffness": 7.5e6, "damping": 1.2}, "sample_rate": 50, "duration": 6,
             "dampers": [{"mass": 0.011, "clearance": 1e-6, "buffer": {"restitution": 0.95, "contact_time": 7.6e-6}}],
             "contact": {"model": "spring_damper", "separation": "zero_penetration"},
             "excitation": {"kind": "sine", "amplitude": 1.4, "frequency": 0.23}}
    first, second = (program.run("run", "-", "--max-cpu-seconds", "0.042", text=json.dumps(often)) for _ in range(2))
    assert first[0] == 1 and "more than 4.2e+06 solver steps, about 0.126 s of CPU" in first[2], first
    assert first == second, "the count decides, not the clock"


def test_a_full_disk_is_told():
    """Output that cannot be written is exit code 1."""
    with open("/dev/full", "w", encoding="utf-8") as full:
        done = subprocess.run([program.impactd(), "run", SPONGE], stdout=full, stderr=subprocess.PIPE,
                              text=True, check=False)
    assert done.returncode == 1 and "cannot be written" in done.stderr, done


def test_interrupts_stop_at_once():
    """Ctrl-C and SIGTERM end a long run within half a second, exit code 130, and leave no file."""
    for number in (signal.SIGINT, signal.SIGTERM):
        with tempfile.TemporaryDirectory() as folder:
            target = os.path.join(folder, "out.csv")
            with open(target, "w", encoding="utf-8") as file:
                file.write("mine")
            earlier = sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
            with subprocess.Popen([program.impactd(), "run", "-", "-o", target], stdin=subprocess.PIPE,
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
                process.stdin.write(json.dumps(endless()))
                process.stdin.close()
                end = time.monotonic() + 20
                while len(os.listdir(folder)) < 2:
                    assert process.poll() is None and time.monotonic() < end, process.stderr.read()
                    time.sleep(0.01)
                time.sleep(0.3)
                assert process.poll() is None, "the scene is too short for this test"
                # Of a processor: what else the machine has to do is none of its faults.
                used = program.cpu_of(process.pid)
                process.send_signal(number)
                assert process.wait(60) == 130
                more = sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2]) - earlier - used
                assert more < 0.5, more
            assert os.listdir(folder) == ["out.csv"]
            with open(target, encoding="utf-8") as file:
                assert file.read() == "mine"


def on_a_terminal(text, bars=1000):
    """What `run` writes to a terminal as its stderr, up to so many bars."""
    try:
        master, slave = pty.openpty()
    except OSError as error:
        raise program.Skipped(f"no terminal can be made here: {error}") from None
    with subprocess.Popen([program.impactd(), "run", "-"], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                          stderr=slave, text=True) as process:
        os.close(slave)
        process.stdin.write(text)
        process.stdin.close()
        shown, end = b"", time.monotonic() + 60
        while time.monotonic() < end and shown.count(b"%") < bars and process.poll() is None:
            if select.select([master], [], [], 0.05)[0]:
                try:
                    shown += os.read(master, 4096)
                except OSError:  # the terminal's end: the process is gone
                    break
        process.kill()
    os.close(master)
    return shown.decode()


def test_progress_bar_on_a_terminal():
    """A long run shows a bar that moves on a terminal; a short one, or one into a file, shows none."""
    shown = on_a_terminal(json.dumps(endless()), 5)
    percents = [int(part.split("%")[0].split("]")[1]) for part in shown.split("\r") if "%" in part]
    assert len(percents) >= 3 and percents == sorted(percents) and percents[-1] <= 100, shown
    with open(SPONGE, encoding="utf-8") as file:
        assert "%" not in on_a_terminal(file.read())


def test_no_file_takes_a_closed_streams_place():
    """A daemon without standard streams: what it would print there stands in none of its files."""
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(["sh", "-c", 'exec "$0" serve --listen 127.0.0.1:0 --data "$1" <&- >&- 2>&-',
                                    program.impactd(), folder])
        try:
            lock, end = os.path.join(folder, "impactd.lock"), time.monotonic() + 20
            while not os.path.exists(os.path.join(folder, "impactd.db-wal")) and time.monotonic() < end:
                time.sleep(0.05)
            files = [os.readlink(f"/proc/{process.pid}/fd/{number}") for number in range(3)]
            assert files == 3 * ["/dev/null"], files
            with open(lock, encoding="ascii") as file:
                assert file.read() == f"{process.pid}\n"
        finally:
            process.terminate()
            assert process.wait(20) == 0


def test_edits_need_one_unit_and_any_order():
    """A range has a unit at both ends or at none, kinds are set first, and a number for an object is named as a number."""
    for value in ("5:30mm:5", "5mm:30:5"):
        code, _, errors = program.run("sweep", SPONGE, "--vary", f"dampers.0.clearance={value}")
        assert code == 2 and "5mm:30mm" in errors, errors
    code, _, errors = program.run("sweep", SPONGE, "--vary", "dampers.0.clearance=10mm,20mm", "--set", "duration=1")
    assert code == 0, errors
    code, _, errors = program.run("check", SPONGE, "--set", "structure=5")
    assert code == 3 and "is a number" in errors, errors
    for order in (("band=[2,8]", "rms=0.1g", "kind=random"), ("kind=random", "rms=0.1g", "band=[2,8]")):
        done = program.run("check", SPONGE, "--set", "excitation.displacement=null", *[
            word for one in order for word in ("--set", "excitation." + one)])
        assert done[0] == 0, done


def test_version():
    """`version` and --version print the versions that the daemon tells."""
    code, out, errors = program.run("version")
    assert (code, errors) == (0, "") and out == program.run("--version")[1], (code, out, errors)
    with program.daemon() as daemon:
        told = daemon.get("/version").json()
    assert out == f"impactd {told['version']} (engine {told['engine']})\n", (out, told)


if __name__ == "__main__":
    program.main(globals())
