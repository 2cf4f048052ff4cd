// What differs between scenes: the inputs that vary, with short labels, units and a value for each scene.
import { isObject, unitAt } from "../scene/inputs.js";
import { words } from "../units.js";

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
  const found = new Map();
  const walk = (value, pointer) => {
    if (LEFT_OUT.test(pointer)) return;
    if (isObject(value))
      for (const [name, inner] of Object.entries(value)) walk(inner, `${pointer}/${name}`);
    else if (Array.isArray(value) && value.some(isObject))
      value.forEach((inner, at) => walk(inner, `${pointer}/${at}`));
    else found.set(pointer, Array.isArray(value) ? value.join(", ") : value);
  };
  walk(scene, "");
  if (scene.dampers?.length === 0) found.set("/dampers/0/buffer/material", "no damper");
  return found;
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
