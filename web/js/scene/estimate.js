// The estimate of a scene, from a dry run: modes, cost, warnings. And faults by their places.
import { link } from "../address.js";
import { place } from "./inputs.js";
import { Failure, faultText } from "../ui/controls.js";
import { html } from "../ui/preact.js";
import { number, quantity, title, words } from "../units.js";

// Faults or warnings, each leading to its place by onGo(pointer); the box can take the focus.
const Places = ({ kind, heading, list, onGo }) =>
  html`<div class=${`notice ${kind}`} tabindex="-1">
    <strong>${heading}</strong>
    <ul>
      ${list.map(
        ({ pointer = "", ...fault }) =>
          html`<li>
            <button type="button" class="quiet" onClick=${() => onGo(pointer)}>
              ${title(place(pointer || "/scene"))}</button
            >${` ${faultText(fault)}`}
          </li>`,
      )}
    </ul>
  </div>`;

const Figures = ({ pairs }) =>
  html`<dl class="figures">
    ${pairs.map(
      ([label, value]) =>
        html`<div>
          <dt>${label}</dt>
          <dd>${value}</dd>
        </div>`,
    )}
  </dl>`;

function Answer({ answer, onGo }) {
  const { plan, cost, warnings, cached, result } = answer;
  const { modes, contact_model: model, solver } = plan;
  const each = (write) =>
    modes.slice(0, 3).map(write).join(", ") + (modes.length > 3 ? ` … (${modes.length})` : "");
  return html`<${Figures}
      pairs=${[
        ["Natural frequency", each(({ frequency }) => quantity(frequency, "Hz", 3))],
        ["Damping ratio", each((mode) => `${number(mode.damping_ratio * 100, 2)} %`)],
        ["Contact, solver", `${words(model ?? "none")}, ${solver ?? "by target"}`],
        ["Predicted cost", `${quantity(cost.cpu_seconds, "s", 2)} of CPU`],
      ]}
    />
    ${cached && html`<p>Run before: <a href=${link(`results/${result}`)}>its result</a>.</p>`}
    ${warnings.length > 0 && html`<${Places} kind="warn" heading="Before you rely on it" list=${warnings} onGo=${onGo} />`}`;
}

// `outcome` is {answer}, {faults} or {error}, or null.
export function Estimate({ outcome, onGo }) {
  if (outcome === null) return null;
  const { answer, faults, error } = outcome;
  if (faults)
    return html`<${Places}
      kind="bad"
      heading="To be mended before it runs"
      list=${faults}
      onGo=${onGo}
    />`;
  return error
    ? html`<${Failure} error=${error} />`
    : html`<${Answer} answer=${answer} onGo=${onGo} />`;
}
