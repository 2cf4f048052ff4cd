// What the pages of studies share: the sentence that a study leads to, ways to scenes and runs, bars.
import { html } from "../ui/preact.js";
import { go, jobPath, link, pack } from "../address.js";
import { Chart } from "../chart/chart.js";
import { extentOf } from "../chart/scale.js";
import { Button, Choice, Failure, optionsOf, withSubscripts } from "../ui/controls.js";
import { labelOf } from "../runs/names.js";
import { useLoaded } from "../ui/hooks.js";
import { quantity, readable, share, title } from "../units.js";

// The scene alone, without its study.
export const plainScene = ({ study, ...scene }) => scene;

// A clause of the service as a sentence; a member is named by its words.
export const remarkText = (clause) =>
  `${readable(clause)
    .replace(/^(\/\S+):/, (_, pointer) => labelOf(pointer))
    .replace(/^[a-z](?=[a-z]* )/, (letter) => letter.toUpperCase())}.`;

// What the service remarks on a study, a sentence each; one without a subject is about the member that it points at.
export const remarksOf = ({ warnings }) =>
  warnings.map(({ pointer, detail }) =>
    remarkText(/^(may|is|has) /.test(detail) ? `${labelOf(pointer)} ${detail}` : detail),
  );

// "12 % below the given scene"; null without a reference.
export function compared(value, reference, name) {
  if (!(reference > 0)) return null;
  const part = 1 - value / reference;
  if (Math.abs(part) < 0.0005) return `as ${name}`;
  return `${share(Math.abs(part))} ${part > 0 ? "below" : "above"} ${name}`;
}

export const between = (low, high, unit) =>
  `${quantity(low, unit, 3)} to ${quantity(high, unit, 3)}`;

// What a study leads to: one remarkText, with what follows from it.
export const Decision = ({ children, more = [], actions }) =>
  html`<div class="decision">
    <p class="answer">${typeof children === "string" ? withSubscripts(children) : children}</p>
    ${more.filter(Boolean).map((text) => html`<p>${text}</p>`)}
    ${actions && html`<div class="actions">${actions}</div>`}
  </div>`;

// A column of quantities that have a unit each.
export const quantities = (label, value, digits, unitOf = ({ unit }) => unit) => ({
  label,
  isNumeric: true,
  value,
  cell: (row) => quantity(value(row), unitOf(row), digits),
});

// A column of intervals [low, high]; null where one is not known.
export const intervals = (label, intervalOf, unitOf = ({ unit }) => unit) => ({
  label,
  value: (row) => {
    const interval = intervalOf(row);
    return interval ? between(...interval, unitOf(row)) : null;
  },
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
  const run = async () => go(jobPath(await make()));
  return html`<${Button} isPrimary=${isPrimary} onClick=${run}>${label}<//>`;
}

// The place of the scene that something varies, of several the first.
export const pointerOf = ({ pointer, pointers }) => pointer ?? pointers?.[0] ?? "";

export const MetricChoice = ({ metrics, metric, change }) =>
  html`<${Choice}
    label="Metric"
    options=${optionsOf(metrics, title)}
    value=${metric}
    onChange=${(key) => change({ metric: key })}
  />`;

// Horizontal bars with their names at the left and their numbers at the right: tornado charts, shares, gains.
const ROW = 26; // px

// `rows`: {label, from, to, text, color, interval: [low, high]}; bars go from `from` (0 where absent) to `to`. `origin` is a
// place with an upright line.
export function Bars({ title: name, description, x, rows, origin = 0 }) {
  const ends = rows.flatMap(({ from, to, interval }) => [from ?? origin, to, ...(interval ?? [])]);
  const [low, high] = extentOf([[...ends, origin]]) ?? [0, 1];
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
    title=${name}
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
