"""Arms tests/faults/interpose.c: which call of which kind fails in a process, and how. Not the requests that are sent meanwhile."""
import ctypes
import mmap
import os
import re
import subprocess
import tempfile

import program

ALLOCATIONS = 1
MAX_STACKS = 1 << 16
# What may fail below the data folder, and the bits of interpose.c for it: every call, those that take room, those with a count.
KINDS = {"EIO": (0x3FE, 5), "ENOSPC": (0x25A, 28), "short": (0x0C, 0)}


class Fields(ctypes.Structure):
    _fields_ = [("n", ctypes.c_uint64), ("count", ctypes.c_uint64), ("failed", ctypes.c_uint64), ("calls", ctypes.c_uint32),
                ("is_permanent", ctypes.c_uint32), ("error", ctypes.c_int32), ("lists_stacks", ctypes.c_uint32),
                ("stack", ctypes.c_uint64), ("stacks", ctypes.c_uint64 * MAX_STACKS)]


def library():
    return os.path.join(program.build, "tests", "libinterpose.so")


class Control:
    """The control file of one daemon or command, and the environment that it is to be started with."""

    def __init__(self, folder):
        self.file = tempfile.NamedTemporaryFile(prefix="impactd-faults-")
        self.file.truncate(ctypes.sizeof(Fields))
        self.map = mmap.mmap(self.file.fileno(), ctypes.sizeof(Fields))
        self.fields = Fields.from_buffer(self.map)
        preload = library()
        if "address" in program.sanitizer():
            # The sanitizer has to come first in a program's list of libraries, or to accept that it does not.
            done = subprocess.run(["ldd", program.impactd()], capture_output=True, text=True, check=True)
            preload += ":" + re.search(r"(/\S*libasan\S*)", done.stdout)[1]
        self.environment = {"LD_PRELOAD": preload, "IMPACTD_FAULTS": self.file.name, "IMPACTD_FAULTS_BELOW": folder,
                            "ASAN_OPTIONS": os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"}

    def arm(self, n, calls=ALLOCATIONS, error=0, permanent=False, stack=0, lists_stacks=False):
        """The n-th of these calls from now on fails, or from the first one with a call stack on; n = 0 only counts them."""
        self.fields.calls = 0
        self.fields.n, self.fields.count, self.fields.failed = n, 0, 0
        self.fields.is_permanent, self.fields.error = int(permanent), error
        self.fields.stack, self.fields.lists_stacks = stack, int(lists_stacks)
        self.fields.calls = calls

    def stacks(self):
        """The distinct call stacks of the allocations so far, as numbers that are the same in each run of a program."""
        found = [stack for stack in self.fields.stacks if stack]
        assert len(found) < MAX_STACKS / 2, len(found)
        return sorted(found)

    def disarm(self):
        """Returns how many calls there were and how many failed."""
        self.fields.calls = 0
        return self.fields.count, self.fields.failed
