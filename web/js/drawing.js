// A scene as a picture that can be posed: displacements and clearances share one scale, which a bar states. What it cannot
// read it leaves out.
import { fill, h, hint, s } from "./dom.js";
import { number, quantity, words } from "./units.js";

const MOST = 12; // storeys, from the top, and dampers
const TALL = 44, ABOVE = 18, ROW = 88; // a cavity; over it its label; with label and dimension
export const limit = (value, low, high) => Math.min(high, Math.max(low, value));
const real = (value, initial = 0) => (typeof value === "number" && Math.abs(value) < 1e12 ? value : initial);
const list = (value) => (Array.isArray(value) ? value : []);
const nth = (value, k, initial) => real([value].flat()[k], initial); // a number stands for a list of one

const r = (value) => Math.round(limit(value, -1e5, 1e5) * 100) / 100;
const move = (node, x, squeeze = 1) => node.setAttribute("transform", `translate(${r(x)} 0) scale(${r(squeeze)} 1)`);
const text = (x, y, words, kind) => s("text", { x, y, class: kind }, words);
const path = (d, kind) => s("path", { d, class: kind });
const disc = (cx, cy, r, kind) => s("circle", { cx, cy, r, class: kind });
const block = (x, y, width, height, kind) => s("rect", { x, y, width, height, class: kind });

// The largest up to `most` that is one of `steps` times a power of ten.
function round(most, steps) {
  const ten = 10 ** Math.floor(Math.log10(most));
  return ten * steps.find((step) => step * ten <= most * 1.000001);
}

// Storeys from the top, `k` counts them from the ground; null is what is not known.
function storeysOf(structure, excitation) {
  const masses = structure.masses ?? (structure.kind === "matrices" ? list(structure.mass).map(nth) : [structure.mass]);
  return Array.from({ length: limit(list(masses).length, 1, 200) }, (_, k) => ({ k, mass: nth(masses, k, null),
    stiffness: nth(structure.stiffnesses ?? structure.stiffness, k, null), start: nth(excitation.displacement, k) })).reverse();
}

// A stop: its name, how soft it looks from 0 to 1, and so how thick, by the time of a contact.
function stop(buffer, derived) {
  const soft = limit(Math.log10((derived ? derived.contact_time ?? 0 : 0.02) / 0.0003) / 2, 0, 1);
  const name = buffer?.material ?? (buffer?.trim ? buffer : `e ${number(buffer?.restitution ?? derived?.restitution, 3)}`);
  return { soft, thick: 4 + 36 * soft ** 2, name: buffer ? words(name).split("@")[0].slice(0, 20) : "no stops" };
}

function damperOf(damper, index, storeys, plan) {
  const [mass, clearance, offset, position] = ["mass", "clearance", "offset", "position"].map((name) => real(damper[name]));
  const storey = limit(Math.round(real(damper.storey, storeys.length)), 1, storeys.length) - 1;
  const stops = ["left", "right"].map((side) => stop(damper[`${side}_buffer`] ?? damper.buffer,
    list(plan?.derived).find((row) => row.damper === index + 1 && row.side === side)));
  const radius = limit(46 * Math.sqrt(Math.abs(mass / (storeys.at(-1 - storey).mass || mass || 1))), 4, 18);
  const label = `${quantity(mass, "kg")} · ${[...new Set(stops.map(({ name }) => name))].join(" | ")}`.slice(0, 32);
  return { index, storey, clearance: Math.max(0, clearance), offset, stops, radius, label, place: offset + position,
    way: (clearance ? quantity(clearance, "m") : "no clearance") + (offset ? `, offset ${quantity(offset, "m")}` : ""),
    reach: clearance + 2 * Math.abs(offset) };
}

// About the storey's middle: pads, the free mass and (dashed) where it meets them, the clearance with its number.
function cavity({ stops, offset, clearance, label, way, radius }, scale, top) {
  const middle = offset * scale, half = (clearance * scale) / 2, y = top + TALL / 2, low = top + TALL;
  const mass = disc(0, y, radius, "free"), ends = stops.map(({ soft, thick }, k) => {
    const side = 2 * k - 1, pad = block(0, top, thick, TALL), wall = middle + side * (half + radius + thick);
    pad.style.fill = `color-mix(in srgb, var(--pad-soft) ${soft * 100}%, var(--pad-hard))`;
    return { side, pad, thick, wall, ghost: disc(middle + side * half, y, radius, "ghost") };
  });
  function pose(u) {
    move(mass, u * scale);
    for (const { side, pad, thick, wall } of ends) {
      const deep = side * (u * scale - middle) - half;
      move(pad, wall, -side * limit(1 - deep / thick, 0.12, 1));
      pad.classList.toggle("hit", deep > 0.01);
    }
  }
  const [start, end] = ends.map(({ wall }) => wall);
  return { pose, nodes: [text(0, top - 5, label, "quiet"), block(start, top, end - start, TALL, "cavity"),
    ...ends.flatMap(({ ghost, pad }) => [ghost, pad]), mass, text(middle, low + 21, way, "bold"),
    path(`M${middle - half} ${low + 2}v8v-4H${middle + half}v4v-8`, "clearance")] };
}

