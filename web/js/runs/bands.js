// Third octaves of spectra: means of a density by bands of a tenth of a decade, and by how many dB two spectra differ in each.
import { number, quantity } from "../units.js";

const STEPS = 10; // to a decade

// Map of a band's number k, around 10^(k / 10) Hz, to {mean, count} of the density there.
function bandMeans({ x, y }) {
  const bands = new Map();
  for (let at = 0; at < x.length; at++) {
    if (!(x[at] > 0) || !Number.isFinite(y[at])) continue;
    const band = Math.round(STEPS * Math.log10(x[at]));
    const { mean: sum, count } = bands.get(band) ?? { mean: 0, count: 0 };
    bands.set(band, { mean: sum + y[at], count: count + 1 });
  }
  for (const [band, { mean: sum, count }] of bands) bands.set(band, { mean: sum / count, count });
  return bands;
}

// A spectrum as a line through its third octaves.
export function bandLine(spectrum) {
  const bands = [...bandMeans(spectrum)].sort(([a], [b]) => a - b);
  return {
    x: bands.map(([band]) => 10 ** (band / STEPS)),
    y: bands.map(([, { mean }]) => mean),
  };
}

// The bands that both spectra have: [{frequency, low, high, mean, level, count}], `mean` of the first, `level` in dB of the
// second over it.
export function bandDifferences(first, second) {
  const [means, others] = [bandMeans(first), bandMeans(second)];
  return [...means]
    .filter(([band, { mean }]) => mean > 0 && others.get(band)?.mean > 0)
    .sort(([a], [b]) => a - b)
    .map(([band, { mean, count }]) => ({
      frequency: 10 ** (band / STEPS),
      low: 10 ** ((band - 0.5) / STEPS),
      high: 10 ** ((band + 0.5) / STEPS),
      mean,
      level: 10 * Math.log10(others.get(band).mean / mean),
      count: Math.min(count, others.get(band).count),
    }));
}

// The band of three lines and more where they are furthest apart; undefined where there is none.
export const furthestBand = (bands) =>
  bands
    .filter(({ count }) => count > 2)
    .toSorted((a, b) => Math.abs(b.level) - Math.abs(a.level))[0];

// "around 500 Hz: 39 dB more".
export const bandText = ({ frequency, level }) =>
  `around ${quantity(frequency, "Hz", 2)}: ${number(Math.abs(level), 2)} dB ${level > 0 ? "more" : "less"}`;

// A chart's series of the bands.
export const bandSeries = (label, color, bands) => ({
  kind: "bars",
  label,
  color,
  x: bands.map(({ low, high }) => (low + high) / 2),
  y: bands.map(({ level }) => level),
  width: bands.map(({ low, high }) => 0.94 * (high - low)),
});
