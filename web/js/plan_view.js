// What was decided before the run and why, and what the buffers came to.
import { link } from "./address.js";
import { h, table } from "./dom.js";
import { column } from "./study_bits.js";
import { quantity, title, words } from "./units.js";

export const section = { title: "How it was computed", show };

export const figure = ([label, key, unit]) => column(label, unit, (row) => row[key]);
const FIGURES = [["e", "restitution"], ["T_c", "contact_time", "s"], ["k_b", "stiffness", "N/m"], ["c_b", "damping", "N s/m"],
  ["ζ", "damping_ratio"], ["n (k_b in N/mⁿ)", "exponent"], ["e reached", "reached_restitution"],
  ["T_c reached", "reached_contact_time", "s"]];

function show(host, { result: { plan: { decisions, derived, modes }, engine } }) {
  const decision = ({ about, chose, why, value, unit }) => [h("dt", null, title(about)), h("dd", null,
    h("b", null, words(chose)), `: ${why}`, value !== null && ` (${quantity(value, unit)})`)];
  const known = FIGURES.filter(([, key]) => derived.some((row) => row[key] !== null));
  host.append(h("dl.decisions", null, decisions.map(decision)),
  derived.length === 0 ? "No damper." : table("Each stop, for its pair of masses", [
    { label: "Damper, stop", value: ({ damper, side }) => `${damper}, ${side}` },
    { label: "Material", cell: ({ material }) =>
      (material ? h("a", { href: link(`materials/${material.split("@")[0]}`) }, material) : "its own numbers") },
    ...known.map(figure)], derived),
  table("Modes of the structure", [["Frequency", "frequency", "Hz"], ["ζ", "damping_ratio"]].map(figure), modes), `Engine ${engine}`);
}
