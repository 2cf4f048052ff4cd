// Handles on the drawing of a scene that is edited: what is dragged, or moved by arrow keys, changes the scene.
import { html, useRef, useState } from "../ui/preact.js";
import { number, quantity } from "../units.js";
import { Picture, endsOf } from "./drawing.js";
import { MAX_DAMPERS, MAX_STOREYS, limit, modelOf } from "./model.js";
import { px } from "./parts.js";
import { useNews } from "../form/draft.js";
import { useWidth } from "../ui/hooks.js";
import { layoutOf } from "./layout.js";

const STEP = 1.05; // of an arrow key: a ratio
const E_STEP = 0.02; // of a restitution
const E_PIXELS = 160; // for all restitutions
const RATIO_PIXELS = 60; // for a ratio of e = 2.718
const LARGE = 5; // arrow keys with Shift

const tidy = (value) => Number(value.toPrecision(4));
const isPositive = (value) => typeof value === "number" && value > 0 && Number.isFinite(value);

// A handle is {name, x, y, value, valueText, cursor, begin() -> what a drag starts from, drag(start, dx, dy, place),
// press(right, up)}: `dx` and `dy` in pixels of the drawing, up is positive; `right` and `up` count arrow keys.
function clearanceHandle({ draft, cavity, x, scale, which }) {
  const { damper, top } = cavity;
  const pointer = `/dampers/${damper.index}/clearance`;
  const now = () => draft.get(pointer);
  const end = endsOf(damper, scale)[1];
  const set = (value) => draft.move(pointer, Math.max(0, tidy(value)));
  if (typeof now() !== "number" || !(scale > 0)) return null;
  return {
    name: `Clearance${which}`,
    x: x + end.wall,
    y: top + 8,
    value: now(),
    valueText: quantity(now(), "m"),
    cursor: "ew-resize",
    begin: now,
    drag: (start, dx) => set(start + (2 * dx) / scale),
    press: (right, up) => set(now() * STEP ** (right + up) || 0.001),
  };
}

function massHandle({ draft, cavity, x, scale, which }) {
  const { damper, top, tall } = cavity;
  const pointer = `/dampers/${damper.index}/mass`;
  const now = () => draft.get(pointer);
  if (!isPositive(now())) return null;
  const center = [x + damper.place * scale, top + tall - damper.radius - 1];
  const set = (value) => draft.move(pointer, tidy(value));
  return {
    name: `Free mass${which}`,
    x: center[0] + damper.radius * 0.72,
    y: center[1] - damper.radius * 0.72,
    value: now(),
    valueText: quantity(now(), "kg"),
    cursor: "nesw-resize",
    begin: () => ({ mass: now(), radius: damper.radius }),
    // The rim follows the pointer: twice the area is twice the mass.
    drag: ({ mass, radius }, dx, dy) =>
      set(mass * Math.max(0.15, 1 + (dx + dy) / Math.SQRT2 / radius) ** 2),
    press: (right, up) => set(now() * STEP ** (right + up)),
  };
}

// The pads of a damper: up and down is e, to the sides is T_c. A material becomes numbers of one's own.
function padHandle({ draft, cavity, x, scale, which }) {
  const { damper, top, tall } = cavity;
  const pointer = `/dampers/${damper.index}/buffer`;
  const given = draft.get(pointer);
  const derived = draft.check?.plan?.derived?.find((one) => one.damper === damper.index + 1);
  const own = typeof given === "object" && given?.restitution !== undefined ? given : derived;
  const { restitution, contact_time: time } = Object(own);
  if (given === undefined || Object(given).stiffness !== undefined) return null;
  if (typeof restitution !== "number" || !isPositive(time)) return null;
  const now = () => ({ restitution, time });
  const set = (e, seconds) =>
    draft.move(pointer, {
      restitution: Number(limit(e, 0, 1).toFixed(3)),
      contact_time: tidy(limit(seconds, 1e-6, 10)),
    });
  const [end] = endsOf(damper, scale);
  return {
    name: `Restitution and contact time${which}`,
    x: x + end.wall + end.thickness / 2,
    y: top + tall / 2,
    value: restitution,
    valueText: `e ${number(restitution, 3)}, contact time ${quantity(time, "s")}`,
    cursor: "move",
    begin: now,
    drag: (start, dx, dy) =>
      set(start.restitution + dy / E_PIXELS, start.time * Math.exp(dx / RATIO_PIXELS)),
    press: (right, up) => set(restitution + up * E_STEP, time * STEP ** right),
  };
}

// Where the structure starts: the other storeys in proportion.
function startHandle({ draft, model, layout }) {
  const pointer = "/excitation/displacement";
  const given = draft.get(pointer);
  const { scale, middle, wide, slabs } = layout;
  const top = model.start;
  if (!(scale > 0) || given === undefined || (top === 0 && Array.isArray(given))) return null;
  const set = (value) => {
    const next = tidy(value);
    const part = next / top;
    if (!Array.isArray(given)) draft.move(pointer, next);
    else if (next !== 0)
      draft.move(
        pointer,
        given.map((one) => tidy(one * part)),
      );
  };
  const [{ y }] = slabs;
  return {
    name: "Start",
    x: middle + top * scale + (top >= 0 ? wide / 2 : -wide / 2),
    y: y + 14,
    value: top,
    valueText: quantity(top, "m"),
    cursor: "ew-resize",
    begin: () => top,
    drag: (start, dx) => set(start + dx / scale),
    press: (right, up) => set(top * STEP ** (Math.sign(top) * right + up) || 0.001 * (right + up)),
  };
}