function build(scene, { plan, stroke }, width) {
  const structure = Object(scene?.structure), excitation = Object(scene?.excitation), { kind } = structure;
  const all = storeysOf(structure, excitation), every = list(scene?.dampers).map((one, k) => damperOf(Object(one), k, all, plan));
  const storeys = all.slice(0, MOST), dampers = every.filter(({ storey }) => storey >= storeys.at(-1).k).slice(0, MOST);
  // The largest round scale (pixels per metre) at which all fits.
  const left = 84, room = width - left - 10, middle = left + room / 2, reach = Math.max(0, ...dampers.map((one) => one.reach));
  const least = Math.min(room - 20, Math.max(132, ...dampers.map(({ label }) => label.length * 6.4)));
  const far = stroke ?? Math.max(...storeys.map(({ start }) => Math.abs(start)));
  const most = Math.min((room - least) / (reach + 2 * far), room / 2 / reach);
  const scale = most < 1e12 ? round(most, [7, 5, 3, 2, 1.5, 1]) : 0, wide = least + reach * scale;
  const parts = [], moved = []; // moved: functions of x(k), where storey k is, and of the masses' positions
  let y = 28;
  for (const { k, mass, stiffness, start } of storeys) {
    const own = dampers.filter(({ storey }) => storey === k), tall = own.length * ROW || 20, low = y + tall;
    const node = s("g", null, block(-wide / 2, y, wide, tall, "mass"));
    own.forEach((damper, j) => {
      const { nodes, pose } = cavity(damper, scale, y + j * ROW + ABOVE);
      node.append(...nodes);
      moved.push((x, positions) => pose(positions[damper.index] ?? damper.place));
    });
    moved.push((x) => move(node, x(k)));
    if (stroke === undefined && start) parts.push(block(middle + start * scale - wide / 2, y, wide, tall, "ghost"));
    const half = low - tall / 2;
    parts.push(node, text(0, half - 2, all.length > 1 ? `storey ${k + 1}` : "structure", "left"),
      text(0, half + 12, quantity(mass, "kg"), "left"));
    y = low + limit(300 / storeys.length, 20, 64);
    if (kind === "matrices") continue;
    const foot = y, bow = (low + foot) / 2, legs = path("", "column");
    parts.unshift(legs, text(0, bow + 4, quantity(stiffness, "N/m"), "quiet left"));
    moved.push((x) => legs.setAttribute("d", [-0.43, 0.43].map((part) => {
      const [a, b] = [k, k - 1].map((end) => r(x(end) + part * wide));
      return `M${a} ${low}C${a} ${bow} ${b} ${bow} ${b} ${foot}`;
    }).join("")));
  }
  const shaking = excitation.kind ?? "free", base = shaking === "free" ? "" : `${words(shaking).slice(0, 20)} base`;
  const [{ mass, stiffness, start }] = all, released = start ? `starts at ${quantity(start, "m")}` : "";
  parts.push(path(`M${left} ${y}H${width - 10}`, "ground"),
    text(middle, y + 20, base ? `⟵ ${base} ⟶` : "base at rest", "quiet"));
  if (stroke === undefined) parts.push(text(middle + start * scale, 18, released));
  if (scale > 0) {
    const bar = round(90 / scale, [5, 2, 1]);
    parts.push(path(`M6 ${y + 30}v6h${bar * scale}v-6`, "bar"), text(12 + bar * scale, y + 39, quantity(bar, "m"), "left"));
  }
  const what = all.length > 1 ? `${all.length} storeys` : `${quantity(mass, "kg")} on ${quantity(stiffness, "N/m")}`;
  const told = [`A structure of ${what}`, ...dampers.map(({ storey, label, way }) =>
    `on storey ${storey + 1} a free mass of ${label}, clearance ${way}`), base, released].filter(Boolean).join("; ");
  return {
    drawn: { storeys: storeys.map(({ k }) => k), dampers: dampers.map(({ index }) => index) },
    nodes: [s("svg", { viewBox: `0 0 ${width} ${y + 44}`, width, role: "img", "aria-label": told }, parts),
      hint("To scale; twice the free mass, twice its area; a longer contact, a thicker pad.",
        all.length + every.length > storeys.length + dampers.length && ` At most ${MOST} storeys and dampers are drawn.`)],
    pose: (displacements, positions) =>
      moved.forEach((place) => place((k) => middle + (displacements[k] ?? 0) * scale, positions)),
  };
}

// show(scene, {plan, stroke}): `stroke` is the largest displacement, without it the start is dashed; returns which {storeys,
// dampers} are drawn, from 0. pose(displacements of storeys, positions of free masses in theirs), in m.
export function drawing(host) {
  const box = host.appendChild(h("div.drawing"));
  let asked = null, picture = null, posed = [[], []];
  function show(...scene) {
    asked = scene;
    picture = build(...asked, Math.round(limit(box.clientWidth || 640, 260, 760)));
    fill(box, picture.nodes);
    picture.pose(...posed);
    return picture.drawn;
  }
  new ResizeObserver(() => asked && show(...asked)).observe(box);
  return { show, pose: (...state) => picture.pose(...(posed = state)) };
}
