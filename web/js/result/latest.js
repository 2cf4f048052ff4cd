// The names of the latest results, by their ids.
import { get } from "../api.js";
import { brief, moment } from "../units.js";

export async function latest(limit) {
  const { jobs } = await get("v1/jobs", { status: "successful", kind: "none", limit });
  const named = jobs.filter(({ result }) => result);
  return new Map(
    named.map(({ result, title, finished }) => [
      result,
      `${title ?? brief(result)}, ${moment(finished)}`,
    ]),
  );
}
