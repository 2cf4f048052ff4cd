// Places of a document in words.
import { words } from "../units.js";
import { parts } from "./draft.js";

// "/dampers/0/clearance" as "damper 1, clearance".
export const place = (pointer) =>
  parts(pointer)
    .map(words)
    .join(", ")
    .replace("axes", "axis")
    .replace(/(?<!i)s?, (\d+)/g, (_, at) => ` ${Number(at) + 1}`);

// The unit of such a place, by its name in the schema's text.
export const unitOf = (pointer, text) => {
  const [, name] = /([a-z_]+)[/\d]*$/.exec(pointer);
  return RegExp(`"${name}":{[^{}]*"x-unit":"([^"]*)`).exec(text)?.[1];
};
