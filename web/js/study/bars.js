// Horizontal bars with their names at the left and their numbers at the right: tornado charts, shares, gains.
import { html } from "../ui/preact.js";
import { Chart } from "../chart/chart.js";
import { extentOfValues } from "./parts.js";

const ROW = 26; // px

// `rows`: {label, from, to, text, color, interval: [low, high]}; bars go from `from` (0 where absent) to `to`. `origin` is a
// place with an upright line.
export function Bars({ title, description, x, rows, origin = 0 }) {
  const ends = rows.flatMap(({ from, to, interval }) => [from ?? origin, to, ...(interval ?? [])]);
  const [low, high] = extentOfValues([...ends, origin]) ?? [0, 1];
  const margin = 0.03 * (high - low || 1);
  const least = low === 0 ? 0 : low - margin;
  const domain = [least, high === 0 ? 0 : high + margin];
  const draw = ({ x: across, y: up }) =>
    rows.map((row, at) => {
      const y = up.to(at);
      const a = across.to(row.from ?? origin);
      const b = across.to(row.to);
      return html`<g class="hbar" style=${{ "--ink": `var(--${row.color ?? "accent"})` }}>
        <rect
          x=${Math.min(a, b)}
          y=${y - 8}
          width=${Math.max(1.5, Math.abs(b - a))}
          height="16"
          rx="2"
        />
        ${
          row.interval &&
          html`<path
            d=${`M${across.to(row.interval[0])} ${y}H${across.to(row.interval[1])}m0 -4v8M${across.to(row.interval[0])} ${y - 4}v8`}
          />`
        }
      </g>`;
    });
  return html`<${Chart}
    title=${title}
    description=${description ?? rows.map(({ label, text }) => `${label}: ${text}`).join("; ")}
    height=${rows.length * ROW}
    isFixed
    x=${{ ...x, domain }}
    y=${{ label: "", categories: rows.map(({ label }) => label), ends: rows.map(({ text }) => text) }}
    series=${[]}
    rules=${[{ x: origin, label: "", color: "quiet" }]}
  >
    ${draw}
  <//>`;
}
