// A scene as a picture that can be posed: one mass on a spring and a dashpot, or storeys on columns, each free mass between
// its pads. Poses change attributes of what is there, so that an animation costs little.
import { html, useLayoutEffect, useMemo, useRef, useState } from "../ui/preact.js";
import { quantity } from "../units.js";
import { CAVITY, WALL, layout, limit } from "./layout.js";

const COILS = 6;
const GHOSTS = 5; // places of a free mass' trail
const LONGEST_ARROW = 40; // px

const pixel = (value) => Math.round(limit(value, -1e5, 1e5) * 100) / 100;
const shifted = (x) => `translate(${pixel(x)} 0)`;

// Short strokes beside a line from (x0, y0) to (x1, y1), as drawings mark what does not move.
function hatching(x0, y0, x1, y1, dx, dy) {
  const length = Math.hypot(x1 - x0, y1 - y0);
  const steps = Math.floor(length / 8);
  return Array.from({ length: steps + 1 }, (_, step) => {
    const part = Math.min(1, (step * 8) / length);
    return `M${pixel(x0 + part * (x1 - x0))} ${pixel(y0 + part * (y1 - y0))}l${dx} ${dy}`;
  }).join("");
}

// A line with arrows at both ends; where it is too short for them they point at it from outside.
function dimensionPath(from, to, y) {
  const ends = `M${pixel(from)} ${y - 5}v10M${pixel(to)} ${y - 5}v10`;
  const line = `M${pixel(from)} ${y}H${pixel(to)}`;
  if (to - from < 16)
    return {
      line,
      arrows: `${ends}M${pixel(from - 9)} ${y}h9l-5 -3m5 3l-5 3M${pixel(to + 9)} ${y}h-9l5 -3m-5 3l5 3`,
    };
  return {
    line,
    arrows: `${ends}M${pixel(from + 5)} ${y - 3}l-5 3l5 3M${pixel(to - 5)} ${y - 3}l5 3l-5 3`,
  };
}

// From x0 to x1 along y; its ends are straight.
function springPath(x0, x1, y) {
  const lead = Math.min(10, (x1 - x0) / 6);
  const step = (x1 - x0 - 2 * lead) / (2 * COILS);
  const turns = Array.from({ length: 2 * COILS }, (_, turn) => {
    const x = x0 + lead + (turn + 0.5) * step;
    return `L${pixel(x)} ${y + (turn % 2 === 0 ? -7 : 7)}`;
  }).join("");
  return `M${pixel(x0)} ${y}h${pixel(lead)}${turns}L${pixel(x1 - lead)} ${y}H${pixel(x1)}`;
}

// The cylinder stands at the wall, the piston moves with the mass.
function dashpotPath(x0, x1, y, { start, length }) {
  const piston = limit(x1 - (length + 2 * (start - x0)) / 2, start + 3, start + length - 3);
  return {
    cylinder: `M${x0} ${y}H${start}M${pixel(start + length)} ${y - 8}H${start}v16H${pixel(start + length)}`,
    piston: `M${pixel(piston)} ${y - 6}v12M${pixel(piston)} ${y}H${pixel(x1)}`,
  };
}

// A column that is vertical at both ends: x = b + (a - b)(3s² - 2s³), which a Bézier curve with its controls at the thirds is.
function columnPath(top, foot, a, b) {
  const third = (foot - top) / 3;
  return `M${pixel(a)} ${top}C${pixel(a)} ${pixel(top + third)} ${pixel(b)} ${pixel(foot - third)} ${pixel(b)} ${foot}`;
}

// The parts of a cavity about its storey's middle, and what a pose changes of it.
function cavityOf(damper, scale) {
  const { stops, offset, clearance, radius, top } = damper;
  const middle = offset * scale;
  const half = (clearance * scale) / 2;
  const ends = stops.map((stop, at) => {
    const side = 2 * at - 1;
    return { ...stop, side, wall: middle + side * (half + radius + stop.thickness) };
  });
  return { ...damper, middle, half, ends, y: top + CAVITY / 2, low: top + CAVITY };
}

