"""Table I and Figures 4 to 7: the buffers' parameters and free vibration from 15 mm."""

import numpy

import measure
from rows import FAR, bin_note, criterion_of, judge, mean_distances, pair, parting, percent, row
from scenes import BALL, CLEARANCE, FREE, K, M, RELEASE, TABLE, C, ask, both

CONVERTER = 24.0                     # [m/s^2] where the paper's analogue-to-digital conversion clipped
RELEASES = (0.98, 0.99, 1.01, 1.02)  # repeated tests: released that many times as far out
CHANNELS = ["acceleration", "displacement"]


def identification():
    """Table I, equations (9) and (10)."""
    worst = {}
    for mass in (BALL, 0.11):
        worst[mass] = 0
        for name, (_, _, k, c) in TABLE.items():
            derived = ask(name, damper={"mass": mass}, segment=0).derived[0]
            worst[mass] = max(worst[mass], abs(derived["stiffness"] / k - 1), abs(derived["damping"] / c - 1))
    return [row("Table I", "k_b and c_b of five buffers, from e and T_c",
                f"all ten within {percent(worst[BALL], 2)} (m = 0.1107 kg; {percent(worst[0.11], 2)} with 0.11)",
                "within 0.5 %", worst[BALL] < 0.005, {"worst": worst[BALL], "worst_0.11": worst[0.11]},
                why="eq. (9) lacks its minus sign in print, and c_b is in N s/m: -2 m_e ln(e) / T_c")]


def first_impact():
    """When the ball first touches, by both models and by pen and paper."""
    known = measure.first_touch(M, K, C, RELEASE, CLEARANCE)
    found = [run.impacts[0]["start"] for run in both("sponge")]
    worst = max(abs(one - known) for one in found)
    return [row("4-7", "(does not state when the ball first touches)",
                f"{found[0]:.14f} s by both models, {known:.14f} s by pen and paper", "within 1e-13 s", worst < 1e-13,
                {"start": found[0]}, brief=False)]


def hard_motion():
    """Figure 4: time histories with bare aluminium."""
    run, impulse = both("aluminium", channels=CHANNELS)
    pushes = run.each("peak_force") / M
    many, late = int((pushes > CONVERTER).sum()), float(pushes[run.each("start") > 2.5].max())
    smooth = float(numpy.abs(impulse.series["acceleration"]).max())
    third = [one.impacts[2]["start"] for one in (run, impulse)]
    apart = parting([run], [impulse])
    return [
        row("4", "impacts are peaks beyond the converter's 24 m/s^2 \"in most cases\", large at first, then "
                 "decreasing; the impulse model has none",
            f"{many} of {len(pushes)} contacts push with more than 24 m/s^2 (the largest {pushes.max():.0f}, after "
            f"2.5 s {late:.0f}); impulse: none above {smooth:.2f}, the release itself",
            "more than half; after 2.5 s below a tenth of the largest; impulse at most K x0 / M = 9.611",
            many > len(pushes) / 2 and late < pushes.max() / 10 and smooth <= K * RELEASE / M * (1 + 1e-9),
            {"above": many, "contacts": len(pushes), "largest": float(pushes.max()), "late": late, "impulse": smooth}),
        row("4", "both models match the experiment \"well\" but for the peaks",
            f"their displacements differ by {percent(apart, 1)} rms; third impact at {pair(third, 5)} s",
            "below 5 % rms", apart < 0.05, {"rms": apart, "third": third})]


def soft_motion():
    """Figure 6: time histories with the sponge."""
    run, impulse = both("sponge", channels=CHANNELS)
    apart, hard = parting([run], [impulse]), parting(*([one] for one in both("aluminium", channels=CHANNELS)))
    third = [one.impacts[2]["start"] for one in (run, impulse)]
    counts = [len(one.impacts) for one in (run, impulse)]
    pushes, lengths = run.each("peak_force") / M, run.each("duration")
    return [
        row("6", "with the sponge the impulse model \"does not match the experimental result well\"",
            f"displacements differ by {percent(apart)} rms; third impact at {pair(third, 3)} s; "
            f"{pair(counts, 0)} impacts",
            f"more than {FAR} times as far as aluminium's", apart > FAR * hard,
            {"rms": apart, "third": third, "impacts": counts}),
        row("6", "collisions are \"peaks on the decaying sine curve\"",
            f"contacts of {1e3 * lengths.min():.1f} to {1e3 * lengths.max():.1f} ms push with at most "
            f"{pushes.max():.1f} m/s^2, below the {K * RELEASE / M:.1f} of the release",
            "the largest push is below K x0 / M", pushes.max() < K * RELEASE / M,
            {"shortest": float(lengths.min()), "longest": float(lengths.max()), "push": float(pushes.max())},
            brief=False)]


def spectra(figure, name, says):
    """Figures 5 and 7: PSDs of both models."""
    one, other = both(name)
    models = measure.distances(one, other)
    repeated = [ask(name, dict(FREE, displacement=part * RELEASE)) for part in RELEASES]
    again = mean_distances([one] * len(repeated), repeated)
    near = name == "aluminium"
    return row(figure, says,
               f"models {pair(models['thirds'])} dB apart, repeated tests {pair(again['thirds'])} dB; up to 16 Hz they "
               f"differ by at most {percent(models['linear'][0], 1)} of the peak",
               criterion_of(near, "released 1 and 2 % further out or in"),
               judge(near, models["thirds"], again["thirds"]), {**models, "again": again},
               why=f"{bin_note(models, again)}; two estimates of one spectrum are {measure.CHANCE:.1f} dB apart by "
                   "chance")


def all_free():
    return [*identification(), *first_impact(), *hard_motion(),
            spectra("5", "aluminium", "PSDs of both models and of the experiment \"very close\""), *soft_motion(),
            spectra("7", "sponge", "a \"large discrepancy for the impulse-momentum model\"")]
