// A scene as a picture in a state of motion: one mass on its spring and dashpot, or storeys on columns, each with its free
// masses between their stops.
import { html } from "../ui/preact.js";
import { quantity } from "../units.js";
import { roundDown } from "./layout.js";
import { limit } from "./model.js";
import {
  Ball,
  Dashpot,
  Dimension,
  Force,
  Hatched,
  Shaking,
  Spring,
  columnPath,
  px,
} from "./parts.js";

const FORCE = 44; // pixels of the largest force's arrow

const Text = ({ x, y, name, children }) =>
  html`<text x=${px(x)} y=${px(y)} class=${name}>${children}</text>`;
const Block = ({ x, y, width, height, name, style, rx }) =>
  html`<rect
    x=${px(x)}
    y=${px(y)}
    width=${px(Math.max(0, width))}
    height=${px(height)}
    rx=${rx}
    class=${name}
    style=${style}
  />`;

// The ends of a cavity about the middle of its slab: where the free mass' middle meets a stop, and where the wall is.
export function endsOf({ stops, offset, clearance, radius }, scale) {
  return stops.map(({ softness, thickness, name }, at) => {
    const side = 2 * at - 1;
    const meet = offset * scale + (side * clearance * scale) / 2;
    return { side, softness, thickness, name, meet, wall: meet + side * (radius + thickness) };
  });
}

// A pad between its wall and the free mass: what is pressed out of its length goes to its height.
function Pad({ end, top, tall, at }) {
  const { side, softness, thickness, meet, wall } = end;
  const depth = side * (at - meet);
  const left = limit(1 - depth / thickness, 0.15, 1);
  const width = thickness * left;
  const color = `color-mix(in srgb, var(--pad-soft) ${Math.round(softness * 100)}%, var(--pad-hard))`;
  const inset = 5 * left;
  return html`<${Block}
    x=${side < 0 ? wall : wall - width}
    y=${top + inset}
    width=${width}
    height=${tall - 2 * inset}
    rx=${Math.min(4, width / 2)}
    name=${depth > 0.01 ? "pad hit" : "pad"}
    style=${{ fill: color }}
  />`;
}

