// From a drop test to a revision that can be simulated with: readings typed, what they come to while typing, kept, and proposed
// as the next revision.
import { go, link } from "./address.js";
import { ask, post, schema } from "./api.js";
import { makeDraft } from "./draft.js";
import { figures, fill, h, hint, notice, panel } from "./dom.js";
import { dropGrid } from "./drop_grid.js";
import { form } from "./form.js";
import { refusal, writeForm } from "./material_form.js";
import { path, QUANTITIES, range, readMaterial } from "./material_parts.js";
import { traceWidget } from "./trace_view.js";
import { quantity } from "./units.js";

// What a test comes to: e and T_c with their intervals, and warnings.
function results({ evaluation, warnings }) {
  const known = QUANTITIES.filter(([name]) => evaluation?.[name].count > 0).map(([name, label, unit]) => {
    const { mean, low, high, why, count, outliers } = evaluation[name];
    return [label, [quantity(mean, unit),
      hint(low === null ? why : `95 %: ${range(low, high, unit)}`, `; readings: ${count}, far off: ${outliers}`)]];
  });
  return [known.length > 0 ? figures(known) : "Nothing counts yet.",
    warnings.map(({ detail }) => hint(detail))];
}

// The first step: the readings, and what they come to.
async function entry(host, { slug }, signal) {
  const draft = makeDraft({}, signal), fields = h("div"), outcome = h("div");
  const out = h("div", { role: "status" }, "Heights or speeds give e, durations or force traces T_c.");
  const button = h("button.primary", { onclick: keep }, "Keep this test (Ctrl+Enter)");
  const refused = refusal(draft, fields, outcome);
  let turn = 0, timer;

  // Whether it was answered; what was typed meanwhile is asked for anew.
  async function send(query, answered, moves) {
    const mine = ++turn;
    clearTimeout(timer);
    fill(outcome, "Wait …");
    try {
      const answer = await post(path(slug, "/measurements"), draft.scene, { query });
      if (mine === turn) answered(answer);
      return true;
    } catch (error) {
      if (mine === turn) refused(error, moves);
    }
  }
  function evaluated(answer) {
    fill(out, results(answer));
    fill(outcome);
    draft.say(answer, []);
  }
  async function keep() {
    button.disabled = true; // a test that is kept stays for good
    button.disabled = await send({}, ({ measurement }) => go(`materials/${slug}/measure`, { measurement }), true);
  }
  form(fields, { schema: await schema("measurement"), draft, shows: (pointer) => /^.(drops|traces)/.test(pointer),
    widgets: [[/^.drops$/, dropGrid], [/^.traces.\d+.force$/, traceWidget],
      [/interval$/, () => ({ element: h("div", { hidden: true }), refresh() {} })]] }); // a trace's file tells it
  fill(host, h("div.columns", { onkeydown: (event) => event.key === "Enter" && event.ctrlKey && button.click() },
    panel("What was read", fields), panel("Result", out, button, outcome)));
  draft.onChange(({ pointer }) => {
    if (pointer === undefined || button.disabled) return;
    turn++;
    clearTimeout(timer);
    if (!draft.scene.traces?.some(({ force }) => !force)) // its file is yet to be chosen
      timer = setTimeout(send, 400, { dry_run: 1 }, evaluated);
  });
  fields.querySelector("tbody input").focus();
  return { leave: () => clearTimeout(timer) };
}

// The second step: the revision that a test proposes, one click from being made.
async function proposal(host, material, measurements) {
  const answer = await ask("GET", path(material.slug, "/proposal"), { query: { measurements } }), found = await answer.json();
  const seen = { ...material, etag: answer.headers.get("ETag") };
  fill(host, h("div.columns", null, panel(`What comes of test ${measurements}`, found.revision === null
    ? notice("warn", "No revision", h("p", null, found.why))
    : await writeForm("material_revision", found.revision, `Make it revision ${seen.latest + 1}`, seen, "/revisions")),
  panel("Result", results(found))));
  host.querySelector("form > button")?.focus();
}

export const page = {
  title: ({ path: [, slug] }) => `Drop test of ${slug}`,
  async show(host, { path: [, slug], query: { measurement } }, signal) {
    const inner = h("div"), material = await readMaterial(slug);
    fill(host, h("h1", null, "Drop test of ", h("a", { href: link(`materials/${slug}`) }, material.name)), inner);
    return measurement ? proposal(inner, material, measurement) : entry(inner, material, signal);
  },
};
