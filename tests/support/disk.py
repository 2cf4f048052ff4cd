"""A small disk of its own for a test, and a way to fill it.

Not for tests that only need a folder."""

import contextlib
import os
import shutil
import subprocess
import tempfile

import program

SIZE = 24  # [MiB]


@contextlib.contextmanager
def small_disk():
    """A folder on a disk of its own."""
    folder = tempfile.mkdtemp(prefix="impactd-disk-")
    try:
        done = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={SIZE}m", "tmpfs", folder],
                              capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise program.Skipped(f"no disk of its own can be mounted here: {done.stderr.strip()}")
        try:
            yield folder
        finally:
            subprocess.run(["umount", "-l", folder], check=False)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def fill(folder):
    """Takes all that is free but for a few pages."""
    ballast = os.path.join(folder, "ballast")
    with open(ballast, "wb", buffering=0) as file:
        with contextlib.suppress(OSError):
            while True:
                file.write(b"0" * 4096)
    return ballast
