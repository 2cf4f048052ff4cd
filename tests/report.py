#!/usr/bin/env python3
"""Writes the figures of a README anew: each block between two markers is what the command in the first marker prints.

    /usr/bin/python3 tests/report.py tests/bench/README.md              # lists the commands
    /usr/bin/python3 tests/report.py tests/bench/README.md order.py     # runs those whose command has this word
    /usr/bin/python3 tests/report.py tests/bench/README.md --all

A block is `<!-- measured: COMMAND -->`, a line with the command, the machine and the date, the output, `<!-- end -->`. Output
that is no Markdown table is a ```text block. Commands run in the folder of the sources; programs are those of build/."""

import argparse
import datetime
import os
import re
import shlex
import subprocess
import sys

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
BLOCK = re.compile(r"(<!-- measured: (.+?) -->\n)(.*?)(<!-- end -->)", re.S)


def machine():
    """The processor as Linux names it, and the number of processors."""
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        text = file.read()
    name, flags = (re.search(rf"^{key}\s*: (.*)$", text, re.M) for key in ("model name", "flags"))
    width = next((label for flag, label in (("avx512f", ", AVX-512"), ("avx2", ", AVX2"))
                  if flags and flag in flags[1].split()), "")
    return f"{name[1] if name else 'unknown processor'}, {os.cpu_count()} processors{width}"


def block(command, output):
    """The lines between the markers. Of what a program prints only the table counts, if there is one."""
    table = re.search(r"^\|.*?(?:\n(?!\|)|\Z)", output, re.M | re.S)
    text = table[0].rstrip() if table else f"```text\n{output.rstrip()}\n```"
    return f"`{command}`, {machine()}, {datetime.date.today().isoformat()}:\n\n{text}\n"


def measured(command):
    arguments = shlex.split(command)
    if arguments[0].endswith(".py"):
        arguments.insert(0, sys.executable)
    done = subprocess.run(arguments, cwd=SOURCE, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{command}: exit code {done.returncode}, nothing is written")
    return done.stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("readme")
    parser.add_argument("word", nargs="*", help="run the commands that have one of these words")
    parser.add_argument("--all", action="store_true", help="run all commands")
    arguments = parser.parse_args()
    with open(arguments.readme, encoding="utf-8") as file:
        commands = [found[2] for found in BLOCK.finditer(file.read())]
    for command in commands:
        if not arguments.all and not any(word in command for word in arguments.word):
            print(command)
            continue
        new = block(command, measured(command))
        with open(arguments.readme, encoding="utf-8") as file:  # a program may have written to the page itself
            text = file.read()
        text = BLOCK.sub(lambda found, new=new, command=command:
                         found[1] + new + found[4] if found[2] == command else found[0], text)
        with open(arguments.readme, "w", encoding="utf-8") as file:
            file.write(text)
        print(f"{command}: written")


if __name__ == "__main__":
    main()
