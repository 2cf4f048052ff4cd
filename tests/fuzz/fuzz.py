#!/usr/bin/env python3
"""Runs the targets of the fuzzer with libFuzzer, in a build of the preset fuzz, from the kept inputs in corpus/.

    fuzz.py --build build-fuzz --seconds 3600            all targets, one after the other, in so many seconds
    fuzz.py --build build-fuzz --seconds 600 rows head   these
    fuzz.py --build build-fuzz --seconds 60 --keep       keeps the inputs that reach something new, and only those
    fuzz.py --build build-fuzz --seconds 0               measures what the kept inputs reach
    fuzz.py --build build-fuzz --seconds 0 --keep        leaves out those that reach nothing of their own

An input that breaks a rule is printed as a line for corpus/. The end shows which regions (pieces of code that run as a whole)
and branches of the parsers the kept inputs reach."""

import argparse
import collections
import os
import re
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
SOURCE = os.path.dirname(os.path.dirname(HERE))
CORPUS = os.path.join(HERE, "corpus")
SIZE_MAX = 8192

# What reads bytes that others wrote.
PARSERS = """core/base/json_pointer.c core/base/rfc3339.c core/formats/force_trace_text.c core/formats/ground_motion_text.c
    core/formats/text_table.c server/cli/client.c server/http/header.c server/http/request.c server/jobs/outcome_blob.c
    server/json/document.c server/json/parse.c server/json/table.c server/materials/import.c server/util/csv.c
    server/util/units.c""".split()

ESCAPES = {ord("\n"): "\\n", ord("\r"): "\\r", ord("\t"): "\\t", ord("\\"): "\\\\"}


def encode(data):
    """An input as a line of corpus/."""
    return "".join(ESCAPES.get(byte, chr(byte) if 32 <= byte < 127 else f"\\x{byte:02x}") for byte in data)


def decode(line):
    return re.sub(rb"\\(x..|.)", lambda match: {b"n": b"\n", b"r": b"\r", b"t": b"\t", b"\\": b"\\"}.get(match[1])
                  or bytes([int(match[1][1:], 16)]), line.encode("ascii"))


def unpack(target, folder):
    """The kept inputs as files; returns them."""
    os.mkdir(folder)
    with open(os.path.join(CORPUS, f"{target}.txt"), encoding="ascii") as file:
        inputs = [decode(line.rstrip("\n")) for line in file]
    for number, data in enumerate(inputs):
        with open(os.path.join(folder, f"{number:05}"), "wb") as file:
            file.write(data)
    return inputs


def words(inputs):
    """The words that inputs share, as a dictionary of libFuzzer."""
    counts = collections.Counter()
    for data in inputs:
        counts.update(set(re.findall(rb"[A-Za-z_][A-Za-z_0-9-]{2,30}", data)))
    return "".join(f'"{word.decode()}"\n' for word, _ in counts.most_common(300))


class Fuzzer:
    def __init__(self, build, work):
        self.program = os.path.join(build, "tests", "fuzz")
        self.work = work

    def run(self, target, *arguments, profile=os.devnull):
        environment = {**os.environ, "IMPACTD_FUZZ": target, "LLVM_PROFILE_FILE": profile, "ASAN_OPTIONS": "detect_leaks=1",
                       "UBSAN_OPTIONS": "halt_on_error=1:print_stacktrace=1"}
        # What commands print is of no interest.
        quiet = "-close_fd_mask=3" if target == "replies" else "-close_fd_mask=1"
        return subprocess.run([self.program, quiet, f"-max_len={SIZE_MAX}", "-timeout=30", "-rss_limit_mb=4096",
                               f"-artifact_prefix={self.work}/wrong-", *arguments],
                              env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, errors="replace", check=False)

    def fuzz(self, target, seconds):
        """True if nothing broke a rule."""
        folder = os.path.join(self.work, target)
        dictionary = os.path.join(self.work, "words")
        with open(dictionary, "w", encoding="ascii") as file:
            file.write(words(unpack(target, folder)))
        done = self.run(target, f"-max_total_time={seconds}" if seconds > 0 else "-runs=0", f"-dict={dictionary}", "-print_final_stats=1", folder)
        executed = re.search(r"number_of_executed_units: (\d+)", done.stderr)
        edges = re.findall(r"cov: (\d+)", done.stderr)
        print(f"{target:<10} {executed[1] if executed else '?':>9} inputs, {edges[-1] if edges else '?':>6} edges, "
              f"{len(os.listdir(folder))} kept meanwhile", flush=True)
        if done.returncode == 0:
            return True
        print(done.stderr[-6000:])
        for name in os.listdir(self.work):
            if name.startswith("wrong-"):
                with open(os.path.join(self.work, name), "rb") as file:
                    print(f"{target} {name}: {encode(file.read())}")
                os.remove(os.path.join(self.work, name))
        return False

    def keep(self, target):
        """Writes the fewest inputs that reach all that the present ones do."""
        merged = os.path.join(self.work, target + "-merged")
        os.mkdir(merged)
        # How often a piece of code runs does not count.
        done = self.run(target, "-merge=1", "-use_counters=0", merged, os.path.join(self.work, target))
        assert done.returncode == 0, done.stderr[-3000:]
        lines = []
        for name in os.listdir(merged):
            with open(os.path.join(merged, name), "rb") as file:
                lines.append(encode(file.read()) + "\n")
        with open(os.path.join(CORPUS, f"{target}.txt"), "w", encoding="ascii") as file:
            file.writelines(sorted(lines, key=lambda line: (len(line), line)))

    def measure(self, targets):
        """Prints what the kept inputs of the targets reach."""
        profiles = []
        for target in targets:
            profiles.append(os.path.join(self.work, f"{target}.profraw"))
            folder = os.path.join(self.work, f"{target}-kept")
            unpack(target, folder)
            done = self.run(target, "-runs=0", folder, profile=profiles[-1])
            assert done.returncode == 0, done.stderr[-3000:]
        data = os.path.join(self.work, "profile")
        subprocess.run(["llvm-profdata", "merge", "-o", data, *profiles], check=True)
        report = subprocess.run(["llvm-cov", "report", self.program, f"-instr-profile={data}",
                                 *(os.path.join(SOURCE, path) for path in PARSERS)],
                                capture_output=True, text=True, check=True).stdout
        for line in report.splitlines():
            parts = line.split()
            if len(parts) == 13 and parts[0] != "Filename":
                name = os.path.relpath(os.path.join(SOURCE, parts[0]), SOURCE) if parts[0] != "TOTAL" else "together"
                print(f"{name:<40} {parts[1]:>5} regions {parts[3]:>7}  {parts[10]:>5} branches {parts[12]:>7}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(SOURCE, "build-fuzz"))
    parser.add_argument("--seconds", type=int, default=3600)
    parser.add_argument("--keep", action="store_true")
    parser.add_argument("targets", nargs="*", metavar="TARGET")
    arguments = parser.parse_args()
    targets = arguments.targets or sorted(name[:-len(".txt")] for name in os.listdir(CORPUS))
    failed = []
    with tempfile.TemporaryDirectory() as work:
        fuzzer = Fuzzer(arguments.build, work)
        for target in targets if arguments.seconds > 0 or arguments.keep else ():
            if not fuzzer.fuzz(target, arguments.seconds // len(targets)):
                failed.append(target)
            elif arguments.keep:
                fuzzer.keep(target)
        if not failed:
            fuzzer.measure(targets)
    print(f"{len(targets)} targets, broken: {', '.join(failed) or 'none'}")
    return len(failed)


if __name__ == "__main__":
    sys.exit(main())
