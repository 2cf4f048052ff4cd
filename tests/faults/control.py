"""Arms tests/faults/interpose.c: which call of which kind fails in a process, and how. Not the requests that are sent meanwhile."""
import ctypes
import mmap
import os
import re
import subprocess
import tempfile

import program

ALLOCATIONS = 1
# What may fail below the data folder, and the bits of interpose.c for it: every call, those that take room, those with a count.
KINDS = {"EIO": (0x3FE, 5), "ENOSPC": (0x25A, 28), "short": (0x0C, 0)}


class Fields(ctypes.Structure):
    _fields_ = [("n", ctypes.c_uint64), ("count", ctypes.c_uint64), ("failed", ctypes.c_uint64), ("calls", ctypes.c_uint32),
                ("is_permanent", ctypes.c_uint32), ("error", ctypes.c_int32)]


def library():
    return os.path.join(program.build, "tests", "libinterpose.so")


class Control:
    """The control file of one daemon or command, and the environment that it is to be started with."""

    def __init__(self, folder):
        self.file = tempfile.NamedTemporaryFile(prefix="impactd-faults-")
        self.file.truncate(mmap.PAGESIZE)
        self.map = mmap.mmap(self.file.fileno(), mmap.PAGESIZE)
        self.fields = Fields.from_buffer(self.map)
        preload = library()
        if "address" in program.sanitizer():
            # The sanitizer has to come first in a program's list of libraries, or to accept that it does not.
            done = subprocess.run(["ldd", program.impactd()], capture_output=True, text=True, check=True)
            preload += ":" + re.search(r"(/\S*libasan\S*)", done.stdout)[1]
        self.environment = {"LD_PRELOAD": preload, "IMPACTD_FAULTS": self.file.name, "IMPACTD_FAULTS_BELOW": folder,
                            "ASAN_OPTIONS": os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"}

    def arm(self, n, calls=ALLOCATIONS, error=0, permanent=False):
        """The n-th of these calls from now on fails; n = 0 only counts them."""
        self.fields.calls = 0
        self.fields.n, self.fields.count, self.fields.failed = n, 0, 0
        self.fields.is_permanent, self.fields.error = int(permanent), error
        self.fields.calls = calls

    def disarm(self):
        """Returns how many calls there were and how many failed."""
        self.fields.calls = 0
        return self.fields.count, self.fields.failed
