// A measured motion over a result: shifted in time, compared over time and in the spectrum. In
// the address: measured (the channel), shift (s).
import { html, useMemo, useState } from "../ui/preact.js";
import { ask, post, wait } from "../api.js";
import { Chart } from "../chart/chart.js";
import { bandDifferences, bandSeries, bandText, furthestBand } from "../runs/bands.js";
import { differenceOf, quietTime, readNpy, windowChanges } from "./series.js";
import { Button, Choice, Failure, Loaded, Notice, optionsOf } from "../ui/controls.js";
import { useLoaded } from "../ui/hooks.js";
import { number, pretty, quantity, title, words } from "../units.js";
import { useResult, windowOf } from "./context.js";
import { readMeasured, VALUE_UNITS } from "./measured_file.js";
import { quantityColor } from "./motion.js";

const MAX_SAMPLES = 2e6;
const AUDIBLE = 1e-3; // of the loudest third octave: quieter ones are not put into words
const PAUSE = 200; // ms that a shift stands before it is sent
const QUANTITIES = { m: "displacement", "m/s": "velocity", "m/s^2": "acceleration", N: "force" };

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

// The service's comparison, with both densities: at a shift, or at the one where both correlate best.
function compareMeasured(result, channel, { interval, start, values }, shift, signal) {
  const quantity = QUANTITIES[result.units[channel]];
  const body = {
    a: result.id,
    channel,
    measured: { samples: Array.from(values), interval, start, quantity },
    densities: true,
    ...(shift === undefined ? { align: "auto" } : { shift }),
  };
  return post("v1/compare", body, { signal });
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
  const isShown = channel && result.count <= MAX_SAMPLES;
  const series = useLoaded(
    (signal) => (isShown ? loadChannel(path, channel, signal) : null),
    [result.id, channel],
  );
  const found = useLoaded(
    (signal) => (isShown ? compareMeasured(result, channel, measured, undefined, signal) : null),
    [result.id, channel, measured],
  );
  const best = found.data?.shift ?? 0;
  const shift = query.shift === undefined ? best : Number(query.shift) || 0;
  const compared = useLoaded(
    async (signal) => {
      if (!isShown || found.isLoading) return null;
      if (found.data?.shift === shift) return found.data;
      await wait(PAUSE, signal);
      return compareMeasured(result, channel, measured, shift, signal);
    },
    [found, shift],
  );
  if (!channel) return html`<p>${`The result has no channel in ${pretty(file.unit)}.`}</p>`;
  if (!isShown)
    return html`<p>
      ${`The result has ${number(result.count)} samples; up to ${number(MAX_SAMPLES)} are compared here.`}
    </p>`;
  return html`<div class="row level measured-row">
      <span
        ><strong>${`${file.name} `}</strong>
        ${`${number(file.values.length)} samples every ${quantity(interval, "s")}`}</span
      >
      <${Choice}
        label="Compared with"
        options=${optionsOf(channels)}
        value=${channel}
        onChange=${(value) => change({ measured: value, shift: null }, true)}
      />
      ${
        file.unit === null &&
        html`<${Choice}
          label="Unit of the file"
          options=${optionsOf(units, pretty)}
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
        min=${best - 0.25}
        max=${best + 0.25}
        step="0.0005"
        value=${shift}
        onInput=${(event) => change({ shift: Number(event.currentTarget.value) })}
      />
      <${Button} disabled=${query.shift === undefined} onClick=${() => change({ shift: null })}
        >Find the shift<//
      >
    </div>
    ${found.error && !compared.error && html`<${Failure} error=${found.error} />`}
    <${Loaded} loaded=${series}>
      ${(own) =>
        own && html`<${Overlay} ...${{ series: own, measured, shift, channel, compared }} />`}
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

function Overlay({ series, measured, shift, channel, compared }) {
  const { result, query, change } = useResult();
  const unit = result.units[channel];
  const rate = result.sample_rate;
  const difference = useMemo(
    () =>
      differenceOf(
        { start: 0, interval: 1 / rate, values: series.values },
        { ...measured, start: measured.start + shift },
      ),
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
  if (!difference)
    return html`<p role="status">
      The measured samples do not overlap with the result: change the shift.
    </p>`;
  const window = windowOf(result, query);
  const isGiven = query.from !== undefined || query.to !== undefined;
  const quiet = quietTime([series], window.end);
  const range = isGiven || !quiet ? [window.from, window.to] : [0, quiet];
  const setRange = (next) => change(windowChanges(next, quiet, window.end), true);
  const x = { label: "Time", unit: "s", domain: [0, window.end] };
  const color = quantityColor(channel);
  const shared = { x, range, onRange: setRange, group: "time" };
  return html`${compared.error && html`<${Failure} error=${compared.error} />`}
    ${compared.data && html`<${Answer} answer=${compared.data} />`}
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
      series=${[{ label: "measured less simulated", color: "measured", ...difference }]}
    />
    ${compared.data && html`<${MeasuredSpectra} answer=${compared.data} color=${color} />`}`;
}

// Both densities {x, y} of an answer, without those at 0 Hz.
const densitiesOf = ({ psd: { frequency, a, measured } }) =>
  [a, measured].map((values) => ({ x: frequency.slice(1), y: values.slice(1) }));

function Answer({ answer: { shift, unit, motion, ...answer } }) {
  const bands = bandDifferences(...densitiesOf(answer));
  const loudest = Math.max(...bands.map(({ mean }) => mean));
  const most = furthestBand(bands.filter(({ mean }) => mean > AUDIBLE * loudest));
  const { relative } = motion;
  const share =
    (relative ?? null) === null ? "" : `, ${number(100 * relative, 3)} % of the simulated rms`;
  const apart =
    relative < 1e-9
      ? "is the simulated motion but for rounding"
      : `differs by ${quantity(motion.difference_rms, unit, 3)} rms${share}`;
  const sentence = `Moved by ${quantity(shift, "s")}, the measurement ${apart}; correlation ${number(motion.correlation, 3)}.`;
  const level = most ? ` Most ${bandText(most)} measured.` : "";
  return html`<p class="answer" role="status">${sentence + level}</p>`;
}

function MeasuredSpectra({ answer, color }) {
  const { channel, unit: plain } = answer;
  const [own, other] = densitiesOf(answer);
  const bands = bandDifferences(own, other);
  const unit = `${plain.includes("/") ? `(${plain})` : plain}^2/Hz`;
  const x = { label: "Frequency", unit: "Hz", log: true };
  const ends = [bands[0]?.low, bands[bands.length - 1]?.high];
  return html`<div class="columns">
    <${Chart}
      title=${`Spectra of the measured and simulated ${words(channel)}`}
      x=${x}
      y=${{ label: "Density", unit, log: true }}
      height=${180}
      series=${[
        { label: "simulated", color, ...own },
        { label: "measured", color: "measured", ...other },
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
