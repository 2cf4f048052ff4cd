#!/usr/bin/env python3
"""How many lines and branches of server/ and core/ the tests reach, in a build of the preset coverage.

    coverage.py --build build-coverage run [NAME]   runs the unit tests and those of contract/ that a commit has to pass, and the
                                                 drills of clusters; all or those whose name holds NAME; prints the figures
    coverage.py --build build-coverage           prints the figures, by folder
    coverage.py --build build-coverage WORD...   prints the unreached lines and branches of files whose path holds a word

A branch is one of the ways out of a condition, as gcc compiles it with -O1: `a && b` has four. Processes that are killed
leave no counts. The verdicts of the tests do not matter here: other builds have them."""

import argparse
import collections
import glob
import json
import os
import subprocess
import sys

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
TARGETS = ("impactd_core", "impactd_server", "impactd")

# Contract tests that run no program of the build, or only other programs.
WITHOUT_PROGRAM = ("dependencies", "includes", "language", "lint", "traffic", "web")


def run(build, name):
    """Forgets all counts and runs the tests whose name holds `name`."""
    for path in glob.glob(os.path.join(build, "**", "*.gcda"), recursive=True):
        os.remove(path)
    subprocess.run(["ctest", "--test-dir", build, "-j", str(os.cpu_count()), "-R", f"/test_.*{name}"], check=False)
    for path in sorted(glob.glob(os.path.join(SOURCE, "tests", "contract", "test_*.py"))):
        with open(path, encoding="utf-8") as file:
            is_nightly = "\nNIGHTLY = True" in file.read()
        test = os.path.basename(path)[len("test_"):-len(".py")]
        if (is_nightly and test != "slurm_drills") or test in WITHOUT_PROGRAM or name not in test:
            continue
        done = subprocess.run([sys.executable, path, "--build", build], capture_output=True, text=True, check=False)
        print((done.stdout.splitlines() or [f"{path} printed nothing"])[-1], flush=True)


def counts(build):
    """path -> line -> (count, [count of each branch]) of every source file of the program, reached or not."""
    found = collections.defaultdict(dict)
    for target in TARGETS:
        for note in sorted(glob.glob(os.path.join(build, "CMakeFiles", f"{target}.dir", "**", "*.gcno"), recursive=True)):
            done = subprocess.run(["gcov", "--json-format", "--stdout", "--branch-probabilities", note],
                                  capture_output=True, text=True, check=True)
            for file in json.loads(done.stdout)["files"]:
                path = os.path.relpath(os.path.join(SOURCE, file["file"]), SOURCE)
                if not path.startswith(("server/", "core/")) or path.endswith(".h"):
                    continue
                for line in file["lines"]:
                    found[path][line["line_number"]] = (line["count"], [branch["count"] for branch in line["branches"]])
    return found


def total(lines):
    """Of one or more files: (lines, reached ones, branches, reached ones)."""
    branches = [count for _, ways in lines for count in ways]
    return len(lines), sum(count > 0 for count, _ in lines), len(branches), sum(count > 0 for count in branches)


def share(reached, of):
    return f"{100 * reached / of:5.1f} %" if of else "     -"


def show(name, lines):
    line, lines_reached, branch, branches_reached = total(lines)
    print(f"{name:<20} {line:6} lines {share(lines_reached, line)}   {branch:6} branches {share(branches_reached, branch)}")


def show_unreached(path, lines):
    with open(os.path.join(SOURCE, path), encoding="utf-8") as file:
        text = file.read().splitlines()
    show(path, list(lines.values()))
    for number, (count, ways) in sorted(lines.items()):
        if count == 0 or 0 in ways:
            mark = "never" if count == 0 else f"{sum(way == 0 for way in ways)}/{len(ways)}"
            print(f"{mark:>6} {number:5}  {text[number - 1]}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(SOURCE, "build-coverage"))
    parser.add_argument("words", nargs="*", metavar="WORD", help="run, or parts of paths")
    arguments = parser.parse_args()
    is_run = arguments.words[:1] == ["run"]
    if is_run:
        run(arguments.build, "".join(arguments.words[1:2]))
    found = counts(arguments.build)
    if arguments.words and not is_run:
        for path, lines in sorted(found.items()):
            if any(word in path for word in arguments.words):
                show_unreached(path, lines)
        return
    folders = collections.defaultdict(list)
    for path, lines in found.items():
        for name in (os.path.dirname(path), path.split("/")[0], "together"):
            folders[name] += lines.values()
    for name in sorted(folders):
        show(name, folders[name])
    sys.exit(0 if any(count > 0 for count, _ in folders["together"]) else "no test has run in this build")


if __name__ == "__main__":
    main()
