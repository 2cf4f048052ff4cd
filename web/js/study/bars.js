// Horizontal bars with their names at the left and their numbers at the ends: tornado charts, shares, gains.
import { html } from "../ui/preact.js";
import { Chart } from "../chart/chart.js";
import { extentOfValues } from "./parts.js";

const ROW = 26; // px

// `rows`: {label, from, to, text, color, interval: [low, high]}; bars go from `from` (0 where absent) to `to`. `origin` is a
// place with an upright line.
export function Bars({ title, description, x, rows, origin = 0, log = false }) {
  const ends = rows.flatMap(({ from, to, interval }) => [from ?? origin, to, ...(interval ?? [])]);
  const [low, high] = extentOfValues([...ends, origin]) ?? [0, 1];
  const margin = 0.12 * (high - low || 1);
  const least = low === 0 ? 0 : low - margin;
  const domain = log ? [low / 1.2, high * 1.3] : [least, high + margin];
  const draw = ({ x: across, left, right }) =>
    rows.map((row, at) => {
      const y = 8 + (at + 0.5) * ROW;
      const a = across.to(row.from ?? origin);
      const b = across.to(row.to);
      const start = Math.min(a, b);
      const isLow = row.to < (row.from ?? origin);
      const [first, last] = row.interval ? row.interval.map(across.to) : [start, Math.max(a, b)];
      const outer = isLow ? first : last;
      const isFlipped = isLow ? outer - 60 < left : outer + 60 > right;
      const anchor = isLow === isFlipped ? "start" : "end";
      return html`<g class="hbar" style=${{ "--ink": `var(--${row.color ?? "accent"})` }}>
        <rect x=${start} y=${y - 8} width=${Math.max(1.5, Math.abs(b - a))} height="16" rx="2" />
        ${
          row.interval &&
          html`<path
            d=${`M${across.to(row.interval[0])} ${y}H${across.to(row.interval[1])}m0 -4v8M${across.to(row.interval[0])} ${y - 4}v8`}
          />`
        }
        <text x=${outer + (anchor === "start" ? 6 : -6)} y=${y + 4} text-anchor=${anchor}>
          ${row.text}
        </text>
      </g>`;
    });
  return html`<${Chart}
    title=${title}
    description=${description ?? rows.map(({ label, text }) => `${label}: ${text}`).join("; ")}
    height=${rows.length * ROW}
    isFixed
    x=${{ ...x, domain, log }}
    y=${{ label: "", categories: rows.map(({ label }) => label) }}
    series=${[]}
    rules=${log ? [] : [{ x: origin, label: "", color: "quiet" }]}
  >
    ${draw}
  <//>`;
}
