"""One SVG of four panels, written line by line: Figures 5, 7 and 12 and where the two models part.

Draws what it is given and measures nothing but the closed form of an isolated contact."""

import math

import numpy

import measure
from rows import SEEDS, plain
from scenes import TABLE, ask, both, sine

WIDTH, HEIGHT = 960, 690
MODELS = (("spring-damper", "#1f5fa8", ""), ("impulse-momentum", "#d1641b", ' stroke-dasharray="5 3"'))
BUFFERS = dict(zip(TABLE, ("#1f5fa8", "#7a4ea3", "#2e8b57", "#b8860b", "#c0392b")))


class Panel:
    """A box with two logarithmic or linear axes."""

    def __init__(self, left, top, title, x, y, is_log):
        self.left, self.top, self.width, self.height = left + 62, top + 34, 390, 250
        self.x, self.y, self.is_log = x, y, is_log
        self.parts = [f'<text x="{self.left}" y="{top + 22}" font-weight="bold">{title}</text>']

    def place(self, x, y):
        """Where a point of the data stands in the drawing."""
        spot = []
        for value, (low, high), is_log in ((x, self.x, self.is_log[0]), (y, self.y, self.is_log[1])):
            part = math.log(value / low) / math.log(high / low) if is_log else (value - low) / (high - low)
            spot.append(part)
        return self.left + self.width * spot[0], self.top + self.height * (1 - spot[1])

    def axes(self, xs, ys, names):
        """Frame, ticks at xs and ys, names of both axes."""
        out = self.parts
        for value in xs:
            x, _ = self.place(value, self.y[0])
            y = self.top + self.height + 15
            out.append(f'<path class="grid" d="M{x:.1f} {self.top}v{self.height}"/>'
                       f'<text x="{x:.1f}" y="{y}" text-anchor="middle">{value:g}</text>')
        for value in ys:
            _, y = self.place(self.x[0], value)
            label = f"{value:g}".replace("e-0", "e-")
            out.append(f'<path class="grid" d="M{self.left} {y:.1f}h{self.width}"/>'
                       f'<text x="{self.left - 5}" y="{y + 4:.1f}" text-anchor="end">{label}</text>')
        out.append(f'<rect class="frame" x="{self.left}" y="{self.top}" width="{self.width}" height="{self.height}"/>')
        x, y = self.left + self.width / 2, self.top + self.height + 31
        out.append(f'<text x="{x}" y="{y}" text-anchor="middle">{names[0]}</text>')
        x, y = self.left - 44, self.top + self.height / 2
        out.append(f'<text x="{x}" y="{y}" text-anchor="middle" transform="rotate(-90 {x} {y})">{names[1]}</text>')

    def line(self, xs, ys, colour, dash=""):
        """A curve, broken where it leaves the box."""
        pieces, pen = [[]], None  # the pen in tenths, so that steps of it add up
        for x, y in zip(xs, ys):
            if not (self.x[0] <= x <= self.x[1] and self.y[0] <= y <= self.y[1]):
                pieces.append([])
                continue
            spot = [round(10 * one) for one in self.place(x, y)]
            if not pieces[-1]:
                pieces[-1].append(f"M{spot[0] / 10:g} {spot[1] / 10:g}l")
            elif spot != pen:
                right, down = ((a - b) / 10 for a, b in zip(spot, pen))
                pieces[-1].append(f"{right:g}{'' if down < 0 else ' '}{down:g} ")
            pen = spot
        path = "".join("".join(piece).rstrip() for piece in pieces if len(piece) > 1)
        self.parts.append(f'<path class="line" stroke="{colour}"{dash} d="{path}"/>')

    def dots(self, points, colour):
        for x, y in points:
            if self.x[0] <= x <= self.x[1] and self.y[0] <= y <= self.y[1]:
                self.parts.append('<circle cx="{:.1f}" cy="{:.1f}" r="3" fill="{}"/>'.format(*self.place(x, y), colour))

    def legend(self, x, y, entries):
        """Lines of (colour, dash, text), the first at (x, y) from the box's upper left corner."""
        for i, (colour, dash, text) in enumerate(entries):
            at = self.top + y + 16 * i
            self.parts.append(f'<path class="line" stroke="{colour}"{dash} d="M{self.left + x} {at - 4}h24"/>'
                              f'<text x="{self.left + x + 30}" y="{at}">{text}</text>')

    def note(self, x, y, text):
        self.parts.append(f'<text x="{self.left + x}" y="{self.top + y}" fill="#666">{text}</text>')


def spectra(left, top, name, title):
    panel = Panel(left, top, title, (1, 100), (1e-7, 2), (True, True))
    panel.axes((1, 2, 5, 10, 20, 50, 100), (1e-6, 1e-3, 1), ("frequency [Hz]", "PSD [(m/s²)²/Hz]"))
    for run, (_, colour, dash) in zip(both(name), MODELS):
        panel.line(run.frequency, run.psd, colour, dash)
    panel.legend(225, 20, [(colour, dash, text) for text, colour, dash in MODELS])
    return panel


def pulses(left, top):
    panel = Panel(left, top, "12: force in the first impact under the 1 Hz base", (0.002, 50), (0.2, 400), (True, True))
    panel.axes((0.01, 0.1, 1, 10), (1, 10, 100), ("time from the touch [ms]", "force [N]"))
    entries = []
    for name, rate in (("aluminium", 1e6), ("sponge", 2e4)):
        one = ask(name, sine()).impacts[0]
        run = ask(name, sine(), duration=one["end"] + 1e-5, rate=rate, channels=["contact_force"], segment=0)
        force = run.series["contact_force"] * (1 if one["side"] == "right" else -1)
        panel.line(1e3 * (numpy.arange(len(force)) / rate - one["start"]), force, BUFFERS[name])
        entries.append((BUFFERS[name], "", f"{name}: {one['peak_force']:.3g} N, {1e3 * one['duration']:.2g} ms"))
    panel.legend(190, 24, entries)
    panel.note(220, 58, "(less the pull at its end)")
    return panel


def reach(left, top, points):
    panel = Panel(left, top, "9, 11: where the models differ, random base", (0.02, 2), (-1, 27), (True, False))
    panel.axes((0.02, 0.05, 0.1, 0.2, 0.5, 1, 2), (0, 5, 10, 15, 20, 25),
               ("frequency × contact time", "impulse over spring-damper [dB]"))
    fine = numpy.geomspace(0.02, 2, 160)
    entries = []
    for name, colour in BUFFERS.items():
        e, contact_time = TABLE[name][:2]
        panel.line(fine, measure.pulse_loss(e, contact_time, fine / contact_time), colour)
        panel.dots(points[name], colour)
        entries.append((colour, "", f"{plain(name)}, {1e3 * contact_time:g} ms"))
    panel.legend(15, 20, entries)
    panel.note(15, 104, f"dots: {SEEDS} runs of 30 s; lines: isolated contact")
    return panel


def draw(points):
    """The whole chart as text; `points` are those of forced.reach."""
    panels = [spectra(0, 0, "aluminium", "5: free vibration, bare aluminium"),
              spectra(480, 0, "sponge", "7: free vibration, sponge"),
              pulses(0, 345), reach(480, 345, points)]
    body = "\n".join(part for panel in panels for part in panel.parts)
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
            'font-size="12">\n'
            "<style>.grid{stroke:#ddd}.frame{fill:none;stroke:#333}.line{fill:none;stroke-width:1.4}</style>\n"
            f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>\n{body}\n</svg>\n')
