"""What the campaigns of inject.py and commands.py share: counts, a verdict, and the calls dealt to processes."""
import argparse
import collections
import concurrent.futures
import os
import time

import program
from control import ALLOCATIONS, KINDS


class Campaign:
    """Every `stride`-th call or call stack from the `first` to the `last`. A campaign adds run(name)."""

    def __init__(self, kind, stride=1, first=1, last=None):
        self.kind = kind
        self.calls, self.error = KINDS.get(kind, (ALLOCATIONS, 0))
        self.tried, self.outcomes, self.wrong = 0, collections.Counter(), []
        self.chosen = slice(first - 1, last, stride)

    def fault(self, what, text):
        self.outcomes[what] += 1
        self.wrong.append(text)
        print(f"  {what}: {text[:600]}", flush=True)

    def disarm(self, control):
        """After the call that was to fail."""
        self.tried += 1
        self.outcomes["not reached"] += control.disarm()[1] == 0

    def is_good(self):
        """Nothing is wrong, and most faults did happen."""
        return not self.wrong and self.outcomes["not reached"] * 2 < self.tried


def run_part(make, kind, stride, first, name):
    """What a process does: the calls of one name that are dealt to it."""
    campaign = make(kind, stride, first)
    campaign.run(name)
    return campaign.tried, campaign.outcomes, campaign.wrong


def main(make, document, kinds, names, processes):
    """`names` returns those of a kind, if none is given."""
    parser = argparse.ArgumentParser(description=document.split("\n")[0])
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--stride", type=int, default=1, help="each so many calls")
    parser.add_argument("--processes", type=int, default=processes, help="at the same time")
    parser.add_argument("kind", choices=kinds)
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_intermixed_args()
    program.build = os.path.abspath(arguments.build)
    total, began = make(arguments.kind), time.monotonic()
    stride = arguments.stride * arguments.processes
    with concurrent.futures.ProcessPoolExecutor(arguments.processes) as pool:
        parts = {name: [pool.submit(run_part, make, arguments.kind, stride, first, name) for first in range(1, stride + 1, arguments.stride)]
                 for name in arguments.names or names(arguments.kind)}
        for name, done in parts.items():
            before = total.tried
            for tried, outcomes, wrong in (one.result() for one in done):
                total.tried += tried
                total.outcomes += outcomes
                total.wrong += wrong
            print(f"{name}: {total.tried - before} tried, after {time.monotonic() - began:.0f} s", flush=True)
    print(f"{arguments.kind}: {total.tried} tried, " + ", ".join(f"{count} {what}" for what, count in sorted(total.outcomes.items())))
    return 0 if total.is_good() else 1
