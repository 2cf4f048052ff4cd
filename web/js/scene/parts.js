// The parts of a drawing: hatched bodies, springs, dashpots, columns, dimension lines, arrows.
import { html } from "../ui/preact.js";
import { limit } from "./model.js";

export const px = (value) => Math.round(limit(value, -1e5, 1e5) * 100) / 100;

// Diagonal strokes that fill a rectangle.
function hatchPath(x, y, width, height, step = 7) {
  const strokes = [];
  for (let at = -height; at < width; at += step) {
    const [from, to] = [Math.max(at, 0), Math.min(at + height, width)];
    if (to > from)
      strokes.push(
        `M${px(x + from)} ${px(y + height - (from - at))}L${px(x + to)} ${px(y + height - (to - at))}`,
      );
  }
  return strokes.join("");
}

// A body that stands still: its face is the side that others meet.
export function Hatched({ x, y, width, height, face }) {
  const faces = {
    top: `M${px(x)} ${px(y)}h${px(width)}`,
    right: `M${px(x + width)} ${px(y)}v${px(height)}`,
  };
  return html`<g class="solid">
    <path class="hatch" d=${hatchPath(x, y, width, height)} />
    <path class="face" d=${faces[face]} />
  </g>`;
}

// A zigzag between two places.
export function Spring({ from, to, y }) {
  const lead = 9;
  const turns = 6;
  const step = (to - from - 2 * lead) / (2 * turns);
  const points = Array.from({ length: 2 * turns }, (_, at) => {
    const x = from + lead + (at + 0.5) * step;
    return `L${px(x)} ${px(y + (at % 2 === 0 ? -7 : 7))}`;
  });
  return html`<path
    class="spring"
    d=${`M${px(from)} ${y}h${lead}${points.join("")}L${px(to - lead)} ${y}H${px(to)}`}
  />`;
}

// A piston on a rod from the right in a cylinder on a rod from the left; `rest` is its length unloaded, `far` the largest way
// from there. Where that is longer than the cylinder, the piston moves in proportion.
export function Dashpot({ from, to, rest, far, y }) {
  const [lead, half] = [14, 7];
  const start = from + lead;
  const end = from + lead + Math.max(16, Math.min(rest * 0.6, rest - far - lead - 3));
  const travel = (end - start) / 2 - 4;
  const way = to - from - rest;
  const piston = (start + end) / 2 + limit(way * Math.min(1, travel / (far || 1)), -travel, travel);
  return html`<g class="dashpot">
    <path
      d=${`M${px(from)} ${y}h${lead}M${px(end)} ${y - half}H${px(start)}v${2 * half}H${px(end)}`}
    />
    <path class="piston" d=${`M${px(piston)} ${y - half + 2}v${2 * half - 4}`} />
    <path d=${`M${px(piston)} ${y}H${px(to)}`} />
  </g>`;
}

// A column that is held upright at both ends bends as x(s) = a + (b - a)(3s² - 2s³): a cubic with these four points.
export const columnPath = (a, low, b, foot) => {
  const third = (foot - low) / 3;
  return `M${px(a)} ${px(low)}C${px(a)} ${px(low + third)} ${px(b)} ${px(foot - third)} ${px(b)} ${px(foot)}`;
};

// The point of an arrow at (x, y) that looks to `side` (1 is right).
const head = (x, y, side, size = 5) =>
  `M${px(x)} ${px(y)}l${-side * size} ${-size * 0.42}v${size * 0.84}Z`;

// A dimension line with its arrows from one place to another, from outside where there is little room between.
export function Dimension({ from, to, y, up = 7, down = 4, name = "dimension" }) {
  const [low, high] = from < to ? [from, to] : [to, from];
  const isTight = high - low < 16;
  const way = isTight ? -1 : 1;
  const line = isTight
    ? `M${px(low - 12)} ${y}H${px(low)}M${px(high)} ${y}H${px(high + 12)}`
    : `M${px(low)} ${y}H${px(high)}`;
  return html`<g class=${name}>
    <path class="line" d=${line} />
    <path
      class="ends"
      d=${`M${px(low)} ${y - up}v${up + down}M${px(high)} ${y - up}v${up + down}`}
    />
    <path class="heads" d=${head(low, y, -way) + head(high, y, way)} />
  </g>`;
}

// A force: an arrow of so many pixels from a place, negative to the left.
export function Force({ x, y, length }) {
  const size = Math.abs(length);
  if (size < 2) return null;
  const side = Math.sign(length);
  const tip = Math.min(8, size);
  return html`<g class="force">
    <path class="shaft" d=${`M${px(x)} ${px(y)}h${px(side * (size - tip))}`} />
    <path class="tip" d=${head(x + length, y, side, tip)} />
  </g>`;
}

export const Ball = ({ x, y, radius }) =>
  html`<g class="ball">
    <circle cx=${px(x)} cy=${px(y)} r=${px(radius)} />
    <circle
      class="gleam"
      cx=${px(x - radius * 0.34)}
      cy=${px(y - radius * 0.36)}
      r=${px(radius * 0.24)}
    />
  </g>`;

// Arrows both ways: what the base does.
export const Shaking = ({ x, y, half = 16 }) =>
  html`<g class="shaking">
    <path class="line" d=${`M${px(x - half)} ${y}h${2 * half}`} />
    <path class="heads" d=${head(x - half, y, -1, 7) + head(x + half, y, 1, 7)} />
  </g>`;
