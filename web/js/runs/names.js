// Names that tell runs apart: their own titles, else what differs in their scenes.
import { capital, words } from "../units.js";
import { materialOf, valueText } from "./scene_name.js";
import { isSame, labelOf, varyingInputs } from "./scenes.js";

const MOST_PARTS = 3; // of a name

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
export function differingNames(jobs, schema, mostParts = MOST_PARTS, isBelowTitle = false) {
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
  const groups = Map.groupBy(jobs, ({ title }) => title ?? "");
  for (const [title, group] of groups) {
    const isAlone = title !== "" && new Set(group.map(({ result, id }) => result ?? id)).size === 1;
    const found = isAlone ? [] : differingNames(group, schema, MOST_PARTS, title !== "");
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
