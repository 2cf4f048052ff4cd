// The motion of a result in a window of time: every sample while there are few enough to draw, else the least and the largest
// of buckets, one for each device pixel.
import { ask, get } from "../api.js";
import { useLoaded } from "../ui/hooks.js";

export const MAX_SAMPLES = 50000;

// Few enough samples to load all of them, whatever the window.
export const isWhole = ({ count }) => count <= MAX_SAMPLES;

// {time, columns: Map of channel to {values} or {low, high}, isEnvelope, bucket} of these channels.
export async function loadSeries({ path, result, channels, window, pixels, signal }) {
  const { sample_rate: rate } = result;
  const names = channels.join();
  const inWindow = (window.to - window.from) * rate;
  if (inWindow <= MAX_SAMPLES) {
    const query = isWhole(result)
      ? { channels: names }
      : { channels: names, from: window.from, to: window.to };
    const response = await ask("GET", `${path}/series.npy`, { query, signal });
    const [time, ...columns] = readNpy(await response.arrayBuffer());
    const found = new Map(channels.map((channel, at) => [channel, { values: columns[at] }]));
    return { time, columns: found, isEnvelope: false, bucket: 1 };
  }
  const query = { channels: names, from: window.from, to: window.to, points: pixels };
  const series = await get(`${path}/series.json`, query, signal);
  const { bucket = 1 } = series;
  const found = new Map(channels.map((channel) => [channel, columnOf(series, channel)]));
  return { time: timesOf(series), columns: found, isEnvelope: bucket > 1, bucket };
}

// The instants of a series in JSON, of buckets the middles.
export const timesOf = ({ start, count, bucket = 1, sample_rate: rate }) =>
  Float64Array.from({ length: count }, (_, k) => start + ((k + 0.5) * bucket - 0.5) / rate);

// {values}, or of buckets {low, high}.
export function columnOf({ channels, bucket = 1 }, channel) {
  const { values, min, max } = channels[channel];
  return values || bucket === 1 ? { values: values ?? min } : { low: min, high: max };
}

// The same as the state of a view.
export function useSeries({ path, result, channels, window, pixels }) {
  const isAll = isWhole(result);
  const keys = [path, channels.join(), ...(isAll ? [] : [window.from, window.to, pixels])];
  return useLoaded(async (signal) => {
    if (channels.length === 0 || (!isAll && pixels === 0)) return null;
    return loadSeries({ path, result, channels, window, pixels, signal });
  }, keys);
}

// A chart's series from a column.
export const seriesOf = (label, color, time, column, more) =>
  column.values
    ? { kind: "line", label, color, x: time, y: column.values, ...more }
    : { kind: "band", label, color, x: time, low: column.low, high: column.high, ...more };

// "displacement" of "displacement_2".
export const wordOf = (channel) => channel.replace(/_\d+$/, "");

// The time by which this part of a motion's sum of squares has passed: where there is something to see.
function timeOfEnergy(time, values, part = 0.9995) {
  let total = 0;
  for (const value of values) total += value * value;
  let sum = 0;
  for (let at = 0; at < values.length; at++) {
    sum += values[at] * values[at];
    if (sum >= part * total) return time[at];
  }
  return time[time.length - 1];
}

const QUIET_PART = 0.7;

// Until when motions [{time, values}] are shown at first: as long as they hold energy; null where that is most of the run, whose
// `end` stands for a motion without values.
export function quietTime(motions, end) {
  const times = motions.map(({ time, values }) =>
    values ? 1.1 * timeOfEnergy(time, values) : end,
  );
  const until = Math.max(0, ...times);
  return until > 0 && until < QUIET_PART * end ? Number(until.toPrecision(2)) : null;
}

// What the address has of a chosen part of the time. The whole, null, is named only where less is shown at first.
export function windowChanges(range, quiet, end) {
  const whole = quiet ? [0, end] : [null, null];
  const [from, to] = range?.map((value) => Number(value.toPrecision(8))) ?? whole;
  return { from, to };
}

export function readNpy(buffer) {
  const view = new DataView(buffer);
  const isVersion1 = view.getUint8(6) === 1;
  const length = isVersion1 ? view.getUint16(8, true) : view.getUint32(8, true);
  const start = (isVersion1 ? 10 : 12) + length;
  const header = new TextDecoder("latin1").decode(new Uint8Array(buffer, start - length, length));
  const shape = /'shape':\s*\((\d+),\s*(\d*)\)/.exec(header);
  if (!shape || !/'descr':\s*'<f8'/.test(header))
    throw new Error("The series is not an array of float64.");
  const rows = Number(shape[1]);
  const columns = Number(shape[2] || 1);
  return Array.from(
    { length: columns },
    (_, at) => new Float64Array(buffer.slice(start + 8 * rows * at, start + 8 * rows * (at + 1))),
  );
}

// The value at an instant, between samples on a line; null outside.
function valueAt({ start, interval, values }, instant) {
  const place = (instant - start) / interval;
  const low = Math.floor(place + 1e-6);
  if (low < 0 || place > values.length - 1 + 1e-6) return null;
  const next = values[Math.min(values.length - 1, low + 1)];
  return values[low] + Math.max(0, place - low) * (next - values[low]);
}

// {x, y} of b - a over their common span, at the samples of the coarser one; null where they have none. Both are {start, interval,
// values}.
export function differenceOf(a, b) {
  const coarser = b.interval > a.interval * (1 + 1e-9) ? b : a;
  const [x, y] = [[], []];
  for (let at = 0; at < coarser.values.length; at++) {
    const instant = coarser.start + at * coarser.interval;
    const own = valueAt(a, instant);
    const other = valueAt(b, instant);
    if (own === null || other === null) continue;
    x.push(instant);
    y.push(other - own);
  }
  return x.length < 2 ? null : { x, y };
}
