// A study of kind "tradeoff": error against CPU time of every way to run this scene, and which to take.
import { table } from "./dom.js";
import { plot } from "./plot.js";
import { column, lesson, plain, sceneLink } from "./study_bits.js";
import { number, title, words } from "./units.js";

export function show(host, { result: { scene, study: { metric, points, recommendation, error: wanted } } }) {
  const unit = metric === "psd" ? "dB" : "", label = `Error of ${words(metric)}`, taken = points[recommendation.point - 1];
  const error = (point) => point.errors[metric], time = (point) => point.cpu_minimum;
  const links = new Map(points.map((point) => [point, sceneLink(point.name, applied(scene, point))]));
  const why = recommendation.why.replace(/\d[\d.]*e-?\d+/g, (text) => number(Number(text)));
  host.append(lesson(`${taken ? `Take ${taken.name}. ` : ""}${title(why)}.`,
    taken && sceneLink("Use it in the scene", applied(scene, taken))));

  // Ways that differ in a number alone are joined, the cheapest first; dashed where all are beaten in both.
  const measured = points.filter((point) => time(point) > 0 && error(point) !== null).sort((a, b) => time(a) - time(b));
  const series = [...Map.groupBy(measured, ({ name }) => name.replace(/ [\d.e-]+( \w+)?$/, " …"))].map(([name, ways], at) =>
    ({ label: name, color: (at % 8) + 1, ways, x: ways.map(time), y: ways.map(error), dash: !ways.some((way) => way.is_best) }));
  plot(host, { title: "Error against cost", height: 360, x: { label: "CPU time of a run", unit: "s", log: true },
    y: { label, unit, log: true }, series, onPick: (at, index) => links.get(series[at].ways[index]).focus(),
    lines: [{ y: wanted, label: "wanted" }, ...(taken ? [{ x: time(taken), label: "recommended" }] : [])],
    summary: "Down and to the left is better. A point leads to its row below." });
  host.append(table("Ways to run this scene, each a link to use it", [
    { label: "Way", value: ({ name }) => name, cell: (point) => links.get(point) },
    column("CPU time", "s", time), column(label, unit, error),
    { label: "Note", value: (point) => point.why ?? (point === taken ? "recommended"
      : point.is_best || error(point) === null ? "" : "beaten in both") },
  ], points, { sort: true }));
}

// The scene run this way.
function applied(scene, way) {
  const known = (...names) => Object.fromEntries(names.filter((name) => way[name] !== null).map((name) => [name, way[name]]));
  const { overlap, ...psd } = scene.output.psd ?? {};
  return { ...plain(scene), ...known("sample_rate", "duration"), accuracy: known("solver", "step", "tolerance", "modes"),
    ...(way.contact_model && { contact: { model: way.contact_model } }),
    ...(way.segment && { output: { ...scene.output, psd: { ...psd, segment: way.segment } } }) };
}
