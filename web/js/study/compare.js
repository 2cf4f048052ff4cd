// Contact models side by side: how far each is from the scene's own one, in level, motion and force; spectra and motions over
// each other. In the address: by.
import { html, useMemo } from "../ui/preact.js";
import { Chart } from "../chart/chart.js";
import { useResult } from "../result/context.js";
import { bandLine } from "../runs/bands.js";
import { Choice } from "../ui/controls.js";
import { Table } from "../ui/table.js";
import { capital, metricOf, number, quantity, share, title, words } from "../units.js";
import { Bars, Decision, remarkText } from "./parts.js";

const MAX_NAMED = 3; // in a sentence
const PROPER = /^(hertz|hunt crossley|lankarani nikravesh|flores|jankowski)/;
const modelName = (name) =>
  words(name).replace(PROPER, (names) => names.split(" ").map(capital).join("-"));

const signed = (value, digits = 3) => `${value > 0 ? "+" : ""}${number(value, digits)}`;

// What entries can be told apart by: {value, label, unit, of(entry): a number, null where it is not known}.
const MEASURES = [
  {
    value: "level",
    label: "Level of the spectrum",
    axis: "Level of the spectrum [dB]",
    of: ({ psd }) => psd?.level ?? null,
    text: (value) => `${signed(value)} dB`,
  },
  ...["rms_displacement", "peak_acceleration", "peak_contact_force", "impacts"].map((metric) => ({
    value: metric,
    label: title(metric),
    axis: `Change of the ${words(metric)} [%]`,
    of: ({ differences }) =>
      Number.isFinite(differences?.[metric]) ? 100 * differences[metric] : null,
    text: (value) => `${signed(value)} %`,
  })),
];

function decisionOf(entries, study) {
  const [own, ...others] = entries;
  const impulse = others.find((entry) => entry.contact_model === "impulse");
  if (impulse && own.contacts.mean_duration > 0)
    return `The impulse model's spectrum is off by ${number(impulse.psd.level, 2)} dB: its contacts take no time, those of ${modelName(own.name)} ${quantity(own.contacts.mean_duration, "s", 2)} on average.`;
  const furthest = others.reduce(
    (most, entry) => (Math.abs(entry.psd.level) > Math.abs(most?.psd.level ?? 0) ? entry : most),
    null,
  );
  return furthest
    ? `Furthest from ${modelName(own.name)}: ${modelName(furthest.name)}, whose spectrum of the ${words(study.channel)} is off by ${number(furthest.psd.level, 2)} dB.`
    : "No model differs from the scene's own.";
}

function partingsOf(entries, part) {
  const [own, ...others] = entries;
  const all = others.filter(({ divergence }) => divergence?.time !== null);
  if (all.length === 0) return null;
  const first = all.toSorted((a, b) => a.divergence.time - b.divergence.time).slice(0, MAX_NAMED);
  const texts = first.map(
    ({ name, divergence }) =>
      `${modelName(name)} from ${quantity(divergence.time, "s")} on${divergence.is_trusted ? "" : " (or by rounding)"}`,
  );
  return `Displacements differ from ${modelName(own.name)} by more than ${share(part)} of the largest: ${texts.join(", ")}${all.length > first.length ? "; others later" : ""}.`;
}

export function CompareStudy() {
  const { result, query, change } = useResult();
  const { study, units } = result;
  const entries = useMemo(
    () => study.entries.filter(({ status }) => status === "run"),
    [result.id],
  );
  const refused = study.entries.filter(({ status }) => status !== "run");
  const known = MEASURES.filter(({ of }) => entries.slice(1).some((entry) => of(entry) !== null));
  const measure = known.find(({ value }) => value === query.by) ?? known[0];
  return html`<${Decision} more=${[partingsOf(entries, study.part)]}>
      ${decisionOf(entries, study)}
    <//>
    ${
      measure &&
      html`<div class="row">
          <${Choice}
            label="Compared by"
            options=${known}
            value=${measure.value}
            onChange=${(value) => change({ by: value })}
          />
        </div>
        <${Differences} entries=${entries} measure=${measure} />`
    }
    <${Spectra} entries=${entries} study=${study} />
    <${Motions} entries=${entries} study=${study} />
    <${Numbers} entries=${entries} units=${units} />
    ${refused.map(({ name, why }) => html`<p class="hint">${`Not run: ${modelName(name)}. ${remarkText(why).replace(", is ", "; it is ")}`}</p>`)}`;
}

