#!/usr/bin/env python3
"""What `cmake --install` puts where: the program, its manual, completions and unit, each used from there; and the package."""

import contextlib
import json
import os
import re
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import package  # noqa: E402
import program  # noqa: E402
from client import client, fake, raw, say  # noqa: E402
from package import need  # noqa: E402

MANUALS = ("man1/impactd.1", "man5/impactd-scene.5", "man8/impactd.service.8")
OPTION = re.compile(r"^  (?:-\w, |    )(--[\w-]+)", re.M)


@contextlib.contextmanager
def installed(prefix="/opt/x"):
    """The folder that stands for / of an installation under `prefix`."""
    with tempfile.TemporaryDirectory() as root:
        subprocess.run(["cmake", "--install", program.build, "--prefix", prefix], check=True, capture_output=True,
                       env={**os.environ, "DESTDIR": root})
        yield root


def listed(root):
    return {os.path.relpath(os.path.join(folder, file), root) for folder, _, files in os.walk(root) for file in files}


def commands():
    """Every command with its options, as help lists them."""
    text = program.run("--help")[1]
    names = re.findall(r"^  ([\w-]+) +\S", text[text.rindex('"sample_rate"'):], re.M)
    return {name: OPTION.findall(program.run("help", name)[1]) for name in names}


def test_everything_is_installed_under_its_prefix():
    """Program, manual, completions, unit, contract, examples and licence stand under the prefix, and nothing elsewhere."""
    with installed() as root:
        files = listed(root)
        assert all(file.startswith("opt/x/") for file in files), files
        wanted = {"bin/impactd", "lib/systemd/system/impactd.service", "share/bash-completion/completions/impactd",
                  "share/impactd/schema/openapi.json", "share/impactd/schema/scene.schema.json",
                  "share/impactd/examples/paper_free_sponge.json", "share/doc/impactd/LICENSE",
                  *("share/man/" + manual for manual in MANUALS)}
        assert wanted <= {file[len("opt/x/"):] for file in files}, wanted - {file[len("opt/x/"):] for file in files}
        assert os.access(os.path.join(root, "opt/x/bin/impactd"), os.X_OK)


def test_the_installed_program_runs_from_there():
    """The installed program runs an installed example without anything of the source tree."""
    with installed() as root, tempfile.TemporaryDirectory() as elsewhere:
        done = subprocess.run([os.path.join(root, "opt/x/bin/impactd"), "run",
                               os.path.join(root, "opt/x/share/impactd/examples/paper_free_sponge.json")],
                              capture_output=True, text=True, check=True, cwd=elsewhere, env={"PATH": "/usr/bin:/bin"})
        assert json.loads(done.stdout)["status"] == "successful"


def test_the_manual_is_well_formed_and_whole():
    """mandoc finds no fault in any page, man shows them, and every command has one with all its options."""
    need("mandoc", "man")
    with installed() as root:
        folder = os.path.join(root, "opt/x/share/man/man1")
        pages = [os.path.join(folder, name) for name in sorted(os.listdir(folder))]
        pages += [os.path.join(root, "opt/x/share/man", manual) for manual in MANUALS[1:]]
        assert len(pages) == len(commands()) + 3, pages
        done = subprocess.run(["mandoc", "-Tlint", "-Wwarning", *pages], capture_output=True, text=True, check=False)
        faults = [line for line in done.stdout.splitlines()
                  if "WARNING" in line and "missing date" not in line or "ERROR" in line]
        assert not faults, faults
        for page in [pages[0], *pages[-2:]]:
            shown = subprocess.run(["man", "-l", page], capture_output=True, text=True, check=False,
                                   env={**os.environ, "MANPAGER": "cat", "MANWIDTH": "200", "LC_ALL": "C.UTF-8"})
            assert shown.returncode == 0 and len(shown.stdout) > 500, (page, shown)
        shown = {page: re.sub(r".\x08", "", subprocess.run(["mandoc", "-Tascii", "-Owidth=200", page], capture_output=True,
                                                           text=True, check=True).stdout) for page in pages}
        overview = shown[os.path.join(folder, "impactd.1")]
        for name, options in commands().items():
            text = shown[os.path.join(folder, f"impactd-{name}.1")]
            assert re.search(rf"^ *impactd-{name}\(1\)", overview, re.M), name
            assert re.search(rf"^ *impactd {name}\b", text, re.M), name
            for option in options:
                assert option in text, (name, option)
        scene = subprocess.run(["mandoc", "-Tascii", pages[-2]], capture_output=True, text=True, check=True).stdout
        scene = re.sub(r".\x08", "", scene)
        for member in ("structure", "dampers[]", "contact", "excitation", "duration", "sample_rate"):
            assert member in scene, member


