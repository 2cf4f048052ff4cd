// A metric over two axes of numbers: filled contours with a scale of colours, the best point, the chosen one, a cursor that
// arrow keys move.
import { announce } from "../ui/announce.js";
import { html, useMemo, useState } from "../ui/preact.js";
import { axisUnit } from "../chart/axis.js";
import { Chart } from "../chart/chart.js";
import { number, quantity } from "../units.js";
import { contourPaths, levelsOf, shade } from "./contour.js";
import { extentOfValues } from "./parts.js";
import { placeText, rowAt } from "./sweep_model.js";

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
export const ColorScale = ({ levels, factor }) =>
  html`<div class="color-scale" aria-hidden="true">
    ${levels.map(
      (level, at) =>
        html`<span style=${{ borderColor: shade(partOf(levels, at)) }}
          >${number(level / factor, 3)}</span
        >`,
    )}
  </div>`;

export const partOf = (levels, at) => (levels.length > 1 ? at / (levels.length - 1) : 0.5);

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
  const valueAt = (i, j) => {
    const value = metric.values[rows[j][i]];
    return Number.isFinite(value) ? value : NaN;
  };
  const [low, high] = extentOfValues(rows.flat().map((row) => metric.values[row])) ?? [0, 0];
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
