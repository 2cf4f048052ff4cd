// A result by its URL: views of it that share one window of time; of a study the view of its kind, with the scene's run below.
import { note, read } from "./address.js";
import { get } from "./api.js";
import { failure, fill, folded, h, help, notice, panel } from "./dom.js";
import { Ledger } from "./ledger.js";
import { sceneLink } from "./study_bits.js";
import { section as animation } from "./animation.js";
import { section as impacts } from "./impacts_view.js";
import { section as plan } from "./plan_view.js";
import { section as series } from "./series_view.js";
import { section as spectrum } from "./spectrum_view.js";
import { energy, section as summary } from "./summary_view.js";
import { section as take } from "./take_view.js";

// A section is {title, show(host, context) -> controller}; the controller may have follow(view) and leave().
const sections = [summary, series, animation, impacts, spectrum, energy, plan];

const STUDIES = { compare: "Contact models side by side", sensitivity: "What errors of the buffers do",
  tradeoff: "Error against cost", sweep: "Many points", ensemble: "Many runs", optimize: "The best values",
  calibrate: "Parameters fitted to a measurement", response: "Response curve", fragility: "Fragility" };
const DESIGN = ["optimize", "calibrate", "response", "fragility"]; // share a view

async function showStudy(host, context) {
  const { scene, study: { kind } } = context.result, view = await import(`./${DESIGN.includes(kind) ? "design" : kind}_view.js`);
  const controller = await view.show(host, context);
  host.append(h("p", null, sceneLink("Change the study", scene)), help("this study", `study-${kind}`));
  return controller;
}

// What sections share: the result and its path, the view (the URL's query), its latest jobs (a promise), its impacts.
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
  title: ({ path }) => `Result ${path[1].slice(0, 10)}`,
  async show(host, address, signal) {
    fill(host, h("h1", null, "Result"), "Loading …");
    const result = await get(`v1/results/${encodeURIComponent(address.path[1])}`);
    const context = new Context(result, address.query, signal), heading = h("h1", null, "Result");
    fill(host, heading);
    // A title is a job's; the result is that of all equal scenes.
    context.jobs.then((jobs) => (heading.textContent = jobs.find((job) => job.title)?.title ?? "Result"), () => {});
    if (result.warnings.length > 0)
      host.append(notice("warn", "Warnings", h("ul", null, result.warnings.map((warning) => h("li", null, warning.detail)))));
    const open = (inner, chosen) => Promise.all(chosen.map(async (section) => {
      const box = h("div"), part = { faults: h("div") };
      inner.append(panel(section.title, part.faults, box));
      const { view } = context;
      part.controller = await attempt(part, () => section.show(box, context));
      context.parts.push(part);
      if (context.view !== view) context.lead(part); // it changed meanwhile
    }));
    await open(host, [...(result.study ? [{ title: STUDIES[result.study.kind], show: showStudy }] : sections), take]);
    if (result.study) host.append(folded("The run of the unchanged scene, without the study", () => {
      const inner = h("div");
      open(inner, sections);
      return inner;
    }));
    return {
      change: (next) => context.follow(next.query),
      leave: () => context.parts.forEach(({ controller }) => controller?.leave?.()),
    };
  },
};
