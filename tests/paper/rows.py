"""What a row of the table is, and how two models are judged to agree or to differ.

A row's "holds" is computed from the criterion that it states. Rows that are "firm" are of motions that rounding cannot
change; of the others another machine may find slightly different numbers. The experiments are not in the paper's text:
where it says that a simulation matches one, what can be told is whether its two models agree. How closely they have to,
a repeated test says: the same model with the ball or the release a little elsewhere."""

import numpy

import measure

FAR, NEAR = 3, 1.5  # times the distance of a repeated test: from there models differ; up to there they agree
SEEDS = 20          # random bases


def row(figure, says, finds, criterion, holds, values, firm=True, brief=True, why=""):
    """One line of the table; `brief` ones stand in the README too."""
    return {"figure": figure, "says": says, "finds": finds, "criterion": criterion, "holds": bool(holds), "why": why,
            "firm": firm, "brief": brief, "values": values}


def pair(values, digits=1):
    return " / ".join(f"{value:.{digits}f}" for value in values)


def percent(value, digits=0):
    return f"{100 * value:.{digits}f} %"


def plain(name):
    return name.replace("_", " ")


def criterion_of(near, repeated):
    return (f"{'at most' if near else 'more than'} {NEAR if near else FAR} times as far apart as two tests of one "
            f"model, {repeated}; thirds of octaves in 1-16 / 16-128 Hz")


def judge(near, models, again):
    """Whether models are as near, or as far apart, as their distances and those of repeated tests have it."""
    return all((m <= NEAR * a) if near else (m > FAR * a) for m, a in zip(models, again))


def mean_distances(ones, others):
    """measure.distances of pairs of runs, averaged."""
    each = [measure.distances(one, other) for one, other in zip(ones, others)]
    return {kind: numpy.mean([one[kind] for one in each], axis=0).tolist() for kind in each[0]}


def bin_note(models, again):
    return f"bin by bin (0.5-15 / 15-100 Hz) {pair(models['bins'])} dB, repeated {pair(again['bins'])} dB"


def parting(ones, others):
    """Mean over pairs of runs of how far their displacements part, rms over rms."""
    return float(numpy.mean([measure.apart(a.series["displacement"], b.series["displacement"])[0]
                             for a, b in zip(ones, others)]))
