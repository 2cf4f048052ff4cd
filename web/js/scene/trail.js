// Where the structure and its free masses were a moment ago: lines that rise from the top of the drawing and fade, as a
// recorder's paper would show them.
import { html } from "../ui/preact.js";
import { px } from "./parts.js";

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
export function Trail({ trail, model, layout }) {
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
