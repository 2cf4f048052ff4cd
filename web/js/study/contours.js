// A metric over two axes of numbers: filled contours with a scale of colours, the best point, the chosen one, a cursor that
// arrow keys move. Each level's area is where the values are at least so large; where a corner is not known there is a gap.
import { announce } from "../ui/announce.js";
import { html, useMemo, useState } from "../ui/preact.js";
import { axisUnit } from "../chart/axis.js";
import { Chart } from "../chart/chart.js";
import { number, quantity } from "../units.js";
import { placeText, rowAt } from "./sweep_model.js";
import { extentOf, roundStep } from "../chart/scale.js";

// From dark to light in even steps of lightness, for any sight.
const STOPS = [
  [37, 45, 110],
  [38, 99, 148],
  [42, 147, 140],
  [110, 190, 100],
  [243, 225, 95],
];

export function shade(part) {
  const place = Math.min(1, Math.max(0, part)) * (STOPS.length - 1);
  const low = Math.min(STOPS.length - 2, Math.floor(place));
  const mix = STOPS[low].map((from, at) =>
    Math.round(from + (place - low) * (STOPS[low + 1][at] - from)),
  );
  return `rgb(${mix.join(", ")})`;
}

// The part of a triangle [{x, y, value}] where the value is at least `level`, as corners in their order.
function clipped(triangle, level) {
  const corners = [];
  triangle.forEach((from, at) => {
    const to = triangle[(at + 1) % 3];
    if (from.value >= level) corners.push(from);
    if (from.value >= level === to.value >= level) return;
    const part = (level - from.value) / (to.value - from.value);
    corners.push({ x: from.x + part * (to.x - from.x), y: from.y + part * (to.y - from.y) });
  });
  return corners;
}

const pathOf = (corners) =>
  `M${corners.map(({ x, y }) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L")}Z`;

