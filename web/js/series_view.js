// A result's motion: a chart for each quantity, impacts as marks, beyond the trust horizon shaded. It asks for a bucket for
// each pixel, finer ones with each zoom; never the whole series.
import { go } from "./address.js";
import { get, post } from "./api.js";
import { button, failure, faults, fill, h, hint, notice, once } from "./dom.js";
import { plot } from "./plot.js";
import { number, quantity, title, words } from "./units.js";

const MOST_NUMBERS = 12000; // in one answer: some 110 kB packed
const MOST_LINES = 8; // in a chart: as there are colours
const MOST_MARKS = 300;
const USUAL = ["displacement", "contact_force", "acceleration"]; // what people look for

const kind = (channel) => channel.replace(/_\d+$/, "");
const hue = (nth) => ((nth - 1) % 8) + 1;

export const section = { title: "Motion over time", show };

function show(host, context) {
  const { result, ledger, path } = context, { sample_rate: rate, channels = [], units = {}, summary } = result;
  const horizon = summary.trust_horizon;
  if (channels.length === 0) return void fill(host, h("p", null, "The scene asked for no channels."));
  const state = hint(), marksNote = hint(), box = h("div");
  let chosen = null, charts = [], shown, fetching, waiting; // a chart is {drawn, chart}
  const choose = () => context.change(
    { channels: boxes.filter((one) => one.checked).map((one) => one.value).join() || "none" }, true);
  const boxes = channels.map((value) => h("input", { type: "checkbox", value, onchange: choose }));
  fill(host, h("div.row", { role: "group", "aria-label": "Channels" },
    boxes.map((one) => h("label", null, one, ` ${words(one.value)}`))), state, marksNote, box);

  function build() {
    const { end } = context.window;
    leave();
    for (const one of boxes) one.checked = chosen.includes(one.value);
    charts = Object.entries(Object.groupBy(chosen, kind)).map(([name, all]) => ({
      drawn: all.slice(0, MOST_LINES),
      chart: plot(box, {
        title: title(name), group: "time", whole: [0, end], height: 200, x: { label: "Time", unit: "s" },
        y: { label: title(name), unit: units[all[0]] },
        spans: horizon === null ? [] : [{ from: horizon, to: end, label: "only statistics hold here" }],
        onZoom: (from, to) => context.change({ from, to }, true),
      }),
    }));
  }

  async function load() {
    fetching = new AbortController();
    const { signal } = fetching, { from, to, end } = context.window, drawn = charts.flatMap((one) => one.drawn);
    const buckets = Math.floor(Math.min(MOST_NUMBERS / 2 / drawn.length, host.clientWidth || 800, 800));
    const beyond = Math.max(1.5 / rate, (to - from) / buckets); // a bucket more on either side, where lines leave the picture
    const query = { channels: drawn.join(), from: Math.max(0, from - beyond), to: Math.min(end, to + beyond),
      points: (to - from) * rate > 2 * buckets ? buckets : null };
    state.textContent = "Loading the series …"; // the old picture stays until then
    try {
      const { start, count, bucket = 1, channels: found } = await get(`${path}/series.json`, query, signal);
      const at = Array.from({ length: count }, (_, k) => Math.min(start + ((k + 0.5) * bucket - 0.5) / rate, end)); // middles
      for (const { drawn, chart } of charts) chart.set({ at, series: drawn.map((channel, k) => {
        const { values: y, min: low, max: high } = found[channel], nth = /_(\d+)$/.exec(channel)?.[1] ?? k + 1;
        return { label: words(channel), color: hue(nth), y, low, high };
      }) });
      state.textContent = (bucket === 1 ? "Every sample is drawn."
        : `A column is the least and the largest of ${number(bucket)} samples: no peak is lost.`)
        + (drawn.length < chosen.length ? ` The first ${MOST_LINES} of a kind are drawn.` : "");
    } catch (error) {
      if (!signal.aborted) fill(state, error.status === 410
        ? notice("warn", "The series of this result is not stored any more", button("Run the scene again", again))
        : [failure(error), button("Try again", load)]);
    }
  }
  const again = once(() => post(`${path}/again`).then(({ id }) => go(`jobs/${id}`), faults(state)));

  // Marks of the impacts in view, rules at the one chosen and at the animation's instant.
  async function mark() {
    const { view, window: { from, to } } = context, { impact, t } = view;
    const { impacts, count } = await ledger.window(from, to, MOST_MARKS), picked = await ledger.at(impact);
    if (view !== context.view) return;
    const lines = picked ? [{ x: picked.start, label: `impact ${picked.number}`, color: 2 }] : [];
    if (t >= 0) lines.push({ x: Number(t), label: "the animation" });
    const isCut = count > impacts.length, markers = isCut ? [] : impacts.map((one) => ({
      x: one.start, color: hue(one.damper + 1), pick: () => context.change({ impact: one.number }, true),
      label: `${one.kind} ${one.number}, damper ${one.damper}, ${one.side} stop, ${quantity(one.peak_force, "N")}` }));
    for (const { chart } of charts) chart.set({ lines, markers });
    if (ledger.isListed) marksNote.textContent = `${number(count)} contacts in this window${
      isCut ? `: zoom to ${MOST_MARKS} to see them marked` : ", marked at the top; choose one to see its force"}.`;
  }

  function follow() {
    const { view, window: { from, to } } = context, named = view.channels?.split(",");
    const usual = channels.filter((one) => USUAL.includes(kind(one)));
    const next = named ? channels.filter((one) => named.includes(one)) : usual.length > 0 ? usual : channels;
    if (`${next}` !== `${chosen}`) {
      chosen = next;
      build();
    }
    const wanted = `${next} ${from} ${to}`;
    if (wanted !== shown) {
      stop();
      for (const { chart } of charts) chart.set({ range: [from, to] });
      if (chosen.length > 0) waiting = setTimeout(load, shown ? 150 : 0);
      shown = wanted;
    }
    mark().catch(faults(marksNote));
  }
  function stop() {
    clearTimeout(waiting);
    fetching?.abort();
  }
  function leave() {
    stop();
    for (const { chart } of charts) chart.destroy();
  }
  follow();
  return { follow, leave };
}