function Differences({ entries, measure }) {
  const [own, ...others] = entries;
  const rows = others
    .map((entry, at) => ({ entry, at, value: measure.of(entry) }))
    .filter(({ value }) => value !== null)
    .sort((a, b) => Math.abs(b.value) - Math.abs(a.value))
    .map(({ entry, at, value }) => ({
      label: modelName(entry.name),
      to: value,
      color: `c${((at + 1) % 8) + 1}`,
      text: measure.text(value),
    }));
  return html`<${Bars}
    title=${`Difference from ${modelName(own.name)}`}
    x=${{ label: measure.axis, unit: "1" }}
    rows=${rows}
  />`;
}

const colorOf = (at) => `c${(at % 8) + 1}`;

function Spectra({ entries, study: { frequency, channel, unit } }) {
  const series = useMemo(
    () =>
      entries.map(({ name, density }, at) => ({
        label: modelName(name),
        color: colorOf(at),
        ...bandLine({ x: frequency, y: density }),
      })),
    [entries],
  );
  return html`<${Chart}
    title=${`Spectra of the ${words(channel)}`}
    height=${300}
    x=${{ label: "Frequency", unit: "Hz", log: true }}
    y=${{ label: `Spectrum of the ${words(channel)} by third octaves`, unit, log: true }}
    series=${series}
  />`;
}

// The least and the largest displacement of each part of the run.
function Motions({ entries, study }) {
  const series = useMemo(
    () =>
      entries.map(({ name, trace: { minimum, maximum } }, at) => ({
        kind: "band",
        label: modelName(name),
        color: colorOf(at),
        x: minimum.map((_, index) => index / study.trace_rate),
        low: minimum,
        high: maximum,
      })),
    [entries],
  );
  const rules = entries
    .map(({ name, divergence }, at) => ({
      x: divergence?.time,
      label: `${modelName(name)} differs`,
      color: colorOf(at),
    }))
    .filter(({ x }) => Number.isFinite(x));
  return html`<${Chart}
    title="Displacement over time"
    height=${220}
    x=${{ label: "Time", unit: "s" }}
    y=${{ label: "Displacement", unit: "m" }}
    series=${series}
    rules=${rules.length < 3 ? rules : rules.map((rule) => ({ ...rule, label: "" }))}
  />`;
}

// But for rounding.
const isEqual = (a, b) => a === b || Math.abs(a - b) <= 1e-6 * Math.abs(a);

function Numbers({ entries, units }) {
  const metrics = Object.keys(entries[0].summary).filter(
    (key) =>
      !/residual|estimate|horizon/.test(key) &&
      entries.some(({ summary }) => !isEqual(summary[key], entries[0].summary[key])),
  );
  const columns = [
    { label: "Contact model", value: ({ name }) => modelName(name) },
    ...metrics.map((key) => ({
      label: title(key),
      unit: units[key] ?? "1",
      value: ({ summary }) => metricOf(summary, key),
    })),
    { label: "Mean contact", unit: "s", value: ({ contacts }) => contacts.mean_duration },
    {
      label: "Mean restitution",
      isNumeric: true,
      value: ({ contacts }) => contacts.mean_restitution,
    },
    {
      label: "Spectrum level [dB]",
      isNumeric: true,
      digits: 3,
      value: ({ psd }) => psd?.level,
    },
    { label: "Differs from", unit: "s", digits: 3, value: ({ divergence }) => divergence?.time },
  ];
  return html`<${Table} caption="Numbers that differ" columns=${columns} rows=${entries} />`;
}