function Cavity({ cavity, layout, x, place, force }) {
  const { damper, top, tall } = cavity;
  const { scale, isCompact } = layout;
  const ends = endsOf(damper, scale);
  const [start, end] = ends.map(({ wall }) => x + wall);
  const at = place * scale;
  const y = top + tall - damper.radius - 1;
  const low = top + tall;
  const middle = x + damper.offset * scale;
  return html`<g>
    ${!isCompact && html`<${Text} x=${x} y=${top - 7} name="quiet">${damper.label}<//>`}
    <${Block} x=${start} y=${top} width=${end - start} height=${tall} name="cavity" rx="2" />
    <path class="stop" d=${`M${px(start)} ${px(top)}v${tall}M${px(end)} ${px(top)}v${tall}`} />
    ${ends.map((one) => html`<${Pad} end=${{ ...one, meet: x + one.meet, wall: x + one.wall }} top=${top} tall=${tall} at=${x + at} />`)}
    ${
      !isCompact &&
      ends.map(
        ({ meet }) =>
          html`<g class="ghost">
            <circle cx=${px(x + meet)} cy=${px(y)} r=${damper.radius} />
            <path d=${`M${px(x + meet)} ${px(y)}V${px(low + 4)}`} />
          </g>`,
      )
    }
    <${Ball} x=${x + at} y=${y} radius=${damper.radius} />
    ${
      force !== 0 &&
      html`<${Force} x=${x + at} y=${y} length=${-force} />
        <${Force} x=${force > 0 ? end : start} y=${y} length=${force} />`
    }
    ${
      !isCompact &&
      html`<${Dimension}
          from=${x + ends[0].meet}
          to=${x + ends[1].meet}
          y=${low + 8}
          up=${4}
          name="clearance"
        />
        <${Text} x=${middle} y=${low + 22} name="bold">${damper.dimension}<//>`
    }
  </g>`;
}

function Slab({ slab, layout, x, state, peak }) {
  const { y, tall, cavities } = slab;
  const { wide } = layout;
  return html`<g>
    <${Block} x=${x - wide / 2} y=${y} width=${wide} height=${tall} name="mass" rx="4" />
    ${cavities.map((cavity) => {
      const { damper } = cavity;
      const force = state.forces?.[damper.index] ?? 0;
      return html`<${Cavity}
        cavity=${cavity}
        layout=${layout}
        x=${x}
        place=${state.positions?.[damper.index] ?? damper.place}
        force=${peak > 0 ? (FORCE * force) / peak : 0}
      />`;
    })}
  </g>`;
}

// What holds one mass: a wall, a spring and a dashpot side by side, and wheels on the ground.
function Suspension({ slab, model, layout, x }) {
  const { wall, wide, middle, ground, isCompact, width } = layout;
  const { y, tall, storey } = slab;
  const from = wall;
  const to = x - wide / 2;
  const rest = middle - wide / 2 - from;
  const [upper, lower] = [y + tall * 0.3, y + tall * 0.74].map(Math.round);
  const label = from + rest / 2;
  return html`<g>
    <${Hatched} x=${0} y=${y - 6} width=${wall} height=${ground - y + 6} face="right" />
    <${Hatched} x=${0} y=${ground} width=${width} height=${wall - 4} face="top" />
    <${Spring} from=${from} to=${to} y=${upper} />
    ${model.damping && html`<${Dashpot} from=${from} to=${to} rest=${rest} far=${layout.far} y=${lower} />`}
    ${
      !isCompact &&
      html`<${Text} x=${label} y=${upper - 13} name="quiet">${quantity(storey.stiffness, "N/m")}<//>
        ${model.damping && html`<${Text} x=${label} y=${lower + 21} name="quiet">${model.damping}<//>`}`
    }
    ${[-0.32, 0.32].map((part) => html`<circle class="wheel" cx=${px(x + part * wide)} cy=${ground - 4.5} r="4.5" />`)}
  </g>`;
}

function Columns({ slabs, model, layout, xOf }) {
  const { legs } = layout;
  const name = model.kind === "chain" ? "column" : "coupling";
  const lowest = slabs.at(-1).storey.index;
  return slabs.map(({ storey, y, tall, foot }) => {
    const here = xOf(storey.index);
    const isLowest = storey.index === lowest;
    const below = isLowest && lowest > 0 ? here : xOf(storey.index - 1); // it stands on one that is not drawn
    const d = [-legs, legs].map((leg) => columnPath(here + leg, y + tall, below + leg, foot));
    return html`<path class=${name} d=${d.join("")} />`;
  });
}

// The names of storeys; where these are close to each other every fifth, without their masses.
function StoreyLabels({ slab, model, layout }) {
  const { storey, y, tall, foot } = slab;
  const { isCompact, pitch } = layout;
  const half = y + tall / 2;
  const number = storey.index + 1;
  const isClose = pitch < 13;
  if (isClose && number % 5 !== 0 && number !== model.count) return null;
  const name = model.count > 1 ? `storey ${number}` : "structure";
  if (isCompact || pitch < 44)
    return html`<${Text} x=${2} y=${half + 4} name="quiet left">${isCompact ? number : name}<//>`;
  return html`<${Text} x=${2} y=${half - 2} name="left">${name}<//>
    <${Text} x=${2} y=${half + 13} name="quiet left">${quantity(storey.mass, "kg")}<//>
    ${model.kind === "chain" && html`<${Text} x=${2} y=${(y + tall + foot) / 2 + 4} name="quiet left">${quantity(storey.stiffness, "N/m")}<//>`}`;
}

