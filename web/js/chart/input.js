// How a chart is zoomed, moved and read: by mouse, fingers and keys. `latest.current` is the state of chart.js.
import { announce } from "../ui/announce.js";
import { markerAt, placeText, valuesAt } from "./cursor.js";

const SHORT = 5; // pixels: less is a click, not a drag

// The part of x in view, `factor` times as wide about `center` and moved by `shift` of its width; never beyond the whole.
function turned({ whole, domain, xScale }, factor, center, shift = 0) {
  const [map, back] = xScale.isLog ? [Math.log10, (value) => 10 ** value] : [Number, Number];
  const [first, last] = whole.map(map);
  const [low, high] = domain.map(map);
  const width = Math.max((high - low) * factor, (last - first) * 1e-6);
  if (width >= last - first) return null;
  const middle = center === null ? (low + high) / 2 : map(center);
  const part = (middle - low) / (high - low);
  const start = Math.min(Math.max(middle - part * width + shift * width, first), last - width);
  return [back(start), back(start + width)];
}

// Opens the marker or the point under the cursor.
function pick({ cursor, markers, series, xScale, yScale, onPick }) {
  const at = cursor.get();
  if (!at) return;
  const marker = markerAt(markers, xScale, at.x);
  if (marker?.onPick) return marker.onPick();
  if (!onPick) return;
  const values = valuesAt(series, at.x, {}).filter((one) => one.y !== null);
  if (values.length === 0) return;
  const distance = (one) => (at.y === null ? 0 : Math.abs(yScale.to(one.y) - at.y));
  const nearest = values.reduce((a, b) => (distance(b) < distance(a) ? b : a));
  onPick(nearest.series, nearest.index);
}

// Listens to the pointers over the plot; returns a function that ends it.
export function handlePointers(box, svg, latest) {
  const pointers = new Map(); // id -> {start, now, y}, in pixels of the plot
  const selection = box.appendChild(
    Object.assign(document.createElement("div"), { className: "selection" }),
  );
  let drag = null; // "select" or "move"
  let pinch = null; // {domain, span}
  const stop = new AbortController();
  const { signal } = stop;
  const listen = (name, act, options) => box.addEventListener(name, act, { signal, ...options });
  const place = (event) => {
    const { left, top } = svg.getBoundingClientRect();
    return { x: event.clientX - left, y: event.clientY - top };
  };
  const valueAt = (pixel) => {
    const { xScale } = latest.current;
    const [first, last] = xScale.pixels;
    return xScale.from(Math.min(last, Math.max(first, pixel)));
  };
  function showSelection(from, to) {
    const { yScale } = latest.current;
    const [bottom, top] = yScale.pixels;
    Object.assign(selection.style, {
      display: "block",
      left: `${Math.min(from, to)}px`,
      width: `${Math.abs(to - from)}px`,
      top: `${top}px`,
      height: `${bottom - top}px`,
    });
  }
  const end = () => {
    selection.style.display = "none";
    drag = null;
    pinch = null;
  };
  const spanOf = () => {
    const [a, b] = [...pointers.values()].map((one) => one.now);
    return { width: Math.max(20, Math.abs(a - b)), middle: (a + b) / 2 };
  };

  listen("pointerdown", (event) => {
    const { x, y } = place(event);
    const { xScale, domain } = latest.current;
    const [first, last] = xScale.pixels;
    if (event.button > 1 || x < first - 4 || x > last + 4 || event.target.closest("button")) return;
    pointers.set(event.pointerId, { start: x, now: x, y });
    if (pointers.size === 2) {
      end();
      pinch = { domain, ...spanOf() };
    } else {
      drag = event.shiftKey || event.button === 1 ? "move" : "select";
    }
  });
  listen("pointermove", (event) => {
    const { x, y } = place(event);
    const { cursor, id, domain, whole, setRange, xScale } = latest.current;
    const held = pointers.get(event.pointerId);
    const [first, last] = xScale.pixels;
    if (x >= first && x <= last) cursor.set({ x: valueAt(x), y, owner: id });
    if (!held) return;
    if (Math.abs(x - held.start) >= SHORT && !box.hasPointerCapture(event.pointerId))
      box.setPointerCapture(event.pointerId);
    if (pinch && pointers.size === 2) {
      held.now = x;
      const { width, middle } = spanOf();
      const center = xScale.isLog
        ? null
        : pinch.domain[0] +
          ((pinch.middle - first) / (last - first)) * (pinch.domain[1] - pinch.domain[0]);
      const shift = -(middle - pinch.middle) / (last - first);
      setRange(turned({ whole, domain: pinch.domain, xScale }, pinch.width / width, center, shift));
    } else if (drag === "move") {
      const shift = -(x - held.now) / (last - first);
      held.now = x;
      setRange(turned({ whole, domain, xScale }, 1, null, shift));
    } else if (drag === "select") {
      held.now = x;
      if (Math.abs(x - held.start) >= SHORT)
        showSelection(
          Math.min(last, Math.max(first, held.start)),
          Math.min(last, Math.max(first, x)),
        );
    }
  });
  listen("pointerup", (event) => {
    const held = pointers.get(event.pointerId);
    pointers.delete(event.pointerId);
    if (!held) return;
    const isDrag = Math.abs(held.now - held.start) >= SHORT;
    if (drag === "select" && isDrag) {
      const range = [valueAt(held.start), valueAt(held.now)].sort((a, b) => a - b);
      if (range[1] > range[0]) latest.current.setRange(range);
    } else if (drag === "select" && !pinch) {
      latest.current.cursor.set({ x: valueAt(held.start), y: held.y, owner: latest.current.id });
      pick(latest.current);
    }
    if (pointers.size === 0) end();
  });
  listen("pointercancel", (event) => {
    pointers.delete(event.pointerId);
    end();
  });
  listen("pointerleave", () => {
    const { cursor, id } = latest.current;
    if (cursor.get()?.owner === id && pointers.size === 0) cursor.set(null);
  });
  listen("dblclick", () => latest.current.setRange(null));
  // Pinching a touch pad comes as a wheel with Ctrl; a wheel alone scrolls the page, unless the chart has the focus.
  listen(
    "wheel",
    (event) => {
      if (!event.ctrlKey && document.activeElement !== box) return;
      event.preventDefault();
      const state = latest.current;
      const isSideways = Math.abs(event.deltaX) > Math.abs(event.deltaY);
      const factor = isSideways ? 1 : Math.exp(Math.max(-60, Math.min(60, event.deltaY)) / 200);
      const shift = isSideways ? event.deltaX / 500 : 0;
      state.setRange(turned(state, factor, valueAt(place(event).x), shift));
    },
    { passive: false },
  );
  return () => {
    stop.abort();
    selection.remove();
  };
}

