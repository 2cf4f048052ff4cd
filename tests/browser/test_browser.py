#!/usr/bin/env python3
"""Runs the browser tests (run.mjs) with what they need from npm, which is fetched once.

    tests/browser/test_browser.py --build build [WORD...]     only tests whose file or sentence holds a WORD

Other options are those of run.mjs."""

import argparse
import os
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
BUILD = os.path.join(HERE, "..", "..", "build")


def ends(why):
    print(f"FAIL  the browser tests cannot run: {why}")
    print("tests/browser: 0 passed, 1 failed")
    sys.exit(1)


def fetch():
    """playwright-core and axe-core, as package-lock.json pins them; asks no network where they are there."""
    taken = os.path.join(HERE, "node_modules", ".taken")
    with open(os.path.join(HERE, "package-lock.json"), encoding="utf-8") as file:
        pinned = file.read()
    if os.path.exists(taken):
        with open(taken, encoding="utf-8") as file:
            if file.read() == pinned:
                return
    done = subprocess.run(["npm", "ci", "--loglevel=error", "--ignore-scripts"], cwd=HERE, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        ends("npm cannot fetch playwright-core and axe-core (tests/browser/package-lock.json); is there a network? "
             + done.stderr.strip()[-500:])
    with open(taken, "w", encoding="utf-8") as file:
        file.write(pinned)


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--build", default=BUILD, help="folder of the build to test")
arguments, others = parser.parse_known_args()  # the others are run.mjs's: --slow, --seed, words of tests
for program in ("node", "npm", "chromium-headless-shell"):
    if shutil.which(program) is None:
        ends(f"{program} is not here (tests/packages.txt)")
fetch()
sys.stdout.flush()
os.execvp("node", ["node", os.path.join(HERE, "run.mjs"), "--build", arguments.build, *others])
