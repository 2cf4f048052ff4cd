// Runs beside each other, {label, color, summary, x, y}, x and y a spectrum. The others are told by the first.
import { h, table } from "./dom.js";
import { plot } from "./plot.js";
import { spectrum, told } from "./study_bits.js";
import { number, title } from "./units.js";

// How far a number is from the first: "70.2 ×", "+4.2 %".
function change(value, first) {
  const ratio = value / first;
  if (!Number.isFinite(ratio) || value === null || Math.abs(ratio - 1) < 1e-9) return "";
  return ratio < 0.1 || ratio > 2 ? `${number(ratio, 3)} ×` : `${ratio > 1 ? "+" : ""}${number((ratio - 1) * 100, 2)} %`;
}

// Those rows [label, unit, values] whose values differ, a column for each run.
export function differing(caption, runs, rows) {
  const differs = ([, , [first, ...others]]) => others.some((value) => value !== first
    && !(Math.abs(value - first) <= 1e-9 * Math.abs(first)));
  return table(caption, [{ label: "", value: ([label]) => label }, ...runs.map((run, at) => ({ label: run.label, numeric: true,
    cell: ([, unit, values]) => [told(values[at], unit), at > 0
      && h("div", { class: "quiet" }, change(values[at], values[0]))] })),
  ], rows.filter(differs));
}

// The numbers of their summaries that differ, and of `more`, [label, unit, value(run)].
export function numbers(runs, units, more) {
  const names = Object.keys(runs[0].summary).filter((name) => !/residual|estimate/.test(name));
  const all = [...names.map((name) => [title(name), units[name], (run) => run.summary[name]]), ...more];
  return differing("Numbers that differ", runs, all.map(([label, unit, value]) => [label, unit, runs.map(value)]));
}

// Their spectra over each other; `level` of the others is how far theirs is from the first's.
export function spectra(host, channel, unit, runs) {
  const [first, ...others] = runs, said = others.map(({ label, level }) => `${label} by ${number(level, 2)} dB`);
  plot(host, { ...spectrum(channel, unit), series: runs, summary: `Apart from ${first.label}: ${said.join(", ")}.` });
}
