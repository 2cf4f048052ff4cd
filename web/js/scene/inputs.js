// What a scene states, place by place: every number, word and list with its label and its unit by the schema.
import { title, words } from "../units.js";
import { parts } from "../form/draft.js";

// "/dampers/0/clearance" as "damper 1, clearance".
export const place = (pointer) =>
  parts(pointer)
    .map(words)
    .join(", ")
    .replace("axes", "axis")
    .replace(/(?<!i)s?, (\d+)/g, (_, at) => ` ${Number(at) + 1}`);

export const isObject = (value) =>
  typeof value === "object" && value !== null && !Array.isArray(value);
const MAX_LISTED = 12; // values of a list that are written out

// The schemas that could describe a value: those of alternatives too.
const alternatives = (schema) => [
  schema,
  ...[...(schema.oneOf ?? []), ...(schema.anyOf ?? [])].flatMap(alternatives),
];

// The unit of a place by the scene's schema, undefined where it has none.
export function unitAt(schema, pointer) {
  let found = [schema];
  let unit;
  for (const part of pointer.split("/").slice(1)) {
    found = found
      .flatMap(alternatives)
      .map((one) => (/^\d+$/.test(part) ? one.items : one.properties?.[part]))
      .filter(Boolean);
    unit =
      found.find((one) => one["x-unit"])?.["x-unit"] ?? (/^\d+$/.test(part) ? unit : undefined);
  }
  return unit;
}

function textOf(value) {
  if (value === null || value.length === 0) return "none";
  if (Array.isArray(value)) {
    const rest = value.length - MAX_LISTED;
    const text = value.slice(0, MAX_LISTED).map(textOf).join(", ");
    return rest > 0 ? `${text}, and ${rest} more` : text;
  }
  if (isObject(value)) return JSON.stringify(value).slice(0, 120);
  return typeof value === "string" ? value.replaceAll("_", " ") : String(value);
}

// [[pointer, value]] of what a scene states: what is an object, or a list of objects, by its members.
export function valuesOf(value, pointer = "") {
  const isList = Array.isArray(value) && value.some(isObject);
  if (!isList && !isObject(value)) return [[pointer, value]];
  return Object.entries(value).flatMap(([name, inner]) => valuesOf(inner, `${pointer}/${name}`));
}

// Rows {pointer, label, value, unit, text}: `value` is a number or what the scene has there, `text` reads it.
export const inputsOf = (scene, schema) =>
  valuesOf(scene).map(([pointer, value]) => ({
    pointer,
    label: title(place(pointer)),
    value,
    unit: unitAt(schema, pointer),
    text: textOf(value),
  }));
