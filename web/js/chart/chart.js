// One chart: series over one axis, with marks of events, shaded spans, rules, zoom, a cursor with a tooltip, a legend that
// hides and isolates, its picture and its numbers to take along. Everything is SVG: the page's style colours it.
import { createStore } from "../store.js";
import { html, useLayoutEffect, useMemo, useRef, useState } from "../ui/preact.js";
import { Help, withSubscripts } from "../ui/controls.js";
import { useId, useWidth } from "../ui/hooks.js";
import { quantity, uncapital } from "../units.js";
import { axisUnit, namesAlong, textWidth, XAxis, YAxis } from "./axis.js";
import { Cursor, cursorOf } from "./cursor.js";
import { ChartTools, DataTable } from "./export.js";
import { handleKey, handlePointers } from "./input.js";
import { Markers, Rules, Spans, uprightLabels } from "./marks.js";
import { extentOf, linearScale, logScale, paddedDomain } from "./scale.js";
import { drawSeries, ink, valuesInView } from "./series.js";

export const MARGIN = { left: 58, right: 14, top: 8, bottom: 22, marks: 14 };

// The ends of what a series covers: bars reach half their width beyond their places.
function placesOf({ kind, x, width }) {
  if (kind !== "bars" || x.length === 0) return x;
  const half = (width.at?.(0) ?? width) / 2;
  return [x[0] - half, x[x.length - 1] + half];
}

function wholeDomain(x, series) {
  if (x.domain) return x.domain;
  if (x.categories) return [-0.5, x.categories.length - 0.5];
  const hasPoints = series.some((one) => one.kind === "points");
  return paddedDomain(extentOf(series.map(placesOf), x.log), x.log, hasPoints ? 0.04 : 0);
}

// What an address asks for may be no part of an axis.
const usable = (range, isLog) =>
  Array.isArray(range) && range[1] > range[0] && (!isLog || range[0] > 0) ? range : null;

function valueDomain(y, series, rules, domain) {
  if (y.domain) return y.domain;
  if (y.categories) return [y.categories.length - 0.5, -0.5];
  const arrays = series.flatMap((one) => valuesInView(one, domain));
  arrays.push(rules.filter((rule) => rule.y !== undefined).map((rule) => rule.y));
  const isBars = !y.log && series.some((one) => one.kind === "bars");
  if (y.includeZero || isBars) arrays.push([0]);
  const extent = extentOf(arrays, y.log);
  const padded = paddedDomain(extent, y.log);
  return isBars && extent?.[0] === 0 ? [0, padded[1]] : padded; // bars stand on their axis
}

// Chart({title, description, x, y, series, …}):
//   title, description   a heading; a sentence on what is seen, for those who do not see it
//   x, y                 {label, unit, log, domain, categories}: without `domain` what the values need; y.ends are texts at the
//                        right of its categories
//   series               [{kind, label, unit, color, x, y, …}], see series.js; `x` and `y` are arrays that nobody changes
//   spans, rules, markers  [{from, to, label}]; [{x or y, label, color}]; [{x, label, color, onPick}]
//   heading              in place of the names of the axes
//   help                 a name of help.js
//   height               of the plot, in pixels
//   range, onRange       the part of x in view, null for all; without onRange the chart keeps it
//   group                charts of one group share the cursor
//   onPick               called with (series, index) of the point that was clicked
//   isCompact            the numbers of x are left out: another chart stands below
//   isShort              the heading names x too, so that no line below does
//   isFixed              without zoom and cursor: the children listen to the pointer, onKeyDown to keys
//   underlay, children   further SVG below and above the series, from the plot {x, y, left, right, top, bottom}: scales, pixels
export function Chart(props) {
  const box = useRef(null);
  const width = useWidth(box);
  return html`<figure class="chart" aria-label=${props.title} ref=${box}>
    ${width > 0 && html`<${Drawn} ...${props} width=${width} />`}
  </figure>`;
}