function Cavity({ cavity, isHousing }) {
  const { ends, top, y, low, middle, half, radius, label, dimension, index } = cavity;
  const [start, end] = ends.map(({ wall }) => wall);
  const { line, arrows } = dimensionPath(middle - half, middle + half, low + 7);
  return html`<g data-damper=${index}>
    ${isHousing && html`<rect class="housing" x=${pixel(start - 5)} y=${top - 3} width=${pixel(end - start + 10)} height=${CAVITY + 28} rx="3" />`}
    <text x="0" y=${top - 6} class="quiet">${label}</text>
    <rect class="cavity" x=${pixel(start)} y=${top} width=${pixel(end - start)} height=${CAVITY} />
    ${ends.map(
      ({ side, thickness, softness, wall }, at) =>
        html`<circle class="ghost" cx=${pixel(middle + side * half)} cy=${y} r=${pixel(radius)} />
          <rect
            class="pad"
            data-part=${`pad-${at}`}
            y=${top}
            width=${pixel(thickness)}
            height=${CAVITY}
            transform=${`translate(${pixel(wall)} 0) scale(${-side} 1)`}
            style=${{ fill: `color-mix(in srgb, var(--pad-soft) ${pixel(softness * 100)}%, var(--pad-hard))` }}
          />
          <path class="stop" d=${`M${pixel(wall)} ${top}v${CAVITY}`} />`,
    )}
    ${Array.from(
      { length: GHOSTS },
      (_, at) =>
        html`<circle
          class="trail"
          data-part="trail"
          cx="0"
          cy=${y}
          r=${pixel(radius)}
          style=${{ opacity: (0.4 * (at + 1)) / GHOSTS }}
          visibility="hidden"
        />`,
    )}
    <circle class="free" data-part="free" cx="0" cy=${y} r=${pixel(radius)} />
    <path class="force" data-part="force" visibility="hidden" />
    <path class="clearance" d=${line} />
    <path class="dimension" d=${arrows} />
    <text x=${pixel(middle)} y=${low + 21} class="bold">${dimension}</text>
  </g>`;
}

const columnEnds = (wide) => [-wide / 2 + 6, wide / 2 - 6];

function Storey({ storey, picture, cavities }) {
  const { index, top, height, slab, mass, start } = storey;
  const { kind, wide, middle, scale, hasGhosts, count } = picture;
  const isMass = kind === "mass";
  const slabTop = top + height - slab;
  const left = middle - wide / 2;
  const shape = (className, x) =>
    html`<rect
      class=${className}
      x=${pixel(x)}
      y=${slabTop}
      width=${pixel(wide)}
      height=${slab}
      rx=${isMass ? 4 : 2}
    />`;
  return html`${hasGhosts && start !== 0 && shape("ghost", left + start * scale)}
    <g data-storey=${index}>
      ${shape("mass", left)}
      ${
        isMass &&
        html`<circle class="roller" cx=${pixel(left + 16)} cy=${storey.foot - 4.5} r="4.5" />
          <circle class="roller" cx=${pixel(left + wide - 16)} cy=${storey.foot - 4.5} r="4.5" />`
      }
      <g transform=${shifted(middle)}>
        ${cavities.map((cavity) => html`<${Cavity} cavity=${cavity} isHousing=${!isMass} />`)}
      </g>
      ${isMass && html`<text x=${pixel(left)} y=${top - 6} class="left">${quantity(mass, "kg")}</text>`}
    </g>
    ${
      !isMass &&
      html`<text x="0" y=${slabTop + 2} class="left"
          >${count > 1 ? `storey ${index + 1}` : "structure"}</text
        >
        <text x="0" y=${slabTop + 15} class="left quiet">${quantity(mass, "kg")}</text>`
    }`;
}

function groundText({ base, isCut }) {
  if (isCut) return "more storeys below";
  return base ? `⟵ ${base} ⟶` : "base at rest";
}

