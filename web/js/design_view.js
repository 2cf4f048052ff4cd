// Studies that design: the chart that the service draws, and the answer's lists as tables.
import { address, get, token } from "./api.js";
import { h, table } from "./dom.js";
import { lesson, member, metric, range, sceneLink, text, told, value } from "./study_bits.js";
import { title, words } from "./units.js";

const DOCUMENTS = { optimize: "optimum", calibrate: "calibration" };

const place = text("Member", ({ pointer }) => title(member(pointer)));
const all = (list) => list.map((one) => `${member(one.pointer)} ${told(one.value)}`).join(", ");
const values = text("Values", (one) => all(one.values));

const parts = {
  optimize: ({ best, given, undamped, objectives: goals, rivals, region, front, candidates, runs }, units) => [
    lesson(best ? `Best: ${all(best.values)}.` : "No candidate keeps the constraints.", `${candidates} candidates, ${runs} runs.`),
    best && table("Objectives", [metric, value("Best", "value"), range("interval_95")], units(best.objectives)),
    table("Gain", [metric, value("Best", "best"), value("Given", "given"), value("Without dampers", "undamped")],
      units(Object.entries(given.metrics).filter(([, one]) => one !== null)
        .map(([name, one]) => ({ metric: name, best: best?.metrics[name], given: one, undamped: undamped.metrics[name] })))),
    region.length > 0 && table("Within 2 % of the best", [place, value("From", "low"), value("To", "high")], region),
    rivals.length > 0 && table("Rivals: how much worse", [values, value("Difference", "difference"), range("interval_95")],
      units(rivals.map((one) => ({ ...one, metric: goals[0].metric })))),
    front.length > 0 && table("Best compromises", [values, ...units(goals).map((one, k) => value(title(one.metric), k, one.unit))],
      front.map((one) => ({ ...one, ...one.objectives })))],
  calibrate: ({ parameters, detail, residual_rms: residuals }) => [lesson(detail),
    table("Parameters", [place, value("Value", "value"), value("Standard error", "standard_error"), range("interval_95"),
      text("Identifiable", ({ identifiable }) => ({ true: "yes", false: "no" })[identifiable] ?? null)], parameters),
    residuals && table("Residuals", [text("Channel", ({ channel }) => words(channel)), value("RMS", "value")], residuals)],
  response: ({ points, unit }) => [table("Points", [value("Value", "value", unit),
    text("Direction", ({ direction }) => direction ?? "continuation"), text("Period [cycles]", ({ period }) => period),
    text("Impacts a period", (one) => one.impacts_per_period), text("Stable", ({ period, stable }) => period && (stable ? "yes" : "no")),
    value("Peak displacement", "peak_displacement", "m"), value("Without dampers", "undamped_peak_displacement", "m")], points)],
  fragility: ({ limits }, units) => [table("Limits", [metric, value("Limit", "value"), value("Median", "median", "m/s^2"), range("median_interval_95", "m/s^2"),
    value("Dispersion", "dispersion", ""), range("dispersion_interval_95", "")], units(limits))],
};

export function show(host, { path, result: { study, units } }) {
  const document = DOCUMENTS[study.kind] ?? study.kind, chart = address(`${path}/${document}.svg`);
  if (!token()) // a picture cannot carry one
    host.append(h("a", { href: chart }, h("img", { src: chart, alt: "Chart; the tables below have its numbers", class: "chart" })));
  host.append(...parts[study.kind](study, (rows) => rows.map((row) => ({ ...row, unit: units[row.metric] }))).filter(Boolean));
  if (study.best || study.parameters)
    host.append(h("p", null, sceneLink("Run the scene with these values", get(`${path}/${document}/scene`))));
  if (study.warnings?.length) host.append(lesson(...study.warnings.map(({ detail }) => detail)));
}
