// One chart: uPlot's lines with units, marks, values at the cursor, zoom, a summary and a table. Nothing else knows uPlot.
import uPlot from "../vendor/uplot/uPlot.esm.js";
import { button, fill, folded, fresh, h, table, tell } from "./dom.js";
import { number, pretty, quantity } from "./units.js";
import { axis, decorate, ink } from "./plot_ink.js";
import { extent } from "./study_bits.js";

const HELP = "Drag to zoom. Keys: + − 0 zoom, ← → cursor, with Shift window, Page Up/Down to marks, Enter opens.";
const MOST_ROWS = 1000;
const isShown = (value, log) => Number.isFinite(value) && (!log || value > 0);

// A range that holds the values, with this part of it to either side.
function padded(values, log, part) {
  if (values.length === 0) return [0.1, 10];
  const [low, high] = extent(values);
  if (part === 0 && low < high) return [low, high];
  return log ? uPlot.rangeLog(low, high, 10, false) : uPlot.rangeNum(low, high, part, false);
}

// plot(host, {title, summary, x: {label, unit, log}, y, height, series, at, markers, spans, lines, range, whole, group, onZoom,
// onPick}) -> {set(changes), destroy()}. A series is {label, color, y or low and high, x or that in `at`, dash, points, width};
// `whole` is the range without zoom; charts of a group share their cursor. onZoom(from, to): as chosen, null for the whole.
export function plot(host, given) {
  const state = { markers: [], spans: [], lines: [], series: [], height: 220, ...given }, { title } = state;
  const id = fresh("plot"), stop = new AbortController();
  let chart = null, xs = [], columns = [], settling, telling, isDue;

  const legend = h("div.legend", { "aria-hidden": "true" }), place = h("span.quiet"), behind = h("div");
  const summary = h("p.hint", { id: `${id}-summary` });
  const box = h("div.plot", { tabindex: "0", role: "application", "aria-label": title,
    "aria-describedby": `${id}-summary`, onkeydown: key });
  const tools = [["Whole", "Show the whole", () => choose()], ["+", "Zoom in", () => turn(0.5)],
    ["−", "Zoom out", () => turn(2)]].map(([text, what, act]) =>
    button(text, act, { class: "quiet", "aria-label": `${what}: ${title}`, title: what }));
  const figure = h("figure.chart", { "aria-label": title }, h("div.row", null, h("h3", null, title),
    h("div.tools", null, tools)), summary, legend, box, behind);
  host.append(figure);

  // uPlot wants columns over one x: undefined is nothing, null a gap. A second value at an x stands right beside the first; a
  // band is two columns.
  function arrange() {
    const rows = new Map(); // x -> [value, index in its series] of each column
    columns = state.series.flatMap((one, at) => (one.low
      ? ["low", "high"].map((name) => ({ ...one, at, label: `${one.label}, ${name}`, y: one[name] })) : { ...one, at }));
    columns.forEach(({ x: places = state.at ?? [], y }, c) => places.forEach((x, k) => {
      if (!isShown(x, state.x.log)) return;
      while (rows.get(x)?.[c]) x += Math.abs(x) * 1e-12 || 1e-12;
      if (!rows.has(x)) rows.set(x, []);
      rows.get(x)[c] = [isShown(y[k], state.y.log) ? y[k] : null, k];
    }));
    xs = [...rows.keys()].sort((a, b) => a - b);
    columns.forEach((column, c) => {
      const [values, indices] = [0, 1].map((part) => xs.map((x) => rows.get(x)[c]?.[part]));
      Object.assign(column, { values, indices, shown: h("b") });
    });
  }

  const placed = (x) => quantity(x, state.x.unit, 6), said = (y) => quantity(y, state.y.unit);
  const whole = () => state.whole ?? padded(xs, state.x.log, state.onPick || state.series.some((one) => one.points) ? 0.03 : 0);
  const inView = () => state.range ?? whole();
  const reach = (u, low, high) => // of what is in view
    padded([low, high, ...state.lines.map((line) => line.y)].filter((value) => isShown(value, state.y.log)), state.y.log, 0.07);

  function build() {
    const { width = 600, cursor: { left = -10 } = {} } = chart ?? {}; // stay
    chart?.destroy();
    const series = columns.map(({ color = 1, low, dash, points, width = low ? 1 : 1.5 }) => {
      const stroke = () => ink(`c${color}`);
      return { stroke, width, dash: dash && [6, 4], paths: points && (() => null),
        points: { size: 8, fill: stroke, ...(points || low ? { show: !low } : {}) } };
    });
    const bands = columns.flatMap(({ y, high, color = 1 }, c) => (y !== high ? []
      : { series: [c + 1, c], fill: () => `color-mix(in srgb, ${ink(`c${color}`)} 35%, transparent)` }));
    const scale = ({ log }, range) => ({ time: false, distr: log ? 3 : 1, range });
    chart = new uPlot({
      width, height: state.height, legend: { show: false }, padding: [22, 24, 0, 0],
      scales: { x: scale(state.x, inView), y: scale(state.y, reach) }, axes: [axis(state.x, "x"), axis(state.y, "y")],
      series: [{}, ...series], bands,
      cursor: { left, top: 9, y: false, drag: { setScale: false, dist: 5 }, bind: { dblclick: () => () => choose() },
        sync: { key: state.group ?? id, scales: ["x", null], filters: { pub: (type) => type === "mousemove" } } },
      hooks: { draw: [(u) => decorate(u, state)], setCursor: [showValues], setSelect: [select] },
    }, [xs, ...columns.map((column) => column.values)], box);
    chart.over.addEventListener("click", () => pick(chart.cursor.top)); // uPlot keeps back that of a drag
  }

  function showValues() {
    columns.forEach(({ shown, values, y, high }, c) => {
      const value = values[chart.cursor.idxs[c + 1]];
      shown.textContent = isShown(value) ? `${y === high ? "… " : ""}${said(value)}` : "";
    });
    const x = cursorX(), mark = markAt();
    place.textContent = x === null ? "" : `at ${placed(xs[chart.cursor.idx] ?? x)}${mark ? ` · ${mark.label}` : ""}`;
  }
  const across = (value) => chart.valToPos(value, "x"), valueAt = (left) => chart.posToVal(left, "x");
  const cursorX = () => (chart?.cursor.left >= 0 ? valueAt(chart.cursor.left) : null);
  const away = (x) => Math.abs(across(x) - chart.cursor.left);
  const markAt = () => state.markers.find((mark) => away(mark.x) < 6);

  function show() {
    const [min, max] = inView();
    chart.setScale("x", { min, max });
    summary.textContent = state.summary ?? reached();
  }
  // The window, in pixels; told to the owner when the reader rests.
  function choose(places) {
    state.range = places?.map((left) => Number(valueAt(left).toPrecision(8)));
    show();
    clearTimeout(settling);
    settling = setTimeout(() => {
      settling = 0;
      if (box.isConnected) state.onZoom?.(...(state.range ?? [null, null]));
    }, 200);
  }
  function select() {
    const { left, width } = chart.select;
    chart.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    choose([left, left + width]);
  }
  // So many times as wide about the cursor, moved by so much of itself.
  function turn(factor, shift = 0) {
    const [first, last] = whole().map(across), width = chart.over.clientWidth, { left } = chart.cursor;
    const span = Math.max(width * factor, (last - first) * 1e-6), about = left >= 0 ? left : width / 2;
    const start = Math.min(Math.max(about * (1 - factor) + shift * width, first), last - span);
    choose(span >= (last - first) * 0.999 ? undefined : [start, start + span]);
  }

  // The cursor to the next of these places, told aloud.
  function step(by, places) {
    const [left, right] = inView(), x = cursorX() ?? -Infinity * by;
    const ahead = places.filter((value) => value >= left && value <= right && (value - x) * by > (right - left) * 1e-9);
    if (ahead.length === 0) return;
    chart.setCursor({ left: across(ahead.reduce((a, b) => ((b - a) * by < 0 ? b : a))), top: 9 }, true, true);
    clearTimeout(telling);
    telling = setTimeout(() => tell(Array.from(legend.children, (one) => one.textContent).join(", ")), 250);
  }
  function key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const sideways = (by) => () => (event.shiftKey ? turn(1, by / 4) : step(by, xs));
    const toMark = (by) => () => step(by, state.markers.map((mark) => mark.x));
    const act = { ArrowLeft: sideways(-1), ArrowRight: sideways(1), PageUp: toMark(-1), PageDown: toMark(1),
      "+": () => turn(0.5), "-": () => turn(2), 0: () => choose(), Enter: () => pick() }[event.key];
    if (act) event.preventDefault();
    act?.();
  }

  // Opens the mark under the cursor, else the nearest point; keys have no height.
  function pick(y) {
    const mark = markAt();
    if (mark?.pick) return mark.pick();
    const [nearest] = columns.map(({ at, values, indices }, c) => {
      const k = chart.cursor.idxs[c + 1], up = y === undefined ? 0 : chart.valToPos(values[k], "y") - y;
      return { at, index: indices[k], far: isShown(values[k]) ? Math.hypot(away(xs[k]), up) : Infinity };
    }).sort((a, b) => a.far - b.far);
    if (nearest?.far < 24) state.onPick?.(nearest.at, nearest.index);
  }

  function reached() {
    const [left, right] = inView();
    const all = state.series.map(({ label, y, low = y, high = y, x = state.at ?? [] }) => {
      const shown = [...low, ...high].filter((y, k) => isShown(y) && x[k % x.length] >= left && x[k % x.length] <= right);
      return shown.length > 0 && `${label} between ${extent(shown).map(said).join(" and ")}`;
    });
    return `From ${placed(left)} to ${placed(right)}: ${all.filter(Boolean).join("; ") || "nothing"}.`;
  }
  function rows() {
    const column = (label, { unit }, all) => ({ label, unit: pretty(unit), numeric: true, value: (k) => number(all[k], 8) });
    const shown = [...xs.keys()].slice(0, MOST_ROWS);
    return table(`${title}, ${shown.length} of ${xs.length} rows`, [column(state.x.label, state.x, xs),
      ...columns.map(({ label, values }) => column(label, state.y, values))], shown);
  }

  function renew() {
    if ((isDue = box.matches(":active"))) return; // a drag that has begun would be lost
    arrange();
    build();
    show();
    fill(legend, state.series.map(({ label, color = 1, points, dash }, at) => h("span", null,
      h("i", { class: points ? "dot" : dash && "dash", style: { color: `var(--c${color})` } }), label,
      columns.filter((one) => one.at === at).map((one) => [" ", one.shown]))), place);
    fill(behind, folded("As a table, and keys", () => [HELP, rows()], behind.firstChild?.open));
  }
  // To the box's width and the theme; paper is narrow.
  function fit() {
    if (!box.isConnected) return destroy();
    chart.setSize({ width: Math.max(200, Math.min(box.clientWidth, paper.matches ? 660 : Infinity)), height: state.height });
  }
  function destroy() {
    stop.abort();
    clearTimeout(settling);
    sizes.disconnect();
    chart.destroy();
    figure.remove();
  }
  const sizes = new ResizeObserver(fit), paper = matchMedia("print");
  renew();
  sizes.observe(box);
  addEventListener("themechange", fit, stop);
  addEventListener("mouseup", () => isDue && setTimeout(renew), stop);
  paper.addEventListener("change", fit, stop);
  function set(changes) {
    Object.assign(state, changes, settling && { range: state.range }); // the reader's, about to be told
    if (changes.series || changes.y) renew();
    else show();
  }
  return { set, destroy };
}
