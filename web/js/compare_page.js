// Up to four results beside each other: what came out, motions and spectra, and what was asked differently.
import { go, link, note, read, swap } from "./address.js";
import { get, schema } from "./api.js";
import { differing, numbers, partings, spectra } from "./compare_view.js";
import { faults, fill, h, help, hint, panel } from "./dom.js";
import { plot } from "./plot.js";
import { place, unitOf } from "./form/place.js";
import { extent, latest, lesson, told } from "./study_bits.js";
import { brief, number, quantity, title, words } from "./units.js";

const LETTERS = [..."abcd"];
const idsOf = (query) => LETTERS.map((letter) => query[letter]).filter(Boolean);

export const page = {
  title: () => "Compare",
  show(host, { query }) {
    const ids = idsOf(query), chooser = h("form.panel"), body = h("div", null, "Loading …");
    let motion = null;
    fill(host, help("Compare"), h("h1", null, "Compare"), chooser, body);
    async function load() {
      const names = await latest(100), [b, a] = names.keys();
      if (ids.length === 0 && a) return swap("compare", { a, b });
      for (const id of ids) if (!names.has(id)) names.set(id, brief(id));
      chooser.onsubmit = () => go("compare", Object.fromEntries(new FormData(chooser))) ?? false;
      fill(chooser, LETTERS.map((name, at) => h("p", { style: { color: `var(--c${at + 1})` } }, h("label", null, "ABCD"[at], " ",
        h("select", { name }, [["", "none"], ...names].map(([value, text]) =>
          h("option", { value, selected: value === ids[at] }, text)))), " ",
      ids[at] && h("a", { href: link(`results/${ids[at]}`) }, "Open"))), h("button.primary", null, "Compare"));
      if (ids.length < 2) return void fill(body, "Choose two results or more to see what differs.");
      motion = await compare(body, await Promise.all(ids.map(run)));
    }
    load().catch(faults(body));
    return { change: (next) => `${idsOf(next.query)}` === `${ids}` && void motion?.(next.query) };
  },
};

// A result with its spectrum and its first impact, where there are such.
async function run(id, at) {
  const load = (name) => get(`v1/results/${encodeURIComponent(id)}${name}`);
  const result = await load(""), { links, plan, summary } = result;
  const hasForce = links.impacts && summary.impacts > 0 && plan.contact_model !== "impulse";
  const [psd, impact] = await Promise.all([links.psd && load("/psd.json"), hasForce && load("/impacts/1/force.json")]);
  return { ...result, psd, impact, color: at + 1, end: (result.count - 1) / result.sample_rate,
    contact: Math.max(...plan.derived.map((stop) => stop.contact_time)) };
}

// Shows them -> what follows the query.
async function compare(host, runs) {
  const [first, ...others] = runs, inputs = new Map();
  const pairs = await Promise.all(others.map((other) => get("v1/compare", { a: first.id, b: other.id })));
  pairs.forEach((pair, at) => pair.inputs.forEach(({ pointer, a, b }) =>
    inputs.set(pointer, (inputs.get(pointer) ?? runs.map(() => a)).with(at + 1, b))));
  // A run is called by the first word that differs, else by the first number.
  const all = [...inputs], isWord = ([, [value]]) => typeof value === "string";
  const telling = all.find(isWord) ?? all[0] ?? ["", [""]];
  const name = isWord(telling) ? "" : words(telling[0].split("/").at(-1));
  runs.forEach((one, at) => Object.assign(one, { label: ["ABCD"[at], name, told(telling[1][at])].filter(Boolean).join(" "),
    divergence: pairs[at - 1]?.divergence, level: pairs[at - 1]?.psd?.[0]?.level }));
  const fields = JSON.stringify(await schema("scene"));
  const push = h("div"), motion = h("div"), spectrum = h("div");
  fill(host, panel("Result", lesson(...others.map((other) => pushes(first, other)), partings(runs).said),
    h("div.columns", null, push, numbers(runs, first.units, []))), panel("Motion", motion), panel("Spectra", spectrum),
  panel("Inputs", differing("Inputs that differ", runs, all.map(([input, values]) =>
    ({ label: title(place(input)), unit: unitOf(input, fields), values }))),
  pairs.flatMap((pair) => pair.warnings).map(({ detail }) => hint(detail))));

  firstImpacts(push, runs.filter(({ impact }) => impact && impact.time.values.length > 2));
  const [psd] = pairs[0].psd ?? [], channel = psd?.channel, some = runs.filter((one) => one.psd?.channels[channel]);
  if (channel) spectra(spectrum, channel, psd.unit, some.map((one) => ({ ...one, x: one.psd.frequency.values,
    y: one.psd.channels[channel].values })));
  else fill(spectrum, "They have no spectrum in common.");
  return motions(motion, runs);
}

