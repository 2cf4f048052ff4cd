"""Figures 8 to 11 and Section 6: a random base of 0-15 Hz and 1 m/s^2 rms, 30 s; how far up impulse models reach."""

import numpy

import measure
from rows import bin_note, criterion_of, judge, mean_distances, pair, parting, percent, plain, row
from scenes import FREE, TABLE, ask, both, random, sine

RESEATED = {"position": 0.002}  # repeated tests: the ball starts 2 mm off the middle [m]
EDGE = 1.2                      # between histories that part as repeated tests do and those that part farther


def experiments(name, rms, seeds, band=(0, 15), **options):
    """Three lists of runs, one run a seed: the paper's model, the impulse model, and the first repeated."""
    runs = [(*both(name, random(rms, seed, band), duration=30, **options),
             ask(name, random(rms, seed, band), duration=30, damper=RESEATED, **options))
            for seed in range(1, seeds + 1)]
    return list(zip(*runs))


def levels(seeds):
    """What the paper lets one infer of its levels: quiet seconds (Section 3.3) and impact speeds (Section 3)."""
    first = [ask("aluminium", random(1.0, seed), duration=30).impacts[0]["start"] for seed in range(1, seeds + 1)]

    def fastest(*bases):
        return max(float(ask("aluminium", base, duration=30).each("approach_speed").max()) for base in bases)

    few = range(1, min(seeds, 5) + 1)
    speeds = {"free": fastest(FREE), "sine_1": fastest(sine(1.0)), "sine_4": fastest(sine(4.0)),
              "random_1": fastest(*(random(1.0, seed) for seed in few)),
              "random_4": fastest(*(random(4.0, seed) for seed in few))}
    quiet = row(
        "8", "\"the first two seconds of motion have no impacts\"",
        f"the first impact comes after {min(first):.1f} to {max(first):.1f} s ({seeds} seeds)",
        "a base of 1 m/s^2 rms from the start: half of the seeds quiet for 2 s", numpy.median(first) > 2,
        {"first": [min(first), max(first)]}, firm=False,
        why="the structure has only to move 7.5 mm: the shaking table must have been run up slowly or started late")
    speed = row(
        "Section 3", "impacts at \"approximately 0.15 and 1.0 m/s\"",
        f"up to {speeds['free']:.2f} m/s free; {speeds['random_1']:.2f} and {speeds['random_4']:.2f} under a random "
        f"base of 1 and 4 m/s^2 rms; {speeds['sine_1']:.2f} and {speeds['sine_4']:.2f} under a sine of 1 and 4 m/s^2",
        "the fastest of each within 0.15 to 1.2 m/s", all(0.15 < v < 1.2 for v in speeds.values()), speeds,
        firm=False,
        why="no level is printed; these speeds speak for up to 4 m/s^2")
    return quiet, speed


def spectra(figure, name, says, runs):
    """Figures 9 and 11: PSDs of both models."""
    models, again = mean_distances(runs[0], runs[1]), mean_distances(runs[0], runs[2])
    means = [numpy.mean([run.psd for run in each], axis=0) for each in runs[:2]]
    frequency = runs[0][0].frequency
    top = int(means[0].argmax())
    natural = float(10 * numpy.log10(means[1][top] / means[0][top]))
    averaged = measure.thirds(frequency, *means)
    near = name == "aluminium"
    wanted = slice(0 if near else 1, 2)
    return row(
        figure, says,
        f"models {pair(models['thirds'])} dB apart, repeated tests {pair(again['thirds'])} dB; mean PSDs of "
        f"{len(runs[0])} seeds {pair(averaged)} dB, at {frequency[top]:.1f} Hz {abs(natural):.1f} dB",
        criterion_of(near, "the ball in the middle or 2 mm off it") + ("" if near else ", the latter alone"),
        judge(near, models["thirds"][wanted], again["thirds"][wanted]),
        {**models, "again": again, "mean": averaged, "natural_db": natural,
         "impacts": [float(numpy.mean([len(run.impacts) for run in each])) for each in runs[:2]]}, firm=False,
        why=bin_note(models, again) + ("" if near else "; near the natural frequency the models hardly differ: there "
                                                       "an impact's momentum counts and not its length"))


def motion(hard, soft):
    """Figures 8 and 10: time histories."""
    near, near_again, far, far_again = (parting(runs[0], other) for runs in (hard, soft) for other in runs[1:])
    return row(
        "8, 10", "time histories match \"reasonably well\" with bare aluminium and differ with the sponge",
        f"displacements differ by {percent(near)} rms (repeated tests {percent(near_again)}) and by {percent(far)} "
        f"({percent(far_again)})", f"aluminium at most, sponge more than {EDGE} times as far as repeated tests",
        near <= EDGE * near_again and far > EDGE * far_again,
        {"aluminium": [near, near_again], "sponge": [far, far_again]}, firm=False, brief=False,
        why="these motions amplify any difference: after some seconds no two tests have the same history")


def reach(seeds):
    """Section 6: the models' spectra must part as the spectrum of a contact parts from an impulse's."""
    worst, corners, points = 0.0, {}, {}
    centres = 16 * 2.0 ** ((numpy.arange(14) + 0.5) / 3)
    for name, (e, contact_time, _, _) in TABLE.items():
        runs = [both(name, random(1.0, seed), duration=30) for seed in range(1, seeds + 1)]
        frequency = runs[0][0].frequency
        means = (numpy.mean([run.psd for run in each], axis=0) for each in zip(*runs))
        paper, impulse = (measure.third_octaves(frequency, mean, 16, 14) for mean in means)
        found, known = 10 * numpy.log10(impulse / paper), measure.pulse_loss(e, contact_time, centres)
        worst = max(worst, float(numpy.abs(found - known)[known < 6].max()))
        points[name] = [[float(f * contact_time), float(loss)] for f, loss in zip(centres, found)]
        fine = numpy.linspace(0, 1, 2001)[1:] / contact_time
        corners[name] = float(fine[numpy.argmax(measure.pulse_loss(e, contact_time, fine) > 3)])
    text = ", ".join(f"{corner:.0f} Hz ({plain(name)})" for name, corner in corners.items())
    return row(
        "Section 6", "impulse models are acceptable only where the contact time is \"negligibly small\"",
        f"the models' spectra differ by what the spectrum of an isolated contact lacks, within {worst:.1f} dB. They differ by 3 dB "
        f"at {text}",
        "random base, five buffers, thirds of octaves in 16-406 Hz: within 2 dB of the closed form where that is "
        "below 6 dB",
        worst < 2, {"worst": worst, "corners": corners, "points": points}, firm=False)


def all_forced(seeds):
    """Rows of Figures 8 to 11, then those of Sections 3 and 6."""
    hard, soft = (experiments(name, 1.0, seeds, channels=["displacement"]) for name in ("aluminium", "sponge"))
    quiet, speed = levels(seeds)
    return [quiet,
            spectra("8, 9", "aluminium",
                    "all three \"match reasonably well, in particular, at the natural frequency\"", hard),
            motion(hard, soft),
            spectra("10, 11", "sponge", "\"significant difference\" for the impulse model", soft),
            ], [speed, reach(seeds)]
