// What stands on a chart beside its series: shaded spans, rules, marks of events.
import { html } from "../ui/preact.js";

export function Spans({ spans, plot }) {
  const { x, left, right, top, bottom } = plot;
  return spans.map(({ from, to, label }) => {
    const start = Math.max(left, x.to(from));
    const end = Math.min(right, x.to(to));
    if (!(end > start)) return null;
    return html`<g class="span">
      <rect x=${start} y=${top} width=${end - start} height=${bottom - top} />
      ${label && end - start > 80 && html`<text x=${start + 6} y=${top + 14}>${label}</text>`}
    </g>`;
  });
}

function Rule({ rule, plot, line }) {
  const { x, y, left, right, top, bottom } = plot;
  const style = { "--ink": `var(--${rule.color ?? "quiet"})` };
  if (rule.x !== undefined) {
    const at = x.to(rule.x);
    if (!(at >= left && at <= right)) return null;
    const isLate = at > (left + right) / 2;
    return html`<g class="rule" style=${style}>
      <line x1=${at} x2=${at} y1=${top} y2=${bottom} />
      <text
        x=${isLate ? at - 5 : at + 5}
        y=${top + 14 * (line + 1)}
        text-anchor=${isLate ? "end" : "start"}
        >${rule.label}</text
      >
    </g>`;
  }
  const at = y.to(rule.y);
  if (!(at >= top && at <= bottom)) return null;
  return html`<g class="rule" style=${style}>
    <line x1=${left} x2=${right} y1=${at} y2=${at} />
    <text x=${right - 4} y=${at < top + 18 ? at + 14 : at - 5} text-anchor="end"
      >${rule.label}</text
    >
  </g>`;
}

// Labels of upright rules stand in lines below each other, below those of spans where `isBelow`.
export const Rules = ({ rules, plot, isBelow }) => {
  const upright = rules.filter((rule) => rule.x !== undefined && rule.label);
  return rules.map((rule) => {
    const line = (isBelow ? 1 : 0) + (Math.max(0, upright.indexOf(rule)) % 3);
    return html`<${Rule} rule=${rule} plot=${plot} line=${line} />`;
  });
};

// Ticks above the plot; a chosen one is longer.
export function Markers({ markers, plot }) {
  const { x, left, right, top } = plot;
  return html`<g class="markers">
    ${markers.map((marker) => {
      const at = x.to(marker.x);
      if (!(at >= left - 1 && at <= right + 1)) return null;
      const style = { "--ink": `var(--${marker.color ?? "force"})` };
      return html`<path
        class=${marker.isChosen ? "marker chosen" : "marker"}
        style=${style}
        d=${`M${at.toFixed(1)} ${top - (marker.isChosen ? 14 : 10)}V${top - 1}`}
      />`;
    })}
  </g>`;
}
