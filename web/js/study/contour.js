// Filled contours of values over a grid: each level's area is where the values are at least so large. Where a corner is not
// known there is a gap.

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
export function contourPaths(xs, ys, valueAt, level) {
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
  const raw = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 2.5, 5, 10].find((one) => one * power >= raw) * power;
  const first = Math.ceil(low / step) * step;
  const levels = [low];
  for (let level = first; level < high; level += step) if (level > low) levels.push(level);
  return levels;
}
