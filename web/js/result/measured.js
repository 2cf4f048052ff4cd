// A measured motion over a result: shifted in time, compared over time and in the spectrum. In
// the address: measured (the channel), shift (s).
import { html, useMemo, useState } from "../ui/preact.js";
import { ask, post } from "../api.js";
import { Chart } from "../chart/chart.js";
import { bandDifferences, bandSeries, furthestBand } from "../runs/bands.js";
import { readNpy } from "../npy.js";
import { Button, Choice, Failure, Loaded, Notice } from "../ui/controls.js";
import { useLoaded } from "../ui/store.js";
import { number, pretty, quantity, title, words } from "../units.js";
import { useResult, windowOf } from "./context.js";
import { readMeasured, VALUE_UNITS } from "./measured_file.js";
import { quantityColor } from "./motion.js";
import { timeOfEnergy } from "./series.js";
import { welch } from "./welch.js";

const MOST_SAMPLES = 2e6;
const AUDIBLE = 1e-3; // of the loudest third octave: quieter ones are not put into words
const SEGMENTS = 4; // of the common span at least

// Channels that a measurement in this unit can be compared with; without a unit all that have one.
function channelsFor(result, unit) {
  const known = Object.values(VALUE_UNITS).map(([si]) => si);
  const wanted = unit ? [VALUE_UNITS[unit][0]] : known;
  return result.channels.filter((channel) => wanted.includes(result.units[channel]));
}

// The channel whose name the heading has, else the displacement, else the first.
function usualChannel(channels, { heading }) {
  const text = heading.toLowerCase();
  const named = channels.find((channel) => text.includes(words(channel)) || text.includes(channel));
  return named ?? channels.find((channel) => channel.startsWith("displacement")) ?? channels[0];
}

async function loadChannel(path, channel, signal) {
  const response = await ask("GET", `${path}/series.npy`, { query: { channels: channel }, signal });
  const [time, values] = readNpy(await response.arrayBuffer());
  return { time, values };
}

// The shift at which both correlate best, as the service finds it; 0 for what it does not compare.
async function findShift(result, channel, measured, signal) {
  const quantityOf = { m: "displacement", "m/s": "velocity", "m/s^2": "acceleration" };
  const kind = quantityOf[result.units[channel]];
  if (!kind) return 0;
  const { interval, start, values } = measured;
  const samples = Array.from(values);
  const body = {
    a: result.id,
    channel,
    measured: { samples, interval, start, quantity: kind },
    align: "auto",
  };
  return (await post("v1/compare", body, { signal })).shift;
}

// The value at an instant, between samples on a line; null outside.
function valueAt({ start, interval, values }, instant) {
  const place = (instant - start) / interval;
  const low = Math.floor(place + 1e-6);
  if (low < 0 || place > values.length - 1 + 1e-6) return null;
  const next = values[Math.min(values.length - 1, low + 1)];
  return values[low] + Math.max(0, place - low) * (next - values[low]);
}

// What both are over their common span, at the samples of the coarser one: {time, difference, rms, own, correlation, from, to},
// `own` being the rms of the simulated one; null where they have none.
function compareMotions(series, measured, shift, rate) {
  const simulated = { start: 0, interval: 1 / rate, values: series.values };
  const later = { ...measured, start: measured.start + shift };
  const coarser = measured.interval > simulated.interval ? later : simulated;
  const [time, difference] = [[], []];
  const sums = { square: 0, own: 0, other: 0, product: 0 };
  for (let at = 0; at < coarser.values.length; at++) {
    const instant = coarser.start + at * coarser.interval;
    const own = valueAt(simulated, instant);
    const other = valueAt(later, instant);
    if (own === null || other === null) continue;
    time.push(instant);
    difference.push(other - own);
    sums.square += (other - own) ** 2;
    sums.own += own * own;
    sums.other += other * other;
    sums.product += own * other;
  }
  if (time.length < 2) return null;
  return {
    time,
    difference,
    from: time[0],
    to: time[time.length - 1],
    rms: Math.sqrt(sums.square / time.length),
    own: Math.sqrt(sums.own / time.length),
    correlation: sums.product / Math.sqrt(sums.own * sums.other),
  };
}

