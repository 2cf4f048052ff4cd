// The power spectra of a result, others laid over them. In the URL: psd (channel), psd_from, psd_to (Hz), overlay (ids).
import { get } from "./api.js";
import { fill, folded, h, hint } from "./dom.js";
import { plot } from "./plot.js";
import { latest, spectrum } from "./study_bits.js";
import { number, pretty, words } from "./units.js";

export const section = { title: "Spectrum", show };

async function show(host, context) {
  const { result: { id, links, plan }, view: { overlay = "" } } = context;
  if (!links.psd) return host.append("The scene asked for no spectrum.");
  const load = (result) => get(`v1/results/${encodeURIComponent(result)}/psd.json`);
  const [psd, names] = await Promise.all([load(id), latest(20)]), frequency = psd.frequency.values;
  names.delete(id);
  const one = h("select", { onchange: () => context.change({ psd: one.value }, true) },
    Object.keys(psd.channels).map((value) => h("option", { value }, words(value)))), box = h("div");
  const boxes = Array.from(names.keys(), (value) => h("input", { type: "checkbox", value, onchange: () =>
    context.change({ overlay: boxes.filter(({ checked }) => checked).map((other) => other.value).join() }, true) }));
  fill(host, h("label", null, "Channel ", one), folded("Lay other results over it", () =>
    boxes.map((other) => h("div", null, h("label", null, other, " ", names.get(other.value)))), overlay !== ""), box,
    hint(`Welch's method: ${psd.segments} segments of ${psd.segment} samples, window ${psd.window}.`));

  let chart = null, wanted = "";
  async function follow(view) {
    const channel = view.psd in psd.channels ? view.psd : one[0].value, { values, unit } = psd.channels[channel];
    const ids = (view.overlay ?? "").split(",").filter(Boolean).slice(0, 7); // there are 8 colours
    const from = Number(view.psd_from), to = Number(view.psd_to), range = to > from ? [from, to] : null;
    const isIn = (at) => at > 0 && (!range || (at >= from && at <= to));
    const best = frequency.reduce((top, at, i) => (isIn(at) && !(values[i] <= values[top]) ? i : top), -1);
    const summary = `Largest ${number(values[best], 3)} ${pretty(unit)} at ${number(frequency[best])} Hz${
      range ? " in view" : ""}.`;
    const key = [channel, ...ids].join();
    if (key === wanted) return chart?.set({ range, summary });
    wanted = key;
    one.value = channel;
    for (const other of boxes) other.checked = ids.includes(other.value);
    const overlays = await Promise.all(ids.map((result) => load(result).catch(() => null)));
    if (key !== wanted) return;
    fill(box);
    chart = plot(box, {
      ...spectrum(channel, unit), summary, range,
      series: [psd, ...overlays].map((run, at) => ({ label: at === 0 ? "this result" : names.get(ids[at - 1]) ?? "another",
        color: at + 1, x: run?.frequency.values ?? [], y: run?.channels[channel]?.values ?? [] })),
      lines: plan.modes.slice(0, 12).map((mode, at) => ({ x: mode.frequency, label: `mode ${at + 1}` })),
      onZoom: (left, right) => context.change({ psd_from: left, psd_to: right }, true),
    });
    return follow(context.view); // its range may have changed meanwhile
  }
  await follow(context.view);
  return { follow };
}
