// How exact a run is to be and what that costs: fields, and a slider over what a study measured on this scene.
import { link } from "./address.js";
import { follow, get, remove, submit } from "./api.js";
import { button, failure, fill, h } from "./dom.js";
import { form } from "./form.js";
import { number, quantity } from "./units.js";

const OTHERS = ["contact_model", "sample_rate", "duration", "segment"]; // change more than the accuracy
const tidy = (_, value) => (typeof value === "number" ? Number(value.toPrecision(12)) : value ?? undefined);
const say = ({ name, error, cost, isBest }) => `${name}: wrong by ${number(error * 100, 2)} % of the peak, ${
  quantity(cost, "s", 2)}. ${isBest ? "" : "Beaten: another way errs less and costs less."}`;

// The ways measured, the largest error first.
const stopsOf = ({ points }) => points.filter((point) => point.status === "measured" && point.errors.displacement !== null
  && OTHERS.every((name) => point[name] === null))
  .map(({ name, solver, step, tolerance, modes, cpu_minimum: cost, errors, is_best: isBest }) => ({ name, cost, isBest,
    error: errors.displacement, setting: JSON.parse(JSON.stringify({ solver, step, tolerance, modes }, tidy)) }))
  .sort((a, b) => b.error - a.error || b.cost - a.cost);

export function accuracyWidget({ pointer, schema, draft, options }) {
  const byHand = h("div"), fields = form(byHand, { ...options, widgets: [], schema, draft, pointer, label: "" });
  fields.leave(); // refreshed with this widget
  const slider = h("input", { type: "range", min: 0,
    oninput: () => draft.set(pointer, stops[slider.value].setting) });
  const lead = h("p"), said = h("p"), whole = h("a", null, "The whole measurement");
  const trade = h("div", null, lead, h("label", null, "From the crudest to the most exact", slider), said, whole);
  const act = button("", () => (job ? cancel() : measure()));
  const bar = h("progress", { max: 100, "aria-label": "Measuring" }), news = h("div.hint", { role: "status" });
  let stops = [], measured = null, job = null;

  // The scene without what the slider changes.
  const study = () => ({ ...draft.scene, accuracy: undefined, study: { kind: "tradeoff", repeats: 2 } });

  async function measure() {
    const asked = JSON.stringify(study());
    job = submit(study());
    fill(news, "Every solver runs this scene …");
    refresh();
    try {
      const now = await follow(await job, ({ progress }) => (bar.value = progress ?? 0), draft.signal);
      fill(news, now.status !== "successful" && (now.problem?.detail ?? "Cancelled: nothing was measured."));
      if (now.status === "successful") {
        stops = stopsOf(await get(`v1/results/${now.result}/tradeoff.json`));
        measured = asked;
        whole.href = link(`results/${now.result}`);
      }
    } catch (error) {
      fill(news, failure(error));
    }
    job = null;
    refresh();
  }
  const cancel = () => job.then(({ id }) => remove(`v1/jobs/${id}`)).catch(() => {}); // it may be done by now

  function refresh() {
    fields.refresh();
    act.textContent = job ? "Cancel" : "Measure the trade on this scene";
    bar.hidden = !job;
    trade.hidden = stops.length === 0;
    if (trade.hidden) return;
    const last = stops.length - 1, chosen = JSON.stringify(draft.get(pointer));
    const at = stops.findIndex(({ setting }) => JSON.stringify(setting) === chosen);
    slider.max = last;
    slider.value = at < 0 ? last : at;
    said.textContent = say(stops.at(at));
    slider.ariaValueText = said.textContent;
    const best = stops.filter(({ isBest }) => isBest).map(({ name }) => name).join("; ");
    lead.textContent = measured !== JSON.stringify(study()) ? "Measured on another scene."
      : `Worth having: ${best}. All others err and cost more.`;
  }
  refresh();
  return { element: h("div", null, byHand, trade, h("div.row", null, act, bar), news), refresh };
}
