// What a chart draws, by kind: {kind: "line", "band", "points", "errors" or "bars", label, color, x, y, low, high, width, dash}.
// A line of many samples is reduced to the first, least, largest and last one of each device pixel, so that it looks as if every
// sample were drawn and no peak is lost.
import { html } from "../ui/preact.js";

const round = (pixel) => Math.round(Math.max(-1e5, Math.min(1e5, pixel)) * 20) / 20;

// The index of the first of ascending `xs` that is at least `x`.
function indexAtLeast(xs, x) {
  let low = 0;
  let high = xs.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (xs[middle] < x) low = middle + 1;
    else high = middle;
  }
  return low;
}

const isAscending = (xs) => xs.every((x, index) => index === 0 || x >= xs[index - 1]);

// Whether `xs` ascend; remembered, as arrays are not changed.
const ascending = new WeakMap();
function isSorted(xs) {
  if (!ascending.has(xs)) ascending.set(xs, isAscending(xs));
  return ascending.get(xs);
}

// The samples in view and one more on either side: [from, to).
function inView(xs, scale) {
  if (!isSorted(xs)) return [0, xs.length];
  const [low, high] = scale.domain;
  const from = Math.max(0, indexAtLeast(xs, low) - 1);
  return [from, Math.min(xs.length, indexAtLeast(xs, high) + 1)];
}

// "M… L…" through the points; null, NaN and, on logarithmic axes, values that are not positive leave a gap. `density` is
// device pixels per pixel.
function linePath(xs, ys, xScale, yScale, density = 1) {
  const parts = [];
  const [from, to] = inView(xs, xScale);
  const isShown = (value) => Number.isFinite(value) && (!yScale.isLog || value > 0);
  let isOpen = false;
  const draw = (index) => {
    const command = isOpen ? "L" : "M";
    parts.push(`${command}${round(xScale.to(xs[index]))} ${round(yScale.to(ys[index]))}`);
    isOpen = true;
  };
  const width = Math.abs(xScale.pixels[1] - xScale.pixels[0]) * density;
  if (to - from <= 4 * width || !isSorted(xs)) {
    for (let index = from; index < to; index++) {
      if (isShown(ys[index]) && Number.isFinite(xs[index])) draw(index);
      else isOpen = false;
    }
    return parts.join("");
  }
  for (let first = from; first < to;) {
    const column = Math.floor(xScale.to(xs[first]) * density);
    let least = -1;
    let largest = -1;
    let last = first;
    let next = first;
    for (; next < to && Math.floor(xScale.to(xs[next]) * density) === column; next++) {
      if (!isShown(ys[next])) continue;
      if (least < 0 || ys[next] < ys[least]) least = next;
      if (largest < 0 || ys[next] > ys[largest]) largest = next;
      last = next;
    }
    if (least < 0) isOpen = false;
    else
      for (const index of [...new Set([first, least, largest, last])].sort((a, b) => a - b))
        if (isShown(ys[index])) draw(index);
    first = next;
  }
  return parts.join("");
}

// The area between two lines over the same places.
function bandPath(xs, lows, highs, xScale, yScale) {
  const [from, to] = inView(xs, xScale);
  const there = [];
  const back = [];
  for (let index = from; index < to; index++) {
    if (!Number.isFinite(lows[index]) || !Number.isFinite(highs[index])) continue;
    const x = round(xScale.to(xs[index]));
    there.push(`${x} ${round(yScale.to(highs[index]))}`);
    back.push(`${x} ${round(yScale.to(lows[index]))}`);
  }
  return there.length > 0 ? `M${there.join("L")}L${back.reverse().join("L")}Z` : "";
}

// Dots: lines of no length, which round ends make visible.
function pointsPath(xs, ys, xScale, yScale) {
  const parts = [];
  for (let index = 0; index < xs.length; index++) {
    if (!Number.isFinite(ys[index]) || !Number.isFinite(xs[index])) continue;
    if ((yScale.isLog && ys[index] <= 0) || (xScale.isLog && xs[index] <= 0)) continue;
    parts.push(`M${round(xScale.to(xs[index]))} ${round(yScale.to(ys[index]))}h0`);
  }
  return parts.join("");
}

