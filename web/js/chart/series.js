// What a chart draws, by kind: {kind: "line", "band", "points", "errors" or "bars", label, color, x, y, low, high, width, dash}.
import { html } from "../ui/preact.js";
import {
  bandPath,
  barsPath,
  errorsPath,
  indexAtLeast,
  isSorted,
  linePath,
  pointsPath,
} from "./path.js";

// A colour is the name of a variable of style.css.
const ink = (series) => ({ "--ink": `var(--${series.color ?? "accent"})` });

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
      style=${{ ...ink(series), strokeWidth: series.lineWidth ?? null }}
      stroke-dasharray=${series.dash ? "5 4" : null}
      d=${linePathOf(series, x, y, density)}
    />`,
  band: (series, x, y) =>
    html`<path
      class="band"
      style=${ink(series)}
      d=${bandPath(series.x, series.low, series.high, x, y)}
    />`,
  points: (series, x, y) =>
    html`<path
      class="points"
      style=${{ ...ink(series), strokeWidth: series.size ?? null }}
      d=${pointsPath(series.x, series.y, x, y)}
    />`,
  errors: (series, x, y) =>
    html`<path
      class="errors"
      style=${ink(series)}
      d=${errorsPath(series.x, series.low, series.high, x, y)}
    />`,
  bars: (series, x, y) =>
    html`<path
      class="bars"
      style=${ink(series)}
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
