// One ground motion: its samples and its response spectrum, what is known of it, what uses it.
import { go, link, setQuery } from "../address.js";
import { ask, get } from "../api.js";
import { Chart } from "../chart/chart.js";
import {
  Button,
  Choice,
  Facts,
  Headlines,
  Loaded,
  Menu,
  optionsOf,
  Panel,
} from "../ui/controls.js";
import { save } from "../ui/files.js";
import { pageOf } from "../ui/page.js";
import { html, useState } from "../ui/preact.js";
import { useLoaded } from "../ui/hooks.js";
import { moment, number, pretty, quantity, title } from "../units.js";

const POINTS = 1500; // buckets of a view, some 60 kB
const FORMATS = ["csv", "npy", "mat", "json"];
const RATIOS = [0, 0.02, 0.05, 0.1];

const pathOf = (name) => `v1/records/${encodeURIComponent(name)}`;

function Numbers({ record }) {
  const items = [
    {
      label: "Peak acceleration",
      value: quantity(record.peak, "m/s^2"),
      note: `at ${quantity(record.peak_time, "s")}`,
    },
    { label: "Peak velocity", value: quantity(record.peak_velocity, "m/s", 3) },
    {
      label: "Velocity at the end",
      value: quantity(record.end_velocity, "m/s", 3),
      note: "0 without drift",
    },
    { label: "Duration", value: quantity(record.duration, "s") },
    {
      label: "Samples",
      value: number(record.count, 9),
      note: `every ${quantity(record.interval, "s")}`,
    },
    { label: "Results", value: number(record.used_by.results), note: "made with it" },
  ];
  return html`<${Headlines} items=${items} />`;
}

// The samples; of many, extremes of buckets, so that no peak is lost: finer ones where the reader zooms in.
function Samples({ record, query }) {
  const { name, duration } = record;
  const [range, setRange] = useState(() => {
    const from = Math.max(0, Number(query.from) || 0);
    const to = Math.min(duration, Number(query.to) || duration);
    return from < to && (from > 0 || to < duration) ? [from, to] : null;
  });
  const [from, to] = range ?? [0, duration];
  const loaded = useLoaded(
    (signal) => get(`${pathOf(name)}/samples.json`, { from, to, points: POINTS }, signal),
    [name, from, to],
  );
  const choose = (next) => {
    const rounded = next?.map((end) => Number(end.toPrecision(8))) ?? null;
    setRange(rounded);
    setQuery({ from: rounded?.[0], to: rounded?.[1] });
  };
  const summary =
    `${number(record.count, 9)} samples over ${quantity(duration, "s")}; ` +
    `the largest is ${quantity(record.peak, "m/s^2")}, at ${quantity(record.peak_time, "s")}.`;
  return html`<${Loaded} loaded=${loaded}>
    ${(data) => {
      const { bucket, sample_rate: rate, start } = data;
      const { min, max } = data.channels.acceleration;
      const x = min.map((_, at) => start + (at * bucket) / rate);
      const one = { label: "acceleration", color: "base", x };
      const series =
        bucket > 1 ? { ...one, kind: "band", low: min, high: max } : { ...one, y: min };
      const many =
        bucket > 1 ? ` Each place shows the least and the largest of ${number(bucket)}.` : "";
      return html`<${Chart}
          title=${`Base acceleration of ${name}`}
          description=${summary}
          height=${200}
          x=${{ label: "Time", unit: "s", domain: [0, duration] }}
          y=${{ label: "Base acceleration", unit: "m/s^2" }}
          series=${[series]}
          range=${range}
          onRange=${choose}
        />
        <p class="hint">${summary}${many}</p>`;
    }}
  <//>`;
}

const KINDS = [
  { value: "pseudo_acceleration", label: "Pseudo-acceleration", color: "acceleration" },
  { value: "pseudo_velocity", label: "Pseudo-velocity", color: "velocity" },
  { value: "displacement", label: "Displacement", color: "displacement" },
];

