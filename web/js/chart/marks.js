// What stands on a chart beside its series: shaded spans, rules, marks of events.
import { html } from "../ui/preact.js";
import { textWidth } from "./axis.js";
import { nearestIndex } from "./series.js";

export function Spans({ spans, plot }) {
  const { x, left, right, top, bottom } = plot;
  return spans.map(({ from, to, label }) => {
    const start = Math.max(left, x.to(from));
    const end = Math.min(right, x.to(to));
    if (!(end > start)) return null;
    return html`<g class="span">
      <rect x=${start} y=${top} width=${end - start} height=${bottom - top} />
      ${label && end - start > 80 && html`<text x=${start + 6} y=${top + 14}>${label}</text>`}
    </g>`;
  });
}

// Rules at the stops of a damper, as its free mass meets them.
export const wallsOf = ({ offset = 0, clearance }) =>
  [-1, 1].map((side) => ({
    y: offset + (side * clearance) / 2,
    label: side < 0 ? "left stop" : "right stop",
    color: "wall",
  }));

const LINE = 14; // px
const PLACES = 40; // along a level rule that are tried

// Where the labels of upright rules stand above the plot, none over another: {height, places: Map of rules to {line, start}}.
export function uprightLabels(rules, x) {
  const upright = rules.filter((rule) => rule.x !== undefined && rule.label);
  const [left, right] = x.pixels;
  const ends = []; // of each line
  const places = new Map();
  for (const rule of upright.toSorted((a, b) => a.x - b.x)) {
    const at = x.to(rule.x);
    if (!(at >= left && at <= right)) continue;
    const size = textWidth(rule.label);
    const start = Math.max(left, Math.min(at, right - size));
    const free = ends.findIndex((end) => end < start);
    const line = free < 0 ? ends.length : free;
    ends[line] = start + size + 8;
    places.set(rule, { line, start });
  }
  return { height: LINE * Math.max(ends.length, Math.min(1, upright.length)), places };
}

// Whether a series is where a label of this width at (x, y) would stand.
function isBehind(one, plot, x, y, width) {
  const places = [0, 0.2, 0.4, 0.6, 0.8, 1].flatMap((part) => {
    const across = plot.x.from(x + part * width);
    const at = nearestIndex(one, across);
    const values = one.low ? [one.low[at], one.high[at]] : [one.y[at]];
    const pixels = values.filter(Number.isFinite).map(plot.y.to);
    if (one.kind !== "bars") return pixels;
    return Math.abs(across - one.x[at]) < (one.width[at] ?? one.width) / 2
      ? [...pixels, plot.bottom]
      : [];
  });
  return Math.min(...places) < y + 6 && Math.max(...places) > y - 14;
}

// A level rule has its label where no series is, as far at the right as can be, above or below.
function levelPlace(at, label, plot, series) {
  const { left, right, top, bottom } = plot;
  const width = textWidth(label);
  const step = (right - left - width - 8) / PLACES;
  const places = Array.from({ length: PLACES + 1 }, (_, index) => right - 4 - width - index * step)
    .flatMap((x) => [at - 5, at + 14].map((y) => ({ x, y })))
    .filter(({ y }) => y - 12 > top && y < bottom);
  const isFree = ({ x, y }) => !series.some((one) => isBehind(one, plot, x, y, width));
  return places.find(isFree) ?? places[0];
}

function Rule({ rule, plot, label, series }) {
  const { x, y, left, right, top, bottom } = plot;
  const style = { "--ink": `var(--${rule.color ?? "quiet"})` };
  if (rule.x !== undefined) {
    const at = x.to(rule.x);
    if (!(at >= left && at <= right)) return null;
    const foot = 10 + LINE * (label?.line ?? 0);
    return html`<g class="rule" style=${style}>
      <line x1=${at} x2=${at} y1=${label ? foot + 3 : top} y2=${bottom} />
      ${label && html`<text x=${label.start} y=${foot}>${rule.label}</text>`}
    </g>`;
  }
  const at = y.to(rule.y);
  if (!(at >= top && at <= bottom)) return null;
  const place = rule.label && levelPlace(at, rule.label, plot, series);
  return html`<g class="rule" style=${style}>
    <line x1=${left} x2=${right} y1=${at} y2=${at} />
    ${place && html`<text x=${place.x} y=${place.y}>${rule.label}</text>`}
  </g>`;
}

export const Rules = ({ rules, plot, labels, series }) =>
  rules.map(
    (rule) =>
      html`<${Rule} rule=${rule} plot=${plot} label=${labels.places.get(rule)} series=${series} />`,
  );

// Ticks above the plot; a chosen one is longer.
export function Markers({ markers, plot }) {
  const { x, left, right, top } = plot;
  return html`<g class="markers">
    ${markers.map((marker) => {
      const at = x.to(marker.x);
      if (!(at >= left - 1 && at <= right + 1)) return null;
      const style = { "--ink": `var(--${marker.color ?? "force"})` };
      return html`<path
        class=${marker.isChosen ? "marker chosen" : "marker"}
        style=${style}
        d=${`M${at.toFixed(1)} ${top - (marker.isChosen ? 14 : 10)}V${top - 1}`}
      />`;
    })}
  </g>`;
}
