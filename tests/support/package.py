"""The Debian package of a build, as `cpack -G DEB` makes it."""

import os
import shutil
import subprocess

import program


def need(*tools):
    for tool in tools:
        if shutil.which(tool) is None:
            raise program.Skipped(f"{tool} is not here")


def made(folder, version=None):
    """Makes the package in the folder; its path. Of another version, if one is given."""
    need("cpack", "dpkg-shlibdeps", "file")
    command = ["cpack", "-G", "DEB", "-B", folder, "--config", os.path.join(program.build, "CPackConfig.cmake")]
    if version is not None:
        command += ["-D", f"CPACK_PACKAGE_VERSION={version}"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    found = [name for name in os.listdir(folder) if name.endswith(".deb") and (version or "") in name]
    assert len(found) == 1, found
    return os.path.join(folder, found[0])


def asked(package, *arguments):
    """What dpkg-deb prints of it."""
    return subprocess.run(["dpkg-deb", arguments[0], package, *arguments[1:]], capture_output=True, text=True, check=True).stdout
