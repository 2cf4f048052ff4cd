// What errors of e, T_c and the masses do to the response: a tornado chart, the spread of drawn runs, spectra. In the address:
// metric.
import { html } from "../ui/preact.js";
import { Chart } from "../chart/chart.js";
import { useResult } from "../result/context.js";
import { Table } from "../ui/table.js";
import { number, quantity, share, title, words } from "../units.js";
import { Bars, Decision, MetricChoice, between, quantities } from "./parts.js";

const NAMES = { restitution: "restitution e", contact_time: "contact time", mass: "free mass" };
const nameOf = (parameter) => NAMES[parameter] ?? words(parameter);

// The slopes of a metric by every parameter, the steepest first.
const slopesOf = (response, metric) =>
  response
    .flatMap(({ parameter, slopes }) =>
      slopes.filter((slope) => slope.metric === metric).map((slope) => ({ parameter, ...slope })),
    )
    .sort((a, b) => Math.abs(b.derivative) - Math.abs(a.derivative));

function decisionOf({ response, statistics, made }, errors, metric) {
  const [steepest] = slopesOf(response, metric).filter(({ is_settled: isSettled }) => isSettled);
  const one = statistics.find((row) => row.metric === metric);
  const range =
    made > 0 && one
      ? ` With ${errors}, 90 of 100 runs give a ${words(metric)} from ${between(one.q05, one.q95, one.unit)} (stated ${quantity(one.value, one.unit, 3)}).`
      : "";
  const slope = steepest
    ? `The ${words(metric)} depends most on the ${nameOf(steepest.parameter)}: ${number(steepest.derivative, 2)} % for 1 % more of it.`
    : `No slope of the ${words(metric)} settles.`;
  return slope + range;
}

export function SensitivityStudy() {
  const { result, query, change } = useResult();
  const { study } = result;
  const { restitution_deviation: e, contact_time_deviation: time, response, statistics } = study;
  const errors =
    (e ?? time)
      ? `e off by ${share(e ?? 0)} and T_c by ${share(time ?? 0)}`
      : "the measured spread";
  const metrics = response[0].slopes.map(({ metric }) => metric);
  const moving = metrics.filter((metric) =>
    slopesOf(response, metric).some(({ derivative }) => derivative !== 0),
  );
  const initial = moving.includes("peak_contact_force") ? "peak_contact_force" : moving[0];
  const metric = metrics.includes(query.metric) ? query.metric : (initial ?? metrics[0]);
  const remarks = [
    study.failed > 0 && `${study.failed} runs failed and count in nothing.`,
    study.is_chaotic && `${study.why}.`,
  ];
  return html`<${Decision} more=${remarks}>${decisionOf(study, errors, metric)}<//>
    <div class="row">
      <${MetricChoice} metrics=${metrics} metric=${metric} change=${change} />
    </div>
    <${Tornado} response=${response} metric=${metric} />
    ${study.made > 0 && html`<${Spread} statistics=${statistics} made=${study.made} errors=${errors} />`}
    ${study.spectra.map((spectrum) => html`<${Spectrum} key=${spectrum.channel} spectrum=${spectrum} frequency=${study.frequency} />`)}
    <${Contacts} contacts=${study.contact} />`;
}

function Tornado({ response, metric }) {
  const rows = slopesOf(response, metric).map(
    ({ parameter, derivative, spread, is_settled: isSettled }) => ({
      label: nameOf(parameter),
      to: derivative,
      color: isSettled ? "accent" : "ghost",
      interval: spread > 0.02 ? [derivative - spread / 2, derivative + spread / 2] : null,
      text: `${derivative > 0 ? "+" : ""}${number(derivative, 2)} %${isSettled ? "" : ", not settled"}`,
    }),
  );
  const hasGrey = rows.some(({ color }) => color === "ghost");
  return html`<${Bars}
      title=${`Slopes of the ${words(metric)}`}
      x=${{ label: `Change of the ${words(metric)} for 1 % more of each [%]`, unit: "1" }}
      rows=${rows}
    />
    ${hasGrey && html`<p class="hint">Grey: the slope does not settle as the step shrinks, so it is no derivative.</p>`}`;
}

function Spread({ statistics, made, errors }) {
  const columns = [
    { label: "Metric", value: (row) => title(row.metric) },
    quantities("As stated", ({ value }) => value),
    quantities("Median", ({ median }) => median),
    { label: "5 to 95 %", value: (row) => between(row.q05, row.q95, row.unit) },
    {
      label: "Width",
      isNumeric: true,
      value: (row) => (row.q95 - row.q05) / Math.abs(row.value || 1),
      cell: (row) => share((row.q95 - row.q05) / Math.abs(row.value || 1)),
    },
  ];
  return html`<${Table}
    caption=${`The response of ${made} runs with ${errors}`}
    isHeaded
    columns=${columns}
    rows=${statistics}
  />`;
}

function Spectrum({ spectrum: { channel, unit, value, median, q05, q95 }, frequency }) {
  const series = [
    { kind: "band", label: "5 to 95 %", color: "acceleration", low: q05, high: q95 },
    { label: "median", color: "acceleration", dash: true, y: median },
    { label: "as stated", color: "c2", y: value },
  ].map((one) => ({ ...one, x: frequency }));
  const width = 10 * Math.log10(Math.max(...q95) / Math.max(...q05));
  return html`<${Chart}
    title=${`Spectrum of the ${words(channel)}`}
    description=${`90 of 100 runs: ${number(width, 2)} dB between the band's peaks.`}
    height=${260}
    x=${{ label: "Frequency", unit: "Hz", log: true }}
    y=${{ label: `Spectrum of the ${words(channel)}`, unit, log: true }}
    series=${series}
  />`;
}

// A deviation of 0 was not stated.
function withDeviation(stop, name, unit) {
  const deviation = stop[`${name}_deviation`];
  return `${quantity(stop[name], unit)}${deviation > 0 ? ` ± ${share(deviation)}` : ""}`;
}

function Contacts({ contacts }) {
  const part = (label, name, unit) => ({
    label,
    isNumeric: true,
    value: (stop) => stop[name],
    cell: (stop) => stop.why ?? withDeviation(stop, name, unit),
  });
  const columns = [
    { label: "Stop", value: ({ damper, side }) => `damper ${damper}, ${side}` },
    part("k_b", "stiffness", "N/m"),
    part("c_b", "damping", "N s/m"),
  ];
  return html`<${Table}
    caption="Each stop's stiffness and damping"
    isHeaded
    columns=${columns}
    rows=${contacts}
  />`;
}