// Both spectra over the common span, by the same segments in time.
function spectraOf(series, measured, shift, { from, to }, rate) {
  const seconds = Math.min((to - from) / SEGMENTS, 4096 / rate);
  const simulated = { start: 0, interval: 1 / rate, values: series.values };
  const later = { ...measured, start: measured.start + shift };
  return [simulated, later].map((signal) => welch(signal, { from, to, seconds }));
}

// The measurement in a text file, or what is wrong with it.
export function MeasuredText({ name, text }) {
  const { result } = useResult();
  const { file, error } = useMemo(() => {
    try {
      return { file: readMeasured(text, name, result.channels) };
    } catch (problem) {
      return { error: problem };
    }
  }, [text]);
  if (error)
    return html`<${Notice} kind="bad" title="The file was not read"><p>${error.message}</p><//>`;
  return html`<${Measured} key=${text} file=${file} />`;
}

function Measured({ file }) {
  const { result, path, query, change } = useResult();
  const [ownUnit, setOwnUnit] = useState(null); // chosen where the file states none
  const [interval, setInterval] = useState(file.interval ?? 1 / result.sample_rate);
  const channels = channelsFor(result, file.unit);
  const channel = channels.includes(query.measured) ? query.measured : usualChannel(channels, file);
  const units = Object.keys(VALUE_UNITS).filter(
    (one) => VALUE_UNITS[one][0] === result.units[channel],
  );
  const unit = file.unit ?? (units.includes(ownUnit) ? ownUnit : units[0]);
  const measured = useMemo(() => {
    const factor = VALUE_UNITS[unit]?.[1] ?? 1;
    return { start: file.start, interval, values: file.values.map((value) => value * factor) };
  }, [file, unit, interval]);
  const series = useLoaded(
    (signal) => (channel ? loadChannel(path, channel, signal) : null),
    [result.id, channel],
  );
  const found = useLoaded(
    (signal) => (channel ? findShift(result, channel, measured, signal) : 0),
    [result.id, channel, measured],
  );
  if (!channel) return html`<p>${`The result has no channel in ${pretty(file.unit)}.`}</p>`;
  if (result.count > MOST_SAMPLES)
    return html`<p>The result has too many samples to be drawn here.</p>`;
  const shift = query.shift === undefined ? (found.data ?? 0) : Number(query.shift) || 0;
  return html`<div class="row level measured-row">
      <span
        ><strong>${`${file.name} `}</strong>
        ${`${number(file.values.length)} samples every ${quantity(interval, "s")}`}</span
      >
      <${Choice}
        label="Compared with"
        options=${channels.map((value) => ({ value, label: words(value) }))}
        value=${channel}
        onChange=${(value) => change({ measured: value, shift: null }, true)}
      />
      ${
        file.unit === null &&
        html`<${Choice}
          label="Unit of the file"
          options=${units.map((value) => ({ value, label: pretty(value) }))}
          value=${unit}
          onChange=${setOwnUnit}
        />`
      }
      ${file.interval === null && html`<${NumberField} label="Interval [ms]" value=${1000 * interval} onChange=${(value) => value > 0 && setInterval(value / 1000)} />`}
      <${NumberField}
        label="Shift [ms]"
        value=${Number((1000 * shift).toPrecision(6))}
        onChange=${(value) => change({ shift: value / 1000 })}
      />
      <input
        type="range"
        aria-label="Shift"
        min=${(found.data ?? 0) - 0.25}
        max=${(found.data ?? 0) + 0.25}
        step="0.0005"
        value=${shift}
        onInput=${(event) => change({ shift: Number(event.currentTarget.value) })}
      />
      <${Button} disabled=${query.shift === undefined} onClick=${() => change({ shift: null })}
        >Find the shift<//
      >
    </div>
    ${found.error && html`<${Failure} error=${found.error} />`}
    <${Loaded} loaded=${series}>
      ${(own) =>
        own &&
        html`<${Overlay} series=${own} measured=${measured} shift=${shift} channel=${channel} />`}
    <//>`;
}

// What is typed stands until it is entered, whatever is drawn anew meanwhile.
function NumberField({ label, value, onChange }) {
  const [typed, setTyped] = useState(null);
  const enter = (event) => {
    setTyped(null);
    onChange(Number(event.currentTarget.value));
  };
  return html`<label class="number-field">
    ${label}
    <input
      type="number"
      step="any"
      value=${typed ?? value}
      onInput=${(event) => setTyped(event.currentTarget.value)}
      onChange=${enter}
    />
  </label>`;
}

