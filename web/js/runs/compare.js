// Up to four results beside each other. In the address: a to d (results), and what comparison.js keeps there.
import { go, link, note, read, swap } from "../address.js";
import { follow, get, submit } from "../api.js";
import { Button, Failure, Help, IconButton, Loaded } from "../ui/controls.js";
import { pageOf } from "../ui/page.js";
import { html, useEffect, useReducer, useRef } from "../ui/preact.js";
import { useLoaded } from "../ui/store.js";
import { brief } from "../units.js";
import { idsOf, lettered, LETTERS, loadComparison } from "./compared.js";
import { Comparison } from "./comparison.js";
import { latest } from "./latest.js";

const LATEST = 60;
const PAIRS = [
  { label: "Sponge against aluminium", examples: ["paper_free_sponge", "paper_free_aluminium"] },
  { label: "Sponge against no damper", examples: ["no_damper", "paper_free_sponge"] },
  {
    label: "Contact with and without duration",
    examples: ["paper_free_sponge", "paper_free_impulse_sponge"],
  },
];

// Runs scenes to their ends; the ids of their results.
async function runAll(scenes) {
  const jobs = await Promise.all(scenes.map(submit));
  const ends = await Promise.all(jobs.map((job) => (job.finished ? job : follow(job, () => {}))));
  const failed = ends.find((job) => job.status !== "successful");
  if (failed) throw Object.assign(new Error("A run failed"), failed.problem);
  return ends.map((job) => job.result);
}

const runPair = async (examples) => {
  const scenes = await Promise.all(examples.map((name) => get(`v1/examples/${name}`)));
  go("compare", lettered(await runAll(scenes)));
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
      const label = labels[at] ?? `${"ABCD"[at]} ${brief(id)}`;
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
  const [, redraw] = useReducer((count) => count + 1, 0);
  const { query } = read();
  const ids = idsOf(query);
  const known = useLoaded(() => latest(LATEST), [ids.join()]);
  const loaded = useLoaded(
    (signal) => (ids.length > 1 ? loadComparison(ids, signal) : { runs: [] }),
    [ids.join()],
  );
  const change = (changes, push) => {
    note(changes, push);
    redraw();
  };
  // Without any named the last two are compared.
  useEffect(() => {
    const [b, a] = known.data?.keys() ?? [];
    if (a && idsOf(read().query).length === 0) swap("compare", { a, b });
  }, [known.data, address]);
  const isCurrent = !loaded.isLoading && loaded.data?.runs.length === ids.length;
  const labels = isCurrent ? loaded.data.runs.map(({ label }) => label) : [];
  return html`<div class="title-row">
      <h1>Compare</h1>
      <${Help} name="Compare" />
      <${Chosen} ids=${ids} labels=${labels} names=${known.data ?? new Map()} />
    </div>
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

export const page = pageOf(() => "Compare", ComparePage);
