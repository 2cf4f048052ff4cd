"""Tokens for a daemon, and commands run beside it. Not the daemon itself: that is daemon.py."""
import os
import re
import subprocess

import program


def impactd(*arguments, environment=None, seconds=20):
    """Runs a command to its end."""
    return subprocess.run([program.impactd(), *arguments], capture_output=True, text=True, timeout=seconds,
                          env={**os.environ, **(environment or {})})


def token(data, name, scopes="read,submit", *more):
    done = impactd("token", "create", "--name", name, "--scopes", scopes, "--data", data, *more)
    assert done.returncode == 0, done
    assert re.fullmatch(r"impactd_[0-9a-f]{64}\n", done.stdout), done.stdout
    return done.stdout.strip()


def bearer(text):
    return {"Authorization": f"Bearer {text}"}
