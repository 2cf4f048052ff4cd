// From a drop test to a revision that can be simulated with: readings typed, what they come to while typing, kept, and proposed
// as the next revision.
import { go, link } from "./address.js";
import { ask, post, schema } from "./api.js";
import { makeDraft } from "./draft.js";
import { failure, figures, fill, h, hint, notice, panel } from "./dom.js";
import { dropGrid } from "./drop_grid.js";
import { form } from "./form.js";
import { writeForm } from "./material_form.js";
import { path, QUANTITIES, range, readMaterial } from "./material_parts.js";
import { traceWidget } from "./trace_view.js";
import { quantity } from "./units.js";

// What a test comes to: e and T_c with their intervals, and warnings.
function results({ evaluation, warnings }) {
  const known = QUANTITIES.filter(([name]) => evaluation?.[name].count > 0).map(([name, label, unit]) => {
    const { mean, low, high, why, count, outliers } = evaluation[name];
    return [label, [quantity(mean, unit),
      hint(low === null ? why : `95 %: ${range(low, high, unit)}`, `; ${count} readings, ${outliers} far off`)]];
  });
  return [known.length > 0 ? figures(known) : "Nothing counts yet.",
    warnings.map(({ detail }) => hint(detail))];
}

// The first step: the readings, and what they come to.
async function entry(host, { slug }, signal) {
  const draft = makeDraft({}, signal);
  const fields = h("div"), out = h("div"), outcome = h("div");
  const button = h("button", { class: "primary", onclick: keep }, "Keep this test (Ctrl+Enter)");
  const send = (query) => post(path(slug, "/measurements"), draft.scene, { query });
  let turn = 0, timer;
  function refused(error) {
    draft.say(null, error.errors ?? []);
    fill(outcome, failure(error));
  }
  async function evaluate() {
    const mine = ++turn, answer = await send({ dry_run: 1 }).catch((error) => mine === turn && refused(error));
    if (!answer || mine !== turn) return;
    fill(out, results(answer));
    draft.say(answer, []);
    fill(outcome);
  }
  async function keep() {
    button.disabled = true; // a test that is kept stays for good
    clearTimeout(timer);
    turn++;
    try {
      go(`materials/${slug}/measure`, { measurement: (await send()).measurement });
    } catch (error) {
      refused(error);
      fields.querySelector("[aria-invalid=true]")?.focus();
      button.disabled = false;
    }
  }
  form(fields, { schema: await schema("measurement"), draft, shows: (pointer) => /^.(drops|traces)/.test(pointer),
    widgets: [[/^.drops$/, dropGrid], [/^.traces.\d+.force$/, traceWidget]] });
  fill(host, h("div", { class: "columns", onkeydown: (event) => event.key === "Enter" && event.ctrlKey && button.click() },
    panel("What was read", fields), panel("What it comes to", out, button, outcome)));
  draft.onChange(({ pointer }) => {
    if (pointer === undefined || draft.scene.traces?.some(({ force }) => !force)) return; // its file is yet to be chosen
    clearTimeout(timer);
    timer = setTimeout(evaluate, 400);
  });
  fields.querySelector("tbody input").focus();
  return { leave: () => clearTimeout(timer) };
}

// The second step: the revision that a test proposes, one click from being made.
async function proposal(host, material, measurements) {
  const answer = await ask("GET", path(material.slug, "/proposal"), { query: { measurements } }), found = await answer.json();
  const seen = { ...material, etag: answer.headers.get("ETag") };
  fill(host, h("div", { class: "columns" }, panel(`What comes of test ${measurements}`, found.revision === null
    ? notice("warn", "No revision", h("p", null, found.why))
    : await writeForm("material_revision", found.revision, `Make it revision ${seen.latest + 1}`, seen, "/revisions")),
  panel("What it comes to", results(found))));
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