// The largest response of oscillators to this motion, over their periods.
function Spectrum({ name, query }) {
  const [ratio, setRatio] = useState(
    RATIOS.includes(Number(query.damping)) ? Number(query.damping) : 0.05,
  );
  const [kind, setKind] = useState(
    KINDS.some(({ value }) => value === query.spectrum) ? query.spectrum : KINDS[0].value,
  );
  const loaded = useLoaded(
    (signal) => get(`${pathOf(name)}/spectrum.json`, { damping_ratio: ratio }, signal),
    [name, ratio],
  );
  const chosen = KINDS.find(({ value }) => value === kind);
  return html`<${Panel} title="Response spectrum">
    <div class="row">
      <${Choice}
        label="Quantity"
        options=${KINDS}
        value=${kind}
        onChange=${(value) => {
          setKind(value);
          setQuery({ spectrum: value });
        }}
      />
      <${Choice}
        label="Damping ratio"
        options=${optionsOf(RATIOS, (value) => `${100 * value} %`)}
        value=${ratio}
        onChange=${(value) => {
          setRatio(value);
          setQuery({ damping: value });
        }}
      />
    </div>
    <${Loaded} loaded=${loaded}>
      ${(data) => {
        const { unit, values } = data[kind];
        return html`<${Chart}
          title=${`${chosen.label} of oscillators`}
          height=${200}
          x=${{ label: "Period [s]", unit: "1", log: true }}
          y=${{ label: chosen.label, unit, log: true }}
          series=${[{ label: chosen.label, color: chosen.color, x: data.period.values, y: values }]}
        />`;
      }}
    <//>
  <//>`;
}

function RecordFacts({ record }) {
  const { earthquake, station, source, processing, notes, layout, author, header } = record;
  const { created, digest, used_by: used } = record;
  const unit = pretty(record.stated_unit ?? record.unit);
  const given = { earthquake, station, source, processing, notes, layout, header, unit, author };
  const later = { uploaded: moment(created), unfinished_jobs: used.unfinished_jobs, digest };
  const facts = Object.entries({ ...given, ...later })
    .filter(([, value]) => value !== null && typeof value !== "object")
    .map(([key, value]) => [title(key), number(value)]);
  return html`<${Panel} title="What is known of it" help="Ground motions">
    <${Facts} pairs=${facts} />
  <//>`;
}

function Record({ record, query }) {
  const { name } = record;
  const path = pathOf(name);
  const [isLeaving, setLeaving] = useState(false);
  const remove = async () => {
    if (!confirm(`Delete ${name} for good?`)) return;
    setLeaving(true); // nothing is asked about it any more
    await ask("DELETE", path).catch((problem) => {
      setLeaving(false);
      throw problem;
    });
    go("records");
  };
  return html`<div class="title-row">
      <h1>${name}</h1>
      <div class="actions">
        <a class="button primary" href=${link("scene", { record: name })}>Use in a scene</a>
        <${Menu} label="Download">
          ${FORMATS.map(
            (format) =>
              html`<${Button}
                isQuiet
                onClick=${() => save(`${path}/samples.${format}`, `${name}.${format}`)}
                >${`Samples as ${format}`}<//
              >`,
          )}
        <//>
        <${Button} onClick=${remove}>Delete<//>
      </div>
    </div>
    <${Numbers} record=${record} />
    <div class="split">
      <div>
        ${
          !isLeaving &&
          html`<section class="panel" aria-label="Samples">
              <${Samples} record=${record} query=${query} />
            </section>
            <${Spectrum} name=${name} query=${query} />`
        }
      </div>
      <${RecordFacts} record=${record} />
    </div>`;
}

function RecordPage({ address: { path: parts, query } }) {
  const name = parts[1];
  const loaded = useLoaded((signal) => get(pathOf(name), null, signal), [name]);
  return html`<${Loaded} loaded=${loaded} heading=${name}>
    ${(record) => html`<${Record} key=${JSON.stringify(query)} record=${record} query=${query} />`}
  <//>`;
}

export const page = pageOf((address) => `Record ${address.path[1]}`, RecordPage);
