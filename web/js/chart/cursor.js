// The cursor of a chart and its tooltip. Charts of a group share one cursor; the tooltip is at the chart under the pointer.
import { html, useEffect, useLayoutEffect, useRef, useState } from "../ui/preact.js";
import { useStore } from "../ui/hooks.js";
import { createStore } from "../store.js";
import { quantity } from "../units.js";
import { ink, nearestIndex } from "./series.js";

const groups = new Map();

// The cursor of a group: a store of {x, y, owner} or null; `y` in pixels of the owner.
export function cursorOf(group) {
  if (!groups.has(group)) groups.set(group, createStore(null));
  return groups.get(group);
}

// The marker under the cursor, within some pixels.
export const markerAt = (markers, scale, x) =>
  markers
    .filter((marker) => Math.abs(scale.to(marker.x) - scale.to(x)) < 6)
    .sort((a, b) => Math.abs(a.x - x) - Math.abs(b.x - x))[0];

const isValue = (value) => typeof value === "number" && Number.isFinite(value);

// What the series show at x: [{series, index, value: text, y}].
export function valuesAt(series, x, y) {
  return series.flatMap((one) => {
    const index = nearestIndex(one, x);
    if (index < 0) return [];
    const unit = one.unit ?? y.unit;
    if (one.low) {
      const text = `${quantity(one.low[index], unit)} to ${quantity(one.high[index], unit)}`;
      return isValue(one.high[index])
        ? [{ series: one, index, text, x: one.x[index], y: null }]
        : [];
    }
    const value = one.y[index];
    const read = y.categories ? y.categories[value] : quantity(value, unit);
    const text = one.notes?.[index] ? `${read}, ${one.notes[index]}` : read;
    return isValue(value) ? [{ series: one, index, text, x: one.x[index], y: value }] : [];
  });
}

export const placeText = (axis, x) =>
  axis.categories ? axis.categories[Math.round(x)] : quantity(x, axis.unit, 6);

export function Cursor({ id, cursor, series, markers, plot, x, y }) {
  const at = useStore(cursor);
  const tip = useRef(null);
  const [tipWidth, setTipWidth] = useState(0);
  useEffect(() => () => cursor.set(null), [cursor]); // a chart of the next page may be of this group
  useLayoutEffect(() => {
    const width = tip.current?.offsetWidth ?? 0;
    if (width !== tipWidth && width > 0) setTipWidth(width);
  });
  if (!at || !(at.x >= plot.x.domain[0] && at.x <= plot.x.domain[1])) return null;
  const pixel = plot.x.to(at.x);
  const values = valuesAt(series, at.x, y);
  const dots = values.filter((one) => one.y !== null);
  const marker = markerAt(markers, plot.x, at.x);
  const isOwner = at.owner === id;
  const isFlipped = pixel + 14 + tipWidth > plot.right;
  const place = {
    left: `${isFlipped ? Math.max(0, pixel - 14 - tipWidth) : pixel + 14}px`,
    top: `${plot.top + 4}px`,
  };
  return html`
    <svg class="cursor" width=${plot.right + 14} height=${plot.bottom + 6} aria-hidden="true">
      <line x1=${pixel} x2=${pixel} y1=${plot.top} y2=${plot.bottom} />
      ${dots.map(
        (one) =>
          html`<circle
            cx=${plot.x.to(one.x)}
            cy=${plot.y.to(one.y)}
            r="3.5"
            style=${{ "--ink": ink(one.series.color) }}
          />`,
      )}
    </svg>
    ${
      isOwner &&
      html`<div class="tooltip" ref=${tip} style=${place} aria-hidden="true">
        <b>${x.categories ? "" : `${x.label} `}${placeText(x, values[0]?.x ?? at.x)}</b>
        ${values
          .slice(0, 12)
          .map(
            (one) =>
              html`<div style=${{ "--ink": ink(one.series.color) }}>
                <span class="swatch line"></span>${one.series.label} <output>${one.text}</output>
              </div>`,
          )}
        ${marker && html`<div class="quiet">${marker.label}</div>`}
      </div>`
    }
  `;
}
