// Values of several runs beside each other: a row has one unit, the others' changes against the first stand below them.
import { html } from "../ui/preact.js";
import { columnFormat, Table } from "../ui/table.js";
import { number, pretty, title } from "../units.js";
import { isSame } from "./scenes.js";

// "70.2 ×", "+4.2 %"; "" where that says nothing.
export function changeText(value, first) {
  const ratio = value / first;
  if (ratio < 0) return ""; // across zero a ratio says nothing
  if (typeof value !== "number" || !Number.isFinite(ratio) || Math.abs(ratio - 1) < 1e-9) return "";
  if (ratio < 0.1 || ratio > 2) return `${number(ratio, 3)} ×`;
  const sign = ratio > 1 ? "+" : "−";
  return `${sign}${number(Math.abs(100 * (ratio - 1)), 2)} %`;
}

// `head` names what a row is; `rows` are {name or label, unit, values: one for each run}; with `isDiffering` those that are the same are left out.
export function ComparisonTable({ caption, head, runs, rows, isDiffering = false }) {
  const shown = rows
    .filter(
      ({ values }) =>
        values.some((value) => value !== null) &&
        !(isDiffering && values.every((value) => isSame(value, values[0]))),
    )
    .map((row) => {
      const format = columnFormat(row.values, row.unit);
      const unit = format.unit ? ` [${format.unit}]` : "";
      const texts = row.values.map((value) =>
        typeof value === "number" ? format.write(value) : (value ?? "–"),
      );
      return { ...row, heading: `${row.label ?? title(row.name)}${unit}`, texts };
    });
  const columns = [
    {
      label: head,
      value: (row) => `${row.label ?? title(row.name)}${row.unit ? ` [${pretty(row.unit)}]` : ""}`,
      cell: (row) => row.heading,
    },
    ...runs.map(({ label, color }, at) => ({
      label,
      isNumeric: true,
      color,
      value: (row) => row.values[at],
      cell: (row) =>
        html`${row.texts[at]}${
          at > 0 && html`<span class="change">${changeText(row.values[at], row.values[0])}</span>`
        }`,
    })),
  ];
  return html`<${Table}
    caption=${caption}
    columns=${columns}
    rows=${shown}
    keyOf=${(row) => row.heading}
    empty="Nothing differs."
  />`;
}