function Drawn(props) {
  const { title, description, x, y, width, height = 200, onPick } = props;
  const { isCompact = false, isShort = false, isFixed = false } = props;
  const { spans = [], rules = [], markers = [], underlay, children } = props;
  const id = useId("chart");
  const box = useRef(null);
  const svg = useRef(null);
  const [hidden, setHidden] = useState(new Set());
  const [hasNumbers, setHasNumbers] = useState(false);
  const [ownRange, setOwnRange] = useState(null);

  const series = props.series.filter((one) => !hidden.has(one.label));
  const whole = wholeDomain(x, props.series);
  const range = usable((props.onRange ? props.range : ownRange) ?? null, x.log);
  const domain = range ?? whole;
  const room = (texts, part) => Math.min(part * width, 10 + Math.max(...texts.map(textWidth)));
  const left = y.categories ? Math.max(MARGIN.left, room(y.categories, 0.4)) : MARGIN.left;
  const ends = y.ends ? room(y.ends, 0.25) : MARGIN.right;
  const right = Math.max(left + 20, width - ends);
  const makeX = x.log ? logScale : linearScale;
  const makeY = y.log ? logScale : linearScale;
  const xScale = makeX(domain, [left, right]);
  const labels = uprightLabels(rules, xScale);
  const top = MARGIN.top + labels.height + (markers.length > 0 ? MARGIN.marks : 0);
  const bottom = top + height;
  const names = x.categories ? namesAlong(x, right - left).lines : [];
  const below = names.some((lines) => lines.length > 1) ? 12 : 0;
  const outerHeight = bottom + (isCompact ? 6 : MARGIN.bottom + below);
  const yScale = makeY(valueDomain(y, series, rules, domain), [bottom, top]);
  const density = Math.max(1, globalThis.devicePixelRatio ?? 1);
  const ownCursor = useMemo(() => createStore(null), []);
  const cursor = props.group ? cursorOf(props.group) : ownCursor;

  const setRange = (next) => {
    const isWhole = next === null || (next[0] <= whole[0] && next[1] >= whole[1]);
    const chosen = isWhole ? null : [Math.max(next[0], whole[0]), Math.min(next[1], whole[1])];
    if (props.onRange) props.onRange(chosen);
    else setOwnRange(chosen);
  };
  const axes = { x, y };
  const state = {
    id,
    series,
    markers,
    axes,
    xScale,
    yScale,
    whole,
    domain,
    cursor,
    setRange,
    onPick,
  };
  const latest = useRef(state);
  latest.current = state;
  useLayoutEffect(
    () => (isFixed ? undefined : handlePointers(box.current, svg.current, latest)),
    [],
  );

  const xTitle = axisUnit(x, domain).title;
  const yTitle = axisUnit({ ...y, label: y.label ?? title }, yScale.domain).title;
  const both = isShort ? `${yTitle} over ${uncapital(xTitle)}` : yTitle;
  const heading = props.heading ?? (y.categories ? title : both);
  const plot = { x: xScale, y: yScale, left, right, top, bottom };
  const summary = description ?? describe(props.series, x, y, domain);
  return html`<div class="chart-head">
      <h3>${withSubscripts(heading)}</h3>
      ${props.help && html`<${Help} name=${props.help} />`}
      ${
        props.series.length > 1 &&
        html`<${Legend} series=${props.series} hidden=${hidden} setHidden=${setHidden} />`
      }
      <${ChartTools}
        title=${title}
        heading=${`${yTitle} over ${xTitle}`}
        series=${series}
        svg=${svg}
        isZoomed=${range !== null}
        onWhole=${() => setRange(null)}
        hasNumbers=${hasNumbers}
        onNumbers=${() => setHasNumbers(!hasNumbers)}
      />
    </div>
    <div
      class="plot"
      ref=${box}
      tabindex=${isFixed && !props.onKeyDown ? null : 0}
      role=${isFixed && !props.onKeyDown ? "img" : "application"}
      aria-label=${title}
      aria-describedby=${`${id}-summary`}
      aria-keyshortcuts=${isFixed ? null : "ArrowLeft ArrowRight PageUp PageDown Plus - 0 Enter"}
      onKeyDown=${isFixed ? props.onKeyDown : (event) => handleKey(event, latest.current)}
    >
      <svg ref=${svg} width=${width} height=${outerHeight} aria-hidden="true">
        <defs>
          <clipPath id=${`${id}-clip`}>
            <rect x=${left} y=${top - 1} width=${right - left} height=${height + 2} />
          </clipPath>
        </defs>
        <${Spans} spans=${spans} plot=${plot} />
        ${underlay?.(plot)}
        <${YAxis} axis=${y} scale=${yScale} left=${left} right=${right} edge=${width - 2} />
        <${XAxis} axis=${x} scale=${xScale} top=${top} bottom=${bottom} isCompact=${isCompact} />
        <g clip-path=${`url(#${id}-clip)`}>
          ${series.map((one) => drawSeries(one, xScale, yScale, density))}
        </g>
        <${Rules} rules=${rules} plot=${plot} labels=${labels} series=${series} />
        ${children?.(plot)}
        <${Markers} markers=${markers} plot=${plot} />
      </svg>
      ${
        !isFixed &&
        html`<${Cursor}
          id=${id}
          cursor=${cursor}
          series=${series}
          markers=${markers}
          plot=${plot}
          x=${x}
          y=${y}
        />`
      }
    </div>
    ${!isCompact && !isShort && html`<p class="x-title" aria-hidden="true">${withSubscripts(xTitle)}</p>`}
    <p class="visually-hidden" id=${`${id}-summary`}>${summary}</p>
    ${hasNumbers && html`<${DataTable} title=${title} series=${props.series} x=${x} y=${y} />`}`;
}

// A sentence with the ranges of what is shown.
function describe(series, x, y, domain) {
  const span = `${x.label} from ${quantity(domain[0], x.unit)} to ${quantity(domain[1], x.unit)}`;
  const parts = series.map((one) => {
    const extent = extentOf(valuesInView(one, domain));
    const unit = one.unit ?? y.unit;
    return extent
      ? `${one.label} between ${quantity(extent[0], unit)} and ${quantity(extent[1], unit)}`
      : `${one.label} has no values`;
  });
  return `${[span, ...parts].join("; ")}.`;
}

// The names of the series: a click hides or shows one, a double click or Shift with a click shows it alone.
function Legend({ series, hidden, setHidden }) {
  const labels = [...new Set(series.map((one) => one.label))];
  const isolate = (label) => {
    const others = labels.filter((one) => one !== label);
    const isAlone = others.every((one) => hidden.has(one)) && !hidden.has(label);
    setHidden(new Set(isAlone ? [] : others));
  };
  const toggle = (label, event) => {
    if (event.shiftKey) return isolate(label);
    const next = new Set(hidden);
    if (!next.delete(label)) next.add(label);
    setHidden(next.size === labels.length ? new Set() : next);
  };
  return html`<div class="legend">
    ${labels.map((label) => {
      const one = series.find((other) => other.label === label);
      return html`<button
        type="button"
        class="legend-item"
        aria-pressed=${!hidden.has(label)}
        title="Click: hide or show. Double click: show it alone."
        style=${{ "--ink": ink(one.color) }}
        onClick=${(event) => toggle(label, event)}
        onDblClick=${() => isolate(label)}
      >
        <span class=${`swatch ${one.kind ?? "line"} ${one.dash ? "dash" : ""}`}></span>${label}
      </button>`;
    })}
  </div>`;
}
