// The table of a sweep as its page thinks of it: axes, metrics, points by their indices, which metric tells most, the best
// point.
import { valueText } from "../runs/scene_name.js";
import { title } from "../units.js";
import { pointerOf } from "./parts.js";
import { labelOf } from "../runs/names.js";
import { extentOf } from "../chart/scale.js";

// Metrics of the structure's response, of which less is better, the first question of a sweep.
const RESPONSES = /^(rms|peak)_(displacement|acceleration|storey_drift|base_shear)$/;
const isSmallerBetter = (key) => RESPONSES.test(key) || key === "peak_contact_force";

function axisOf({ unit, values, ...varied }, index, all) {
  const place = pointerOf(varied);
  return {
    index,
    pointer: place,
    unit,
    values,
    label: title(labelOf(place)),
    isNumeric: values.every((value) => typeof value === "number"),
    texts: values.map((value) => valueText(value, unit, 5)),
    step: all.slice(index + 1).reduce((product, axis) => product * axis.values.length, 1),
  };
}

function metricColumn(key, { unit, values }) {
  const [low, high] = extentOf([values]) ?? [null, null];
  const largest = Math.max(Math.abs(low), Math.abs(high));
  return {
    key,
    unit,
    label: title(key),
    values,
    low,
    high,
    spread: largest > 0 && high - low > 1e-9 * largest ? (high - low) / largest : 0, // else rounding
    isDecisive: isSmallerBetter(key),
  };
}

// {isGrid, axes, varying, metrics, columns, status, indices: of points by row, rows: Map of the index of a point to its row}
export function sweepModel(answer) {
  const { columns } = answer;
  const axes = answer.axes.map(axisOf);
  const metrics = Object.keys(columns)
    .filter((key) => !/^(index|status|\/.*)$/.test(key))
    .map((key) => metricColumn(key, columns[key]));
  const indices = columns.index.values;
  return {
    isGrid: answer.mode === "grid",
    axes,
    varying: axes.filter(({ values }) => values.length > 1),
    metrics,
    indices,
    status: columns.status.values,
    rows: new Map(indices.map((index, row) => [index, row])),
    columns,
  };
}

// The response that varies most, else any metric that does.
export function tellingMetric({ metrics }) {
  const byRank = metrics.toSorted((a, b) => b.spread - a.spread);
  return (
    byRank.find(({ key, spread }) => RESPONSES.test(key) && spread > 0) ??
    byRank.find(({ isDecisive }) => isDecisive) ??
    byRank[0]
  );
}

// The row with the least value of a metric; -1 where nothing is known or less is no better.
export function bestRow({ isDecisive, values, spread }) {
  if (!isDecisive || !(spread > 0)) return -1;
  let best = -1;
  values.forEach((value, row) => {
    if (Number.isFinite(value) && (best < 0 || value < values[best])) best = row;
  });
  return best;
}

// The places of a row on the axes: positions in their values, of a list the row itself.
export function positionsOf(model, row) {
  const index = model.indices[row];
  return model.axes.map(({ step, values }) =>
    model.isGrid ? Math.floor(index / step) % values.length : index,
  );
}

// The row at such positions; undefined where it is not there yet.
export const rowAt = (model, positions) =>
  model.rows.get(model.axes.reduce((sum, { step }, axis) => sum + positions[axis] * step, 0));

// "clearance 22.7 mm, buffer sponge"
export const placeText = (model, row) =>
  model.varying
    .map(({ pointer, index, unit }) => {
      const value = model.isGrid
        ? model.axes[index].values[positionsOf(model, row)[index]]
        : model.columns[pointer]?.values[row];
      return `${labelOf(pointer)} ${valueText(value, unit)}`;
    })
    .join(", ");

// Whether the row lies at an end of an axis of numbers, beyond which it might go on.
export function edgeOf(model, row) {
  if (!model.isGrid) return null;
  const positions = positionsOf(model, row);
  return model.varying.find(
    ({ isNumeric, values, index }) =>
      isNumeric && (positions[index] === 0 || positions[index] === values.length - 1),
  );
}

// How to draw it: {x, over, fixed}: the axis across, the one whose values are lines or which goes up, those that stand still.
export function pictureOf({ isGrid, varying, axes }) {
  if (!isGrid) {
    const [first] = axes.filter(({ isNumeric }) => isNumeric);
    return first ? { kind: "list", x: first, fixed: [] } : { kind: "table" };
  }
  const numeric = varying.filter(({ isNumeric }) => isNumeric);
  const named = varying.filter(({ isNumeric }) => !isNumeric);
  const x = numeric.at(-1) ?? named.at(-1);
  if (!x) return { kind: "table" };
  const others = varying.filter((axis) => axis !== x);
  const over = others.find(({ isNumeric }) => !isNumeric) ?? others.at(-1) ?? null;
  const fixed = others.filter((axis) => axis !== over);
  if (!x.isNumeric) return over ? { kind: "table" } : { kind: "bars", x, fixed };
  if (over?.isNumeric) return { kind: "contours", x, over, fixed };
  return { kind: "lines", x, over, fixed };
}