// What stands still: ground, wall, labels, the bar of the scale.
function Surroundings({ picture }) {
  const { kind, width, ground, base, start, bar, storeys, middle, wide, scale, isCut } = picture;
  const isMass = kind === "mass";
  const [first] = storeys;
  const from = isMass ? WALL : pixel(middle - wide / 2 - picture.far - 10);
  const to = isMass ? width - 4 : pixel(middle + wide / 2 + picture.far + 10);
  const top = first.top + 4;
  const startX = middle + first.start * scale + (isMass ? wide / 2 : 0);
  return html`${
      isMass &&
      html`<path class="hatching" d=${hatching(WALL, top, WALL, ground, -7, 7)} />
        <path class="ground" d=${`M${WALL} ${top}V${ground}`} />
        ${first.stiffness !== null && html`<text x=${WALL + 6} y=${first.top + first.height * 0.28 - 13} class="left quiet">${quantity(first.stiffness, "N/m")}</text>`}`
    }
    ${
      isCut
        ? html`<path class="cut" d=${`M${from} ${ground}H${to}`} />`
        : html`<path class="hatching" d=${hatching(from + 6, ground, to, ground, -7, 7)} />
            <path class="ground" d=${`M${from} ${ground}H${to}`} />`
    }
    <text x=${to} y=${ground + 22} class=${base ? "right base" : "right quiet"}>
      ${groundText(picture)}
    </text>
    ${start && html`<text x=${pixel(startX)} y=${first.top - 6} class=${isMass ? "right" : null}>${start}</text>`}
    ${
      scale > 0 &&
      html`<path
          class="bar"
          d=${`M${isMass ? WALL : 2} ${ground + 15}v6h${pixel(bar.length)}v-6`}
        />
        <text x=${pixel((isMass ? WALL : 2) + bar.length + 6)} y=${ground + 23} class="left"
          >${bar.label}</text
        >`
    }`;
}

// The parts of an SVG that poses change.
function partsOf(svg, picture, cavities) {
  const find = (root, selector) => root.querySelector(selector);
  return {
    spring: find(svg, "[data-part=spring]"),
    piston: find(svg, "[data-part=piston]"),
    columns: [...svg.querySelectorAll("[data-part=columns]")],
    storeys: picture.storeys.map(({ index }) => find(svg, `[data-storey="${index}"]`)),
    dampers: cavities.flat().map((cavity) => {
      const group = find(svg, `[data-damper="${cavity.index}"]`);
      return {
        cavity,
        free: find(group, "[data-part=free]"),
        force: find(group, "[data-part=force]"),
        pads: [0, 1].map((at) => find(group, `[data-part=pad-${at}]`)),
        trail: [...group.querySelectorAll("[data-part=trail]")],
      };
    }),
  };
}

function springEnds(picture) {
  const [{ top, height }] = picture.storeys;
  const length = picture.middle - picture.wide / 2 - WALL;
  const cylinder = limit(2 * picture.far + 12, 22, length - 30);
  return {
    springY: pixel(top + height * 0.28),
    dashpotY: pixel(top + height * 0.72),
    cylinder: { start: WALL + pixel((length - cylinder) / 2), length: pixel(cylinder) },
    massLeft: (x) => picture.middle - picture.wide / 2 + x,
  };
}

function poseDamper({ cavity, free, force, pads, trail }, scale, place, past, strength) {
  const at = place * scale;
  free.setAttribute("transform", shifted(at));
  pads.forEach((pad, index) => {
    const { side, wall, thickness } = cavity.ends[index];
    const depth = side * (at - cavity.middle) - cavity.half;
    const squeeze = limit(1 - depth / thickness, 0.12, 1);
    pad.setAttribute("transform", `translate(${pixel(wall)} 0) scale(${pixel(-side * squeeze)} 1)`);
    pad.classList.toggle("hit", depth > 0.01);
  });
  trail.forEach((ghost, index) => {
    const was = past?.[index];
    ghost.setAttribute("visibility", was === undefined ? "hidden" : "visible");
    if (was !== undefined) ghost.setAttribute("transform", shifted(was * scale));
  });
  // Of the buffer on the free mass, from the pad into the cavity.
  const length = limit(Math.abs(strength ?? 0), 0, 1) * LONGEST_ARROW;
  force.setAttribute("visibility", length > 1.5 ? "visible" : "hidden");
  if (length <= 1.5) return;
  const sign = at > cavity.middle ? -1 : 1;
  const tip = at + sign * (length + 8);
  const head = sign * Math.min(8, length);
  force.setAttribute(
    "d",
    `M${pixel(at)} ${cavity.y}H${pixel(tip)}m${pixel(-head)} -5l${pixel(head)} 5l${pixel(-head)} 5`,
  );
}

