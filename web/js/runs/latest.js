// The latest results by their ids: a name that tells each from the others, and when it ended.
import { get, schema as schemaNamed } from "../api.js";
import { moment } from "../units.js";
import { namesOf } from "./names.js";

export async function latest(limit) {
  const query = { status: "successful", kind: "none", limit, details: 1 };
  const [{ jobs }, schema] = await Promise.all([get("v1/jobs", query), schemaNamed("scene")]);
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
