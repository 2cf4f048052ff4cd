// What plot.js draws with: colours of the theme, axes with prefixes, marks, shades and rules.
import { h } from "./dom.js";
import { number, pretty, scale } from "./units.js";

const FONT = '12px system-ui, sans-serif';

// A colour of style.css, for a canvas.
const probe = document.body.appendChild(h("span", { hidden: true }));
export function ink(name) {
  probe.style.color = `var(--${name})`;
  return getComputedStyle(probe).color;
}

// The factor of an axis' numbers, their unit: a prefix, else a power of a thousand.
function prefix({ log, unit }, low, high) {
  const size = Math.max(Math.abs(low), Math.abs(high));
  if (log || !(size > 0)) return [1, pretty(unit)];
  const [factor, scaled] = scale(size, unit);
  if (factor !== 1 || (size >= 0.01 && size < 1e5)) return [factor, pretty(scaled)];
  const power = 3 * Math.floor(Math.log10(size) / 3);
  return [10 ** power, pretty(`10^${power} ${unit ?? ""}`)];
}

// An axis as uPlot takes it, named "Displacement [mm]"; `key` is "x" or "y".
export function axis(of, key) {
  const [size, space] = key === "x" ? [26, 65] : [50, 26], line = { stroke: () => ink("line"), width: 1 };
  const scaled = (u) => prefix(of, u.scales[key].min, u.scales[key].max);
  return { stroke: () => ink("quiet"), font: FONT, labelFont: FONT, labelSize: 18, size, gap: 3, space, grid: line, ticks: line,
    label: (u) => `${of.label} [${scaled(u)[1]}]`.replace(/ \[1?\]$/, ""),
    values: (u, ticks) => ticks.map((value) => number(value / scaled(u)[0], 9)),
    ...(of.log && logarithmic(space)) };
}

// Ticks at 1 to 9 of a decade, at 1, 2 and 5, or at some powers of ten, as there is room.
const logarithmic = (space) => ({
  splits(u, index, low, high) {
    const room = (index === 0 ? u.width : u.height) / space / Math.max(0.3, Math.log10(high / low)), ticks = []; // in a decade
    for (let power = Math.floor(Math.log10(low)); 10 ** power <= high; power++)
      if (power % Math.ceil(1 / room) === 0)
        for (const digit of room >= 9 ? "123456789" : room > 3 ? "125" : "1") ticks.push(Number(`${digit}e${power}`));
    return ticks.filter((value) => value >= low && value <= high);
  },
  filter: (u, ticks) => ticks,
  values: (u, ticks) => ticks.map((value) => number(value, 1).replace(/^1 × /, "")),
});

// What stands on the lines, in CSS pixels: shaded spans, rules, marks.
export function decorate(u, { spans, lines, markers }) {
  const { ctx } = u, ratio = ctx.canvas.width / u.width;
  const [left, top, width, height] = ["left", "top", "width", "height"].map((side) => u.bbox[side] / ratio);
  const right = left + width, bottom = top + height, across = (value) => left + u.valToPos(value, "x");
  const block = (color, ...place) => {
    ctx.fillStyle = ink(color);
    ctx.fillRect(...place);
  };
  // A text on a plate of the panel's colour, kept inside.
  const plate = (text, x, y) => {
    if (!text) return;
    const wide = ctx.measureText(text).width, at = Math.max(left + 2, Math.min(x, right - wide));
    block("front", at - 2, y - 12, wide + 4, 16);
    ctx.fillStyle = ink("quiet");
    ctx.fillText(text, at, y);
  };
  ctx.save();
  ctx.scale(ratio, ratio);
  Object.assign(ctx, { font: FONT, textBaseline: "alphabetic", textAlign: "left" });
  for (const { from, to, label } of spans) {
    const start = Math.max(left, across(from)), end = Math.min(right, across(to));
    if (!(end > start)) continue;
    ctx.globalAlpha = 0.2;
    block("edge", start, top, end - start, height);
    ctx.globalAlpha = 1;
    plate(label, start, 12); // above the plot, where no line runs
  }
  ctx.setLineDash([4, 3]);
  for (const { x, y, label, color } of lines) {
    const isUpright = x !== undefined;
    const [at, low, high] = isUpright ? [across(x), left, right] : [top + u.valToPos(y, "y"), top, bottom];
    if (!(at >= low && at <= high)) continue;
    ctx.strokeStyle = ink(color ? `c${color}` : "text");
    ctx.stroke(new Path2D(isUpright ? `M${at} ${top}V${bottom}` : `M${left} ${at}H${right}`));
    plate(label, isUpright ? at + 4 : right, isUpright ? top + 22 : at - 5);
  }
  for (const { x, color = 2 } of markers) {
    const at = across(x);
    if (at < left - 1 || at > right + 1) continue;
    ctx.fillStyle = ink(`c${color}`);
    ctx.fillText("▼", at - 5, top + 9);
  }
  ctx.restore();
}
