// What views of studies and comparisons share: ways to scenes and runs, pieces of text and tables.
import { go, link, pack } from "./address.js";
import { get } from "./api.js";
import { failure, h, once } from "./dom.js";
import { brief, moment, quantity, title, words } from "./units.js";

// The scene alone, without its study.
export const plain = ({ study, ...scene }) => scene;

// A link to the form with this scene, or what a promise of one brings, which is in the URL.
export function sceneLink(label, scene) {
  const anchor = h("a", null, label);
  Promise.resolve(scene).then(pack).then((s) => (anchor.href = link("scene", { s })), (error) => anchor.append(failure(error)));
  return anchor;
}

// The names of the latest results, by their ids.
export const latest = async (limit) => new Map((await get("v1/jobs", { status: "successful", kind: "none", limit })).jobs
  .filter(({ result }) => result).map(({ result, title: name, finished }) =>
    [result, `${name ?? brief(result)}, ${moment(finished)}`]));

// A button that makes a job and goes to its result, or to the job while it runs.
export function jobButton(label, make) {
  const act = once(() => make().then((job) => go(job.status === "successful" ? `results/${job.result}` : `jobs/${job.id}`),
    (error) => button.after(failure(error))));
  const button = h("button", { type: "button", onclick: act }, label);
  return button;
}

export const lesson = (...texts) => h("div.notice", null, texts.filter(Boolean).map((text) => h("p", null, text)));
export const column = (label, unit, value) => ({ label, numeric: true, value, cell: (row) => quantity(value(row), unit) });
export const between = (low, high, unit) => `${quantity(low, unit, 3)} to ${quantity(high, unit, 3)}`;
// "clearance" of "/dampers/0/clearance".
export const member = (pointer) => words(pointer.replace(/^\/(dampers\/0\/)?/, "").replaceAll("/", " "));
export const told = (value, unit) => (typeof value === "number" ? quantity(value, unit)
  : typeof value === "string" ? value : value ? JSON.stringify(value).slice(0, 80) : "–");

// Columns: a text; a member and an interval, perhaps unknown, in this unit or the row's.
export const text = (label, cell) => ({ label, cell });
export const metric = text("Number", (row) => title(row.metric));
export const value = (label, key, unit) => ({ label, numeric: true, cell: (row) => quantity(row[key], unit ?? row.unit) });
export const range = (key, unit) => text("95 %", (row) => row[key]?.[0] != null ? between(...row[key], unit ?? row.unit) : null);

// Columns for rows {metric, unit, q05, q95, …}: the metric, its value of this name, where 90 of 100 runs are.
export const spread = (label, name) => [metric,
  value(label, name),
  { label: "5 to 95 %", numeric: true, cell: ({ q05, q95, unit }) => between(q05, q95, unit) }];

// [smallest, largest] of the numbers among values.
export function extent(values) {
  let low = Infinity, high = -Infinity;
  for (const value of values) if (typeof value === "number") [low, high] = [Math.min(low, value), Math.max(high, value)];
  return [low, high];
}

// What plot() wants for a spectrum.
export const spectrum = (channel, unit) => ({ title: `Spectrum of the ${words(channel)}`, height: 300,
  x: { label: "Frequency", unit: "Hz", log: true }, y: { label: "Density", unit, log: true } });
