// Values of several runs beside each other: a row has one unit, the others' changes against the first stand below them. And of
// their first impacts, with the forces.
import { html } from "../ui/preact.js";
import { Chart } from "../chart/chart.js";
import { Panel } from "../ui/controls.js";
import { columnFormat, Table } from "../ui/table.js";
import { number, pretty, quantity, title } from "../units.js";
import { isSame } from "./names.js";

// "70.2 ×", "+4.2 %"; "" where that says nothing.
function changeText(value, first) {
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
      label: label.split(" ")[0], // the letter; names stand above
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

const ALIKE = 10; // pushes of up to this ratio share a chart

const isAlike = (values) => Math.max(...values) < ALIKE * Math.min(...values);

// The push of each run's first impact: a blow and a push each have a chart of their own.
export function Pushes({ runs }) {
  const pushing = runs.filter(({ force }) => force && force.time.values.length > 2);
  const series = pushing.map(({ label, color, force: { time, channels } }) => {
    const forces = channels.contact_force.values;
    const sign = Math.sign(forces[forces.length >> 2]);
    return {
      label,
      color,
      x: time.values.map((one) => one - time.values[0]),
      y: forces.map((force) => force * sign),
    };
  });
  if (series.length === 0) return null;
  const lastOf = ({ x }) => x[x.length - 1];
  const isOne = isAlike(series.map(lastOf)) && isAlike(series.map(({ y }) => Math.max(...y)));
  const charts = isOne ? [series] : series.map((one) => [one]);
  return html`<${Panel} title="Force of the first impacts" help="Impacts">
    <div class="columns">
      ${charts.map(
        (shown) =>
          html`<${Chart}
            key=${shown[0]?.label}
            title=${`Push of the first impact${isOne ? "" : `: ${shown[0].label}`}`}
            height=${isOne ? 220 : 150}
            x=${{ label: "Time since it began", unit: "s" }}
            y=${{ label: isOne ? "Contact force" : `${shown[0].label}: contact force`, unit: "N", includeZero: true }}
            series=${shown}
            rules=${shown.map((one) => ({ x: lastOf(one), label: `contact time ${quantity(lastOf(one), "s", 3)}`, color: one.color }))}
          />`,
      )}
    </div>
  <//>`;
}

export function FirstImpacts({ runs }) {
  const rows = [
    { label: "Start", unit: "s", of: (impact) => impact.start },
    { label: "Approach speed", unit: "m/s", of: (impact) => impact.approach_speed },
    { label: "Restitution", unit: "1", of: (impact) => impact.restitution },
    { label: "Contact time", unit: "s", of: (impact) => impact.duration },
    { label: "Peak force", unit: "N", of: (impact) => impact.peak_force },
    { label: "Impulse", unit: "N s", of: (impact) => impact.impulse },
    { label: "Energy lost", unit: "J", of: (impact) => impact.energy_lost },
  ].map(({ label, unit, of }) => ({
    label,
    unit,
    values: runs.map(({ impact }) => (impact ? of(impact) : null)),
  }));
  return html`<${ComparisonTable}
    caption="First impacts"
    head="Quantity"
    runs=${runs}
    rows=${rows}
  />`;
}
