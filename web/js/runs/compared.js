// Results to be compared: each with its spectrum, its first impact and a name that tells it from the others.
import { get, schema as schemaNamed } from "../api.js";
import { inputsOf } from "../scene/inputs.js";
import { differingNames } from "./names.js";
import { materialOf, valueText } from "./scene_name.js";
import { isSame } from "./scenes.js";

export const LETTERS = [..."abcd"];
export const idsOf = (query) => LETTERS.map((letter) => query[letter]).filter(Boolean);
// The address' query of these results.
export const lettered = (ids) =>
  Object.fromEntries(LETTERS.map((letter, at) => [letter, ids[at] ?? null]));

async function loadRun(id, signal) {
  const load = (name, query) => get(`v1/results/${encodeURIComponent(id)}${name}`, query, signal);
  const result = await load("");
  const { links, plan, summary } = result;
  const hasImpacts = links.impacts && summary.impacts > 0;
  const hasForce = hasImpacts && plan.contact_model !== "impulse";
  const [psd, first, force] = await Promise.all([
    links.psd ? load("/psd.json") : null,
    hasImpacts ? load("/impacts.json", { first: 1, limit: 1 }) : null,
    hasForce ? load("/impacts/1/force.json") : null,
  ]);
  return {
    result,
    psd,
    force,
    impact: first?.impacts[0] ?? null,
    path: `v1/results/${result.id}`,
    end: (result.count - 1) / result.sample_rate,
  };
}

// {runs, pairs, inputs}: `pairs` are the others against the first, as the service compares them; `inputs` those that differ.
export async function loadComparison(ids, signal) {
  const [schema, ...runs] = await Promise.all([
    schemaNamed("scene"),
    ...ids.map((id) => loadRun(id, signal)),
  ]);
  const [first, ...others] = runs;
  const pairs = await Promise.all(
    others.map((other) => get("v1/compare", { a: first.result.id, b: other.result.id }, signal)),
  );
  const scenes = runs.map(({ result }) => result.scene);
  const names = differingNames(
    scenes.map((scene, at) => ({ scene, title: "ABCD"[at] })),
    schema,
    2,
  );
  const lower = (name) => (name ?? "").replace(/^./, (letter) => letter.toLowerCase());
  runs.forEach((run, at) =>
    Object.assign(run, {
      color: `c${at + 1}`,
      label: `${"ABCD"[at]} ${lower(names[at] ?? materialOf(scenes[at]))}`.trim(),
    }),
  );
  return { runs, pairs, inputs: differingInputs(scenes, schema) };
}

// Rows {label, unit, values} of the inputs that are not the same, a value for each scene.
function differingInputs(scenes, schema) {
  const maps = scenes.map(({ study, ...scene }) => inputsOf(scene, schema));
  const rows = new Map();
  maps.forEach((inputs, at) => {
    for (const { pointer, label, unit, value, text } of inputs) {
      const row = rows.get(pointer) ?? { label, unit, values: scenes.map(() => null) };
      row.values[at] = typeof value === "number" ? value : valueText(text);
      rows.set(pointer, row);
    }
  });
  return [...rows.values()].filter(
    ({ values }) => !values.every((value) => isSame(value, values[0])),
  );
}
