// How likely limits are exceeded at an intensity of the ground motion: fitted curves with their uncertainty, the records
// themselves. In the address: limit (an index).
import { html, useMemo } from "../ui/preact.js";
import { Chart } from "../chart/chart.js";
import { useResult } from "../result/context.js";
import { Choice } from "../ui/controls.js";
import { Table } from "../ui/table.js";
import { number, quantity, title, words } from "../units.js";
import { Decision, between, intervals, quantities, remarksOf } from "./parts.js";

const STEPS = 200;

// The standard normal distribution, to 1e-7 (Abramowitz and Stegun, 26.2.17).
function normal(x) {
  const t = 1 / (1 + 0.2316419 * Math.abs(x));
  const density = Math.exp((-x * x) / 2) / Math.sqrt(2 * Math.PI);
  const tail =
    density *
    t *
    (0.31938153 + t * (-0.356563782 + t * (1.781477937 + t * (-1.821255978 + t * 1.330274429))));
  return x > 0 ? 1 - tail : tail;
}

function measureText({ period, measure }) {
  if (period) return `Spectral acceleration at ${quantity(period, "s")}`;
  return measure && measure !== "pga" ? title(measure) : "Peak ground acceleration";
}

// Of each level the part of the records whose metric exceeds the limit.
function observed(curves, { metric, value }) {
  const levels = [...new Set(curves.flatMap(({ points }) => points.map(({ level }) => level)))];
  return levels
    .sort((a, b) => a - b)
    .map((level) => {
      const at = curves
        .map(({ points }) => points.find((point) => point.level === level)?.metrics?.[metric])
        .filter((one) => Number.isFinite(one));
      return { level, part: at.filter((one) => one > value).length / at.length };
    });
}

function curveSeries(limit, levels, color) {
  const high = Math.max(levels.at(-1), 1.2 * limit.median);
  const x = Array.from({ length: STEPS + 1 }, (_, at) => (high * at) / STEPS);
  const at = (median) =>
    x.map((intensity) =>
      intensity > 0 ? normal(Math.log(intensity / median) / limit.dispersion) : 0,
    );
  const [low, upper] = limit.median_interval_95 ?? [];
  const name = `${words(limit.metric)} above the limit`;
  return [
    low && {
      kind: "band",
      label: "95 % of the median",
      color,
      x,
      low: at(upper),
      high: at(low),
    },
    { label: name, color, x, y: at(limit.median) },
  ].filter(Boolean);
}

export function FragilityStudy() {
  const { result, query, change } = useResult();
  const { study, units } = result;
  const { limits, curves, fractiles, intensity } = study;
  const chosen = limits[Number(query.limit)] ? Number(query.limit) : 0;
  const limit = limits[chosen];
  const unitOf = ({ metric }) => units[metric];
  const measure = measureText(intensity);
  const hasFit = Number.isFinite(limit.median) && Number.isFinite(limit.dispersion);
  const series = useMemo(() => {
    const points = observed(curves, limit);
    const dots = {
      kind: "points",
      size: 8,
      label: "part of the records",
      color: "text",
      x: points.map(({ level }) => level),
      y: points.map(({ part }) => part),
    };
    const levels = points.map(({ level }) => level);
    return hasFit ? [...curveSeries(limit, levels, "force"), dots] : [dots];
  }, [result.id, chosen]);
  const answer = hasFit
    ? `Half of such motions bring the ${words(limit.metric)} above ${quantity(limit.value, unitOf(limit))} at a ${measure.toLowerCase()} of ${quantity(limit.median, "m/s^2")} (95 %: ${between(...limit.median_interval_95, "m/s^2")}).`
    : `The ${words(limit.metric)} exceeds ${quantity(limit.value, unitOf(limit))} in ${limit.exceeded} of ${curves.length} records; no curve can be fitted.`;
  const remarks = [
    hasFit &&
      `Dispersion ${number(limit.dispersion, 3)} (95 %: ${between(...limit.dispersion_interval_95, "")}); ${limit.exceeded} of ${curves.length} records exceed the limit within the levels.`,
    ...remarksOf(study),
  ];
  return html`<${Decision} more=${remarks}>${answer}<//>
    <div class="row">
      <${Choice}
        label="Limit"
        options=${limits.map((one, at) => ({ value: at, label: `${title(one.metric)} ${quantity(one.value, unitOf(one))}` }))}
        value=${chosen}
        onChange=${(at) => change({ limit: at })}
      />
    </div>
    <${Chart}
      title="Fragility"
      heading="Probability of exceeding the limit"
      height=${320}
      x=${{ label: measure, unit: "m/s^2" }}
      y=${{ label: "Probability", unit: "1", domain: [-0.03, 1.03] }}
      series=${series}
      rules=${hasFit ? [{ x: limit.median, label: "median", color: "quiet" }] : []}
    />
    <${Records}
      curves=${curves}
      fractiles=${fractiles}
      limit=${limit}
      unit=${unitOf(limit)}
      measure=${measure}
    />
    <${Limits} limits=${limits} unitOf=${unitOf} />`;
}

// The metric of each record over the intensity, and the fractiles of all.
function Records({ curves, fractiles, limit, unit, measure }) {
  const { metric, value } = limit;
  const series = useMemo(() => {
    const own = curves.slice(0, 40).map(({ points }) => ({
      color: "ghost",
      x: points.map(({ level }) => level),
      y: points.map(({ metrics }) => metrics?.[metric] ?? NaN),
    }));
    const rows = fractiles.filter((row) => row.metric === metric);
    const x = rows.map(({ level }) => level);
    // All records are one line with gaps, so that the legend has one name for them.
    const gap = [NaN];
    return [
      {
        label: "records",
        color: "ghost",
        x: own.flatMap((one) => [...one.x, ...gap]),
        y: own.flatMap((one) => [...one.y, ...gap]),
      },
      {
        kind: "band",
        label: "16 to 84 %",
        color: "c1",
        x,
        low: rows.map(({ p16 }) => p16),
        high: rows.map(({ p84 }) => p84),
      },
      { label: "median", color: "c1", x, y: rows.map(({ p50 }) => p50) },
    ];
  }, [curves, metric]);
  return html`<${Chart}
    title=${`${title(metric)} of each record`}
    height=${240}
    x=${{ label: measure, unit: "m/s^2" }}
    y=${{ label: title(metric), unit }}
    series=${series}
    rules=${[{ y: value, label: "limit", color: "force" }]}
  />`;
}

function Limits({ limits, unitOf }) {
  const columns = [
    { label: "Metric", value: ({ metric }) => title(metric) },
    quantities("Limit", ({ value }) => value, 4, unitOf),
    { label: "Median", unit: "m/s^2", value: ({ median }) => median },
    intervals(
      "95 % of the median",
      (one) => one.median_interval_95,
      () => "m/s^2",
    ),
    { label: "Dispersion", isNumeric: true, value: ({ dispersion }) => dispersion },
    intervals(
      "95 % of the dispersion",
      (one) => one.dispersion_interval_95,
      () => "",
    ),
    { label: "Records that exceed it", isNumeric: true, value: ({ exceeded }) => exceeded },
  ];
  return html`<${Table} caption="Limits" columns=${columns} rows=${limits} />`;
}
