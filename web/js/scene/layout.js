// Where the parts of a drawing are, in pixels, and how many pixels a metre has: displacements and clearances share the scale.
import { limit } from "./model.js";

const NOTHING = 0.02; // m that there is room for where nothing has a length
const STEPS = [7, 5, 3, 2, 1.5, 1]; // a scale is one of them times a power of ten
const WALL = 16; // a hatched wall or ground is thick
const SPRING = 62; // the shortest that the spring of one mass becomes
const LEGS = 0.42; // of the width from the middle to a column

// The largest up to `most` that is one of `steps` times a power of ten.
export function roundDown(most, steps) {
  const ten = 10 ** Math.floor(Math.log10(most));
  return ten * steps.find((step) => step * ten <= most * 1.000001);
}

// What a slab is made of from its top: a label, the cavity, the dimension; the same without words.
const ROWS = {
  full: { above: 20, cavity: 48, below: 28, bare: 24, least: 168 },
  compact: { above: 8, cavity: 42, below: 8, bare: 14, least: 96 },
};

function scaleFor(model, { room, least, stroke, fixed }) {
  if (fixed) return fixed;
  const far = stroke ?? model.far;
  const longest = Math.max(0, ...model.dampers.map((one) => one.reach));
  const reach = longest || (far > 0 ? 0 : NOTHING);
  const most = Math.min((room - least) / (reach + 2 * far), (room * 0.42) / reach);
  return most > 0 && most < 1e12 ? roundDown(most, STEPS) : 0;
}

// Of many storeys each is a thin plate.
const TALL = 6;
const PLATES = { full: { bare: 9, gap: 7 }, compact: { bare: 4, gap: 3 } };

const leastWidth = ({ label, radius, stops }, row) =>
  Math.max(
    row === ROWS.full ? label.length * 6.6 + 16 : 0,
    2 * radius + stops[0].thickness + stops[1].thickness + 36,
  );

// {scale, width, height, slabs: [{storey, y, tall, foot, cavities}], middle, wide, …}. `stroke` is the largest displacement that
// will be shown, without it the start's; `height` is what a frame should come to; `fixed` keeps a scale.
export function layoutOf(model, { width, stroke, height, isCompact, trail = 0, fixed }) {
  const kind = isCompact ? "compact" : "full";
  const row = ROWS[kind];
  const isTall = model.storeys.length > TALL;
  const { bare, gap: leastGap } = isTall
    ? PLATES[kind]
    : { bare: row.bare, gap: isCompact ? 16 : 34 };
  const { isSingle, storeys, dampers } = model;
  const labels = isCompact ? 22 : 88;
  const left = isSingle ? WALL + 2 : labels;
  const room = width - left - (isSingle ? 8 : 12) - (isSingle ? SPRING : 0);
  const least = Math.min(
    room - 24,
    Math.max(isSingle ? 120 : row.least, ...dampers.map((one) => leastWidth(one, row))),
  );
  const scale = scaleFor(model, { room, least, stroke, fixed });
  const reach = Math.max(0, ...dampers.map((one) => one.reach));
  const wide = least + reach * scale;
  const far = (stroke ?? model.far) * scale;
  const spring = SPRING + Math.max(far, (room - wide - far) * 0.45);
  const middle = isSingle ? left + spring + wide / 2 : left + room / 2;

  const top = isCompact ? 8 + trail : Math.max(46, trail + 26);
  const bottom = isCompact ? WALL + 6 : WALL + 40;
  const tallOf = (storey) => {
    const own = dampers.filter((one) => one.storey === storey.index).length;
    const empty = isSingle ? row.cavity + 16 : bare;
    return own * (row.above + row.cavity + row.below) || empty;
  };
  const slabsTall = storeys.reduce((sum, storey) => sum + tallOf(storey), 0);
  const gap = isSingle
    ? 9
    : limit(((height ?? 430) - top - bottom - slabsTall) / storeys.length, leastGap, 66);
  let y = top;
  const slabs = storeys.map((storey) => {
    const tall = tallOf(storey);
    const own = dampers.filter((one) => one.storey === storey.index);
    const slab = {
      storey,
      y,
      tall,
      foot: y + tall + gap,
      cavities: own.map((damper, at) => ({
        damper,
        top: y + at * (row.above + row.cavity + row.below) + row.above,
        tall: row.cavity,
      })),
    };
    y = slab.foot;
    return slab;
  });
  return {
    width,
    height: y + bottom,
    scale,
    isCompact,
    pitch: gap + bare,
    left,
    far,
    middle,
    wide,
    legs: LEGS * wide,
    slabs,
    ground: y,
    wall: WALL,
    top,
    trail,
  };
}
