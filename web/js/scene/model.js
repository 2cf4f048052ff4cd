// What a drawing of a scene shows: its storeys and dampers, and the sentence that says it. What cannot be read is left out.
import { number, quantity, words } from "../units.js";

export const MAX_STOREYS = 40; // that are drawn, from the top
export const MAX_DAMPERS = 12;
const LABEL = 32; // letters

export const limit = (value, low, high) => Math.min(high, Math.max(low, value));
const isReal = (value) => typeof value === "number" && Math.abs(value) < 1e12;
const real = (value, initial = 0) => (isReal(value) ? value : initial);
const list = (value) => (Array.isArray(value) ? value : []);
const nth = (value, at, initial) => real([value].flat()[at], initial); // a number stands for a list of one
const upTo = (text, most) => (text.length > most ? `${text.slice(0, most - 1)}…` : text);

// Storeys from the top, `index` counts them from the ground; null is what is not known.
function storeysOf(structure, excitation) {
  const isFull = structure.kind === "matrices";
  const diagonal = (matrix) => list(matrix).map((row, at) => nth(row, at));
  const masses = isFull ? diagonal(structure.mass) : (structure.masses ?? [structure.mass]);
  const stiffnesses = isFull ? [] : (structure.stiffnesses ?? [structure.stiffness]);
  return Array.from({ length: limit(list(masses).length, 1, 200) }, (_, index) => ({
    index,
    mass: nth(masses, index, null),
    stiffness: nth(stiffnesses, index, null),
    start: nth(excitation.displacement, index),
  })).reverse();
}

// What stands at the dashpot of one mass; empty where it has none.
function dampingText({ damping, damping_ratio: ratio }) {
  if (real(damping) !== 0) return quantity(damping, "N s/m");
  return real(ratio) === 0 ? "" : `ζ ${number(ratio, 3)}`;
}

// A stop: its name, how soft it looks from 0 to 1, and so how thick, by the time of a contact.
function stopOf(buffer, derived) {
  const own = buffer?.contact_time ?? (derived ? (derived.contact_time ?? 0) : 0.02);
  const softness = limit(Math.log10(real(own) / 0.0003) / 2, 0, 1) || 0;
  const restitution = buffer?.restitution ?? derived?.restitution;
  const material = buffer?.material ?? (typeof buffer === "string" ? buffer : null);
  const name = material ? words(material).split("@")[0] : `e ${number(restitution, 3)}`;
  return {
    softness,
    thickness: 6 + 30 * softness ** 2,
    name: buffer ? upTo(name, 20) : "no stops",
  };
}

function damperOf(damper, index, storeys, plan) {
  const [mass, clearance, offset, position] = ["mass", "clearance", "offset", "position"].map(
    (name) => real(damper[name]),
  );
  const storey = limit(Math.round(real(damper.storey, storeys.length)), 1, storeys.length) - 1;
  const stops = ["left", "right"].map((side) =>
    stopOf(
      damper[`${side}_buffer`] ?? damper.buffer,
      list(plan?.derived).find((row) => row.damper === index + 1 && row.side === side),
    ),
  );
  const carrier = storeys.at(-1 - storey).mass || mass || 1;
  const names = [...new Set(stops.map(({ name }) => name))].join(" | ");
  const shift = offset ? `, offset ${quantity(offset, "m")}` : "";
  return {
    index,
    storey,
    clearance: Math.max(0, clearance),
    offset,
    place: offset + position,
    stops,
    radius: limit(46 * Math.sqrt(Math.abs(mass / carrier)), 5, 17),
    label: upTo(`${quantity(mass, "kg")} · ${names}`, LABEL),
    dimension: (clearance ? quantity(clearance, "m") : "no clearance") + shift,
    reach: Math.max(0, clearance) + 2 * Math.abs(offset),
  };
}

function baseOf({ kind = "free", name }) {
  if (kind === "free" || typeof kind !== "string") return "";
  return kind === "record" && name
    ? `${upTo(String(name), 16)} base`
    : `${upTo(words(kind), 16)} base`;
}

export function modelOf(scene, plan) {
  const structure = Object(scene?.structure);
  const excitation = Object(scene?.excitation);
  const all = storeysOf(structure, excitation);
  const every = list(scene?.dampers).map((one, at) => damperOf(Object(one), at, all, plan));
  const storeys = all.slice(0, MAX_STOREYS);
  const lowest = storeys.at(-1).index;
  const dampers = every.filter(({ storey }) => storey >= lowest).slice(0, MAX_DAMPERS);
  const [top] = all;
  const base = baseOf(excitation);
  const released = top.start ? `starts at ${quantity(top.start, "m")}` : "";
  const what =
    all.length > 1
      ? `${all.length} storeys`
      : `${quantity(top.mass, "kg")} on ${quantity(top.stiffness, "N/m")}`;
  const parts = [
    `A structure of ${what}`,
    ...dampers.map(
      ({ storey, label, dimension }) =>
        `on storey ${storey + 1} a free mass of ${label}, clearance ${dimension}`,
    ),
    base,
    released,
  ];
  return {
    kind: structure.kind === "matrices" ? "matrices" : "chain",
    isSingle: all.length === 1 && structure.kind !== "matrices",
    count: all.length,
    damping: dampingText(structure),
    storeys,
    dampers,
    base,
    start: top.start,
    far: Math.max(...storeys.map(({ start }) => Math.abs(start))),
    isCut: all.length + every.length > storeys.length + dampers.length,
    sentence: parts.filter(Boolean).join("; "),
  };
}
