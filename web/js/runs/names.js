// Names that tell runs apart: their own titles, else what differs in their scenes.
import { get, getSchema } from "../api.js";
import { capital, moment, pretty, words } from "../units.js";
import { materialOf, valueText } from "./scene_name.js";
import { unitAt, valuesOf } from "../scene/inputs.js";

const MAX_PARTS = 3; // of a name

// "clearance 15 mm"; words speak for themselves: "sponge".
const partText = ({ label, unit }, value) =>
  typeof value === "number" ? `${label} ${valueText(value, unit)}` : valueText(value);

function studyText({ kind, axes, variables, parameters }) {
  // Of a sensitivity study the parameters are words.
  const nameOf = (one) =>
    typeof one === "string"
      ? [words(one)]
      : [one.pointer ?? one.pointers].flat().map((pointer) => labelOf(pointer));
  const varied = (axes ?? variables ?? parameters ?? []).flatMap(nameOf);
  return varied.length > 0 ? `${kind}: ${varied.join(" and ")}` : kind;
}

// What a scene is where nothing else tells it: "sponge, free".
const plainName = (scene) => `${materialOf(scene)}, ${words(scene.excitation?.kind ?? "free")}`;

// The value that more than half of them have.
const usualValue = (values) =>
  values.find((one) => 2 * values.filter((value) => isSame(value, one)).length > values.length);

// A name for each of {scene, title}: by the inputs that vary among them, else by what they are. Without a title the material
// comes first; below a title stands only what is unusual among them.
export function differingNames(jobs, schema, mostParts = MAX_PARTS, isBelowTitle = false) {
  const scenes = jobs.map(({ scene }) => scene ?? {});
  const inputs = varyingInputs(scenes, schema);
  const usual = inputs.map(({ values }) => (isBelowTitle ? usualValue(values) : undefined));
  const isTelling = ({ values }, at, one) =>
    (values[one] ?? null) !== null && values[one] !== "auto" && values[one] !== usual[at];
  return jobs.map(({ scene, title }, at) => {
    if (!scene) return null;
    const parts = inputs
      .filter((input, place) => isTelling(input, place, at))
      .slice(0, mostParts)
      .map((input) => partText(input, input.values[at]));
    if (!title && parts.length > 0 && !inputs.some(({ label }) => label === "material"))
      parts.unshift(materialOf(scene));
    const study = scene.study && studyText(scene.study);
    if (parts.length === 0 && (isBelowTitle || inputs.length > 0)) return study && capital(study);
    const own = parts.length > 0 ? parts.join(", ") : plainName(scene);
    return capital(study ? `${study}; ${own}` : own);
  });
}

// Map of job id to {name, detail}: the title, and below it what tells a run from others of that title; without a title the name
// is what differs. `jobs` are {id, title, scene, result}.
export function namesOf(jobs, schema) {
  const names = new Map();
  const groups = Map.groupBy(jobs, ({ title }) => pretty(title));
  for (const [title, group] of groups) {
    const isAlone = title !== "" && new Set(group.map(({ result, id }) => result ?? id)).size === 1;
    const found = isAlone ? [] : differingNames(group, schema, MAX_PARTS, title !== "");
    const isTelling = new Set(found).size > 1;
    group.forEach((job, at) => {
      const own = found[at] ?? `A ${job.study ?? "run"} without a title`;
      names.set(
        job.id,
        title ? { name: title, detail: isTelling ? found[at] : null } : { name: own },
      );
    });
  }
  return names;
}

// Results beside each other are called A to D; the address names them by these letters.
export const LETTERS = [..."abcd"];
export const lettered = (ids) =>
  Object.fromEntries(LETTERS.map((letter, at) => [letter, ids[at] ?? null]));

// The latest results by their ids: a name that tells each from the others, and when it ended.
export async function latestResults(limit) {
  const query = { status: "successful", kind: "none", limit, details: 1 };
  const [{ jobs }, schema] = await Promise.all([get("v1/jobs", query), getSchema("scene")]);
  const there = jobs.filter((job) => job.result && !job.result_deleted);
  const names = namesOf(there, schema);
  const found = new Map();
  for (const { id, result, finished } of there) {
    const { name, detail } = names.get(id);
    const text = [name, detail, moment(finished)].filter(Boolean).join(", ");
    if (!found.has(result)) found.set(result, text);
  }
  return found;
}

