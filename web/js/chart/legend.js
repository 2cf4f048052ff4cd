// The names of a chart's series: a click hides or shows one, a double click or Shift with a click shows it alone.
import { html } from "../ui/preact.js";

export function Legend({ series, hidden, setHidden }) {
  const labels = [...new Set(series.map((one) => one.label))];
  const isolate = (label) => {
    const others = labels.filter((one) => one !== label);
    const isAlone = others.every((one) => hidden.has(one)) && !hidden.has(label);
    setHidden(new Set(isAlone ? [] : others));
  };
  const toggle = (label, event) => {
    if (event.shiftKey) return isolate(label);
    const next = new Set(hidden);
    if (!next.delete(label)) next.add(label);
    setHidden(next.size === labels.length ? new Set() : next);
  };
  return html`<div class="legend">
    ${labels.map((label) => {
      const one = series.find((other) => other.label === label);
      return html`<button
        type="button"
        class="legend-item"
        aria-pressed=${!hidden.has(label)}
        title="Click: hide or show. Double click: show it alone."
        style=${{ "--ink": `var(--${one.color ?? "accent"})` }}
        onClick=${(event) => toggle(label, event)}
        onDblClick=${() => isolate(label)}
      >
        <span class=${`swatch ${one.kind ?? "line"} ${one.dash ? "dash" : ""}`}></span>${label}
      </button>`;
    })}
  </div>`;
}
