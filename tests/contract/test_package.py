#!/usr/bin/env python3
"""The Debian package in an empty Debian 12: installed, used, upgraded, removed and purged.

Needs root, debootstrap and Debian's archive; IMPACTD_DEBIAN names a folder with a base system to copy instead of one from
debootstrap. Nothing is mounted in the copy. systemd does not run in it."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import package  # noqa: E402
import program  # noqa: E402

NIGHTLY = True
SCENE = "/usr/share/impactd/examples/paper_free_sponge.json"
WANTED = "/etc/systemd/system/multi-user.target.wants/impactd.service"
DAEMON = "exec runuser -u impactd -- impactd serve --data /var/lib/impactd --listen 127.0.0.1:8379"
# Directories whose files dpkg, apt and adduser write whatever the package is; a backup of a file ends in "-".
IGNORED = ("var/log", "var/lib/dpkg", "var/cache", "var/lib/apt", "tmp", "var/lib/systemd", "proc", "sys", "dev", "run")


class Tree:
    """A base system in a folder of its own."""

    def __init__(self, folder):
        self.root = os.path.join(folder, "debian")
        given = os.environ.get("IMPACTD_DEBIAN")
        if given:
            subprocess.run(["cp", "-a", given, self.root], check=True)
        else:
            package.need("debootstrap")
            done = subprocess.run(["debootstrap", "--variant=minbase", "bookworm", self.root], capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise program.Skipped(f"debootstrap failed: {done.stdout.splitlines()[-1:]}")
        shutil.copy("/etc/resolv.conf", self.path("etc/resolv.conf"))

    def path(self, name):
        return os.path.join(self.root, name.lstrip("/"))

    def start(self, command, **options):
        environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/root", "LANG": "C.UTF-8", "DEBIAN_FRONTEND": "noninteractive"}
        return subprocess.Popen(["chroot", self.root, "/bin/sh", "-c", command], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                text=True, env=environment, **options)

    def run(self, command):
        """Runs the command there; what it printed."""
        process = self.start(command)
        text, errors = process.communicate()
        assert process.returncode == 0, (command, text, errors)
        return text

    def files(self):
        found = set()
        for folder, folders, files in os.walk(self.root):
            where = os.path.relpath(folder, self.root)
            folders[:] = [name for name in folders if os.path.normpath(os.path.join(where, name)) not in IGNORED]
            found |= {os.path.normpath(os.path.join(where, name)) for name in (*files, *folders)}
        return {name for name in found if not name.endswith("-")}


def served(tree, command):
    """Runs the command there while a daemon serves /var/lib/impactd as the package's user; what it printed."""
    daemon = tree.start(DAEMON)
    try:
        for _ in range(100):
            assert daemon.poll() is None, daemon.communicate()
            if os.path.exists(tree.path("/var/lib/impactd/impactd.db")):
                break
            time.sleep(0.1)
        return tree.run("export IMPACTD_SERVER=http://127.0.0.1:8379; for i in 1 2 3 4 5 6 7 8 9; do impactd get materials >/dev/null 2>&1; "
                        f"[ $? = 7 ] || break; sleep 0.3; done; {command}")
    finally:
        daemon.terminate()
        daemon.wait(20)


def test_lintian_finds_no_error():
    """lintian finds no error in the package."""
    package.need("lintian")
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(["lintian", "--fail-on", "error", package.made(folder)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_comes_and_goes():
    """An empty Debian 12 installs the package, runs a scene, serves, upgrades and keeps the data, removes it and purges it wholly."""
    if os.geteuid() != 0:
        raise program.Skipped("not root")
    with tempfile.TemporaryDirectory() as folder:
        tree = Tree(folder)
        version = subprocess.run([program.impactd(), "--version"], capture_output=True, text=True, check=True).stdout
        packages = {}
        for number in ("1.0", "1.1"):
            os.makedirs(os.path.join(folder, number))
            packages[number] = package.made(os.path.join(folder, number), number)
            shutil.copy(packages[number], tree.path("/tmp"))
        depends = package.asked(packages["1.0"], "-f", "Depends").split(", ")
        tree.run("apt-get update -qq && apt-get install -qq -y --no-install-recommends "
                 + " ".join(one.split(" ")[0] for one in depends))
        before = tree.files()

        def install(number):
            return tree.run(f"apt-get install -qq -y --no-install-recommends /tmp/{os.path.basename(packages[number])}")

        install("1.0")
        assert tree.run("impactd --version") == version
        assert json.loads(tree.run(f"impactd run {SCENE}"))["status"] == "successful"
        assert os.path.islink(tree.path(WANTED)), "the unit is not enabled"
        uid, gid = tree.run("id -u impactd; id -g impactd").split()
        assert 0 < int(uid) < 1000 and 0 < int(gid) < 1000
        # The unit's StateDirectory= does it where systemd runs.
        tree.run("install -d -m 0700 -o impactd -g impactd /var/lib/impactd")
        job = served(tree, f"impactd submit {SCENE} --wait 60").split()[-1]

        with open(tree.path("/etc/default/impactd"), "a", encoding="utf-8") as file:
            file.write("IMPACTD_WORKERS=1\n")
        os.unlink(tree.path(WANTED))  # as `systemctl disable` does
        install("1.1")
        assert tree.run("dpkg-query -W -f '${Version} ${Status}' impactd") == "1.1 install ok installed"
        with open(tree.path("/etc/default/impactd"), encoding="utf-8") as file:
            assert file.read().endswith("IMPACTD_WORKERS=1\n"), "the upgrade changed the configuration"
        assert not os.path.lexists(tree.path(WANTED)), "the upgrade enabled what was disabled"
        assert json.loads(served(tree, f"impactd get {job} job"))["status"] == "successful"

        tree.run("apt-get remove -qq -y impactd")
        assert not os.path.exists(tree.path("/usr/bin/impactd"))
        assert os.path.exists(tree.path("/etc/default/impactd")) and os.path.exists(tree.path("/var/lib/impactd/impactd.db"))
        install("1.1")
        assert json.loads(served(tree, f"impactd get {job} job"))["status"] == "successful"

        tree.run("apt-get purge -qq -y impactd")
        left = tree.files() - before
        assert not left, left
        assert "impactd" not in tree.run("dpkg-query -W; ls -R /var/lib/systemd /etc/systemd")


if __name__ == "__main__":
    program.main(globals())
