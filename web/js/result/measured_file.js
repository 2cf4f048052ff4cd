// A measured motion from a text file: one column of values, or times and values at even steps.
import { numberRows } from "../ui/number_rows.js";
import { number, words } from "../units.js";

const MIN_SAMPLES = 16; // samples that the service compares
const MAX_VALUE = 1e100; // whose square is a number
const TIME_UNITS = { s: 1, ms: 1e-3, µs: 1e-6, us: 1e-6, min: 60 };
// What a measured value may be in: the SI unit of each and its factor.
export const VALUE_UNITS = {
  m: ["m", 1],
  cm: ["m", 1e-2],
  mm: ["m", 1e-3],
  µm: ["m", 1e-6],
  "m/s": ["m/s", 1],
  "mm/s": ["m/s", 1e-3],
  "m/s^2": ["m/s^2", 1],
  "mm/s^2": ["m/s^2", 1e-3],
  g: ["m/s^2", 9.80665],
  N: ["N", 1],
  kN: ["N", 1000],
};

const unitIn = (head) =>
  /[[(]\s*([^\])]+?)\s*[\])]/
    .exec(head ?? "")?.[1]
    .replace("²", "^2")
    .replace(/s2$/, "s^2");

const example = (hasTime) =>
  hasTime ? "a time and a value would be right: 0.005; 0.0132" : "a value would be right: 0.0132";

// The column of values: the one whose heading is the channel's, else the first after the times.
function columnOf(heads, columns, channels) {
  if (columns === 1) return 0;
  const at = heads.findIndex(
    (head, index) =>
      index > 0 &&
      channels.some(
        (name) => head.toLowerCase().startsWith(words(name).toLowerCase()) || head.startsWith(name),
      ),
  );
  return at > 0 && at < columns ? at : 1;
}

function checkRows(rows, columns) {
  const hasTime = columns > 1;
  for (const { line, cells, numbers } of rows) {
    if (cells.join("") === "") throw new Error(`Line ${line} is empty; ${example(hasTime)}.`);
    if (cells.length !== columns)
      throw new Error(
        `Line ${line} has ${cells.length} ${cells.length === 1 ? "column" : "columns"}, the lines before have ${columns}; ${example(hasTime)}.`,
      );
    const at = numbers.findIndex((value) => !Number.isFinite(value));
    if (at >= 0)
      throw new Error(
        `Line ${line}: "${cells[at].slice(0, 40)}" is not a number; ${example(hasTime)}.`,
      );
    const huge = numbers.findIndex((value) => Math.abs(value) > MAX_VALUE);
    if (huge >= 0)
      throw new Error(
        `Line ${line}: ${cells[huge].slice(0, 40)} is too large for a measured value; ${example(hasTime)}.`,
      );
  }
}

// {start, interval} of the times, in the file's unit; they rise by even steps.
function stepsOf(rows) {
  const times = rows.map(({ numbers }) => numbers[0]);
  const interval = (times[times.length - 1] - times[0]) / (times.length - 1);
  const step = times[1] - times[0];
  const bad = times.findIndex(
    (time, at) => at > 0 && Math.abs(time - times[at - 1] - step) > 0.3 * Math.abs(step),
  );
  if (!(step > 0) || bad > 0) {
    const at = step > 0 ? bad : 1;
    const right = step > 0 ? number(times[at - 1] + step, 8) : `more than ${number(times[0], 8)}`;
    throw new Error(
      `Line ${rows[at].line}: times rise by even steps, so ${right} would be right, not ${number(times[at], 8)}.`,
    );
  }
  return { start: times[0], interval };
}

// {name, start, interval, values, unit, column}: times in s; `interval` is null where the file has no times; `unit` is null
// where its headings do not state one of VALUE_UNITS. An Error names the line and what would be right there.
export function readMeasured(text, name, channels) {
  const { heads, rows } = numberRows(text);
  if (rows.length < MIN_SAMPLES)
    throw new Error(
      `${name} has ${rows.length} lines of numbers; at least ${MIN_SAMPLES} would be right, each with a value, or a time and a value.`,
    );
  const columns = rows[0].cells.length;
  checkRows(rows, columns);
  const column = columnOf(heads, columns, channels);
  const timeUnit = TIME_UNITS[unitIn(heads[0])] ?? 1;
  const times = columns > 1 ? stepsOf(rows) : { start: 0, interval: null };
  const unit = unitIn(heads[column]);
  return {
    name,
    start: times.start * timeUnit,
    interval: times.interval === null ? null : Number((times.interval * timeUnit).toPrecision(12)),
    values: Float64Array.from(rows, ({ numbers }) => numbers[column]),
    unit: Object.hasOwn(VALUE_UNITS, unit ?? "") ? unit : null,
    heading: heads[column] ?? "",
  };
}
