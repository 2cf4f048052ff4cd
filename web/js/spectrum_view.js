// The power spectra of a result on log axes, others laid over them, the largest peak named. In the URL: psd (channel),
// psd_from, psd_to (Hz), overlay (ids of results).
import { get } from "./api.js";
import { fill, h, hint } from "./dom.js";
import { plot } from "./plot.js";
import { spectrum } from "./study_bits.js";
import { brief, number, pretty, words } from "./units.js";

export const section = { id: "spectrum", title: "Spectrum", show };

async function show(host, context) {
  const { result: { id, links, plan } } = context;
  if (!links.psd) return host.append("The scene asked for no spectrum.");
  const load = (result) => get(`v1/results/${encodeURIComponent(result)}/psd.json`);
  const recent = get("v1/jobs", { status: "successful", kind: "none", limit: 50 });
  const [psd, { jobs }] = await Promise.all([load(id), recent]), frequency = psd.frequency.values;
  const names = new Map(jobs.map(({ result, title }) => [result, title ?? brief(result)]));

  // A list whose choice is a part of the view.
  const list = (key, values, name, more) => h("select", { ...more, onchange: ({ target }) =>
    context.change({ [key]: Array.from(target.selectedOptions, ({ value }) => value).join() }, true) },
  values.map((value) => h("option", { value }, name(value))));
  const one = list("psd", Object.keys(psd.channels), words), box = h("div");
  const others = list("overlay", [...names.keys()], (result) => names.get(result), { multiple: true, size: 4 });
  fill(host, h("label", null, "Channel ", one), h("div", null, h("label", null, "Lay over it (Ctrl for several) ", others)), box,
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
    for (const option of others.options) option.selected = ids.includes(option.value);
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
