// The response to a harmonic load: amplitude over the frequency (or what else varies), stable and unstable motions, those
// without a period, and the structure without its dampers. In the address: metric.
import { html, useMemo } from "../ui/preact.js";
import { Chart } from "../chart/chart.js";
import { useResult } from "../result/context.js";
import { Table } from "../ui/table.js";
import { quantity, title, yesNo } from "../units.js";
import { Decision, MetricChoice, compared, pointerOf, remarksOf } from "./parts.js";
import { labelOf } from "../runs/names.js";

const METRICS = ["peak_displacement", "rms_displacement"];

const counted = (count, name) => `${count} ${name}${count === 1 ? "" : "s"}`;

// What the tooltip adds to an amplitude: "period 1 cycle, 2 impacts".
function noteOf(point) {
  if (!point?.period) return "";
  const impacts = point.impacts_per_period;
  const period = `period ${counted(point.period, "cycle")}`;
  return Number.isFinite(impacts) ? `${period}, ${counted(impacts, "impact")}` : period;
}

// Points of one branch and one kind as a line; a gap (NaN) parts it from the next. A line goes on to the first point of the
// other kind.
function lineOf(points, metric, isWanted) {
  const line = { x: [], y: [], notes: [] };
  const push = (point) => {
    line.x.push(point?.value ?? NaN);
    line.y.push(point?.[metric] ?? NaN);
    line.notes.push(noteOf(point));
  };
  for (const branch of Map.groupBy(points, ({ branch: number }) => number).values()) {
    let length = 0; // of the line that is open
    let last = null;
    const add = (point) => {
      push(point);
      last = point;
      length++;
    };
    const end = () => {
      if (length === 1) push(last); // a dot
      if (length > 0) push(null);
      length = 0;
    };
    branch.forEach((point, at) => {
      const isIn = isWanted(point);
      if (isIn && length === 0 && at > 0 && branch[at - 1].period) add(branch[at - 1]);
      if (isIn) add(point);
      else end();
    });
    end();
  }
  return line;
}

// One value for each place, in their order.
function undampedOf(points) {
  const values = new Map();
  for (const { value, undamped_peak_displacement: peak } of points)
    if (Number.isFinite(peak)) values.set(value, peak);
  const places = [...values.keys()].sort((a, b) => a - b);
  return { x: places, y: places.map((place) => values.get(place)) };
}

const largest = (points, key) =>
  points.reduce((best, point) => (point[key] > (best?.[key] ?? -Infinity) ? point : best), null);

function decisionOf(points, name, unit) {
  const worst = largest(
    points.filter(({ stable }) => stable !== false),
    "peak_displacement",
  );
  const bare = largest(points, "undamped_peak_displacement");
  if (!worst) return "No motion was found.";
  const at = `${quantity(worst.peak_displacement, "m")} at ${name} ${quantity(worst.value, unit)}`;
  if (!bare) return `The largest displacement is ${at}.`;
  const { undamped_peak_displacement: peak, value } = bare;
  const against = compared(worst.peak_displacement, peak, "the largest without dampers");
  return `The largest displacement is ${at}, ${against} (${quantity(peak, "m")} at ${quantity(value, unit)}).`;
}

export function ResponseStudy() {
  const { result, query, change } = useResult();
  const { study } = result;
  const { points, unit } = study;
  const name = labelOf(pointerOf(study));
  const metric = METRICS.includes(query.metric) ? query.metric : METRICS[0];
  const series = useMemo(() => {
    const irregular = points.filter(({ period }) => !period);
    const all = [
      metric === METRICS[0] && { label: "without dampers", color: "ghost", ...undampedOf(points) },
      {
        label: "stable",
        color: "displacement",
        lineWidth: 2,
        ...lineOf(points, metric, ({ period, stable }) => period && stable),
      },
      {
        label: "unstable",
        color: "displacement",
        dash: true,
        ...lineOf(points, metric, ({ period, stable }) => period && !stable),
      },
      {
        kind: "points",
        size: 5,
        label: "without a period",
        color: "c6",
        x: irregular.map(({ value }) => value),
        y: irregular.map((point) => point[metric]),
      },
    ];
    return all.filter((one) => one && one.x.length > 0);
  }, [result.id, metric]);
  const periods = [...new Set(points.map(({ period }) => period))].filter((period) => period > 1);
  const unstable = points.filter(({ stable }) => stable === false).length;
  const irregular = points.filter(({ period }) => !period).length;
  const counts = [
    periods.length > 0 &&
      `Motions that repeat after ${periods.sort((a, b) => a - b).join(", ")} cycles of the load were found too.`,
    irregular > 0 && `${irregular} of ${points.length} points have no period.`,
    unstable > 0 && `${unstable} motions are unstable: none of them lasts.`,
  ];
  const facts = [counts.filter(Boolean).join(" "), ...remarksOf(study)];
  return html`<${Decision} more=${facts}>${decisionOf(points, name, unit)}<//>
    <div class="row">
      <${MetricChoice} metrics=${METRICS} metric=${metric} change=${change} />
    </div>
    <${Chart}
      title="Response curve"
      height=${360}
      x=${{ label: title(name), unit: unit ?? "1" }}
      y=${{ label: title(metric), unit: "m" }}
      series=${series}
    />
    <${Points} points=${points} unit=${unit} name=${name} />`;
}

function Points({ points, unit, name }) {
  const columns = [
    { label: title(name), unit: unit ?? "1", value: ({ value }) => value },
    { label: "Direction", value: ({ direction }) => direction ?? "continuation" },
    { label: "Period [cycles]", isNumeric: true, value: ({ period }) => period },
    { label: "Impacts a period", isNumeric: true, value: (one) => one.impacts_per_period },
    {
      label: "Stable",
      value: ({ period, stable }) => (period ? yesNo[stable] : null),
    },
    { label: "Peak displacement", unit: "m", value: (one) => one.peak_displacement },
    { label: "Without dampers", unit: "m", value: (one) => one.undamped_peak_displacement },
    { label: "Lyapunov exponent", unit: "1/s", value: (one) => one.lyapunov },
  ];
  return html`<details>
    <summary>All points as a table</summary>
    <${Table} caption="Points" columns=${columns} rows=${points} filter="Words of a row" />
  </details>`;
}
