// Where the parts of a scene's drawing are, in pixels. Displacements and clearances share one scale, which a bar states. What
// cannot be read is left out: the scene may be half typed.
import { number, quantity, words } from "../units.js";

const MOST = 12; // storeys, from the top, and dampers
export const CAVITY = 46; // height of a cavity
const LABEL = 17; // over it
const DIMENSION = 27; // under it
export const ROW = LABEL + CAVITY + DIMENSION;
const SLAB = 13;
const TOP = 24; // for the labels above
const FOOT = 34; // below the ground: hatching, labels, scale bar
const SPRING = 74; // least length of the spring between the wall and the mass
export const WALL = 16; // where the wall's face is

export const limit = (value, low, high) => Math.min(high, Math.max(low, value));
const isObject = (value) => typeof value === "object" && value !== null;
const numberOr = (value, initial) =>
  typeof value === "number" && Math.abs(value) < 1e12 ? value : initial;
const listOf = (value) => (Array.isArray(value) ? value : []);
const nth = (value, index, initial) => numberOr([value].flat()[index], initial); // a number stands for a list of one

// The largest number up to `most` that is one of `steps` times a power of ten.
function roundDown(most, steps) {
  const power = 10 ** Math.floor(Math.log10(most));
  return power * steps.find((step) => step * power <= most * 1.000001);
}

function massesOf({ kind, mass, masses }) {
  if (masses) return listOf(masses);
  return kind === "matrices" ? listOf(mass).map((row, index) => nth(row, index, null)) : [mass];
}

// From the top, `index` counts from the ground; null is what is not known.
function storeysOf(structure, excitation) {
  const masses = massesOf(structure);
  return Array.from({ length: limit(masses.length, 1, 200) }, (_, index) => ({
    index,
    mass: nth(masses, index, null),
    stiffness: nth(structure.stiffnesses ?? structure.stiffness, index, null),
    start: nth(excitation.displacement, index, 0),
  })).reverse();
}

function bufferName(buffer, derived) {
  if (!buffer) return "no stops";
  const isNamed = typeof buffer === "string" && buffer.trim() !== "";
  const name =
    buffer.material ??
    (isNamed ? buffer : `e ${number(buffer.restitution ?? derived?.restitution, 3)}`);
  return words(name).split("@")[0].slice(0, 20);
}

// A stop: its name and how soft it looks, from 0 to 1, by the time of a contact; so thick is its pad.
function stopOf(buffer, derived) {
  const contactTime = derived ? (derived.contact_time ?? 0) : 0.02;
  const softness = limit(Math.log10(contactTime / 0.0003) / 2, 0, 1);
  return { softness, thickness: 5 + 33 * softness ** 2, name: bufferName(buffer, derived) };
}

function damperOf(damper, index, storeys, plan) {
  const mass = numberOr(damper.mass, 0);
  const clearance = Math.max(0, numberOr(damper.clearance, 0));
  const offset = numberOr(damper.offset, 0);
  const storey = limit(Math.round(numberOr(damper.storey, storeys.length)), 1, storeys.length) - 1;
  const stops = ["left", "right"].map((side) =>
    stopOf(
      damper[`${side}_buffer`] ?? damper.buffer,
      listOf(plan?.derived).find((row) => row.damper === index + 1 && row.side === side),
    ),
  );
  const carrier = storeys.at(-1 - storey).mass || mass || 1;
  const names = [...new Set(stops.map(({ name }) => name))].join(" | ");
  const size = clearance > 0 ? quantity(clearance, "m") : "no clearance";
  return {
    index,
    storey,
    clearance,
    offset,
    stops,
    radius: limit(46 * Math.sqrt(Math.abs(mass / carrier)), 5, 17),
    label: `${quantity(mass, "kg")} · ${names}`.slice(0, 32),
    place: offset + numberOr(damper.position, 0),
    dimension: offset ? `${size}, offset ${quantity(offset, "m")}` : size,
    reach: clearance + 2 * Math.abs(offset),
  };
}

// Of one mass; empty where it has none.
function dampingText({ damping, damping_ratio: ratio }) {
  if (numberOr(damping, 0) !== 0) return quantity(damping, "N s/m");
  return numberOr(ratio, 0) === 0 ? "" : `ζ ${number(ratio, 3)}`;
}