function Overlay({ series, measured, shift, channel }) {
  const { result, query, change } = useResult();
  const unit = result.units[channel];
  const rate = result.sample_rate;
  const both = useMemo(
    () => compareMotions(series, measured, shift, rate),
    [series, measured, shift],
  );
  const times = useMemo(
    () =>
      Float64Array.from(
        measured.values,
        (_, at) => measured.start + shift + at * measured.interval,
      ),
    [measured, shift],
  );
  const spectra = useMemo(
    () => (both && both.to > both.from ? spectraOf(series, measured, shift, both, rate) : null),
    [both],
  );
  if (!both)
    return html`<p role="status">
      The measured samples do not overlap with the result: change the shift.
    </p>`;
  const window = windowOf(result, query);
  const isGiven = query.from !== undefined || query.to !== undefined;
  const quiet = Math.min(window.end, 1.1 * timeOfEnergy(series.time, series.values));
  const range =
    isGiven || !(quiet > 0) ? [window.from, window.to] : [0, Number(quiet.toPrecision(2))];
  const setRange = (next) => {
    const ends = (next ?? [0, window.end]).map((end) => Number(end.toPrecision(8)));
    change({ from: ends[0], to: ends[1] }, true);
  };
  const x = { label: "Time", unit: "s", domain: [0, window.end] };
  const bands = spectra ? bandDifferences(...spectra) : [];
  const loudest = Math.max(...bands.map(({ mean }) => mean));
  const most = furthestBand(bands.filter(({ mean }) => mean > AUDIBLE * loudest));
  const sentence =
    `Moved by ${quantity(shift, "s")}, the measurement differs by ${quantity(both.rms, unit, 3)} rms, ` +
    `${number((100 * both.rms) / both.own, 3)} % of the simulated rms; correlation ${number(both.correlation, 3)}.`;
  const level = most
    ? ` Most around ${quantity(most.frequency, "Hz", 2)}: ${number(Math.abs(most.level), 2)} dB ${most.level > 0 ? "more" : "less"} measured.`
    : "";
  const color = quantityColor(channel);
  const shared = { x, range, onRange: setRange, group: "time" };
  return html`<p class="answer" role="status">${sentence + level}</p>
    <${Chart}
      ...${shared}
      title=${`Measured and simulated ${words(channel)}`}
      y=${{ label: title(channel), unit }}
      height=${200}
      isCompact
      series=${[
        { label: "measured", color: "measured", lineWidth: 3, x: times, y: measured.values },
        { label: "simulated", color, x: series.time, y: series.values },
      ]}
    />
    <${Chart}
      ...${shared}
      title="Measured less simulated"
      y=${{ label: "Difference", unit }}
      height=${90}
      series=${[{ label: "measured less simulated", color: "measured", x: both.time, y: both.difference }]}
    />
    ${spectra && html`<${MeasuredSpectra} spectra=${spectra} bands=${bands} channel=${channel} color=${color} />`}`;
}

function MeasuredSpectra({ spectra: [own, other], bands, channel, color }) {
  const { result } = useResult();
  const plain = result.units[channel];
  const unit = `${plain.includes("/") ? `(${plain})` : plain}^2/Hz`;
  const x = { label: "Frequency", unit: "Hz", log: true };
  const ends = [bands[0]?.low, bands[bands.length - 1]?.high];
  const positive = ({ x: frequencies, y }) => ({ x: frequencies.subarray(1), y: y.subarray(1) });
  return html`<div class="columns">
    <${Chart}
      title=${`Spectra of the measured and simulated ${words(channel)}`}
      x=${x}
      y=${{ label: "Density", unit, log: true }}
      height=${180}
      series=${[
        { label: "simulated", color, ...positive(own) },
        { label: "measured", color: "measured", ...positive(other) },
      ]}
      group="measured-spectra"
    />
    <${Chart}
      title="Measured over simulated by third octaves"
      x=${{ ...x, domain: bands.length > 0 ? ends : undefined }}
      y=${{ label: "Level of measured over simulated", unit: "dB" }}
      height=${180}
      series=${[bandSeries("measured over simulated", "measured", bands)]}
      group="measured-spectra"
    />
  </div>`;
}
