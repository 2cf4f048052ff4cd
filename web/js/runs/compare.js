// Up to four results beside each other. In the address: a to d (results), and what comparison.js keeps there.
import { go, link, read, replace } from "../address.js";
import { get, runScene, getSchema } from "../api.js";
import { Button, Failure, IconButton, Loaded } from "../ui/controls.js";
import { pageOf, PageTitle } from "../ui/page.js";
import { html, useEffect, useRef } from "../ui/preact.js";
import { useLoaded, useQuery } from "../ui/hooks.js";
import { brief, uncapital } from "../units.js";
import { Comparison } from "./comparison.js";
import { differingNames, isSame, latestResults, LETTERS, lettered } from "./names.js";
import { inputsOf } from "../scene/inputs.js";
import { materialOf, valueText } from "./scene_name.js";

const LATEST = 60;
const PAIRS = [
  { label: "Sponge against aluminium", examples: ["paper_free_sponge", "paper_free_aluminium"] },
  { label: "Sponge against no damper", examples: ["no_damper", "paper_free_sponge"] },
  {
    label: "Contact with and without duration",
    examples: ["paper_free_sponge", "paper_free_impulse_sponge"],
  },
];

const idsOf = (query) => LETTERS.map((letter) => query[letter]).filter(Boolean);

const runPair = async (examples) => {
  const scenes = await Promise.all(examples.map((name) => get(`v1/examples/${name}`)));
  go("compare", lettered(await Promise.all(scenes.map(runScene))));
};

// What the paper compares, run with one click.
const Pairs = () =>
  html`<div class="row" role="group" aria-label="Comparisons of the paper">
    ${PAIRS.map(({ label, examples }) => html`<${Button} onClick=${() => runPair(examples)}>${label}<//>`)}
  </div>`;

// The compared results, each with its colour, and a list with a button to add one.
function Chosen({ ids, labels, names }) {
  // From the address: the page may not be drawn yet as it says.
  const set = (make) => go("compare", lettered(make(idsOf(read().query))));
  const list = useRef(null);
  const others = [...names].filter(([id]) => !ids.includes(id));
  return html`<div class="compared">
    ${ids.map((id, at) => {
      const label = labels[at] ?? `${LETTERS[at].toUpperCase()} ${brief(id)}`;
      return html`<span class="compared-run" style=${{ "--ink": `var(--c${at + 1})` }}>
        <span class="swatch"></span>
        <a href=${link(`results/${id}`)} title=${names.get(id)}>${label}</a>
        <${IconButton}
          label=${`Take ${label} out`}
          onClick=${() => set((now) => now.filter((one) => one !== id))}
          >×<//
        >
      </span>`;
    })}
    ${
      ids.length < LETTERS.length &&
      others.length > 0 &&
      html`<span class="add">
        <select key=${ids.join()} aria-label="Add a result" ref=${list}>
          ${others.map(([id, text]) => html`<option value=${id}>${text}</option>`)}
        </select>
        <${Button} label="Add it" onClick=${() => set((now) => [...now, list.current.value])}
          >Add<//
        >
      </span>`
    }
  </div>`;
}

function ComparePage({ address }) {
  const { query, change } = useQuery();
  const ids = idsOf(query);
  const known = useLoaded(() => latestResults(LATEST), [ids.join()]);
  const loaded = useLoaded(
    (signal) => (ids.length > 1 ? loadComparison(ids, signal) : { runs: [] }),
    [ids.join()],
  );
  // Without any named the last two are compared, unless the reader has just gone to another page.
  useEffect(() => {
    const [b, a] = known.data?.keys() ?? [];
    const { path, query: now } = read();
    if (a && path[0] === "compare" && idsOf(now).length === 0) replace("compare", { a, b });
  }, [known.data, address]);
  const isCurrent = !loaded.isLoading && loaded.data?.runs.length === ids.length;
  const labels = isCurrent ? loaded.data.runs.map(({ label }) => label) : [];
  return html`<${PageTitle} title="Compare">
      <${Chosen} ids=${ids} labels=${labels} names=${known.data ?? new Map()} />
    <//>
    ${known.error && html`<${Failure} error=${known.error} />`}
    ${
      ids.length < 2
        ? html`<section class="panel" aria-label="Begin">
            <p>
              ${ids.length === 0 ? "Choose two results or more, or begin with a pair of the paper:" : "Choose another one to see what differs, or begin with a pair of the paper:"}
            </p>
            <${Pairs} />
          </section>`
        : html`<${Loaded} loaded=${isCurrent || loaded.error ? loaded : { data: null }}>
            ${(comparison) => html`<${Comparison} comparison=${comparison} query=${query} change=${change} />`}
          <//>`
    }`;
}

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
async function loadComparison(ids, signal) {
  const [schema, ...runs] = await Promise.all([
    getSchema("scene"),
    ...ids.map((id) => loadRun(id, signal)),
  ]);
  const [first, ...others] = runs;
  const pairs = await Promise.all(
    others.map((other) => get("v1/compare", { a: first.result.id, b: other.result.id }, signal)),
  );
  const scenes = runs.map(({ result }) => result.scene);
  const names = differingNames(
    scenes.map((scene, at) => ({ scene, title: LETTERS[at].toUpperCase() })),
    schema,
    2,
  );
  runs.forEach((run, at) =>
    Object.assign(run, {
      color: `c${at + 1}`,
      label:
        `${LETTERS[at].toUpperCase()} ${uncapital(names[at] ?? materialOf(scenes[at]))}`.trim(),
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

export const page = pageOf(() => "Compare", ComparePage);