const LEFT_OUT = /^\/(output|study|title|labels)\b/;
const SECTIONS = [
  "dampers",
  "contact",
  "excitation",
  "structure",
  "duration",
  "accuracy",
  "sample_rate",
];
const FIRST = ["material", "clearance", "kind", "model", "mass"]; // of a section

// Map of pointer to value: numbers, words, lists as text.
function flatten(scene) {
  const text = (value) => (Array.isArray(value) ? value.join(", ") : value);
  const found = valuesOf(scene).filter(([pointer]) => !LEFT_OUT.test(pointer));
  const map = new Map(found.map(([pointer, value]) => [pointer, text(value)]));
  if (scene.dampers?.length === 0) map.set("/dampers/0/buffer/material", "no damper");
  return map;
}

// But for rounding.
export const isSame = (a, b) =>
  a === b ||
  (typeof a === "number" &&
    typeof b === "number" &&
    Math.abs(a - b) <= 1e-9 * Math.max(Math.abs(a), Math.abs(b)) + 1e-15);

// The sections in the order of a scene's page, in each what is most often varied first.
function rank(pointer) {
  const [section, ...rest] = pointer.slice(1).split("/");
  const first = FIRST.indexOf(rest.at(-1));
  const number = section === "dampers" ? Number(rest[0]) : 0;
  return [SECTIONS.indexOf(section), number, first < 0 ? FIRST.length : first];
}

function byRank(a, b) {
  const [first, second] = [rank(a.pointer), rank(b.pointer)];
  const at = first.findIndex((value, index) => value !== second[index]);
  return at < 0 ? 0 : first[at] - second[at];
}

// "clearance" of "/dampers/0/clearance", "damper mass" beside "structure mass".
export function labelOf(pointer, hasManyDampers = false) {
  const [section, ...rest] = pointer.slice(1).split("/");
  const name = words(rest.at(-1) ?? section);
  if (section === "dampers") {
    const which = hasManyDampers || rest[0] !== "0" ? `damper ${Number(rest[0]) + 1}` : "";
    const side = /^(left|right)_/.exec(rest[1])?.[1];
    const own = name === "mass" && !which ? "damper mass" : name;
    return [which, side, own].filter(Boolean).join(" ");
  }
  if (name === "kind") return words(section);
  if (rest.length > 0 && /^\d+$/.test(rest.at(-1))) return words(`${rest.at(-2)} ${name}`);
  return ["mass", "model", "displacement"].includes(name) ? `${words(section)} ${name}` : name;
}

// The inputs that are not the same in all scenes that have them: [{pointer, label, unit, values}], the most telling first. Numbers of a
// material stand for nothing of their own where the material varies; what varies along with an earlier input is left out.
export function varyingInputs(scenes, schema) {
  const flat = scenes.map(flatten);
  const withMany = scenes.filter((scene) => scene.dampers?.length > 1);
  const hasManyDampers = 2 * withMany.length > scenes.length;
  const pointers = [...new Set(flat.flatMap((inputs) => [...inputs.keys()]))];
  const all = pointers.map((pointer) => ({
    pointer,
    label: labelOf(pointer, hasManyDampers),
    unit: unitAt(schema, pointer),
    values: flat.map((inputs) => inputs.get(pointer)),
  }));
  const isThere = (value) => value !== undefined && value !== null;
  const varying = all.filter(({ values }) => {
    const first = values.find(isThere);
    return values.some((value) => isThere(value) && !isSame(value, first));
  });
  const isNamed = ({ pointer }) => {
    const material = pointer.replace(/(restitution|contact_time)$/, "material");
    return material !== pointer && varying.some((other) => other.pointer === material);
  };
  return varying
    .filter((input) => !isNamed(input))
    .sort(byRank)
    .filter(
      ({ values }, at, sorted) =>
        !sorted
          .slice(0, at)
          .some((earlier) => earlier.values.every((value, one) => isSame(value, values[one]))),
    );
}
