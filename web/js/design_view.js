// Studies that design: optimize, calibrate, response and fragility. The chart that the service draws, and the answer's lists as tables.
import { address, get, token } from "./api.js";
import { figures, h, table } from "./dom.js";
import { column, lesson, sceneLink, told } from "./study_bits.js";
import { number, title } from "./units.js";

const DOCUMENTS = { optimize: "optimum", calibrate: "calibration", response: "response", fragility: "fragility" };

const member = ({ pointer }) => title(pointer.slice(1).replaceAll("/", " "));
const within = (interval) => (interval?.[0] != null ? `${number(interval[0], 4)} to ${number(interval[1], 4)}` : "–");
const values = (list) => list.map((one) => `${member(one)} ${told(one.value)}`).join(", ");
const text = (label, cell) => ({ label, cell });

const parts = {
  optimize: ({ best, rivals, region, front, candidates, runs }) => [
    lesson(best ? `Best: ${values(best.values)}.` : "No candidate keeps the constraints.", `${candidates} candidates, ${runs} runs.`),
    best && figures(best.objectives.map(({ metric, value, interval_95: interval }) =>
      [title(metric), `${number(value, 5)}${interval?.length ? ` (${within(interval)})` : ""}`])),
    region.length > 0 && table("Within 2 % of the best", [text("Member", member), column("From", null, ({ low }) => low),
      column("To", null, ({ high }) => high)], region),
    rivals.length > 0 && table("Rivals: how much worse, over the same runs", [text("Values", (one) => values(one.values)),
      column("Difference", null, ({ difference }) => difference), text("95 %", (one) => within(one.interval_95))], rivals),
    front.length > 0 && table("Neither objective can improve without the other", [text("Values", (one) => values(one.values)),
      column("First", null, (one) => one.objectives[0]), column("Second", null, (one) => one.objectives[1])], front)],
  calibrate: ({ parameters, detail, residual_rms: residuals }) => [lesson(detail),
    table("Parameters", [text("Member", member), column("Value", null, ({ value }) => value),
      column("Standard error", null, (one) => one.standard_error), text("95 %", (one) => within(one.interval_95)),
      text("Identifiable", ({ identifiable }) => (identifiable ? "yes" : "no"))], parameters),
    residuals && h("p", null, `Residual, rms of each channel: ${residuals.map(({ channel, unit, value }) => `${channel} ${told(value, unit)}`).join(", ")}.`)],
  response: ({ points }) => [table("Points of the curve", [column("Value", null, ({ value }) => value),
    text("Direction", ({ direction }) => direction ?? "continuation"), text("Period [cycles]", ({ period }) => period ?? "none found"),
    text("Impacts a period", (one) => one.impacts_per_period), text("Stable", ({ period, stable }) => (period === null ? "–" : stable ? "yes" : "no")),
    column("Peak displacement", "m", (one) => one.peak_displacement), column("Without dampers", "m", (one) => one.undamped_peak_displacement)], points)],
  fragility: ({ limits, curves }) => [lesson(`${curves.length} ground motions.`),
    table("Limits", [text("Metric", ({ metric }) => title(metric)), column("Limit", null, ({ value }) => value),
      column("Median", "m/s^2", ({ median }) => median), text("95 %", (one) => within(one.median_interval_95)),
      column("Dispersion", null, ({ dispersion }) => dispersion), text("95 % ", (one) => within(one.dispersion_interval_95))], limits)],
};

export function show(host, { path, result: { study } }) {
  const document = DOCUMENTS[study.kind], chart = address(`${path}/${document}.svg`);
  if (!token()) // a picture cannot carry one
    host.append(h("a", { href: chart }, h("img", { src: chart, alt: `Chart of the ${document}; the tables below have its numbers`, class: "chart" })));
  host.append(...parts[study.kind](study).filter(Boolean));
  if (study.best || study.parameters)
    host.append(h("p", null, sceneLink("Run the scene with these values", get(`${path}/${document}/scene`))));
  if (study.warnings?.length) host.append(lesson(...study.warnings.map(({ detail }) => detail)));
}
