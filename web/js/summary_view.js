// What one wants to know first: figures, how exact they are, what they cost, where the energy went.
import { link } from "./address.js";
import { get } from "./api.js";
import { figures, h, table } from "./dom.js";
import { column } from "./study_bits.js";
import { number, quantity, title } from "./units.js";

export const section = { title: "Summary", show };
export const energy = { title: "Energy", show: showEnergy };

// "12.3 %"; what is next to nothing as a power of ten.
export const share = (part, digits = 3) =>
  (part !== 0 && Math.abs(part) < 1e-5 ? number(part, 2) : `${number(100 * part, digits)} %`);

function show(host, { result: { summary, units, id, count, sample_rate: rate, work, study }, jobs }) {
  const { energy_residual: residual, error_estimate: error, trust_horizon: horizon, ...shown } = summary;
  const pairs = Object.entries(shown).map(([name, value]) =>
    [title(name), name.endsWith("_reduction") ? share(value) : quantity(value, units[name])]);
  const button = (page, query, text) => h("a.button", { href: link(page, query) }, text);
  const size = error === 0 ? "the last digit" : `about ${share(error, 2)} of its largest value`, cost = h("p", null, "…");
  host.append(figures(pairs), h("p", null,
    error === null ? "How exact it is, is not known."
      : horizon === null ? `The displacement is right to ${size}, from beginning to end.`
      : `To ${quantity(horizon, "s")}, the trust horizon, the displacement is right to a millionth of its largest value. ` +
        `At the end its error is ${size}: there spectra, statistics and energies count, no single peak or instant.`,
    residual !== null && ` The energy balance closes to ${number(residual, 2)} of the largest energy.`),
  cost, h("div.row", null, button("scene", { result: id }, "Change this scene"),
    button("compare", { a: id }, "Compare with …")));
  // The job that computed it tells the time; others found it ready, and a study's made more.
  jobs.then((all) => {
    const run = !study && all.find((job) => !job.cached)?.timing.run;
    cost.textContent = `${quantity((count - 1) / rate, "s")} of motion, ${number(work.contacts + work.bounces)} contacts and ${
      number(count)} samples${run ? `, computed in ${quantity(run, "s", 3)}` : ""}.`;
  }).catch((fault) => (cost.textContent = fault.message));
}

// Whether the service counts what comes or what goes; each part goes on where the last one ended.
const SIGNS = { initial: 1, input: 1, structural_damping: -1, contact: -1, kinetic: -1, strain: -1 };
async function showEnergy(host, { path }) {
  const energies = await get(`${path}/energy.json`);
  let level = 0, whole = 0;
  const parts = Object.entries(SIGNS).filter(([name]) => energies[name] !== 0).map(([name, sign]) => {
    const flow = sign * energies[name];
    whole += Math.max(0, flow);
    return { name, flow, ends: [level, (level += flow)] };
  });
  const part = (size) => `${(100 * size) / whole}%`, bar = ([from, to]) => h("div.strip", { "aria-hidden": "true" },
    h("span", { style: { left: part(Math.min(from, to)), width: part(Math.abs(to - from)) } }));
  host.append(whole === 0 ? "Nothing moved: there was no energy." : table("What came and, negative, what went", [
    { label: "Part", cell: ({ name, ends }) => [title(name), bar(ends)] },
    column("Energy", "J", ({ flow }) => flow),
    { label: "Share", numeric: true, value: ({ flow }) => share(flow / whole) }], parts));
}