// Which of two pushes harder, and why.
function pushes(...runs) {
  const force = (run) => run.summary.peak_contact_force, [soft, hard] = runs.sort((a, b) => force(a) - force(b));
  const times = (a, b, unit, said) => (a > 1.05 * b && b > 0
    ? `${number(a / b, 2)} times as ${said} (${quantity(a, unit, 3)} against ${quantity(b, unit, 3)})` : "");
  const harder = times(force(hard), force(soft), "N", `hard as ${soft.label}`);
  const longer = times(soft.contact, hard.contact, "s", "long over a contact");
  return harder && `${hard.label} pushes ${harder}${longer && `, for ${soft.label} takes ${longer}`}.`;
}

// The push of each run's first impact, on scales that show both a blow and a push.
function firstImpacts(host, runs) {
  const series = runs.map(({ label, color, impact: { time, channels } }) => {
    const forces = channels.contact_force.values, sign = Math.sign(forces[forces.length >> 2]);
    return { label, color, x: time.values.map((one) => one - time.values[0]), y: forces.map((force) => force * sign) };
  });
  const [shortest, longest] = extent(series.map(({ x }) => x.at(-1)));
  if (runs.length > 0) plot(host, { title: "Push of the first impact", height: 260, series, whole: [shortest / 20, longest],
    x: { label: "Time since it began", unit: "s", log: true }, y: { label: "Contact force", unit: "N", log: true } });
}

// One channel that all have over a window of time, both in the URL -> what follows it.
function motions(host, runs) {
  const channels = runs[0].channels.filter((one) => runs.every((other) => other.channels.includes(one))), failed = h("div");
  if (channels.length === 0) return void fill(host, "They have no channel in common.");
  const end = Math.max(...runs.map((one) => one.end)), show = (changes) => (note(changes, true), follow(read().query));
  const select = h("select", { onchange: () => show({ channel: select.value }) },
    channels.map((channel) => h("option", { value: channel }, title(channel))));
  fill(host, h("label", null, "Channel ", select), failed);
  const chart = plot(host, { title: "Over time", whole: [0, end], height: 300, x: { label: "Time", unit: "s" }, y: {},
    lines: partings(runs).lines, onZoom: (from, to) => show({ from, to }) });
  let turn = 0;
  async function load({ channel = channels[0], from = 0, to = end }) {
    const mine = ++turn, range = [Number(from), Number(to)], there = runs.filter((one) => from <= one.end);
    const answers = await Promise.all(there.map(({ id }) =>
      get(`v1/results/${id}/series.json`, { channels: channel, from, to, points: 600 })));
    if (mine !== turn) return;
    select.value = channel;
    const { unit } = answers[0].channels[channel];
    const series = answers.map(({ start, bucket, sample_rate: rate, channels: { [channel]: { min: low, max: high } } }, at) =>
      ({ ...there[at], x: low.map((_, i) => start + (i * bucket) / rate), low, high }));
    chart.set({ y: { label: title(channel), unit }, series, range });
    fill(failed);
  }
  const follow = (query) => load(query).catch(faults(failed));
  follow(read().query);
  return follow;
}
