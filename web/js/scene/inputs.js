// What a scene states, place by place: every number, word and list with its label and its unit by the schema.
import { place } from "../form/place.js";
import { title } from "../units.js";

export const isObject = (value) =>
  typeof value === "object" && value !== null && !Array.isArray(value);
const LONGEST = 12; // values of a list that are written out

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
  if (Array.isArray(value)) {
    const rest = value.length - LONGEST;
    const text = value.slice(0, LONGEST).map(textOf).join(", ");
    return rest > 0 ? `${text}, and ${rest} more` : text;
  }
  if (isObject(value)) return JSON.stringify(value).slice(0, 120);
  return typeof value === "string" ? value.replaceAll("_", " ") : String(value);
}

// Rows {pointer, label, value, unit, text}: `value` is a number or what the scene has there, `text` reads it.
export function inputsOf(scene, schema) {
  const rows = [];
  const walk = (value, pointer) => {
    if (isObject(value)) {
      for (const [name, inner] of Object.entries(value)) walk(inner, `${pointer}/${name}`);
      return;
    }
    if (Array.isArray(value) && value.some(isObject)) {
      value.forEach((inner, at) => walk(inner, `${pointer}/${at}`));
      return;
    }
    rows.push({
      pointer,
      label: title(place(pointer)),
      value,
      unit: unitAt(schema, pointer),
      text: textOf(value),
    });
  };
  walk(scene, "");
  return rows;
}
