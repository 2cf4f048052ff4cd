// The scene's form in the steps that one thinks in.
import { useNews } from "../form/draft.js";
import { ChoiceField } from "../form/fields.js";
import { Form } from "../form/form.js";
import { place, unitAt } from "./inputs.js";
import { Help } from "../ui/controls.js";
import { html, useEffect, useMemo } from "../ui/preact.js";
import { title } from "../units.js";
import { initialScene } from "./url.js";
import { storeyCount } from "./channels.js";

const STEPS = [
  ["structure"],
  ["dampers"],
  ["contact"],
  ["excitation"],
  ["duration", "sample_rate", "accuracy"],
  ["output"],
  ["study"],
  ["title", "labels"],
];

// Asked for without "More", though it need not be said.
const SHOWN =
  /\/(damping|\w*buffer|displacement|name|accuracy|title|labels)$|^\/output\/\w+$|^\/study\/axes/;
const MAX_VARIABLES = 200;

// What a sweep may vary: the scene's own numbers, its buffers, the seed.
function variables(scene, schema) {
  const found = [];
  const nameOf = (pointer) => {
    const unit = unitAt(schema, pointer);
    return place(pointer) + (unit ? ` [${unit}]` : "");
  };
  const walk = (value, pointer) => {
    if (found.length > MAX_VARIABLES || /^\/(study|output|excitation\/samples)/.test(pointer))
      return;
    if (typeof value === "number" || pointer.endsWith("buffer"))
      found.push([pointer, nameOf(pointer)]);
    if (typeof value === "object" && value !== null)
      for (const [name, inner] of Object.entries(value)) walk(inner, `${pointer}/${name}`);
  };
  walk(scene, "");
  return found;
}

const round = (value) => Number(value.toPrecision(4));

function axis(draft, pointer) {
  const now = draft.get(pointer);
  if (pointer.endsWith("buffer"))
    return { pointer, values: ["sponge", "soft_rubber", "hard_rubber", "aluminium"] };
  return now > 0
    ? { pointer, from: round(now * 0.5), to: round(now * 1.5), count: 21 }
    : { pointer };
}

// What varies, by its name; with values to begin with.
const axisField = (schema) =>
  Object.assign(function AxisField(context) {
    const { draft, pointer } = context;
    useNews(draft, (news) => news.pointer !== undefined && !news.isMoving);
    const choose = (chosen = "") =>
      draft.set(pointer.replace(/\/pointer$/, ""), axis(draft, chosen));
    return html`<${ChoiceField}
      ...${context}
      schema=${{}}
      label="What varies"
      isWide
      value=${draft.get(pointer)}
      onChoose=${choose}
      choices=${variables(draft.scene, schema)}
    />`;
  });

// What a kind or an item begins with when it is chosen.
function starts(draft) {
  const first = (name, otherwise) => [draft.get(`/structure/${name}`) ?? otherwise].flat(2)[0];
  const [mass, stiffness] = [first("mass", 1000), first("stiffness", 1e6)];
  const three = (value) => [value, value, value];
  const last = draft.get("/dampers")?.at?.(-1) ?? initialScene().dampers[0];
  return {
    "/structure frame": {
      masses: three(mass),
      stiffnesses: three(stiffness),
      damping_ratio: 0.02,
    },
    "/excitation random": { band: [0, 15], rms: 1, seed: 1 },
    "/excitation sine": { frequency: 4, amplitude: 1 },
    "/dampers/N": structuredClone(last),
    "/study sensitivity": { restitution_deviation: 0.15, contact_time_deviation: 0.1 },
    "/study sweep": { axes: [axis(draft, "/dampers/0/clearance")] },
    "/study/axes/N": axis(draft, "/dampers/0/mass"),
  };
}

// A structure of another kind starts from where the last one did, the storeys below the top in proportion.
function fitStart(draft) {
  const pointer = "/excitation/displacement";
  const count = storeyCount(draft.scene);
  const top = [draft.get(pointer)].flat().at(-1);
  if (!top) return;
  const parts = Array.from({ length: count }, (_, at) => round((top * (at + 1)) / count));
  draft.set(pointer, count === 1 ? top : parts);
}

export function SceneForm({ schema, draft, widgets }) {
  const options = useMemo(
    () => ({
      start: (pointer, kind) => starts(draft)[kind ? `${pointer} ${kind}` : pointer],
      shows: (pointer) =>
        SHOWN.test(pointer) || (pointer.endsWith("/storey") && storeyCount(draft.scene) > 1),
      widgets: [...widgets, [/^\/study\/axes\/\d+\/pointer$/, axisField(schema)]],
    }),
    [schema, draft],
  );
  useEffect(
    () => draft.onChange(({ pointer }) => pointer === "/structure" && fitStart(draft)),
    [draft],
  );
  return STEPS.map((members) => {
    const [name] = members;
    const part =
      members.length > 1
        ? { schema, only: members, pointer: "" }
        : {
            pointer: `/${name}`,
            schema: schema.properties[name],
            required: schema.required.includes(name),
          };
    return html`<details class="panel step" open=${name !== "output"} key=${name}>
      <summary><h2>${title(members.join(", "))}</h2></summary>
      <${Help} name=${title(name)} />
      <${Form} draft=${draft} ...${options} ...${part} />
    </details>`;
  });
}
