"""What the paper leaves open, what is taken here, and what another choice would change.

Each entry varies one thing and tells how far the two models' spectra then lie apart, bare aluminium against sponge:
the paper's thesis stands where the first stays small and the second large."""

import numpy
from scipy.signal import welch

import measure
from forced import experiments
from free import CONVERTER
from rows import mean_distances, pair
from scenes import BALL, C, FREE, K, M, ask, both, random, sine


def thesis(aluminium, sponge):
    return {"aluminium": aluminium, "sponge": sponge,
            "text": f"models apart: aluminium {pair(aluminium)} dB, sponge {pair(sponge)} dB"}


def free(**options):
    """Thesis in free vibration."""
    return thesis(*(measure.distances(*both(name, **options))["thirds"] for name in ("aluminium", "sponge")))


def forced(rms, seeds, band=(0, 15)):
    """Thesis under random bases, with the distance of repeated tests."""
    found = [experiments(name, rms, seeds, band) for name in ("aluminium", "sponge")]
    answer = thesis(*(mean_distances(runs[0], runs[1])["thirds"] for runs in found))
    again = [mean_distances(runs[0], runs[2])["thirds"] for runs in found]
    answer["again"] = again
    answer["text"] += f" (repeated tests {pair(again[0])} and {pair(again[1])})"
    return answer


def pulse(amplitude):
    """Force and time of the first impact under the sine, aluminium against sponge."""
    hard, soft = (ask(name, sine(amplitude)).impacts[0] for name in ("aluminium", "sponge"))
    force, length = hard["peak_force"] / soft["peak_force"], soft["duration"] / hard["duration"]
    return {"force": force, "length": length, "newton": [hard["peak_force"], soft["peak_force"]],
            "text": f"first impact at {hard['approach_speed']:.2f} m/s: {hard['peak_force']:.0f} N against "
                    f"{soft['peak_force']:.2f} N (1/{force:.0f}), contact {length:.0f} times longer"}


def clipped():
    """Thesis from records cut at the converter's limits."""
    found = []
    for name in ("aluminium", "sponge"):
        runs = both(name, channels=["mean_acceleration"])
        records = [numpy.clip(run.series["mean_acceleration"], -CONVERTER, CONVERTER) for run in runs]
        psd = [welch(record, 1000, nperseg=4096)[1] for record in records]
        found.append(measure.thirds(runs[0].frequency, *psd))
    return thesis(*found)


def all_open(seeds):
    ratio = C / (2 * (K / M) ** 0.5)  # C as printed: 2 xi sqrt(K / M)
    few = max(2, seeds // 2)

    def entry(about, taken, *others):
        return {"about": about, "taken": taken, "others": [{"choice": choice, **effect} for choice, effect in others]}

    return [
        entry("level of the random base (no number printed)", "1 m/s^2 rms",
              ("0.25 m/s^2", forced(0.25, few)), ("1 m/s^2", forced(1.0, few)), ("4 m/s^2", forced(4.0, few))),
        entry("lower end of its band (\"0 to 15 Hz\")", "0 Hz, flat", ("1 to 15 Hz", forced(1.0, few, (1, 15)))),
        entry("amplitude of the 1 Hz base (no number printed)", "1 m/s^2 (25 mm)",
              ("0.25 m/s^2", pulse(0.25)), ("1 m/s^2", pulse(1.0)), ("4 m/s^2", pulse(4.0))),
        entry("damping: C = 2 xi sqrt(K/M) = 1.092 N s/m has the wrong units", "C = 1.092 N s/m, xi = 1.60 %",
              (f"xi = {100 * ratio:.2f} % out of the printed formula, C = {2 * ratio * (K * M) ** 0.5:.3f} N s/m",
               free(structure={"damping": 2 * ratio * (K * M) ** 0.5}))),
        entry("mass of the ball: 0.11 kg in the text, 0.1107 kg by Table I and by its size", f"{BALL} kg",
              ("0.11 kg", free(damper={"mass": 0.11}))),
        entry("where the ball starts in free vibration", "in the middle, at rest",
              ("2 mm off the middle", free(damper={"position": 0.002})),
              ("at a stop", free(damper={"position": -0.0075}))),
        entry("which pair of masses e and T_c hold for", "ball and structure (Table I does so)",
              ("ball and a fixed base, as in the drop test",
               free(damper={"identified_for": "rig", "rig": {"impactor_mass": BALL}}))),
        entry("when a contact ends", "at zero penetration (the paper's end condition)",
              ("at zero force", free(contact={"separation": "zero_force"}))),
        entry("what the accelerometer and its converter record", "mean acceleration over 1 ms",
              ("over 2 ms", free(rate=500, segment=2048)), ("over 0.5 ms", free(rate=2000, segment=8192)),
              ("clipped at 24 m/s^2", clipped()),
              ("the instant's value: aluminium's spikes at random, no impulses at all", free(of="acceleration"))),
        entry("length of the record and of Welch's segments", "10 s free, 30 s random; 4096",
              ("5 s free", free(duration=5.0)), ("segments of 8192", free(segment=8192))),
        entry("release", "15 mm", ("14.7 mm", free(excitation=dict(FREE, displacement=0.0147))),
              ("30 mm", free(excitation=dict(FREE, displacement=0.03)))),
    ]