// How strongly the base is shaken.
function baseHandle({ draft, model, layout }) {
  const name = ["amplitude", "rms"].find((one) => isPositive(draft.get(`/excitation/${one}`)));
  if (!name || !model.base) return null;
  const pointer = `/excitation/${name}`;
  const now = () => draft.get(pointer);
  const units = { displacement: "m", velocity: "m/s" };
  const unit = units[draft.get("/excitation/quantity")] ?? "m/s^2";
  const set = (value) => draft.move(pointer, tidy(value));
  return {
    name: name === "rms" ? "Base rms" : "Base amplitude",
    x: layout.middle + 34,
    y: layout.ground + layout.wall + 8,
    value: now(),
    valueText: quantity(now(), unit),
    cursor: "ew-resize",
    begin: now,
    drag: (start, dx) => set(start * Math.exp(dx / RATIO_PIXELS)),
    press: (right, up) => set(now() * STEP ** (right + up)),
  };
}

function handlesOf(draft, model, layout) {
  const { middle, scale, slabs } = layout;
  const found = slabs.flatMap(({ cavities }) =>
    cavities.flatMap((cavity) => {
      const which = model.dampers.length > 1 ? `, damper ${cavity.damper.index + 1}` : "";
      const place = { draft, cavity, x: middle, scale, which };
      return [clearanceHandle(place), massHandle(place), padHandle(place)];
    }),
  );
  found.push(startHandle({ draft, model, layout }), baseHandle({ draft, model, layout }));
  return found.filter(Boolean);
}

// `edit` is {draft, history, onDrag(isDragging)}.
function Handles({ edit, model, layout }) {
  const { draft, history, onDrag } = edit;
  const drag = useRef(null); // {name, start, x, y, ratio}
  const handles = handlesOf(draft, model, layout);
  const handleOf = (event) =>
    handles.find(({ name }) => name === event.currentTarget.dataset.handle);
  const begin = (event) => {
    if (event.button > 0) return;
    const { name, begin: from } = handleOf(event);
    const box = event.currentTarget.ownerSVGElement.getBoundingClientRect();
    const ratio = layout.width / box.width;
    drag.current = { name, start: from(), x: event.clientX, y: event.clientY, ratio };
    event.currentTarget.setPointerCapture(event.pointerId);
    history.hold(true);
    onDrag(true);
  };
  const move = (event) => {
    const at = drag.current;
    const handle = at && handles.find(({ name }) => name === at.name);
    if (!handle) return;
    handle.drag(at.start, (event.clientX - at.x) * at.ratio, (at.y - event.clientY) * at.ratio);
  };
  const end = () => {
    if (!drag.current) return;
    drag.current = null;
    history.hold(false);
    onDrag(false);
  };
  const press = (event) => {
    const keys = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const step = keys[event.key];
    if (!step) return;
    event.preventDefault();
    const size = event.shiftKey ? LARGE : 1;
    handleOf(event).press(step[0] * size, step[1] * size);
  };
  return html`<svg
    class="handles"
    viewBox=${`0 0 ${layout.width} ${px(layout.height)}`}
    width=${layout.width}
    height=${px(layout.height)}
    role="group"
    aria-label="Handles of the drawing"
  >
    ${handles.map(
      ({ name, x, y, value, valueText, cursor }) =>
        html`<g
          key=${name}
          class="handle"
          role="slider"
          tabindex="0"
          aria-label=${name}
          aria-valuenow=${value}
          aria-valuetext=${valueText}
          data-handle=${name}
          style=${{ cursor }}
          onPointerDown=${begin}
          onPointerMove=${move}
          onPointerUp=${end}
          onPointerCancel=${end}
          onLostPointerCapture=${end}
          onKeyDown=${press}
        >
          <title>${`${name}: ${valueText}`}</title>
          <circle class="reach" cx=${px(x)} cy=${px(y)} r="12" />
          <circle class="grip" cx=${px(x)} cy=${px(y)} r="5" />
        </g>`,
    )}
  </svg>`;
}

// While something is dragged the scale stays what it was.
export function SceneDrawing({ draft, history }) {
  useNews(draft);
  const box = useRef(null);
  const width = useWidth(box, 250, 720);
  const [fixed, setFixed] = useState(null);
  const model = modelOf(draft.scene, draft.check?.plan);
  const layout = width > 0 && layoutOf(model, { width, fixed });
  const onDrag = (isDragging) => setFixed(isDragging ? layout.scale : null);
  const cut = model.isCut
    ? ` At most ${MAX_STOREYS} storeys and ${MAX_DAMPERS} dampers are drawn.`
    : "";
  return html`<div class="drawing" ref=${box}>
    ${
      layout &&
      html`<div class="drawing-stage">
        <${Picture} model=${model} layout=${layout} />
        <${Handles} edit=${{ draft, history, onDrag }} model=${model} layout=${layout} />
      </div>`
    }
    <p class="hint">
      ${`Drag a stop, the ball's rim, a pad (e up, contact time to the side) or the start. Lengths are to scale.${cut}`}
    </p>
  </div>`;
}