// The cursor to the next of these places; what is there is said.
function step(state, direction, places) {
  const { cursor, domain, series, markers, xScale, id, axes } = state;
  const now = cursor.get()?.x ?? (direction > 0 ? -Infinity : Infinity);
  const least = (domain[1] - domain[0]) * 1e-9;
  const ahead = places.filter(
    (x) => x >= domain[0] && x <= domain[1] && (x - now) * direction > least,
  );
  if (ahead.length === 0) return;
  const x = ahead.reduce((a, b) => ((b - a) * direction < 0 ? b : a));
  cursor.set({ x, y: null, owner: id });
  const marker = markerAt(markers, xScale, x);
  const said = valuesAt(series, x, axes.y).map((one) => `${one.series.label} ${one.text}`);
  announce([placeText(axes.x, x), ...said, marker?.label].filter(Boolean).join(", "));
}

export function handleKey(event, state) {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target !== event.currentTarget)
    return;
  const center = state.cursor.get()?.x ?? null;
  const zoom = (factor, shift) => state.setRange(turned(state, factor, center, shift));
  const sideways = (direction) =>
    event.shiftKey
      ? zoom(1, direction / 4)
      : step(
          state,
          direction,
          state.series.flatMap((one) => Array.from(one.x)),
        );
  const toMarker = (direction) =>
    step(
      state,
      direction,
      state.markers.map((marker) => marker.x),
    );
  const acts = {
    ArrowLeft: () => sideways(-1),
    ArrowRight: () => sideways(1),
    PageUp: () => toMarker(-1),
    PageDown: () => toMarker(1),
    "+": () => zoom(0.5),
    "-": () => zoom(2),
    0: () => state.setRange(null),
    Enter: () => pick(state),
  };
  if (!acts[event.key]) return;
  event.preventDefault();
  acts[event.key]();
}
