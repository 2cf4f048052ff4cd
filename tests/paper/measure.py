"""What is measured on runs, and what pen and paper say: distances between spectra, isolated contacts, the first touch.

Knows no figures. Nothing here is taken from the program: the formulas are the paper's (equation numbers given) or
derived in place."""

import math

import numpy

# rms distance [dB] between the bins of two independent one-segment estimates of the same spectrum: ln(E1 / E2) of
# exponential E1, E2 is logistic, of variance pi^2 / 3.
CHANCE = 10 / math.log(10) * math.pi / math.sqrt(3)


def effective(m1, m2):
    """m_e of two bodies."""
    return m1 * m2 / (m1 + m2)


def identify(e, contact_time, m_e):
    """k_b and c_b: equations (10) and (9), the latter with the sign it lacks in print."""
    return (m_e * (math.pi ** 2 + math.log(e) ** 2) / contact_time ** 2, -2 * m_e * math.log(e) / contact_time)


def isolated_force(e, contact_time, m_e, t):
    """Contact force over approach speed [N s/m] at t after the touch: -m_e times the second derivative of (5)."""
    s, w = -math.log(e) / contact_time, math.pi / contact_time
    return m_e * numpy.exp(-s * t) * (2 * s * numpy.cos(w * t) + (w * w - s * s) / w * numpy.sin(w * t))


def isolated_peak(e, contact_time, m_e):
    """The largest of isolated_force; its derivative is 0 at tan(w t) = w (w^2 - 3 s^2) / (s (3 w^2 - s^2))."""
    s, w = -math.log(e) / contact_time, math.pi / contact_time
    turn = math.atan2(w * (w * w - 3 * s * s), s * (3 * w * w - s * s)) / w
    return float(isolated_force(e, contact_time, m_e, max(turn, 0)))


def pulse_loss(e, contact_time, frequency):
    """How far [dB] the spectrum of an isolated contact's force lies under an impulse of the same momentum.

    The transform of (5) over the contact is y0' (1 + e exp(-i W T_c)) / ((s + i W)^2 + w^2), for sin(w T_c) = 0 and
    exp(-s T_c) = e; the force adds k_b + i W c_b, which is m_e (s^2 + w^2 + 2 i s W)."""
    s, w, omega = -math.log(e) / contact_time, math.pi / contact_time, 2 * math.pi * numpy.asarray(frequency)
    ratio = ((s * s + w * w + 2j * s * omega) * (1 + e * numpy.exp(-1j * omega * contact_time))
             / ((1 + e) * ((s + 1j * omega) ** 2 + w * w)))
    return -20 * numpy.log10(numpy.abs(ratio))


def first_touch(mass, stiffness, damping, release, clearance):
    """When the structure, let go at `release`, has come half the clearance nearer to a ball that stays put [s]."""
    s = damping / (2 * mass)
    w = math.sqrt(stiffness / mass - s * s)
    low, high = 0.0, math.pi / w  # x falls from release to its first minimum
    for _ in range(200):
        middle = (low + high) / 2
        x = release * math.exp(-s * middle) * (math.cos(w * middle) + s / w * math.sin(w * middle))
        low, high = (middle, high) if x > release - clearance / 2 else (low, middle)
    return (low + high) / 2


def decibel(a, b):
    """rms of 10 log10 (a / b)."""
    return float(numpy.sqrt(numpy.mean((10 * numpy.log10(a / b)) ** 2)))


def bins(frequency, a, b, low, high):
    """Distance [dB] of two spectra, Welch bin by bin in [low, high)."""
    wanted = (frequency >= low) & (frequency < high)
    return decibel(a[wanted], b[wanted])


def third_octaves(frequency, psd, low, count):
    """Means of a spectrum over `count` bands [low 2^(k/3), low 2^((k+1)/3))."""
    edges = low * 2.0 ** (numpy.arange(count + 1) / 3)
    return numpy.array([psd[(frequency >= a) & (frequency < b)].mean() for a, b in zip(edges, edges[1:])])


def thirds(frequency, a, b):
    """Distances [dB] of two spectra in 1-16 Hz and 16-128 Hz, third of an octave by third of an octave."""
    return [decibel(third_octaves(frequency, a, low, count), third_octaves(frequency, b, low, count))
            for low, count in ((1, 12), (16, 9))]


def distances(one, other):
    """Of two Runs: by thirds of octaves in 1-16 / 16-128 Hz and bin by bin in 0.5-15 / 15-100 Hz [dB]; the largest
    difference up to 16 Hz in parts of the largest value: what a plot with a linear axis shows."""
    f, a, b = one.frequency, one.psd, other.psd
    return {"thirds": thirds(f, a, b), "bins": [bins(f, a, b, 0.5, 15), bins(f, a, b, 15, 100)],
            "linear": [float(numpy.abs(a - b)[f < 16].max() / a.max())]}


def rms(values):
    return float(numpy.sqrt(numpy.mean(numpy.square(values))))


def apart(a, b):
    """rms of a - b over rms of a, and the largest |a - b| over the largest |a|."""
    return rms(a - b) / rms(a), float(numpy.abs(a - b).max() / numpy.abs(a).max())
