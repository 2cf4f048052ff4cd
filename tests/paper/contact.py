"""Figures 12 and 13 and Section 5: contact forces under the 1 Hz base, and what errors of e and T_c do."""

import math

import numpy

import measure
from rows import mean_distances, percent, row
from scenes import BALL, FREE, M, TABLE, ask, random, sine

EFFECTIVE = measure.effective(M, BALL)
TRUE, WRONG = (0.61, 0.025), (0.5185, 0.0275)  # e 15 %, T_c 10 % wrong


def pulses():
    """Figure 12. The first impact is compared: up to it nothing differs, so both contacts begin at the same speed."""
    runs = [ask(name, sine()) for name in ("aluminium", "sponge")]
    hard, soft = (run.impacts[0] for run in runs)
    force, length = hard["peak_force"] / soft["peak_force"], soft["duration"] / hard["duration"]
    alone = [measure.isolated_peak(*TABLE[name][:2], EFFECTIVE) for name in ("aluminium", "sponge")]
    beyond = [one["peak_force"] / (peak * one["approach_speed"]) - 1 for one, peak in zip((hard, soft), alone)]
    largest = [ask(name).summary["peak_contact_force"] for name in ("aluminium", "sponge")]
    free = largest[0] / largest[1]
    return [
        row("12", "the sponge's contact force is \"two orders of magnitude smaller\", its contact \"two orders\" "
                  "longer",
            f"1/{force:.0f} and {length:.0f} times in the first impact, at {hard['approach_speed']:.3f} m/s (isolated: "
            f"1/{alone[0] / alone[1]:.0f} and {TABLE['sponge'][1] / TABLE['aluminium'][1]:.0f}); the largest forces in "
            f"free vibration, {largest[0]:.0f} and {largest[1]:.2f} N, 1/{free:.0f}",
            "each between 10^1.5 and 10^2.5", all(10 ** 1.5 < ratio < 10 ** 2.5 for ratio in (force, length, free)),
            {"force": force, "length": length, "isolated": alone[0] / alone[1], "free": free, "largest": largest,
             "speed": hard["approach_speed"]}),
        row("12", "the model gives the contact force itself",
            f"its peak is that of an isolated contact {100 * beyond[0]:+.2f} % (aluminium) and "
            f"{100 * beyond[1]:+.1f} % (sponge: the structure's spring acts on for 25 ms)",
            "aluminium within 0.5 %, sponge within 20 %", abs(beyond[0]) < 0.005 and abs(beyond[1]) < 0.2,
            {"aluminium": beyond[0], "sponge": beyond[1]}, brief=False)]


def change(one, other, of):
    return of(other) / of(one) - 1


def moved(bases, duration):
    """What the wrong parameters change under some bases, and in spectra what the wrong model changes."""
    channels = ["displacement", "mean_acceleration"]
    true, wrong, impulse = ([ask(what, base, model=model, duration=duration, channels=channels) for base in bases]
                            for what, model in ((TRUE, "spring_damper"), (WRONG, "spring_damper"), (TRUE, "impulse")))
    pairs = list(zip(true, wrong))
    found = {name: float(numpy.mean([change(a, b, lambda run: measure.rms(run.series[name])) for a, b in pairs]))
             for name in channels}
    return {
        "rms": found,
        "force": float(numpy.mean([change(a, b, lambda run: run.summary["peak_contact_force"]) for a, b in pairs])),
        "largest": measure.apart(true[0].series["displacement"], wrong[0].series["displacement"])[1],
        "thirds": mean_distances(true, wrong)["thirds"],
        "impulse_thirds": mean_distances(true, impulse)["thirds"]}


def parameters():
    """Section 5: its linear formulas beside what k_b and c_b do."""
    found = [b / a - 1 for a, b in zip(measure.identify(*TRUE, EFFECTIVE), measure.identify(*WRONG, EFFECTIVE))]
    log = math.log(TRUE[0])
    linear = [2 * log / (math.pi ** 2 + log ** 2) * -0.15 - 2 * 0.1, -0.15 / log - 0.1]
    return row("Section 5", "errors of e and T_c \"will not dramatically amplify\"",
               f"k_b {100 * found[0]:+.1f} %, c_b {100 * found[1]:+.1f} % (its linear formulas "
               f"{100 * linear[0]:+.1f} %, {100 * linear[1]:+.1f} %)",
               "both by less than 25 %, the sum of the errors", max(map(abs, found)) < 0.25,
               {"k_b": found[0], "c_b": found[1], "linear_k_b": linear[0], "linear_c_b": linear[1]}, brief=False)


def sensitivity(seeds):
    """Figure 13: motion and contact force with T_c 10 % and e 15 % wrong."""
    found = {"free": moved([FREE], 10), "sine": moved([sine()], 10),
             "random": moved([random(1.0, seed) for seed in range(1, seeds + 1)], 30)}
    sizes = [max(map(abs, one["rms"].values())) for one in found.values()]
    forces = [abs(one["force"]) for one in found.values()]
    near = max(one["thirds"][1] for one in found.values())
    far = min(one["impulse_thirds"][1] for one in found.values())
    alone = measure.isolated_peak(*WRONG, EFFECTIVE) / measure.isolated_peak(*TRUE, EFFECTIVE) - 1
    return row("13", "with T_c 10 % and e 15 % wrong the sensitivity is \"acceptable\"",
               f"free, sine and random: rms motion moves by {100 * min(sizes):.0f} to {percent(max(sizes))}, peak "
               f"force by {100 * min(forces):.0f} to {percent(max(forces))}; spectra in 16-128 Hz by {near:.1f} dB, by "
               f"the wrong model {far:.1f} dB",
               "rms and peak force by less than 25 %, the sum of the errors; spectra less than a third as far as the wrong "
               "model",
               max(sizes + forces) < 0.25 and 3 * near < far, {**found, "isolated_force": alone},
               firm=False,
               why=f"an isolated contact's peak force changes by {100 * alone:+.1f} %; pointwise the displacement "
                   f"parts by {percent(found['free']['largest'])} of its largest value in free vibration, by "
                   f"{percent(found['sine']['largest'])} under the sine")
