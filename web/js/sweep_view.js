// The points of a sweep so far: over two axes a map, over one of numbers a line, else a table. Each opens.
import { note, read } from "./address.js";
import { get, post, submit } from "./api.js";
import { button, figures, fill, folded, h, hint, notice, table } from "./dom.js";
import { heat } from "./heat.js";
import { plot } from "./plot.js";
import { jobButton, member, sceneLink, told } from "./study_bits.js";
import { title, words } from "./units.js";

export const show = (host, { path, result: { study } }) => (study.points <= 100000 ? sweepView(host, `${path}/table.json`)
  : void host.append("Too many points to draw: save them as CSV or NPZ."));

// Shows the table at `path`, a result's or that of the job `job`, by the URL's metric and point -> {refresh(), follow()}.
export async function sweepView(host, path, job) {
  let answer, points, drawn = "", opened = null; // points by their indices: {index, status, a value for each axis and metric}
  async function load() {
    answer = await get(path);
    const columns = Object.entries(answer.columns);
    points = new Map(answer.columns.index.values.map((index, row) =>
      [index, Object.fromEntries(columns.map(([key, { values }]) => [key, values[row]]))]));
  }
  await load();
  // A field, an axis or a metric, is a column of dom.js' table too.
  const field = (key, si, name = key) => ({ key, si, name: words(name), label: title(name), numeric: true,
    value: (point) => point?.[key] ?? null, cell: (point) => told(point[key], si) });
  const metrics = Object.keys(answer.columns).filter((key) => !/^(index|status|\/.*)$/.test(key))
    .map((key) => field(key, answer.columns[key].unit));
  const axes = answer.axes.map(({ pointer, unit, values }, at) => ({ values, texts: values.map((value) => told(value, unit)),
    ...field(pointer, unit, member(pointer)),
    step: answer.axes.slice(at + 1).reduce((product, axis) => product * axis.values.length, 1) }));
  const fields = [...axes, ...metrics, field("status")];
  const place = (point) => axes.map((axis) => `${axis.name} ${axis.cell(point)}`).join(", ");
  const [x, y, more] = axes.filter(({ values }) => values.length > 1).reverse();
  const isDrawn = answer.mode === "grid" && x && !more && (y || typeof x.values[0] === "number");
  const pointAt = (i, j) => points.get(i * x.step + (y ? j * y.step : 0));

  const state = h("div"), box = h("div"), opening = h("div", { tabindex: "-1", role: "group", "aria-label": "Point" });
  const select = h("select", { onchange: () => change({ metric: select.value }) },
    metrics.map(({ key, label }) => h("option", { value: key }, label)));
  const change = (changes, push) => (note(changes, push), follow());
  const pick = (point) => point && (change({ point: point.index }, true), opening.focus());
  fill(host, state, isDrawn && h("p", null, h("label", null, "Number ", select)), box, opening,
    folded("All points as a table", all, !isDrawn));

  function follow() {
    const { query } = read(), metric = metrics.find(({ key }) => key === query.metric) ?? metrics[0];
    const wanted = [metric.key, answer.done, y && query.point].join();
    const failed = answer.failures.map((one) => h("p", null, `${one.count} from point ${one.first_point} on: ${one.detail}`));
    if (wanted !== drawn) fill(state, h("p", null, `${answer.done} of ${answer.points} points.`), answer.failed > 0
      && notice("warn", `${answer.failed} failed`, failed, jobButton("Make the failed ones again", retry)));
    select.value = metric.key;
    if (isDrawn && wanted !== drawn) draw(metric, query.point);
    drawn = wanted;
    if (query.point !== opened) open(opened = query.point);
  }
  const retry = async () => // of the job that made it
    post(`v1/jobs/${job ?? (await get("v1/jobs", { result: answer.result, kind: "sweep" })).jobs[0].id}/retry`);
  function draw({ label, name, si, value, cell }, chosen) {
    const made = [...points.values()].filter((point) => value(point) !== null).sort((a, b) => value(a) - value(b));
    const ends = [made[0], made.at(-1)].filter(Boolean), [low, high] = ends.map(value), isLog = low > 0 && high > 50 * low;
    const summary = ends.map((point) => `${cell(point)} at ${place(point)}`).join(" to ");
    fill(box);
    if (!y) return plot(box, { title: label, summary, height: 340, at: x.values, onPick: (_, i) => pick(pointAt(i)),
      series: [{ label: name, y: x.values.map((_, i) => value(pointAt(i))) }],
      x: { label: x.label, unit: x.si }, y: { label, unit: si, log: isLog } });
    const show = (i, j, point = pointAt(i, j)) => ({ value: value(point), isChosen: `${point?.index}` === chosen,
      pick: () => pick(point),
      text: point ? `${place(point)}: ${value(point) === null ? point.status : cell(point)}` : "Not there yet" });
    box.append(hint(summary), heat({ title: `${label}: ${y.name} up, ${x.name} across`,
      x: x.texts, y: y.texts, ends: ends.map(cell), isLog, cell: show }));
  }
  function all() {
    const opener = (point) => button(point.index, () => pick(point), { class: "quiet" });
    return table(`${answer.done} points, up to 1000 of them here`, [{ ...field("index", "", "point"), cell: opener }, ...fields],
      [...points.values()].slice(0, 1000), { sort: true });
  }
  function open(index) {
    const point = points.get(Number(index)), scene = answer.links.scene.replace("{index}", index);
    fill(opening, point ? [h("h3", null, `Point ${index}`), figures(fields.map(({ label, cell }) => [label, cell(point)])),
      jobButton("Run this point", async () => submit(await get(scene))), " ", sceneLink("Change its scene", get(scene))]
      : hint("A click or Enter opens a point."));
  }
  follow();
  return { follow, refresh: () => load().then(() => box.contains(document.activeElement) || follow()) };
}
