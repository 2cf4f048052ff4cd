"""Reads a daemon's database behind its back."""
import collections
import contextlib
import os
import shutil
import sqlite3
import tempfile


def rows(folder, query):
    """Reads a copy of the database as a killed daemon left it."""
    with tempfile.TemporaryDirectory() as copy:
        for name in os.listdir(folder):
            if name.startswith("impactd.db"):
                shutil.copy(os.path.join(folder, name), copy)
        with contextlib.closing(sqlite3.connect(os.path.join(copy, "impactd.db"))) as connection:
            return connection.execute(query).fetchall()


def job_counts(folder):
    """How often the database, which must be whole, has the job with each id."""
    with contextlib.closing(sqlite3.connect(os.path.join(folder, "impactd.db"))) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        return collections.Counter(row[0] for row in connection.execute("SELECT id FROM jobs"))