def complete(script, *words):
    """What bash offers for the last of the words."""
    program_text = f'source "{script}"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _impactd; printf "%s\\n" "${{COMPREPLY[@]}}"'
    done = subprocess.run(["bash", "-c", program_text, "bash", program.impactd(), *words], capture_output=True, text=True,
                          check=True, cwd=program.EXAMPLES)
    assert done.stderr == "", done.stderr
    return done.stdout.split()


def test_bash_completes_commands_options_and_values():
    """bash offers every command, every option of each, the values that are known, and leaves files to itself."""
    with installed() as root:
        script = os.path.join(root, "opt/x/share/bash-completion/completions/impactd")
        known = commands()
        assert len(known) >= 12 and set(complete(script, "")) == {*known, "--help", "--version"}
        for name, options in known.items():
            assert set(complete(script, name, "-")) == {"--help", *options}, name
        assert complete(script, "sub") == ["submit"]
        assert complete(script, "tradeoff", "--metric", "imp") == ["impacts"]
        assert complete(script, "tradeoff", "--solver", "rk") == ["rk4"]
        assert complete(script, "get", "r-1", "imp") == ["impacts"]
        assert complete(script, "token", "re") == ["revoke"] and complete(script, "token", "list", "") == []
        assert complete(script, "tradeoff", "-r", "x", "--metric", "=", "imp") == ["impacts"]
        assert complete(script, "run", "--output", "") == [] and complete(script, "records", "add", "") == []
        assert complete(script, "run", "--record", "run", "chi") == ["chirp.json"] and "bad/" in complete(script, "run", "")
        assert complete(script, "examples", "chi") == ["chirp"] and complete(script, "examples", "x", "") == []
        with program.daemon() as daemon:
            job = program.finished(daemon, program.scene("no_damper"))
            os.environ["IMPACTD_SERVER"] = daemon.url
            assert set(complete(script, "get", "")) == {job["id"], job["result"]}
            assert complete(script, "compare", "r-1", "r-") == [job["result"]] and complete(script, "watch", "x", "") == []
            assert complete(script, "materials", "show", "spo") == ["sponge"] and complete(script, "records", "show", "") == []
        began = time.monotonic()
        assert complete(script, "get", "j-") == [] and time.monotonic() - began < 5
        del os.environ["IMPACTD_SERVER"]
        assert set(complete(script, "help", "")) == set(known)
        bound = subprocess.run(["bash", "-c", f'source "{script}"; complete -p impactd'], capture_output=True, text=True, check=True)
        assert "-o default" in bound.stdout and "_impactd" in bound.stdout, bound


def test_completion_runs_nothing_that_a_server_sends():
    """Names of a server that are none are not offered; no text of a server is expanded, as command or as pattern."""
    with installed() as root, tempfile.TemporaryDirectory() as folder:
        script = os.path.join(root, "opt/x/share/bash-completion/completions/impactd")
        mark = os.path.join(folder, "mark")
        bad = [f"$(touch {mark})", f"`touch${{IFS}}{mark}`", "a;b", "*", "[a-z]*", "~", "a b", "-x", "\x1b[2Jx", "a\nb", "", 1, None]
        lists = {"jobs": [{"id": name, "result": name} for name in [*bad, "j-1"]],
                 "materials": [{"slug": name} for name in [*bad, "felt"]], "records": [{"name": name} for name in [*bad, "kobe.1"]]}
        with fake(say(body=json.dumps(lists).encode())) as (url, _):
            os.environ["IMPACTD_SERVER"] = url
            assert complete(script, "watch", "") == ["j-1", "j-1"] and complete(script, "watch", "$") == []
            assert complete(script, "materials", "show", "") == ["felt"] and complete(script, "records", "show", "k") == ["kobe.1"]
        for answer in (say(503, b'{"title": "busy"}'), say(422, b'{"errors": [{}]}'), say(404, b""), say(body=b"[[["), raw(b"x")):
            with fake(answer) as (url, _):
                for kind in ("ids", "materials", "records"):
                    assert client(url, "complete", kind) == (0, "", ""), kind
        del os.environ["IMPACTD_SERVER"]
        other = os.path.join(folder, "impactd")  # the script alone trusts no program either
        with open(other, "w", encoding="utf-8") as file:
            file.write("#!/bin/sh\ncat <<'E'\n" + "\n".join(str(name) for name in bad[:5]) + "\nE\n")
        os.chmod(other, 0o755)
        text = f'source "{script}"; COMP_WORDS=("{other}" watch ""); COMP_CWORD=2; _impactd; printf "%s\\n" "${{COMPREPLY[@]}}"'
        done = subprocess.run(["bash", "-c", text], capture_output=True, text=True, check=True, cwd=program.EXAMPLES)
        assert "\\$\\(touch" in done.stdout and "\\*" in done.stdout.splitlines() and ".json" not in done.stdout, done
        assert not os.path.exists(mark)
        odd = os.path.join(folder, "*.json")
        for name in ("*.json", "a b.json", "c.json"):
            with open(os.path.join(folder, name), "w", encoding="utf-8"):
                pass
        text = f'source "{script}"; COMP_WORDS=(x run "{folder}/"); COMP_CWORD=2; _impactd; printf "%s\\n" "${{COMPREPLY[@]}}"'
        done = subprocess.run(["bash", "-c", text], capture_output=True, text=True, check=True)
        assert sorted(done.stdout.splitlines()) == [odd, os.path.join(folder, "a b.json"), os.path.join(folder, "c.json")], done


