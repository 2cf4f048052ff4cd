// An ensemble: what a metric does over many runs, as a histogram or by its distribution; the fan of motions, quantiles of
// spectra, shares of the inputs. In the address: metric, shape.
import { labelOf } from "../runs/names.js";
import { html, useMemo } from "../ui/preact.js";
import { Chart } from "../chart/chart.js";
import { useResult } from "../result/context.js";
import { Choice } from "../ui/controls.js";
import { Table } from "../ui/table.js";
import { number, quantity, title, words } from "../units.js";
import {
  Bars,
  Decision,
  MetricChoice,
  SceneLink,
  between,
  plainScene,
  quantities,
} from "./parts.js";

// Bins by the rule of Freedman and Diaconis, at least as many as that of Sturges.
function histogram(values) {
  const sorted = values.toSorted((a, b) => a - b);
  const [low, high] = [sorted[0], sorted.at(-1)];
  const quantile = (part) => sorted[Math.min(sorted.length - 1, Math.floor(part * sorted.length))];
  const width = (2 * (quantile(0.75) - quantile(0.25))) / Math.cbrt(sorted.length);
  const wanted = width > 0 ? Math.ceil((high - low) / width) : 5;
  const count = Math.min(60, Math.max(wanted, 1 + Math.ceil(Math.log2(sorted.length)), 5));
  const step = (high - low) / count || 1;
  const counts = new Array(count).fill(0);
  for (const value of sorted) counts[Math.min(count - 1, Math.floor((value - low) / step))]++;
  return { x: counts.map((_, at) => low + (at + 0.5) * step), y: counts, width: step };
}

const SHAPES = [
  { value: "histogram", label: "Histogram" },
  { value: "ecdf", label: "Cumulative" },
];

export function EnsembleStudy() {
  const { result, query, change } = useResult();
  const { scene, study, summary } = result;
  const { statistics, target, runs, failed, failures, trust, inputs } = study;
  const known = Object.keys(statistics).filter((key) => statistics[key].count > 1);
  const varying = known.filter((key) => statistics[key].standard_deviation > 0);
  const initial = [target?.metric, "rms_displacement", ...varying].find((key) =>
    varying.includes(key),
  );
  const metric = varying.includes(query.metric) ? query.metric : (initial ?? known[0]);
  const motions = trust.whole + trust.beyond + trust.unknown;
  const all =
    trust.whole === motions
      ? `All ${motions} motions are right to their ends.`
      : `${trust.whole} of ${motions} motions are right to their ends; of the others only statistics hold.`;
  const kept = target && `${target.is_kept ? "" : "Not kept: "}${words(target.why)}.`;
  return html`${metric && html`<${Lead} one=${statistics[metric]} metric=${metric} study=${study} more=${[kept, all]} />`}
    ${failed > 0 && html`<p class="fault">${`${failed} runs failed and count in nothing: ${failures[0].detail}`}</p>`}
    <div class="row">
      <${MetricChoice} metrics=${varying} metric=${metric} change=${change} />
      <${Choice}
        label="Shape"
        options=${SHAPES}
        value=${query.shape ?? "histogram"}
        onChange=${(shape) => change({ shape })}
      />
    </div>
    ${metric && html`<${Distribution} study=${study} metric=${metric} given=${summary[metric]} shape=${query.shape} />`}
    ${study.indices.some(({ metric: of, total }) => of === metric && total !== null) && html`<${Shares} indices=${study.indices} metric=${metric} />`}
    ${study.displacement?.length > 0 && html`<${Fan} study=${study} />`}
    ${study.spectra.map((spectrum) => html`<${Spectrum} key=${spectrum.channel} spectrum=${spectrum} study=${study} />`)}
    <${Numbers}
      statistics=${statistics}
      known=${known}
      scene=${scene}
      inputs=${inputs}
      runs=${runs}
    />`;
}

// Sobol indices take runs of their own.
const runsText = (count, runs) =>
  count === runs ? `${runs} runs.` : `${count} runs, ${runs} with those for the Sobol indices.`;

const Lead = ({ one, metric, study: { runs, confidence }, more }) =>
  html`<${Decision} more=${more}>
    ${`Mean ${words(metric)} ${quantity(one.mean, one.unit)} (${number(100 * confidence, 3)} %: ${between(one.low, one.high, one.unit)}); 90 of 100 runs have ${between(one.q05, one.q95, one.unit)}. ${runsText(one.count, runs)}`}
  <//>`;

