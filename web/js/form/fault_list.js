// Faults of what a form describes, or warnings, each with a button to its field.
import { place } from "../scene/inputs.js";
import { faultText } from "../ui/controls.js";
import { html } from "../ui/preact.js";
import { title } from "../units.js";

// onGo(pointer) leads to the field; `whole` names what a fault without a place is about. Further options are attributes.
export const FaultList = ({ kind = "bad", heading, faults, whole, onGo, ...attributes }) =>
  html`<div class=${`notice ${kind}`} ...${attributes}>
    <strong>${heading}</strong>
    <ul>
      ${faults.map(
        ({ pointer, ...fault }) =>
          html`<li>
            <button type="button" class="quiet" onClick=${() => onGo(pointer ?? "")}>
              ${title(place(pointer || `/${whole}`))}</button
            >${` ${faultText(fault)}`}
          </li>`,
      )}
    </ul>
  </div>`;
