// The frame of a chart: grid, ticks and their numbers, in the unit that suits the axis.
import { html } from "../ui/preact.js";
import { chosenScale, number, pretty, scale as unitScale } from "../units.js";
import { ticksOf } from "./scale.js";

// {factor, unit, title} of an axis {label, unit}: numbers are divided by `factor` and shown in `unit`.
export function axisUnit(axis, domain) {
  const size = Math.max(Math.abs(domain[0]), Math.abs(domain[1]));
  const isChosen = chosenScale(axis.unit) !== null;
  let factor = 1;
  let unit = axis.unit === "1" ? "" : (axis.unit ?? "");
  if (size > 0) {
    // On a logarithmic axis the prefix suits the middle.
    const middle = axis.log && domain[0] > 0 ? Math.sqrt(domain[0] * domain[1]) : size;
    [factor, unit] = unitScale(middle, unit);
    if (!isChosen && !axis.log && factor === 1 && (size < 0.01 || size >= 1e5)) {
      const power = 3 * Math.floor(Math.log10(size) / 3);
      factor = 10 ** power;
      unit = `10^${power} ${unit}`.trim();
    }
  }
  return { factor, unit, title: unit ? `${axis.label} [${pretty(unit)}]` : axis.label };
}

const tickText = (value, factor, isLog) =>
  isLog
    ? number(value / factor, 2).replace(/^1 × /, "")
    : number(Number((value / factor).toPrecision(9)), 9);

const GLYPH = 5.8; // px, a letter of an axis' texts
export const textWidth = (text) => GLYPH * text.length;

// A name in one line, or in two where it is wider than `room`.
function linesOf(text, room) {
  if (textWidth(text) <= room) return [text];
  const middle = text.length / 2;
  const spaces = [...text.matchAll(/ /g)].map(({ index }) => index);
  const [at] = spaces.sort((a, b) => Math.abs(a - middle) - Math.abs(b - middle));
  return at ? [text.slice(0, at), text.slice(at + 1)] : [text];
}

// The names of categories along an axis: {lines: of each, room: what the widest one needs}.
export function namesAlong({ categories }, width) {
  const lines = categories.map((text) => linesOf(text, width / categories.length - 2));
  return { lines, room: Math.max(...lines.flat().map(textWidth)) + 2 };
}

const Lines = ({ x, y, lines, anchor }) =>
  html`<text y=${y} text-anchor=${anchor}>
    ${lines.map((line, at) => html`<tspan x=${x} dy=${at > 0 ? 12 : 0}>${line}</tspan>`)}
  </text>`;

const Name = ({ x, y, text, room }) => {
  const lines = linesOf(text, room);
  return html`<${Lines} x=${x} y=${y + 10 - 6 * lines.length} lines=${lines} anchor="end" />`;
};

// Round numbers in the axis' unit; a category axis has `categories`: texts at 0, 1, 2, …
function ticksFor(axis, scale, factor, most) {
  if (!axis.categories) {
    const domain = scale.domain.map((end) => end / factor);
    return ticksOf({ ...scale, domain }, most).map((value) => value * factor);
  }
  const every = Math.max(1, Math.ceil(axis.categories.length / most));
  return axis.categories.map((_, index) => index).filter((index) => index % every === 0);
}

export function XAxis({ axis, scale, top, bottom, isCompact }) {
  const [left, right] = scale.pixels;
  const { factor } = axisUnit(axis, scale.domain);
  const names = axis.categories && namesAlong(axis, right - left);
  const ticks = ticksFor(axis, scale, factor, Math.max(2, (right - left) / (names?.room ?? 80)));
  return html`<g class="axis">
    ${ticks.map((value) => {
      const x = Math.round(scale.to(value)) + 0.5;
      const lines = names?.lines[value] ?? [tickText(value, factor, axis.log)];
      const middle = Math.min(x, right + 10 - Math.max(...lines.map(textWidth)) / 2); // none is cut off
      return html`<g>
        <line x1=${x} x2=${x} y1=${top} y2=${bottom} class="grid" />
        ${!isCompact && html`<${Lines} x=${middle} y=${bottom + 15} lines=${lines} anchor="middle" />`}
      </g>`;
    })}
    <line x1=${left} x2=${right} y1=${bottom + 0.5} y2=${bottom + 0.5} class="frame" />
  </g>`;
}

export function YAxis({ axis, scale, left, right, edge }) {
  const [bottom, top] = scale.pixels;
  const { factor } = axisUnit(axis, scale.domain);
  const ticks = ticksFor(
    axis,
    scale,
    factor,
    Math.max(2, (bottom - top) / (axis.categories ? 18 : 34)),
  );
  return html`<g class="axis">
    ${ticks.map((value) => {
      const y = Math.round(scale.to(value)) + 0.5;
      const text = axis.categories ? axis.categories[value] : tickText(value, factor, axis.log);
      const isZero = value === 0 && !axis.categories;
      return html`<g>
        <line x1=${left} x2=${right} y1=${y} y2=${y} class=${isZero ? "grid zero" : "grid"} />
        <${Name} x=${left - 6} y=${y} text=${text} room=${left - 6} />
      </g>`;
    })}
    ${axis.ends?.map((text, at) => html`<${Name} x=${edge} y=${scale.to(at)} text=${text} room=${edge - right - 6} />`)}
  </g>`;
}
