"""Bodies of at most 2 kB that are as expensive as a daemon's limits allow: drawn scenes and studies for cost.py.

Body `number` of a seed is always the same. `drawn` makes it with any duration; `fitted` finds the duration with which it
is predicted to take most of what is allowed."""

import json
import math
import random
import re

BYTES = 2000  # of a body
POWER_LAWS = ("hertz", "hunt_crossley", "hunt_crossley_textbook", "lankarani_nikravesh", "flores", "jankowski")
METRICS = ("peak_displacement", "rms_displacement", "peak_acceleration", "rms_acceleration", "impacts")


def scattered(dice, low, high):
    """Log-uniform, with few digits."""
    return float(f"{low * (high / low) ** dice.random():.4g}")


def numbers(dice, count, low, high):
    return [float(f"{dice.uniform(low, high):.3g}") for _ in range(count)]


def structure(dice, storeys):
    if storeys == 1:
        made = {"mass": 1.35, "stiffness": scattered(dice, 1, 1e7)}
        made.update(dice.choice([{"damping": dice.choice([0, 1])}, {"damping_ratio": scattered(dice, 1e-4, 1)}]))
        return made
    stiff = scattered(dice, 1e2, 1e6)
    made = {"kind": "frame", "masses": dice.choice([[1] * storeys, numbers(dice, storeys, 1, 5)]),
            "stiffnesses": dice.choice([[stiff] * storeys, numbers(dice, storeys, stiff, 3 * stiff)])}
    if storeys > 60:
        made.update(masses=[1] * storeys, stiffnesses=[900] * storeys)
    made.update({"damping_ratio": 0.02} if storeys > 60 or dice.random() < 0.6 else {"dampings": numbers(dice, storeys, 0.2, 2)})
    return made


def damper(dice, storeys, is_power, law):
    """From bare metal to mud; no clearance, so that masses chatter and rest; or one that is never crossed."""
    buffer = {"restitution": 1 if law == "hertz" else dice.choice([0.05, 0.3, 0.7, 0.95, 0.99]),
              "contact_time": scattered(dice, 1e-6, 0.05)}
    if is_power and dice.random() < 0.5:
        buffer["exponent"] = dice.choice([1.1, 2, 3])
    clearance = dice.choice([1e-6 if is_power else 0, 1e-6, scattered(dice, 1e-4, 0.05), 10])
    return {"mass": scattered(dice, 1e-3, 10), "clearance": clearance,
            "storey": dice.randint(1, storeys), "buffer": buffer}


def excitation(dice, storeys, seconds):
    """Also bases that are far faster than the samples."""
    amplitude, frequency = scattered(dice, 0.1, 100), scattered(dice, 0.1, 1e4)
    kind = dice.choice(["free", "random", "random", "random", "sine", "sine", "chirp", "half_sine", "triangular", "record"])
    if kind == "free":
        return {"kind": kind, "displacement": [scattered(dice, 1e-3, 0.1)] * storeys}
    if kind == "random":
        top = scattered(dice, 1, 500)
        made = {"kind": kind, "seed": dice.randrange(1000), "rms": amplitude, "band": [dice.choice([0, 0.9 * top]), top]}
        if dice.random() < 0.4:
            made["rate"] = scattered(dice, 2.1 * top, 1e5 if top < 1e4 else 3 * top)
        return made
    if kind == "sine":
        return {"kind": kind, "amplitude": amplitude, "frequency": frequency}
    if kind == "chirp":
        return {"kind": kind, "amplitude": amplitude, "start_frequency": 0.5, "end_frequency": frequency,
                "rate": scattered(dice, 10 * frequency, 100 * frequency)}
    if kind == "record":
        return {"kind": kind, "interval": scattered(dice, 1e-5, seconds / 4), "samples": numbers(dice, 60, -10, 10)}
    return {"kind": kind, "amplitude": amplitude, "length": scattered(dice, 1e-3, seconds)}


def accuracy(dice, is_power):
    solver = dice.choice(["exact", "exact", "rk4", "newmark", "adaptive", "auto"] + ["precise"] * (not is_power))
    if solver == "auto":
        return {"solver": solver, "target": scattered(dice, 1e-10, 1e-2)} if dice.random() < 0.6 else {"solver": solver}
    if dice.random() < 0.4:
        return {"solver": solver}
    if solver == "exact":
        return {"solver": solver, "tolerance": scattered(dice, 1e-15, 1e-2)} if is_power else {"solver": solver}
    if solver == "adaptive":
        return {"solver": solver, "tolerance": scattered(dice, 1e-13, 1e-3)}
    return {"solver": solver, "step": scattered(dice, 1e-7, 1e-3)}


