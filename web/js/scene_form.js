// The scene's form in the steps that one thinks in.
import { h, help } from "./dom.js";
import { parts } from "./draft.js";
import { choice } from "./fields.js";
import { form } from "./form.js";
import { sponge, storeysOf } from "./scene_state.js";
import { title, words } from "./units.js";

const steps = [["structure"], ["dampers"], ["contact"], ["excitation"], ["duration", "sample_rate", "accuracy"], ["output"],
  ["study"], ["title", "labels"]];

// Asked for without "More", though it need not be said.
const shown = /\/(damping|\w*buffer|displacement|name|accuracy|title|labels)$|^\/output\/\w+$|^\/study\/axes/;

// "/dampers/0/clearance" as "damper 1, clearance".
export const place = (pointer) => parts(pointer).map(words).join(", ").replace("axes", "axis")
  .replace(/(?<!i)s?, (\d+)/g, (_, at) => ` ${Number(at) + 1}`);

// The unit of such a place, by its name in the schema's text.
export const unitOf = (pointer, text) =>
  RegExp(`"${/([a-z_]+)[/\d]*$/.exec(pointer)[1]}":{[^{}]*"x-unit":"([^"]*)`).exec(text)?.[1];

// What a sweep may vary: the scene's own numbers, its buffers, the seed.
function variables(scene, text) {
  const found = [], name = (pointer, unit = unitOf(pointer, text)) => place(pointer) + (unit ? ` [${unit}]` : "");
  (function walk(value, pointer) {
    if (found.length > 200 || /^\/(study|output|excitation\/samples)/.test(pointer)) return;
    if (typeof value === "number" || pointer.endsWith("buffer")) found.push([pointer, name(pointer)]);
    if (typeof value === "object") for (const name in value) walk(value[name], `${pointer}/${name}`);
  })(scene, "");
  return found;
}

const round = (value) => Number(value.toPrecision(4));

function axis(draft, pointer) {
  const now = draft.get(pointer);
  if (pointer.endsWith("buffer")) return { pointer, values: ["sponge", "soft_rubber", "hard_rubber", "aluminium"] };
  return now > 0 ? { pointer, from: round(now * 0.5), to: round(now * 1.5), count: 21 } : { pointer };
}

// What varies, by its name; with values to begin with.
const axisChoice = (text) => (context) => {
  const { draft, pointer } = context;
  const set = (_, chosen = "") => draft.set(pointer.replace(/\/pointer$/, ""), axis(draft, chosen));
  return choice({ ...context, schema: {}, label: "What varies", draft: { ...draft, set } }, () => variables(draft.scene, text));
};

// What a kind or an item begins with when it is chosen.
function starts(draft) {
  const one = (name, otherwise) => [draft.get(`/structure/${name}`) ?? otherwise].flat(2)[0];
  const mass = one("mass", 1000), stiffness = one("stiffness", 1e6);
  const three = (value) => [value, value, value], last = draft.get("/dampers")?.at?.(-1) ?? sponge().dampers[0];
  return {
    "/structure frame": { masses: three(mass), stiffnesses: three(stiffness), damping_ratio: 0.02 },
    "/excitation random": { band: [0, 15], rms: 1, seed: 1 }, "/excitation sine": { frequency: 4, amplitude: 1 },
    "/dampers/N": structuredClone(last),
    "/study sensitivity": { restitution_deviation: 0.15, contact_time_deviation: 0.1 },
    "/study sweep": { axes: [axis(draft, "/dampers/0/clearance")] }, "/study/axes/N": axis(draft, "/dampers/0/mass"),
  };
}

// A structure of another kind starts from where the last one did, the storeys below the top in proportion.
function fitStart(draft) {
  const pointer = "/excitation/displacement", count = storeysOf(draft.scene), top = [draft.get(pointer)].flat().at(-1);
  if (top) draft.set(pointer, count === 1 ? top : Array.from({ length: count }, (_, at) => round(top * (at + 1) / count)));
}

export function sceneForm(host, { schema, draft, widgets }) {
  const options = {
    draft, start: (pointer, kind) => starts(draft)[kind ? `${pointer} ${kind}` : pointer],
    shows: (pointer) => shown.test(pointer) || (pointer.endsWith("/storey") && storeysOf(draft.scene) > 1),
    widgets: [...widgets, [/^\/study\/axes\/\d+\/pointer$/, axisChoice(JSON.stringify(schema))]],
  };
  for (const members of steps) {
    const inner = h("div"), [name] = members, heading = h("h2", null, title(members.join(", ")));
    host.append(h("details.panel", { open: name !== "output" }, h("summary", null, heading), help(title(name)), inner));
    form(inner, { ...options, ...members.length > 1 ? { schema, only: members }
      : { pointer: `/${name}`, schema: schema.properties[name], required: schema.required.includes(name) } });
  }
  draft.onChange(({ pointer }) => pointer === "/structure" && fitStart(draft));
}