// Calls visit(triangle) for both halves of each cell whose corners are known.
function eachTriangle(xs, ys, valueAt, visit) {
  for (let j = 0; j + 1 < ys.length; j++)
    for (let i = 0; i + 1 < xs.length; i++) {
      const corner = (di, dj) => ({ x: xs[i + di], y: ys[j + dj], value: valueAt(i + di, j + dj) });
      const [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
      for (const triangle of [
        [a, b, c],
        [a, c, d],
      ])
        if (triangle.every(({ value }) => Number.isFinite(value))) visit(triangle);
    }
}

// SVG path data of the area at or above `level` and of the line at it: xs and ys are pixels, valueAt(i, j) the value at
// xs[i], ys[j].
function contourPaths(xs, ys, valueAt, level) {
  const areas = [];
  const lines = [];
  eachTriangle(xs, ys, valueAt, (triangle) => {
    const corners = clipped(triangle, level);
    if (corners.length > 2) areas.push(pathOf(corners));
    const [from, to] = corners.filter(({ value }) => value === undefined);
    if (to) lines.push(pathOf([from, to]).slice(0, -1));
  });
  return { area: areas.join(""), line: lines.join("") };
}

// Round levels between low and high, about `count` of them; equal ratios where `isLog`.
export function levelsOf(low, high, count = 9, isLog = false) {
  if (!(high > low)) return [low];
  if (isLog) {
    const ratio = (high / low) ** (1 / count);
    return Array.from({ length: count }, (_, at) => low * ratio ** at);
  }
  const step = roundStep((high - low) / count);
  const first = Math.ceil(low / step) * step;
  const levels = [low];
  for (let level = first; level < high; level += step) if (level > low) levels.push(level);
  return levels;
}

// The rows of the grid that is shown: rows[j][i] at the i-th value across and the j-th upwards.
function gridOf(model, { x, over }, fixedAt) {
  const start = fixedAt ?? model.axes.map(() => 0);
  return over.values.map((_up, j) =>
    x.values.map((_across, i) => {
      const positions = [...start];
      positions[x.index] = i;
      positions[over.index] = j;
      return rowAt(model, positions);
    }),
  );
}

const nearest = (pixels, at) =>
  pixels.reduce(
    (best, pixel, index) => (Math.abs(pixel - at) < Math.abs(pixels[best] - at) ? index : best),
    0,
  );

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

// The colours of levels; their numbers are in the unit that `factor` makes.
const ColorScale = ({ levels, factor }) =>
  html`<div class="color-scale" aria-hidden="true">
    ${levels.map(
      (level, at) =>
        html`<span style=${{ borderColor: shade(partOf(levels, at)) }}
          >${number(level / factor, 3)}</span
        >`,
    )}
  </div>`;

const partOf = (levels, at) => (levels.length > 1 ? at / (levels.length - 1) : 0.5);

// The name of the upward axis along it.
export function UpwardTitle({ axis, plot: { y, top, bottom } }) {
  const at = `12 ${(top + bottom) / 2}`;
  return html`<text transform=${`translate(${at}) rotate(-90)`} text-anchor="middle">
    ${axisUnit(axis, y.domain).title}
  </text>`;
}

export function Contours({ model, picture, metric, best, chosen, pick, height, isSmall, fixedAt }) {
  const { x, over } = picture;
  const key = picture.fixed.map(({ index }) => fixedAt?.[index]).join();
  const rows = useMemo(() => gridOf(model, picture, fixedAt), [model, key]);
  const valueAt = (i, j) => metric.values[rows[j][i]];
  const [low, high] = extentOf([rows.flat().map((row) => metric.values[row])]) ?? [0, 0];
  const isLog = low > 0 && high > 50 * low;
  const levels = useMemo(() => levelsOf(low, high, 9, isLog), [low, high]);
  const [hovered, setHovered] = useState(null); // a row
  const placeOf = (row) => {
    const j = rows.findIndex((line) => line.includes(row));
    return row !== undefined && j >= 0 ? [rows[j].indexOf(row), j] : null;
  };
  const textOf = (row) => `${placeText(model, row)}: ${quantity(metric.values[row], metric.unit)}`;
  const onKeyDown = (event) => {
    const step = ARROWS[event.key];
    if (event.key === "Enter" && hovered !== null) pick(hovered);
    if (!step) return;
    event.preventDefault();
    const from = [hovered, chosen, best].map((row) => placeOf(row ?? undefined)).find(Boolean);
    const [i, j] = from ?? [0, 0];
    const row = rows[j + step[1]]?.[i + step[0]];
    if (row === undefined) return;
    setHovered(row);
    announce(textOf(row));
  };

  const up = {
    label: over.label,
    unit: over.unit ?? "1",
    domain: [over.values[0], over.values.at(-1)],
  };
  // Areas and what is under the pointer, in the plot's pixels.
  const draw = (plot) => {
    const xs = x.values.map(plot.x.to);
    const ys = over.values.map(plot.y.to);
    const rowUnder = (event) => {
      const { left, top } = event.currentTarget.ownerSVGElement.getBoundingClientRect();
      return rows[nearest(ys, event.clientY - top)][nearest(xs, event.clientX - left)];
    };
    const spot = (row, color) => {
      const place = placeOf(row);
      if (!place) return null;
      const [i, j] = place;
      return html`<circle
        class="spot"
        cx=${xs[i]}
        cy=${ys[j]}
        r="5"
        style=${{ "--ink": `var(--${color})` }}
      />`;
    };
    return html`<g
        class="contours"
        onPointerMove=${(event) => setHovered(rowUnder(event) ?? null)}
        onPointerLeave=${() => setHovered(null)}
        onClick=${(event) => {
          const row = rowUnder(event);
          if (row !== undefined) pick(row);
        }}
      >
        ${levels.map((level, at) => {
          const { area, line } = contourPaths(xs, ys, valueAt, level);
          return html`<path class="area" d=${area} style=${{ fill: shade(partOf(levels, at)) }} />
            ${at > 0 && html`<path class="line" d=${line} />`}`;
        })}
        ${spot(best, "ok")}${spot(chosen, "accent")}${spot(hovered ?? undefined, "text")}
      </g>
      <${UpwardTitle} axis=${up} plot=${plot} />`;
  };
  const values = { label: metric.label, unit: metric.unit, log: isLog };
  const { factor, title } = axisUnit(values, [low, high]);
  const text =
    hovered !== null && metric.values[hovered] !== undefined
      ? textOf(hovered)
      : `From ${quantity(low, metric.unit)} to ${quantity(high, metric.unit)}.`;
  return html`<div class="contour-chart">
    <${Chart}
      title=${metric.label}
      heading=${title}
      description=${`${metric.label} over ${x.label.toLowerCase()} and ${over.label.toLowerCase()}: ${text}`}
      height=${height}
      isFixed
      onKeyDown=${isSmall ? null : onKeyDown}
      x=${{ label: x.label, unit: x.unit ?? "1", domain: [x.values[0], x.values.at(-1)] }}
      y=${up}
      series=${[]}
    >
      ${draw}
    <//>
    <${ColorScale} levels=${levels} factor=${factor} />
    ${!isSmall && html`<p class="hint">${text}</p>`}
  </div>`;
}
