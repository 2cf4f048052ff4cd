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
