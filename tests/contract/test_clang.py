#!/usr/bin/env python3
"""What the second compiler says of the sources. tests/nightly.sh runs the tests as it compiles them."""

import json
import os
import shlex
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

NIGHTLY = True

# What only gcc compiles: references in quad precision and what asks them.
GCC_ONLY = ("tests/truth/", "tests/bench/")


def commands():
    """How gcc was called for each source: folder and arguments, a source of several programs once."""
    with open(os.path.join(program.build, "compile_commands.json"), encoding="utf-8") as file:
        found = {entry["file"]: entry for entry in json.load(file)}
    for path, entry in sorted(found.items()):
        if not os.path.relpath(path, program.SOURCE).startswith(GCC_ONLY):
            yield path, entry["directory"], shlex.split(entry["command"])


def test_clang_has_no_warning():
    """clang checks every source of the program and of the C tests with the flags of the build, and warns of nothing."""
    if shutil.which("clang") is None:
        raise program.Skipped("clang is not here (Debian package clang)")
    count, said = 0, []
    for path, folder, words in commands():
        # "[ccache] cc FLAGS -o OBJECT -c SOURCE"
        flags = words[1:words.index("-o")]
        if flags[0].endswith(("/cc", "/c++", "/gcc", "/g++")):
            del flags[0]
        compiler = "clang++" if path.endswith(".cpp") else "clang"
        done = subprocess.run([compiler, *flags, "-fsyntax-only", path], cwd=folder, capture_output=True, text=True, check=False)
        count += 1
        if done.returncode != 0 or done.stderr:
            said.append(done.stderr[:2000] or f"{path}: clang ended with {done.returncode}")
    assert not said, "\n".join(said)
    assert count > 400, count


if __name__ == "__main__":
    program.main(globals())