// pose({displacements, positions, trails, strengths}): of storeys (m), of free masses in theirs (m), where these were before
// (the earliest first), and their contact forces as parts of the largest; each by its index.
function makePose(svg, picture, cavities) {
  const parts = partsOf(svg, picture, cavities);
  const ends = picture.kind === "mass" ? springEnds(picture) : null;
  return ({ displacements = [], positions = [], trails = [], strengths = [] }) => {
    const shift = (index) => (displacements[index] ?? 0) * picture.scale;
    parts.storeys.forEach((group, at) =>
      group.setAttribute("transform", shifted(shift(picture.storeys[at].index))),
    );
    if (ends) {
      const x = ends.massLeft(shift(0));
      parts.spring?.setAttribute("d", springPath(WALL, x, ends.springY));
      parts.piston?.setAttribute("d", dashpotPath(WALL, x, ends.dashpotY, ends.cylinder).piston);
    }
    parts.columns.forEach((columns, at) => {
      const { index, top, height, foot } = picture.storeys[at];
      const below = index > 0 ? shift(index - 1) : 0;
      const paths = columnEnds(picture.wide).map((end) =>
        columnPath(
          top + height,
          foot,
          picture.middle + end + shift(index),
          picture.middle + end + below,
        ),
      );
      columns.setAttribute("d", paths.join(""));
    });
    for (const damper of parts.dampers) {
      const { index, place } = damper.cavity;
      poseDamper(damper, picture.scale, positions[index] ?? place, trails[index], strengths[index]);
    }
  };
}

// The width of an element, followed while it changes.
function useWidth(box) {
  const [width, setWidth] = useState(0);
  useLayoutEffect(() => {
    const measure = () => setWidth(Math.round(limit(box.current.clientWidth || 640, 240, 720)));
    measure();
    const observer = new ResizeObserver(measure);
    observer.observe(box.current);
    return () => observer.disconnect();
  }, []);
  return width;
}

// `poser` is a ref: its `current` is the pose function above once the picture is there. `pose` is where it begins. `children`
// makes what lies on top: children(picture).
export function Drawing({ scene, plan, stroke, pose, poser, children }) {
  const box = useRef(null);
  const svg = useRef(null);
  const width = useWidth(box);
  const picture = useMemo(
    () => (width > 0 ? layout(scene, { plan, stroke }, width) : null),
    [scene, plan, stroke, width],
  );
  const cavities = picture?.storeys.map(({ dampers }) =>
    dampers.map((damper) => cavityOf(damper, picture.scale)),
  );
  const last = useRef({});
  useLayoutEffect(() => {
    if (!picture) return;
    const set = makePose(svg.current, picture, cavities);
    const keep = (state) => {
      last.current = state;
      set(state);
    };
    keep(pose ?? last.current);
    if (poser) poser.current = keep;
  }, [picture]);
  return html`<div class="drawing" ref=${box}>
    ${
      picture &&
      html`<svg
          ref=${svg}
          viewBox=${`0 0 ${width} ${pixel(picture.height)}`}
          width=${width}
          height=${pixel(picture.height)}
          role="img"
          aria-label=${picture.label}
        >
          <${Surroundings} picture=${picture} />
          ${picture.kind === "mass" && html`<${SpringAndDashpot} picture=${picture} />`}
          ${
            picture.kind === "frame" &&
            picture.hasColumns &&
            picture.storeys.map(
              ({ index, foot, top, height, stiffness }) =>
                html`<path class="column" data-part="columns" key=${index} />
                  <text x="0" y=${pixel((top + height + foot) / 2 + 6)} class="left quiet">
                    ${quantity(stiffness, "N/m")}
                  </text>`,
            )
          }
          ${picture.storeys.map(
            (storey, at) =>
              html`<${Storey}
                key=${storey.index}
                storey=${storey}
                picture=${picture}
                cavities=${cavities[at]}
              />`,
          )}
          ${children?.(picture)}
        </svg>
        ${picture.hidden > 0 && html`<p class="hint">${`${picture.hidden} storeys and dampers are not drawn.`}</p>`}`
    }
  </div>`;
}

function SpringAndDashpot({ picture }) {
  const { springY, dashpotY, cylinder, massLeft } = springEnds(picture);
  const { damping, storeys } = picture;
  return html`${storeys[0].stiffness !== 0 && html`<path class="spring" data-part="spring" d=${springPath(WALL, massLeft(0), springY)} />`}
  ${
    damping &&
    html`<path class="spring" d=${dashpotPath(WALL, massLeft(0), dashpotY, cylinder).cylinder} />
      <path class="spring" data-part="piston" />
      <text x=${WALL + 6} y=${dashpotY + 21} class="left quiet">${damping}</text>`
  }`;
}
