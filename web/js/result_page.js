// A result by its URL: what was asked, what came out, and views of it that share one window of time.
// Sections of a simulation's result are listed here, in their order; a study's kind has a module, loaded when it is met.
import { note, read } from "./address.js";
import { get } from "./api.js";
import { failure, fill, h, notice } from "./dom.js";
import { Ledger } from "./ledger.js";
import { sceneLink } from "./study_bits.js";
import { section as animation } from "./animation.js";
import { section as impacts } from "./impacts_view.js";
import { section as plan } from "./plan_view.js";
import { section as series } from "./series_view.js";
import { section as spectrum } from "./spectrum_view.js";
import { energy, section as summary } from "./summary_view.js";
import { section as take } from "./take_view.js";

// A section is {id, title, show(host, context) -> controller}; the controller may have follow(view) and leave().
const sections = [summary, series, animation, impacts, spectrum, energy, plan, take];
const STUDIES = { compare: "Contact models side by side", sensitivity: "What errors of the buffers do",
  tradeoff: "Error against cost", sweep: "Many points", ensemble: "Many seeds" };

async function showStudy(host, context) {
  const { scene, study: { kind } } = context.result, view = await import(`./${kind}_view.js`);
  const controller = await view.show(host, context);
  host.append(h("p", null, sceneLink("Change the study", scene)));
  return controller;
}

// What sections share: the result's document and path, the view (the URL's query), its latest jobs (a promise), its impacts.
class Context {
  parts = []; // {controller, faults}: what each section returned, and where it says what went wrong
  constructor(result, view, signal) {
    Object.assign(this, { result, view, signal, path: `v1/results/${result.id}` });
    this.ledger = new Ledger(this);
    this.jobs = get("v1/jobs", { result: result.id, limit: 20 }).then(({ jobs }) => jobs);
  }

  // change({from: 1, to: 2}, true): the URL and every section follow; null takes one out; with `push` "back" undoes it.
  change(changes, push = false) {
    note(changes, push);
    this.follow(read().query);
  }

  follow(view) {
    this.view = view;
    for (const part of this.parts) this.lead(part);
  }
  lead(part) {
    attempt(part, () => part.controller?.follow?.(this.view));
  }

  // The window of time in view, whole unless the URL says otherwise.
  get window() {
    const end = (this.result.count - 1) / this.result.sample_rate;
    const within = (text, initial) => Math.min(end, Math.max(0, Number.isFinite(Number(text)) ? Number(text) : initial));
    const from = within(this.view.from ?? 0, 0), to = within(this.view.to ?? end, end);
    return from < to ? { from, to, end } : { from: 0, to: end, end };
  }
}

// One section that fails leaves the others alone, and says so where it stands.
async function attempt({ faults }, act) {
  try {
    fill(faults);
    return await act();
  } catch (error) {
    if (error.name !== "AbortError") fill(faults, failure(error));
  }
}

export const page = {
  title: (address) => `Result ${address.path[1].slice(0, 10)}`,
  async show(host, address, signal) {
    fill(host, h("h1", null, "Result"), "Loading …");
    const result = await get(`v1/results/${encodeURIComponent(address.path[1])}`);
    const context = new Context(result, address.query, signal), heading = h("h1", null, "Result");
    fill(host, heading);
    // A title is a job's; the result is that of all equal scenes.
    context.jobs.then((jobs) => (heading.textContent = jobs.find((job) => job.title)?.title ?? "Result"), () => {});
    if (result.warnings.length > 0)
      host.append(notice("warn", result.warnings.length === 1 ? "A warning" : `${result.warnings.length} warnings`,
        h("ul", null, result.warnings.map((warning) => h("li", null, warning.detail)))));
    const chosen = result.study ? [{ id: "study", title: STUDIES[result.study.kind], show: showStudy }, take] : sections;
    const shown = chosen.map(async (section) => {
      const inner = h("div"), part = { faults: h("div") };
      host.append(h("section", { class: "panel", id: section.id, "aria-labelledby": `${section.id}-title` },
        h("h2", { id: `${section.id}-title` }, section.title), part.faults, inner));
      const { view } = context;
      part.controller = await attempt(part, () => section.show(inner, context));
      context.parts.push(part);
      if (context.view !== view) context.lead(part); // it changed meanwhile
    });
    await Promise.all(shown);
    return {
      change: (next) => context.follow(next.query),
      leave: () => context.parts.forEach(({ controller }) => controller?.leave?.()),
    };
  },
};