function Distribution({ study, metric, given, shape }) {
  const one = study.statistics[metric];
  const values = useMemo(
    () => study.table.map((row) => row[metric]).filter((value) => Number.isFinite(value)),
    [study, metric],
  );
  const isCumulative = shape === "ecdf";
  const series = useMemo(() => {
    if (!isCumulative)
      return [{ kind: "bars", label: "runs", color: "accent", ...histogram(values) }];
    const sorted = values.toSorted((a, b) => a - b);
    return [
      {
        label: "part of the runs up to here",
        color: "accent",
        x: sorted.flatMap((value) => [value, value]),
        y: sorted.flatMap((_, at) => [at / sorted.length, (at + 1) / sorted.length]),
      },
    ];
  }, [values, isCumulative]);
  const rules = [
    { x: one.mean, label: "mean", color: "text" },
    Number.isFinite(given) && { x: given, label: "the scene itself", color: "ghost" },
    { x: one.q05, label: "5 %", color: "quiet" },
    { x: one.q95, label: "95 %", color: "quiet" },
  ].filter(Boolean);
  const spans = [{ from: one.q05, to: one.q95 }];
  return html`<${Chart}
    title=${`Distribution of the ${words(metric)}`}
    heading=${isCumulative ? "Part of the runs at or below" : "Number of runs"}
    height=${240}
    x=${{ label: title(metric), unit: one.unit }}
    y=${isCumulative ? { label: "Part of the runs", unit: "1", domain: [0, 1] } : { label: "Number of runs", unit: "1" }}
    series=${series}
    rules=${rules}
    spans=${spans}
  />`;
}

function Shares({ indices, metric }) {
  const rows = indices
    .filter((one) => one.metric === metric && one.total !== null)
    .sort((a, b) => b.total - a.total)
    .map(({ pointer, total, total_interval_95: interval, first }) => ({
      label: labelOf(pointer),
      to: 100 * total,
      interval: interval?.map((end) => 100 * end),
      text: `${number(100 * total, 3)} % (alone ${number(100 * first, 3)} %)`,
    }));
  return html`<${Bars}
    title=${`What the variance of the ${words(metric)} comes from`}
    x=${{ label: "Total Sobol index with its 95 % interval [%]", unit: "1" }}
    rows=${rows}
  />`;
}

// Displacement over time: the median and the bands that hold most runs.
function Fan({ study }) {
  return study.displacement.map(({ channel, unit, q05, q16, median, q84, q95 }) => {
    const series = [
      { kind: "band", label: "5 to 95 %", color: "displacement", low: q05, high: q95 },
      { kind: "band", label: "16 to 84 %", color: "displacement", low: q16, high: q84 },
      { label: "median", color: "displacement", y: median },
    ].map((one) => ({ ...one, x: study.time }));
    return html`<${Chart}
      key=${channel}
      title=${`Fan of the ${words(channel)}`}
      height=${200}
      x=${{ label: "Time", unit: "s" }}
      y=${{ label: title(channel), unit: unit ?? "m" }}
      series=${series}
    />`;
  });
}

function Spectrum({ spectrum, study }) {
  const { channel, unit, mean, low, high, standard_deviation: deviation } = spectrum;
  const { frequency, confidence } = study;
  const hasQuantiles = spectrum.q05.length > 0;
  const times = (power) => mean.map((value, at) => value * (1 + deviation[at] / value) ** power);
  const bands = hasQuantiles
    ? [
        { label: "5 to 95 %", low: spectrum.q05, high: spectrum.q95 },
        { label: "16 to 84 %", low: spectrum.q16, high: spectrum.q84 },
      ]
    : [{ label: "one run, by a standard deviation", low: times(-1), high: times(1) }];
  const series = [
    ...bands.map((band) => ({ kind: "band", color: "acceleration", ...band })),
    low.length > 0 && {
      kind: "band",
      color: "c2",
      label: `mean, ${number(confidence * 100, 2)} %`,
      low,
      high,
    },
    hasQuantiles && { color: "acceleration", dash: true, label: "median", y: spectrum.median },
    { color: "c2", label: "mean", y: mean },
  ].filter(Boolean);
  const most = mean.indexOf(Math.max(...mean));
  return html`<${Chart}
    title=${`Spectrum of the ${words(channel)}`}
    description=${`The mean is largest at ${quantity(frequency[most], "Hz", 3)}: ${quantity(mean[most], unit, 3)}.`}
    height=${260}
    x=${{ label: "Frequency", unit: "Hz", log: true }}
    y=${{ label: `Spectrum of the ${words(channel)}`, unit, log: true }}
    series=${series.map((one) => ({ ...one, x: frequency }))}
  />`;
}

function Numbers({ statistics, known, scene, inputs, runs }) {
  const seeded = (seed) => () => ({
    ...plainScene(scene),
    excitation: { ...scene.excitation, seed },
  });
  const of = (key) => quantities(title(key), (row) => row[key]);
  const columns = [
    { label: "Metric", value: ({ metric }) => title(metric) },
    of("mean"),
    { label: "95 % interval of the mean", value: (row) => between(row.low, row.high, row.unit) },
    { label: "5 to 95 %", value: (row) => between(row.q05, row.q95, row.unit) },
    of("median"),
    of("standard_deviation"),
    {
      label: "Largest",
      isNumeric: true,
      value: (row) => row.maximum,
      cell: (row) =>
        html`${`${quantity(row.maximum, row.unit, 3)} `}${inputs.length === 0 && html`<${SceneLink} label=${`seed ${row.maximum_seed}`} load=${seeded(row.maximum_seed)} keys=${[row.maximum_seed]} />`}`,
    },
  ];
  const rows = known.map((metric) => ({ ...statistics[metric], metric }));
  return html`<${Table}
    caption=${`Each metric over ${rows[0]?.count ?? runs} runs`}
    columns=${columns}
    rows=${rows}
  />`;
}
