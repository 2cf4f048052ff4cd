// What the pages of studies share: the sentence that a study leads to, ways to scenes and runs, bars.
import { html } from "../ui/preact.js";
import { go, link, pack } from "../address.js";
import { Chart } from "../chart/chart.js";
import { Button, Failure, withSubscripts } from "../ui/controls.js";
import { labelOf } from "../runs/names.js";
import { useLoaded } from "../ui/store.js";
import { quantity, readable } from "../units.js";

// The scene alone, without its study.
export const plainScene = ({ study, ...scene }) => scene;

// A clause of the service as a sentence; a member is named by its words.
export const sentence = (clause) =>
  `${readable(clause)
    .replace(/^(\/\S+):/, (_, pointer) => labelOf(pointer))
    .replace(/^[a-z](?=[a-z]* )/, (letter) => letter.toUpperCase())}.`;

// What the service remarks on a study, a sentence each; one without a subject is about the member that it points at.
export const remarksOf = ({ warnings }) =>
  warnings.map(({ pointer, detail }) =>
    sentence(/^(may|is|has) /.test(detail) ? `${labelOf(pointer)} ${detail}` : detail),
  );

export const between = (low, high, unit) =>
  `${quantity(low, unit, 3)} to ${quantity(high, unit, 3)}`;

// What a study leads to: one sentence, with what follows from it.
export const Decision = ({ children, more = [], actions }) =>
  html`<div class="decision">
    <p class="answer">${typeof children === "string" ? withSubscripts(children) : children}</p>
    ${more.filter(Boolean).map((text) => html`<p>${text}</p>`)}
    ${actions && html`<div class="actions">${actions}</div>`}
  </div>`;

// A column of quantities that have a unit each.
export const quantities = (label, value, unitOf, digits) => ({
  label,
  isNumeric: true,
  value,
  cell: (row) => quantity(value(row), unitOf(row), digits),
});

// A link to the form with the scene that load() brings: the address holds it.
export function SceneLink({ label, load, keys = [], className }) {
  const { data, error } = useLoaded(
    async () => link("scene", { s: await pack(await load()) }),
    keys,
  );
  if (error) return html`<${Failure} error=${error} />`;
  return html`<a class=${className} href=${data}>${label}</a>`;
}

// A button that makes a job and goes to its result, or to the job while it runs.
export function JobButton({ label, make, isPrimary }) {
  const run = async () => {
    const job = await make();
    go(job.status === "successful" ? `results/${job.result}` : `jobs/${job.id}`);
  };
  return html`<${Button} isPrimary=${isPrimary} onClick=${run}>${label}<//>`;
}

// [smallest, largest] of the numbers among values; null where there is none.
export function extentOfValues(values) {
  const numbers = values.filter((value) => Number.isFinite(value));
  if (numbers.length === 0) return null;
  return [Math.min(...numbers), Math.max(...numbers)];
}

// Horizontal bars with their names at the left and their numbers at the right: tornado charts, shares, gains.
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