// Upright lines from each low to each high, with ends.
function errorsPath(xs, lows, highs, xScale, yScale) {
  return Array.from(xs, (place, index) => {
    const x = round(xScale.to(place));
    const [low, high] = [lows[index], highs[index]].map((value) => round(yScale.to(value)));
    return `M${x - 3} ${low}h6m-3 0V${high}m-3 0h6`;
  }).join("");
}

// Bars from the axis' zero, or from its lower end, to each value; `widths` in units of x.
function barsPath(xs, ys, widths, xScale, yScale) {
  const parts = [];
  const [low, high] = yScale.domain;
  const base = yScale.to(yScale.isLog ? low : Math.min(high, Math.max(low, 0)));
  for (let index = 0; index < xs.length; index++) {
    if (!Number.isFinite(ys[index])) continue;
    const half = (widths[index] ?? widths) / 2;
    const left = round(xScale.to(xs[index] - half));
    const right = round(xScale.to(xs[index] + half));
    parts.push(`M${left} ${round(base)}V${round(yScale.to(ys[index]))}H${right}V${round(base)}Z`);
  }
  return parts.join("");
}

// A colour is the name of a variable of style.css.
const inkOf = (series) => ({ "--ink": ink(series.color) });

// Paths of lines as they were last drawn: while a scene is edited some charts are drawn again unchanged.
const paths = new WeakMap();
function linePathOf(series, x, y, density) {
  const key = JSON.stringify([x.domain, x.pixels, x.isLog, y.domain, y.pixels, y.isLog, density]);
  const last = paths.get(series.y);
  if (last?.key === key && last.x === series.x) return last.d;
  const d = linePath(series.x, series.y, x, y, density);
  paths.set(series.y, { key, x: series.x, d });
  return d;
}

const drawings = {
  line: (series, x, y, density) =>
    html`<path
      class="line"
      style=${{ ...inkOf(series), strokeWidth: series.lineWidth ?? null }}
      stroke-dasharray=${series.dash ? "5 4" : null}
      d=${linePathOf(series, x, y, density)}
    />`,
  band: (series, x, y) =>
    html`<path
      class="band"
      style=${inkOf(series)}
      d=${bandPath(series.x, series.low, series.high, x, y)}
    />`,
  points: (series, x, y) =>
    html`<path
      class="points"
      style=${{ ...inkOf(series), strokeWidth: series.size ?? null }}
      d=${pointsPath(series.x, series.y, x, y)}
    />`,
  errors: (series, x, y) =>
    html`<path
      class="errors"
      style=${inkOf(series)}
      d=${errorsPath(series.x, series.low, series.high, x, y)}
    />`,
  bars: (series, x, y) =>
    html`<path
      class="bars"
      style=${inkOf(series)}
      d=${barsPath(series.x, series.y, series.width, x, y)}
    />`,
};

export const drawSeries = (series, x, y, density) =>
  drawings[series.kind ?? "line"](series, x, y, density);

// The values that the vertical axis has to hold, of the samples in view.
export function valuesInView(series, domain) {
  const columns = series.low ? [series.low, series.high] : [series.y];
  if (!isSorted(series.x)) return columns;
  const from = Math.max(0, indexAtLeast(series.x, domain[0]) - 1);
  const to = Math.min(series.x.length, indexAtLeast(series.x, domain[1]) + 1);
  if (from === 0 && to === series.x.length) return columns;
  return columns.map((values) => values.slice(from, to));
}

// The index of the sample nearest to x; -1 where there is none.
export function nearestIndex({ x: xs }, x) {
  if (xs.length === 0) return -1;
  if (!isSorted(xs)) {
    let best = 0;
    for (let index = 1; index < xs.length; index++)
      if (Math.abs(xs[index] - x) < Math.abs(xs[best] - x)) best = index;
    return best;
  }
  const after = Math.min(xs.length - 1, indexAtLeast(xs, x));
  return after > 0 && x - xs[after - 1] < xs[after] - x ? after - 1 : after;
}

// "force" is that colour, "force 0" to "force 1" its shades from light to dark.
export function ink(name = "accent") {
  const [base, place] = name.split(" ");
  if (place === undefined) return `var(--${base})`;
  const far = Math.round(90 * Math.abs(place - 0.5));
  return `color-mix(in srgb, var(--${base}), var(--${place < 0.5 ? "front" : "text"}) ${far}%)`;
}