// What of a scene is drawn: {storeys, dampers, hidden: how many are not}.
function partsOf(scene, plan) {
  const structure = isObject(scene?.structure) ? scene.structure : {};
  const excitation = isObject(scene?.excitation) ? scene.excitation : {};
  const all = storeysOf(structure, excitation);
  const every = listOf(scene?.dampers).map((damper, index) =>
    damperOf(isObject(damper) ? damper : {}, index, all, plan),
  );
  const storeys = all.slice(0, MOST);
  const dampers = every.filter(({ storey }) => storey >= storeys.at(-1).index).slice(0, MOST);
  const hidden = all.length + every.length - storeys.length - dampers.length;
  return { structure, excitation, count: all.length, storeys, dampers, hidden };
}

// The indices of the storeys and dampers that are drawn.
export function drawnParts(scene) {
  const { storeys, dampers } = partsOf(scene, null);
  return {
    storeys: storeys.map(({ index }) => index),
    dampers: dampers.map(({ index }) => index),
  };
}

function describe({ structure, count, storeys, dampers }, base, start) {
  const [{ mass, stiffness }] = storeys;
  const what =
    count > 1 ? `${count} storeys` : `${quantity(mass, "kg")} on ${quantity(stiffness, "N/m")}`;
  const carried = dampers.map(
    ({ storey, label, dimension }) =>
      `on storey ${storey + 1} a free mass of ${label}, clearance ${dimension}`,
  );
  const of = structure.kind === "matrices" && count === 1 ? quantity(mass, "kg") : what;
  return [`A structure of ${of}`, ...carried, base, start].filter(Boolean).join("; ");
}

// The drawing of `scene`, `width` pixels wide. `plan` is the answer's, for what a material's stops come to; `stroke` the
// largest displacement (m), without it the start is what is drawn.
export function layout(scene, { plan, stroke }, width) {
  const parts = partsOf(scene, plan);
  const { structure, excitation, count, storeys, dampers } = parts;
  const kind = count === 1 && structure.kind !== "matrices" ? "mass" : "frame";
  const reach = Math.max(0, ...dampers.map((damper) => damper.reach));
  const far = stroke ?? Math.max(...storeys.map(({ start }) => Math.abs(start)));
  const [left, right] = kind === "mass" ? [WALL + SPRING, 14] : [82, 14];
  const room = width - left - right;
  const wanted = Math.max(140, ...dampers.map(({ label }) => label.length * 6.3));
  const least = Math.min(room - 20, wanted); // of a mass's width, without what its cavities need
  const most = Math.min((room - least) / (reach + 2 * far), room / 2 / reach);
  const scale = most < 1e12 ? roundDown(most, [7, 5, 3, 2, 1.5, 1]) : 0;
  const wide = least + reach * scale;
  const middle =
    kind === "mass"
      ? (width + left - right + (room - wide - 2 * far * scale) * 0.25) / 2
      : left + room / 2;
  let y = TOP;
  const placed = storeys.map((storey) => {
    const own = dampers.filter((damper) => damper.storey === storey.index);
    const height = kind === "mass" ? Math.max(64, own.length * ROW + 6) : own.length * ROW + SLAB;
    const top = y;
    y += height;
    const foot =
      kind === "mass" ? y + 9 : y + limit(300 / storeys.length, 18, own.length > 0 ? 40 : 58);
    y = foot;
    return {
      ...storey,
      top,
      height,
      foot,
      slab: kind === "mass" ? height : SLAB,
      dampers: own.map((damper, row) => ({ ...damper, top: top + row * ROW + LABEL })),
    };
  });
  placed.forEach((storey, at) => {
    const below = placed[at + 1];
    if (below) storey.foot = below.top + below.height - below.slab; // columns stand on the slab
  });
  const shaking = excitation.kind ?? "free";
  const base = shaking === "free" ? "" : `${words(shaking).slice(0, 20)} base`;
  const start = storeys[0].start ? `starts at ${quantity(storeys[0].start, "m")}` : "";
  const metres = scale > 0 ? roundDown(90 / scale, [5, 2, 1]) : 0;
  return {
    kind,
    width,
    height: y + FOOT,
    scale,
    wide,
    middle,
    far: far * scale,
    ground: y,
    isCut: storeys.length < count,
    hasColumns: structure.kind !== "matrices",
    damping: dampingText(structure),
    storeys: placed,
    base,
    start: stroke === undefined ? start : "",
    hasGhosts: stroke === undefined,
    bar: { length: metres * scale, label: quantity(metres, "m") },
    count,
    hidden: parts.hidden,
    label: describe(parts, base, start),
  };
}
