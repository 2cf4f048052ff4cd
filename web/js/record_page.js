// One ground motion: its course, what is known of it, what uses it.
import { go, link, note, read } from "./address.js";
import { ask, get, save } from "./api.js";
import { button, faults, figures, fill, h } from "./dom.js";
import { plot } from "./plot.js";
import { moment, number, quantity, title } from "./units.js";

const UNITS = { duration: "s", interval: "s", peak: "m/s^2", peak_time: "s", peak_velocity: "m/s", end_velocity: "m/s" };
const POINTS = 1500; // buckets of a view, some 60 kB

// A member of a record for people.
export const told = (name, value) => (UNITS[name] ? quantity(value, UNITS[name]) : number(value));

export const page = {
  title: (address) => `Record ${address.path[1]}`,
  async show(host, address) {
    const path = `v1/records/${encodeURIComponent(address.path[1])}`;
    const { links, used_by, name, created, digest, ...facts } = await get(path);
    const news = h("div"), picture = h("div.panel");
    const act = (label, does) => button(label, () => does().catch(faults(news)));
    fill(host, h("h1", null, name), h("div.row", null,
      h("a.button", { href: link("scene", { record: name }) }, "Use in a scene"),
      ["csv", "npy", "mat", "json"].map((format) =>
        act(`.${format}`, () => save(`${path}/samples.${format}`, `${name}.${format}`))),
      act("Delete", async () => confirm(`Delete ${name} for good?`) && (await ask("DELETE", path), go("records")))),
    news, picture, h("div.panel", null, figures(Object.entries({ ...facts, uploaded: moment(created), ...used_by })
      .filter(([, value]) => value !== null).map(([fact, value]) => [title(fact), told(fact, value)]))));

    const say = (fact) => told(fact, facts[fact]);
    const chart = plot(picture, { title: `Base acceleration of ${name}`, whole: [0, facts.duration],
      x: { label: "time", unit: "s" }, y: { label: "acceleration", unit: "m/s^2" },
      onZoom: (from, to) => (note({ from, to }), draw()),
      summary: `${say("count")} samples over ${say("duration")}; the largest is ${say("peak")}, at ${say("peak_time")}.` });
    // Extremes of buckets, so that no peak is lost; finer ones where the reader zooms in.
    async function load() {
      const asked = location.hash, { query } = read();
      const from = Math.max(0, query.from || 0), to = Math.min(facts.duration, query.to || facts.duration);
      const { bucket, sample_rate: rate, start, channels: { acceleration: { min, max } } }
        = await get(`${path}/samples.json`, { from, to, points: POINTS });
      if (asked !== location.hash) return; // zoomed on
      const x = min.map((_, at) => start + (at * bucket) / rate), values = bucket > 1 ? { low: min, high: max } : { y: min };
      chart.set({ range: [from, to], series: [{ label: "acceleration", x, ...values }] });
    }
    const draw = () => load().catch(faults(news));
    draw();
    return { change: draw, leave: chart.destroy };
  },
};