// Where the structure starts: dashed, with the way there as a dimension.
function Start({ model, layout }) {
  const { middle, scale, wide, slabs, top, isCompact } = layout;
  const { start, isSingle } = model;
  const [first] = slabs;
  return html`<g class="start">
    ${slabs.map(
      ({ storey, y, tall }) =>
        storey.start !== 0 &&
        html`<${Block}
          x=${middle + storey.start * scale - wide / 2}
          y=${y}
          width=${wide}
          height=${tall}
          name="ghost"
          rx="4"
        />`,
    )}
    ${
      !isCompact &&
      start !== 0 &&
      html`<${Dimension}
          from=${middle}
          to=${middle + start * scale}
          y=${20}
          up=${6}
          down=${top - 22}
          name="release"
        />
        <${Text} x=${middle + (start * scale) / 2} y=${12} name="bold"
          >${`starts at ${quantity(start, "m")}`}<//
        >`
    }
    ${isSingle && !isCompact && html`<${Text} x=${middle - wide / 2 + 4} y=${first.y - 7} name="left">${quantity(first.storey.mass, "kg")}<//>`}
  </g>`;
}

function Foot({ model, layout }) {
  const { ground, wall, width, scale, middle, isCompact } = layout;
  const y = ground + wall + 18;
  const bar = scale > 0 ? roundDown(84 / scale, [5, 2, 1]) : 0;
  if (isCompact) return model.base && html`<${Shaking} x=${width - 30} y=${ground + 6} />`;
  return html`<g>
    ${model.base && html`<${Shaking} x=${middle} y=${ground + wall + 8} /><${Text} x=${middle} y=${y + 10} name="quiet">${model.base}<//>`}
    ${
      bar > 0 &&
      html`<path class="bar" d=${`M${4} ${y + 2}v7h${px(bar * scale)}v-7`} />
        <${Text} x=${10 + bar * scale} y=${y + 10} name="quiet left bar-text"
          >${quantity(bar, "m")}<//
        >`
    }
  </g>`;
}

// What storeys stand on; dashed where there are more below.
function Ground({ model, layout }) {
  const { left, width, ground, wall } = layout;
  const x = left - 8;
  if (model.storeys.at(-1).index > 0)
    return html`<path class="cut" d=${`M${x} ${px(ground)}H${width}`} />`;
  return html`<${Hatched} x=${x} y=${ground} width=${width - x} height=${wall - 4} face="top" />`;
}

// The picture itself. `state` is {displacements of storeys, positions of free masses in theirs, forces on the structure} by
// index; without it what is at rest, the start dashed. `peak` is the largest force, `trail` the past of the motion.
export function Picture({ model, layout, state = {}, peak = 0, trail, svgRef }) {
  const { width, height, middle, scale, slabs } = layout;
  const { isSingle } = model;
  const xOf = (index) => middle + (state.displacements?.[index] ?? 0) * scale;
  return html`<svg
    ref=${svgRef}
    viewBox=${`0 0 ${width} ${px(height)}`}
    width=${width}
    height=${px(height)}
    role="img"
    aria-label=${model.sentence}
  >
    ${!state.displacements && html`<${Start} model=${model} layout=${layout} />`}
    ${trail && html`<${Trail} trail=${trail} model=${model} layout=${layout} />`}
    ${
      isSingle
        ? html`<${Suspension} slab=${slabs[0]} model=${model} layout=${layout} x=${xOf(0)} />`
        : html`<${Ground} model=${model} layout=${layout} />`
    }
    ${!isSingle && html`<${Columns} slabs=${slabs} model=${model} layout=${layout} xOf=${xOf} />`}
    ${slabs.map((slab) => html`<${Slab} key=${slab.storey.index} slab=${slab} layout=${layout} x=${xOf(slab.storey.index)} state=${state} peak=${peak} />`)}
    ${!isSingle && slabs.map((slab) => html`<${StoreyLabels} slab=${slab} model=${model} layout=${layout} />`)}
    <${Foot} model=${model} layout=${layout} />
  </svg>`;
}

const PIECES = 6; // of a line, each fainter than the one before

function Line({ points, name }) {
  const size = Math.ceil(points.length / PIECES);
  return Array.from({ length: PIECES }, (_, at) => {
    const part = points.slice(at * size, (at + 1) * size + 1);
    if (part.length < 2) return null;
    const d = part.map(([x, y], index) => `${index === 0 ? "M" : "L"}${px(x)} ${px(y)}`).join("");
    return html`<path class=${name} d=${d} stroke-opacity=${px(0.9 * (1 - at / PIECES))} />`;
  });
}

// `trail` is {span, states: [{age, displacements, positions}]}, the newest first.
function Trail({ trail, model, layout }) {
  const { span, states } = trail;
  const { top, middle, scale, trail: height } = layout;
  const highest = model.storeys[0].index;
  const own = model.dampers.filter(({ storey }) => storey === highest);
  const y = (age) => top - (age / span) * height;
  const xOf = (state) => middle + state.displacements[highest] * scale;
  const line = (place) => states.map((state) => [xOf(state) + place(state) * scale, y(state.age)]);
  return html`<g class="trail">
    <${Line} points=${line(() => 0)} name="trail-structure" />
    ${own.map(({ index }) => html`<${Line} points=${line((state) => state.positions[index])} name="trail-ball" />`)}
  </g>`;
}