def output(dice, storeys, dampers):
    """All samples, no samples; segments of any length, also primes, and all but all of them overlapping."""
    names = [f"{name}_{k}" for name in ("displacement", "velocity", "acceleration") for k in range(1, min(storeys, 10) + 1)]
    names += [f"{name}_{k}" for name in ("damper_displacement", "penetration") for k in range(1, dampers + 1)]
    if storeys == 1 and dampers < 2:
        names = [name.removesuffix("_1") for name in names]
    made = {"channels": dice.choice([[], names, names[:1]]), "psd": None}
    if dice.random() < 0.4:
        segment = dice.choice([1 << dice.randint(3, 17), dice.choice([127, 8191, 65537, 131071, 100003, 9973 * 7])])
        overlap = dice.choice([0, segment // 2, segment * 15 // 16, segment - 1])
        made["psd"] = {"channels": names[:dice.choice([1, 1, 8])], "segment": segment, "overlap": overlap}
    for name in ("reduction", "impacts"):
        if dice.random() < 0.3:
            made[name] = False
    return made


def scene(dice, is_simple=False):
    storeys = 1 if is_simple or dice.random() < 0.5 else int(scattered(dice, 2, 200))
    room = max(0, min(14, (1500 - 16 * storeys) // 110))
    dampers = dice.choice([0, 1, 1, 1, 1, dice.randint(1, 4), dice.randint(1, 14)]) if not is_simple else 1
    dampers = min(dampers, room)
    is_power = dampers > 0 and not is_simple and dice.random() < 0.25
    law = dice.choice(POWER_LAWS) if is_power else None
    rate = scattered(dice, 50, 1e5)
    seconds = scattered(dice, 0.1, 100)
    made = {"duration": seconds, "sample_rate": rate, "structure": structure(dice, storeys),
            "dampers": [damper(dice, storeys, is_power, law) for _ in range(dampers)],
            "excitation": excitation(dice, storeys, seconds), "accuracy": accuracy(dice, is_power),
            "output": output(dice, storeys, dampers)}
    if is_power:
        made["contact"] = {"model": law}
    elif dampers > 0 and dice.random() < 0.3:
        made["contact"] = dice.choice([{"model": "impulse"}, {"model": "spring_damper", "separation": "zero_force"}])
    if is_simple:
        made["output"]["psd"] = None
    return made


def study_scene(dice, kind):
    """A scene that the study takes."""
    made = scene(dice, is_simple=dice.random() < 0.7)
    while not made["dampers"]:
        made = scene(dice, is_simple=True)
    made["dampers"][0]["clearance"] = scattered(dice, 1e-4, 0.05)
    if kind in ("ensemble", "optimize") and dice.random() < 0.7:
        made["excitation"] = {"kind": "random", "band": [0, scattered(dice, 5, 50)], "rms": 1, "seed": 1}
    if kind == "response":
        made["excitation"] = {"kind": "sine", "frequency": scattered(dice, 0.5, 50), "amplitude": scattered(dice, 0.1, 10)}
    return made


CLEARANCE = {"pointer": "/dampers/0/clearance", "from": 0.001, "to": 0.05}
MASS = {"pointer": "/dampers/0/mass", "from": 0.01, "to": 1}
DURATION = {"pointer": "/sample_rate", "from": 100, "to": 10000}


def study(dice, kind, made):
    if kind == "sweep":
        count = int(scattered(dice, 2, 300))
        axes = dice.choice([[{**CLEARANCE, "count": count}], [{**MASS, "count": count}, {**CLEARANCE, "count": 7}],
                            [{**DURATION, "count": count, "spacing": "logarithmic"}]])
        return {"kind": kind, "axes": axes, "metrics": list(METRICS)}
    if kind == "ensemble":
        found = {"kind": kind, "runs": int(scattered(dice, 2, 1000))}
        if made["excitation"]["kind"] != "random" or dice.random() < 0.3:
            found["inputs"] = [{"pointer": "/dampers/0/clearance", "distribution": "uniform", "from": 0.001, "to": 0.05}]
            found["sobol_indices"] = dice.random() < 0.5
        return found
    if kind == "compare":
        return {"kind": kind}
    if kind == "sensitivity":
        return {"kind": kind, "restitution_deviation": 0.1, "contact_time_deviation": 0.1, "runs": int(scattered(dice, 1, 500))}
    if kind == "tradeoff":
        return {"kind": kind, "repeats": dice.choice([1, 5]), "trial": dice.randrange(1, 1000)}
    if kind == "response":
        return {"kind": kind, "axis": {"pointer": dice.choice(["/excitation/frequency", "/excitation/amplitude"]), "from": 0.5,
                                       "to": 20, "count": int(scattered(dice, 2, 200))},
                "direction": dice.choice(["up", "both"]), "continuation": dice.random() < 0.3,
                "settle_cycles": int(scattered(dice, 1, 1000)), "max_period": dice.choice([1, 2, 8])}
    if kind == "fragility":
        made.pop("excitation")
        return {"kind": kind, "records": RECORDS[:dice.randint(1, len(RECORDS))],
                "intensity": dice.choice(["pga", {"period": scattered(dice, 0.05, 2), "damping_ratio": 0.02}]),
                "levels": {"from": 1, "to": 12, "count": int(scattered(dice, 2, 50))},
                "limits": [{"metric": "peak_displacement", "value": 0.01}]}
    if kind == "optimize":
        found = {"kind": kind, "variables": [CLEARANCE, MASS][:dice.randint(1, 2)],
                 "objectives": [{"metric": name} for name in METRICS[:dice.randint(1, 2)]],
                 "max_candidates": int(scattered(dice, 2, 300)), "search_seed": dice.randrange(1000)}
        if made["excitation"]["kind"] == "random":
            found["over"] = {"runs": int(scattered(dice, 1, 64)), "first_seed": 1}
        return found
    count = int(scattered(dice, 8, 100))
    made["duration"] = max(made["duration"], 1.0)
    made["output"] = {"channels": [], "psd": None}
    name = "displacement" if made["structure"].get("kind") is None else "displacement_1"
    return {"kind": kind, "starts": int(scattered(dice, 1, 64)),
            "parameters": [{**CLEARANCE, "from": 1e-4, "to": 0.06}, MASS][:dice.randint(1, 2)],
            "measured": [{"channel": name, "interval": float(f"{made['duration'] / count:.4g}"),
                          "samples": numbers(dice, count - 1, -0.02, 0.02)}]}


STUDIES = ("sweep", "ensemble", "compare", "sensitivity", "tradeoff", "response", "optimize", "calibrate", "fragility")
RECORDS = [f"costly_{number}" for number in range(4)]


def upload(daemon):
    """The records that fragility studies name."""
    for name in RECORDS:
        record = {"name": name, "interval": 0.01, "samples": numbers(random.Random(name), 2000, -3, 3)}
        assert daemon.request("POST", "/v1/records", json=record).status == 201


def drawn(seed, number):
    """The kind of a body, and the body before its duration is fitted."""
    dice = random.Random(f"{seed}/{number}")
    while True:
        if dice.random() < 0.5:
            kind, made = "scene", scene(dice)
            kind += " " + made["accuracy"]["solver"] + (" power" if made.get("contact", {}).get("model") in POWER_LAWS else "")
        else:
            kind = dice.choice(STUDIES)
            made = study_scene(dice, kind)
            made["study"] = study(dice, kind, made)
        made["title"] = f"costly {seed}/{number}"
        if len(json.dumps(made)) <= BYTES:
            return kind, made


def lasting(body, factor):
    """The body with another duration."""
    made = {**body, "duration": float(f"{body['duration'] * factor:.6g}")}
    if made.get("study", {}).get("kind") == "calibrate":
        measured = made["study"]["measured"][0]
        made["study"] = {**made["study"], "measured": [{**measured, "interval": float(f"{measured['interval'] * factor:.4g}")}]}
    return made


def fitted(body, predict, target):
    """The body with the duration for which `predict`, which returns cost and reply, predicts `target` seconds of CPU, or as
    near as its limits allow, and its cost; None: it is refused whatever its duration. The last one that was refused for its
    cost comes with it, or None."""
    best, refused, factor, low, high = None, None, 1.0, 0.0, math.inf
    for _ in range(10):
        candidate = lasting(body, factor)
        cost, reply = predict(candidate)
        limits = re.findall(rb"about ([0-9.e+-]+) (?:s|MB) of (?:CPU|memory).{0,80}?, at most ([0-9.e+-]+)", reply.body)
        if cost is not None:
            share = target / cost["cpu_seconds"]
            if best is None or abs(math.log(share)) < abs(math.log(target / best[1]["cpu_seconds"])):
                best = candidate, cost
            if 0.9 < share < 1.1:
                break
            low, high = (factor, high) if share > 1 else (low, factor)
            factor *= min(share, 50)
        elif limits:
            refused, high = candidate, factor
            factor *= 0.97 * min(float(most) / float(about) for about, most in limits)
        else:
            return best, refused
        if not low < factor < high:
            factor = (low * high) ** 0.5 if low > 0 else high / 10
        if high < 1.1 * low or factor < 1e-5:
            break
    return best, refused