def test_the_unit_is_well_formed_and_shut_off():
    """The unit names the installed program, systemd finds no fault in it, and its exposure is at most 1.1 of 10."""
    with installed() as root:
        unit = os.path.join(root, "opt/x/lib/systemd/system/impactd.service")
        with open(unit, encoding="utf-8") as file:
            text = file.read()
        assert "ExecStart=/opt/x/bin/impactd serve\n" in text and "@" not in re.sub(r"@[a-z-]+", "", text), text
        need("systemd-analyze")
        here = os.path.join(root, "impactd.service")
        with open(here, "w", encoding="utf-8") as file:  # as if it were installed in /
            file.write(text.replace("/opt/x", root + "/opt/x"))
        done = subprocess.run(["systemd-analyze", "verify", "--man=no", here], capture_output=True, text=True, check=False)
        assert done.returncode == 0 and "impactd" not in done.stderr, done
        done = subprocess.run(["systemd-analyze", "security", "--offline=true", "--threshold=11", here],
                              capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout[-300:] + done.stderr
        print("      " + re.search(r"Overall exposure level.*?: [0-9.]+", done.stdout)[0])


def test_the_debian_package_is_whole():
    """cpack makes a package with all files compressed and owned as Debian wants, their libraries, a configuration file and scripts."""
    with tempfile.TemporaryDirectory() as folder, installed("/usr") as root:
        deb = package.made(folder, "7.8.9")
        architecture = subprocess.run(["dpkg", "--print-architecture"], capture_output=True, text=True, check=True).stdout.strip()
        assert os.path.basename(deb) == f"impactd_7.8.9_{architecture}.deb"
        lines = [line.split(maxsplit=5) for line in package.asked(deb, "-c").splitlines()]
        assert all(line[1] == "root/root" for line in lines)
        modes = {line[5][2:]: line[0] for line in lines if not line[5].endswith("/")}
        wanted = {file + (".gz" if "/share/man/" in file else "") for file in listed(root)} - {"usr/share/doc/impactd/LICENSE"}
        wanted |= {"etc/default/impactd", "usr/share/lintian/overrides/impactd", "usr/share/doc/impactd/copyright",
                   "usr/share/doc/impactd/changelog.gz"}
        assert modes.keys() == wanted, modes.keys() ^ wanted
        assert {name for name, mode in modes.items() if mode != "-rw-r--r--"} == {"usr/bin/impactd"}
        depends = package.asked(deb, "-f", "Depends").strip()
        needed = subprocess.run(["ldd", program.impactd()], capture_output=True, text=True, check=True).stdout
        for library, name in (("libmicrohttpd", "libmicrohttpd12"), ("libsqlite3", "libsqlite3-0"), ("libfftw3", "libfftw3-double3")):
            assert library in needed and name in depends, (name, depends)
        assert "adduser" in depends and package.asked(deb, "-f", "Version").strip() == "7.8.9"
        control = os.path.join(folder, "control")
        package.asked(deb, "-e", control)
        assert set(os.listdir(control)) == {"control", "md5sums", "conffiles", "postinst", "prerm", "postrm"}
        with open(os.path.join(control, "conffiles"), encoding="utf-8") as file:
            assert file.read() == "/etc/default/impactd\n"
        package.asked(deb, "-x", os.path.join(folder, "tree"))
        with open(os.path.join(folder, "tree/usr/lib/systemd/system/impactd.service"), encoding="utf-8") as file:
            unit = file.read()
        assert "\nUser=impactd\n" in unit and "DynamicUser" not in unit and "ExecStart=/usr/bin/impactd serve\n" in unit
        shown = subprocess.run([os.path.join(folder, "tree/usr/bin/impactd"), "--version"], capture_output=True, check=True).stdout
        assert b"impactd" in shown


if __name__ == "__main__":
    program.main(globals())
