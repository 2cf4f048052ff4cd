// Numbers as people read them, in the units that they chose. What is sent is SI and exact.
import { settings, unitSettings } from "./settings.js";

const SCALED = new Set(["m", "s", "N", "J", "Hz", "N/m", "N s/m", "N s", "W"]);
const PREFIXES = [
  [1e9, "G"],
  [1e6, "M"],
  [1e3, "k"],
  [1, ""],
  [1e-3, "m"],
  [1e-6, "µ"],
  [1e-9, "n"],
];

const superscript = (power) =>
  String(power)
    .replace("-", "⁻")
    .replace(/\d/g, (digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]);

const isUnknown = (value) => Number.isNaN(value ?? NaN);

// "0.01531", "1.2 × 10⁻⁹"; "–" for what is not known.
export function number(value, digits = 4) {
  if (isUnknown(value)) return "–";
  if (typeof value !== "number") return String(value);
  const size = Math.abs(value);
  if (size === Infinity) return value > 0 ? "∞" : "−∞";
  if (size === 0 || (size >= 1e-3 && size < 1e6))
    return String(Number.isInteger(value) ? value : Number(value.toPrecision(digits))).replace(
      "-",
      "−",
    );
  const [mantissa, power] = value.toExponential(digits - 1).split("e");
  return `${String(Number(mantissa)).replace("-", "−")} × 10${superscript(Number(power))}`;
}

// "12.3 %"; what is next to nothing as a power of ten.
export const share = (part, digits = 3) =>
  part !== 0 && Math.abs(part) < 1e-5 ? `${number(part, 2)}` : `${number(100 * part, digits)} %`;

// The unit that the reader chose for this one, also squared as in spectra: [factor, unit]; null for what suits the number.
export function chosenScale(unit) {
  const chosen = settings.get();
  for (const { name, unit: base, choices } of unitSettings) {
    const factor = choices[chosen[name]];
    if (factor === null) continue;
    if (unit === base) return [factor, chosen[name]];
    if (unit === `${base}^2/Hz` || unit === `(${base})^2/Hz`)
      return [factor ** 2, `${chosen[name]}^2/Hz`];
  }
  return null;
}

// The unit that was chosen, else the prefix that suits `size`: [factor, unit].
export function scale(size, unit) {
  const fixed = chosenScale(unit);
  if (fixed) return fixed;
  const [factor, prefix] = (SCALED.has(unit) &&
    size < Infinity &&
    PREFIXES.find(([one]) => size >= one * 0.9999999)) || [1, ""];
  return [factor, prefix + (unit ?? "")];
}

// "15 mm", "5.718 N", "9.611 m/s²".
export function quantity(value, unit, digits = 4) {
  if (isUnknown(value)) return "–";
  const [factor, scaled] = scale(Math.abs(value), unit);
  const text = number(value / factor, digits);
  return scaled && scaled !== "1" ? `${text}\u00a0${pretty(scaled)}` : text;
}

// A text of the service with readable numbers: "step 1e-05 s" as "step 10 µs", "0.000101 m" as "101 µm".
export const readable = (text) =>
  text.replace(
    /(?<![\w.])(?:\d[\d.]*e[+-]?\d+|0\.00\d+(?= [msN]\b))(?: (m|s|N|Hz)(?![\w/^]))?/g,
    (digits, unit) => quantity(parseFloat(digits), unit),
  );

// "m/s^2" as "m/s²".
export const pretty = (unit) =>
  (unit ?? "").replace(/\^(-?\d+)/g, (_, power) => superscript(power));

// "peak_contact_force" as "peak contact force".
export const words = (name) =>
  String(name)
    .replaceAll("_", " ")
    .replace(/\brms\b/g, "RMS")
    .replace(/\bpsd\b/g, "PSD");
export const capital = (text) => text.replace(/^./, (letter) => letter.toUpperCase());
export const uncapital = (text) => (text ?? "").replace(/^./, (letter) => letter.toLowerCase());
export const yesNo = { true: "yes", false: "no" };
export const title = (name) => capital(words(name));

// A time of day: "14:03" today, "21 Nov 2026, 14:03" before.
export function moment(text) {
  if (!text) return "–";
  const when = new Date(text);
  const isToday = when.toDateString() === new Date().toDateString();
  return when.toLocaleString("en-GB", {
    ...(isToday ? {} : { dateStyle: "medium" }),
    timeStyle: "short",
  });
}

// "r-a29adbf1…": enough to tell it by.
export const brief = (id) => (id.length > 14 ? `${id.slice(0, 10)}…` : id);

// A metric of a summary, null where it is not known: impulses have no force.
export const metricOf = (summary, name) =>
  name === "peak_contact_force" && summary.impacts > 0 && summary[name] === 0
    ? null
    : (summary[name] ?? null);
