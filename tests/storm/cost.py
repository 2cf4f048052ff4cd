#!/usr/bin/env python3
"""What expensive bodies cost a daemon, against what it predicted and allows: CPU time and memory.

    tests/storm/cost.py [N] [--seed 1] [--build build] [--kind WORD] [--list]

N bodies (2,000) of costly.py, scenes and studies of all kinds, are sent one at a time to a daemon with small limits. Three
of four are made so long that they are predicted to take a quarter of their limit, the fourth all of it. Each is sent once
more, longer, and has to be refused where its cost is predicted to be above the limit.

CPU is the daemon's, from the request to the answer; memory is what its peak is above its size before. Predictions are
seconds of the machine on which they were calibrated: a run of known work before each body measures how slow this one is
at the moment, and ratios are relative to that. Memory is compared where more than FLOOR is used.

Printed are the share of bodies that took at most twice what was predicted, by kind, of those with a quarter of their limit
(those that are stopped took at least what is stated), the largest CPU time over its limit, and the largest memory over its
limit. The end is 1 if one took more than three times its limit and OVERSHOOT, or if one
that is predicted to take more was not refused."""

import argparse
import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import costly  # noqa: E402
import program  # noqa: E402

RUN, STUDY = 0.05, 0.2   # [s] of CPU, the limits
MEMORY = 16 << 20        # [B] of a run, the limit
OVERSHOOT = 0.1          # [s] of CPU after a job has to end
FLOOR = 2 << 20          # [B] that a process may take for anything


def size_of(process, name):
    """VmRSS or VmHWM [B]."""
    with open(f"/proc/{process}/status", encoding="ascii") as file:
        return next(int(line.split()[1]) for line in file if line.startswith(name)) * 1024


def limit_of(body):
    return STUDY if "study" in body else RUN


def small_daemon():
    return program.daemon("--workers", "1", "--max-cpu-seconds", str(RUN), "--max-study-seconds", str(STUDY),
                          "--max-run-bytes", str(MEMORY), "--cache-bytes", "0", "--store-bytes", "0")


class Meter:
    """Sends bodies to a daemon, and measures it."""

    def __init__(self, daemon):
        self.daemon, self.process, self.references, self.asked = daemon, daemon.process.pid, 0, 0

    def predict(self, body):
        """The predicted cost, None where it is refused, and the reply."""
        before = program.cpu_of_threads(self.process)
        reply = self.daemon.request("POST", "/v1/jobs?dry_run=1", json=body)
        self.asked = max(self.asked, program.cpu_of_threads(self.process) - before)
        return (reply.json()["cost"] if reply.status == 200 else None), reply

    def run(self, body):
        """The job at its end, CPU [s] and memory [B]."""
        with open(f"/proc/{self.process}/clear_refs", "w", encoding="ascii") as file:
            file.write("5")  # the peak begins anew
        resident, cpu = size_of(self.process, "VmRSS"), program.cpu_of_threads(self.process)
        reply = self.daemon.request("POST", "/v1/jobs", json=body, headers={"Prefer": "wait=50"})
        while reply.status in (200, 202) and reply.json()["status"] in ("accepted", "running"):
            reply = self.daemon.get(f"/v1/jobs/{reply.json()['id']}?wait=50")
        assert reply.status == 200, reply
        return reply.json(), program.cpu_of_threads(self.process) - cpu, size_of(self.process, "VmHWM") - resident

    def slowness(self):
        """CPU of a run of known work over its prediction."""
        self.references += 1
        body = program.scene("paper_sine_aluminium")
        body.update(duration=10, sample_rate=1000, accuracy={"solver": "rk4", "step": 5e-5},
                    output={"channels": [], "psd": None, "reduction": False})
        body["dampers"][0]["clearance"] = 0.012 + 1e-8 * self.references
        return self.run(body)[1] / self.predict(body)[0]["cpu_seconds"]


