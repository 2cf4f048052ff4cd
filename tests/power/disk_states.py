"""What a disk may hold after a power failure, of what recorder.c wrote down.

The model: a file's bytes are on the disk when the file was synced after they were written. Of what was not synced, any
sector of 512 bytes may be there or not, in any combination, and so may a change of the file's size. Names of files are on
the disk when their folder was synced; later ones are there up to some moment, as file systems with a journal do it."""

import os
import struct

HEAD = struct.Struct("<IIQq")
MADE, WROTE, TRUNCATED, SYNCED, SYNCED_FOLDER, RENAMED, REMOVED, LINKED = range(1, 9)
SECTOR = 512
MODES = ("dropped", "kept", "reordered", "torn", "last torn")


def read(path):
    """All records of a file: (its place there, kind, inode, offset or size, bytes)."""
    with open(path, "rb") as file:
        log = file.read()
    place, records = 0, []
    while place < len(log):
        kind, size, inode, offset = HEAD.unpack_from(log, place)
        start = place + HEAD.size
        records.append((place, kind, inode, offset, log[start:start + size]))
        place = start + size
    return records


class File:
    def __init__(self):
        self.synced = bytearray()
        self.pending = []  # (offset, bytes), or (size, None)

    @staticmethod
    def apply(content, offset, data):
        if data is None:
            if offset < len(content):
                del content[offset:]
            else:
                content.extend(bytes(offset - len(content)))
            return
        if offset > len(content):
            content.extend(bytes(offset - len(content)))
        content[offset:offset + len(data)] = data

    def sync(self):
        for change in self.pending:
            self.apply(self.synced, *change)
        self.pending = []

    def left(self, mode, chance):
        """The bytes after a failure."""
        content = bytearray(self.synced)
        for number, (offset, data) in enumerate(self.pending):
            is_last = number == len(self.pending) - 1
            is_torn = mode == "torn" or (mode == "last torn" and is_last)
            if data is not None and is_torn:
                # Sectors are those of the disk, also where a write begins between two of them.
                at = 0
                while at < len(data):
                    end = min(len(data), at + SECTOR - (offset + at) % SECTOR)
                    if chance.random() < 0.5:
                        self.apply(content, offset + at, data[at:end])
                    at = end
            elif mode in ("kept", "last torn") or (mode != "dropped" and chance.random() < 0.5):
                self.apply(content, offset, data)
        return content


class Disk:
    """The folder at one moment; `play` goes on to the next record."""

    def __init__(self):
        self.inodes, self.names, self.changes = {}, {}, []

    def play(self, record):
        _, kind, inode, offset, data = record
        if kind == MADE:
            self.inodes[inode] = File()
            self.changes.append((MADE, os.path.basename(data.decode()), self.inodes[inode]))
        elif kind == WROTE:
            self.inodes[inode].pending.append((offset, data))
        elif kind == TRUNCATED:
            self.inodes[inode].pending.append((offset, None))
        elif kind == SYNCED:
            self.inodes[inode].sync()
        elif kind == SYNCED_FOLDER:
            self.names, self.changes = self.named(len(self.changes)), []
        elif kind == REMOVED:
            self.changes.append((REMOVED, os.path.basename(data.decode()), None))
        else:
            pair = [os.path.basename(name.decode()) for name in data.split(b"\0")[:2]]
            self.changes.append((kind, *pair))

    def named(self, count):
        """The files by name, with the first of the changes that were not synced."""
        names = dict(self.names)
        for kind, name, other in self.changes[:count]:
            if kind == MADE:
                names[name] = other
            elif kind == REMOVED:
                names.pop(name, None)
            elif name in names:
                names[other] = names[name]
                if kind == RENAMED:
                    del names[name]
        return names

    def fail(self, folder, mode, chance):
        """Writes what is left into an empty folder."""
        count = {"kept": len(self.changes), "dropped": 0}.get(mode)
        names = self.named(chance.randint(0, len(self.changes)) if count is None else count)
        for name, file in names.items():
            with open(os.path.join(folder, name), "wb") as target:
                target.write(file.left(mode, chance))
        if "impactd.db" in names and chance.random() < 0.3:  # of which nothing may be believed
            with open(os.path.join(folder, "impactd.db-shm"), "wb") as target:
                target.write(chance.randbytes(32768))
