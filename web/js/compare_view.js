// Runs beside each other, {label, color, summary, level, divergence, x, y}, x and y a spectrum: the others are told by the
// first. In a study of kind "compare" they are contact models, the first the scene's own run.
import { h, hint, table } from "./dom.js";
import { plot } from "./plot.js";
import { lesson, spectrum, told } from "./study_bits.js";
import { number, quantity, title, words } from "./units.js";

// How far a number is from the first: "70.2 ×", "+4.2 %".
function change(value, first) {
  const ratio = value / first;
  if (!Number.isFinite(ratio) || value === null || Math.abs(ratio - 1) < 1e-9) return "";
  return ratio < 0.1 || ratio > 2 ? `${number(ratio, 3)} ×` : `${ratio > 1 ? "+" : ""}${number((ratio - 1) * 100, 2)} %`;
}

// Those of {label, unit, values} whose values differ, a column for each run; of many runs each is a row.
export function differing(caption, runs, all) {
  const numbers = all.filter(({ values: [first, ...others] }) => others.some((value) => value !== first
    && !(Math.abs(value - first) <= 1e-9 * Math.abs(first))));
  const isTall = runs.length > 4, [across, down] = isTall ? [numbers, runs] : [runs, numbers];
  const cell = ({ values, unit }, at) => [told(values[at], unit), at > 0 && h("div.quiet", null, change(values[at], values[0]))];
  return table(caption, [{ label: "", value: ({ label }) => label }, ...across.map((one) => ({ label: one.label, numeric: true,
    cell: (other) => (isTall ? cell(one, runs.indexOf(other)) : cell(other, runs.indexOf(one))) }))], down);
}

// The numbers of their summaries that differ, and of `more`, {label, unit, of(run)}.
export function numbers(runs, units, more) {
  const names = Object.keys(runs[0].summary).filter((name) => !/residual|estimate/.test(name));
  const all = [...names.map((name) => ({ label: title(name), unit: units[name], of: (run) => run.summary[name] })), ...more];
  return differing("Numbers that differ", runs, all.map((one) => ({ ...one, values: runs.map(one.of) })));
}

// When the others leave the first: as rules for a chart over time, and as a sentence.
export function partings(runs, part = 0.01) {
  const all = runs.slice(1).filter(({ divergence }) => (divergence?.time ?? null) !== null);
  const lines = all.map(({ divergence: { time }, color, label }) => ({ x: time, color, label: all.length < 3 && `${label} parts` }));
  return { lines, said: all.length === 0 ? null : `Apart from ${runs[0].label} by ${100 * part} % of the largest displacement: ${
    all.map(({ label, divergence }) => `${label} from ${quantity(divergence.time, "s")} on${
      divergence.is_trusted ? "" : " (or by rounding)"}`).join(", ")}.` };
}

// Where the second spectrum is furthest from the first, by thirds of an octave that hold three values and more.
function furthest(first, second) {
  const thirds = ({ x, y }) => Map.groupBy(y, (_, k) => Math.round(10 * Math.log10(x[k]))), others = thirds(second);
  const level = (all) => (all?.length > 2 ? 10 * Math.log10(all.reduce((sum, value) => sum + value) / all.length) : NaN);
  const [most] = Array.from(thirds(first), ([third, all]) => [10 ** (third / 10), level(others.get(third)) - level(all)])
    .filter(([, more]) => Number.isFinite(more)).sort(([, a], [, b]) => Math.abs(b) - Math.abs(a));
  return most ? `, most around ${quantity(most[0], "Hz", 2)}: ${number(Math.abs(most[1]), 2)} dB ${most[1] > 0 ? "more" : "less"}` : "";
}

// Their spectra over each other; `level` of the others is how far theirs is from the first's.
export function spectra(host, channel, unit, runs) {
  const said = runs.slice(1).map((run) => `${run.label} by ${number(run.level, 2)} dB${furthest(runs[0], run)}`);
  plot(host, { ...spectrum(channel, unit), series: runs, summary: `Apart from ${runs[0].label}: ${said.join("; ")}.` });
}

export function show(host, { result: { study, units } }) {
  const runs = study.entries.filter(({ status }) => status === "run").map((entry, at) => ({ ...entry, label: words(entry.name),
    color: (at % 8) + 1, x: study.frequency, y: entry.density, level: entry.psd.level }));
  const impulse = runs.find((run, at) => at > 0 && run.contact_model === "impulse");
  if (impulse) host.append(lesson(`The impulse model's spectrum is off by ${number(impulse.level, 2)} dB: `
    + `its contacts take no time, these ${quantity(runs[0].contacts.mean_duration, "s", 2)} on average.`));
  const { lines, said } = partings(runs, study.part);
  plot(host, { title: "Displacement over time", height: 300, x: { label: "Time", unit: "s" }, y: { label: "Displacement", unit: "m" },
    lines, summary: said, series: runs.map(({ label, color, trace: { minimum: low, maximum: high } }) =>
      ({ label, color, x: low.map((_, k) => k / study.trace_rate), low, high })) });
  spectra(host, study.channel, study.unit, runs);
  host.append(numbers(runs, units, [{ label: "Mean contact", unit: "s", of: (run) => run.contacts.mean_duration },
    { label: "Spectrum apart by", unit: "dB", of: (run) => run.level },
    { label: "Parts at", unit: "s", of: (run) => run.divergence.time }]),
  ...study.entries.filter(({ status }) => status !== "run").map(({ name, why }) =>
    hint(`Not run: ${words(name)}. ${why}`)));
}