def measure(meter, seed, number):
    kind, body = costly.drawn(seed, number)
    share = 1 if number % 4 == 3 else 0.25
    meter.asked = 0
    best, refused = costly.fitted(body, meter.predict, share * limit_of(body))
    found = {"number": number, "kind": kind, "share": share, "asked": meter.asked, "is_refused": best is None}
    if refused is not None:
        reply = meter.daemon.request("POST", "/v1/jobs", json=refused)
        found["wrongly_accepted"] = reply.status != 422
    if best is None:
        return found
    found["body"], cost = best
    slowness = meter.slowness()
    job, cpu, size = meter.run(found["body"])
    problem = job["problem"] or {"type": "", "detail": ""}
    found.update(status=job["status"], detail=problem["detail"], cpu=cpu, bytes=size,
                 is_whole=job["status"] == "successful" or problem["type"] == "/problems/limit",
                 predicted=cost["cpu_seconds"], predicted_bytes=cost["bytes"], slowness=slowness,
                 ratio=cpu / cost["cpu_seconds"] / slowness, memory_ratio=max(size - FLOOR, 0) / cost["bytes"],
                 of_limit=cpu / limit_of(body), bytes_of_limit=size / MEMORY)
    return found


def told(found):
    """One line."""
    line = f"{found['number']:5} {found['kind']:24} "
    if found["is_refused"]:
        return line + f"refused, asked {1e3 * found['asked']:.1f} ms"
    return (line + f"{found['status']:10} {found['share']:4} CPU {found['cpu']:.4f} of {found['predicted']:.4f} s x {found['slowness']:.2f}: "
            f"{found['ratio']:.2f}, memory {found['bytes'] / 1e6:.2f} of {found['predicted_bytes'] / 1e6:.2f} MB: "
            f"{found['memory_ratio']:.2f}, asked {1e3 * found['asked']:.1f} ms {found['detail'][:70]}")


def summary(kind, found):
    """How many ratios are at most 2, and the middle and the largest of them."""
    if not found:
        return
    words = ""
    for name in ("ratio", "memory_ratio"):
        ratios = sorted(one[name] for one in found)
        within = sum(ratio <= 2 for ratio in ratios)
        words += f" {100 * within / len(ratios):7.1f} {ratios[len(ratios) // 2]:7.2f} {ratios[-1]:7.2f} |"
    print(f"{kind:24} {len(found):6} |{words}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", nargs="?", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--kind", default="")
    parser.add_argument("--list", action="store_true")
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    with small_daemon() as daemon:
        return campaign(Meter(daemon), arguments)


def campaign(meter, arguments):
    costly.upload(meter.daemon)
    every = []
    for number in range(arguments.first, arguments.first + arguments.count):
        if arguments.kind in costly.drawn(arguments.seed, number)[0]:
            every.append(measure(meter, arguments.seed, number))
            if arguments.list:
                print(told(every[-1]), json.dumps(every[-1].get("body")), flush=True)
    ran = [one for one in every if not one["is_refused"]]
    quarter = [one for one in ran if one["share"] < 1 and one["is_whole"]]
    print(f"{'measured over predicted':24} {'bodies':>6} | CPU: in 2 [%], middle, most | memory: in 2 [%], middle, most")
    for kind in sorted({one["kind"] for one in quarter}):
        summary(kind, [one for one in quarter if one["kind"] == kind])
    summary("all", quarter)
    limit, size = max(one["of_limit"] for one in ran), max(one["bytes_of_limit"] for one in ran)
    beyond = [one for one in ran if one["cpu"] > 3 * limit_of(one["body"]) + OVERSHOOT or one["bytes"] > 3 * MEMORY + FLOOR]
    accepted = [one for one in every if one.get("wrongly_accepted")]
    for one in beyond + accepted:
        print(told(one))
    within = [100 * sum(one[name] <= 2 for one in quarter) / max(len(quarter), 1) for name in ("ratio", "memory_ratio")]
    print(f"at most twice the prediction: CPU of {within[0]:.1f} %, memory of {within[1]:.1f} %; {len(every)} bodies, {len(every) - len(ran)} refused at any length, {sum('wrongly_accepted' in one for one in every)} refused "
          f"when longer, {len(accepted)} of these accepted; most CPU {limit:.2f} and memory {size:.2f} of the limit, "
          f"{len(beyond)} above 3; most CPU to predict {1e3 * max(one['asked'] for one in every):.0f} ms")
    return 0 if not beyond and not accepted else 1


if __name__ == "__main__":
    sys.exit(main())
