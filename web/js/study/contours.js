// A metric over two axes of numbers: filled contours with a scale of colours, the best point, the chosen one.
import { html, useMemo, useState } from "../ui/preact.js";
import { axisUnit } from "../chart/axis.js";
import { Chart } from "../chart/chart.js";
import { quantity } from "../units.js";
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
  const part = (at) => (levels.length > 1 ? at / (levels.length - 1) : 0.5);
  const [hovered, setHovered] = useState(null); // a row

  // Areas and what is under the pointer, in the plot's pixels.
  const draw = (plot) => {
    const xs = x.values.map(plot.x.to);
    const ys = over.values.map(plot.y.to);
    const rowUnder = (event) => {
      const { left, top } = event.currentTarget.ownerSVGElement.getBoundingClientRect();
      return rows[nearest(ys, event.clientY - top)][nearest(xs, event.clientX - left)];
    };
    const spot = (row, color) => {
      const j = rows.findIndex((line) => line.includes(row));
      if (row === undefined || row < 0 || j < 0) return null;
      const i = rows[j].indexOf(row);
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
        return html`<path class="area" d=${area} style=${{ fill: shade(part(at)) }} />
          ${at > 0 && html`<path class="line" d=${line} />`}`;
      })}
      ${spot(best, "ok")}${spot(chosen, "accent")}
    </g>`;
  };
  const upwards = axisUnit({ label: over.label.toLowerCase(), unit: over.unit }, [
    over.values[0],
    over.values.at(-1),
  ]).title;
  const isRow = hovered !== null && metric.values[hovered] !== undefined;
  const text = isRow
    ? `${placeText(model, hovered)}: ${quantity(metric.values[hovered], metric.unit)}`
    : `From ${quantity(low, metric.unit)} to ${quantity(high, metric.unit)}.`;
  return html`<div class="contour-chart">
    <${Chart}
      title=${metric.label}
      heading=${`${metric.label}: ${upwards} upwards`}
      description=${`${metric.label} over ${x.label.toLowerCase()} and ${over.label.toLowerCase()}: ${text}`}
      height=${height}
      isShort=${isSmall}
      isFixed
      x=${{ label: x.label, unit: x.unit ?? "1", domain: [x.values[0], x.values.at(-1)] }}
      y=${{ label: over.label, unit: over.unit ?? "1", domain: [over.values[0], over.values.at(-1)] }}
      series=${[]}
    >
      ${draw}
    <//>
    <div class="color-scale" aria-hidden="true">
      ${levels.map(
        (level, at) =>
          html`<span
            ><i style=${{ background: shade(part(at)) }}></i
            >${quantity(level, metric.unit, 3)}</span
          >`,
      )}
    </div>
    ${!isSmall && html`<p class="hint">${text}</p>`}
  </div>`;
}
