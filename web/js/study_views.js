// What a study's result shows: the module of its kind, loaded when it is met.
import { h } from "./dom.js";
import { sceneLink } from "./study_bits.js";
import { section as take } from "./take_view.js";

const titles = { compare: "Contact models side by side", sensitivity: "What errors of the buffers do",
  tradeoff: "Error against cost", sweep: "Many points", ensemble: "Many seeds" };

// Sections for result_page.js: {id, title, show(host, context) -> controller}.
export function studyViews({ scene, study: { kind } }) {
  async function show(host, context) {
    const view = await import(`./${kind}_view.js`), controller = await view.show(host, context);
    host.append(h("p", null, sceneLink("Change the study", scene)));
    return controller;
  }
  return [{ id: "study", title: titles[kind], show }, take];
}
