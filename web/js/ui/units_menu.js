// The menu of the header in which units are chosen.
import { settings, unitSettings } from "../settings.js";
import { pretty } from "../units.js";
import { Choice } from "./controls.js";
import { html } from "./preact.js";
import { useStore } from "./store.js";

export function UnitsMenu() {
  const chosen = useStore(settings);
  return html`<button type="button" class="quiet" popovertarget="units-menu">Units</button>
    <div id="units-menu" popover="auto" role="group" aria-label="How numbers are written">
      ${unitSettings.map(
        ({ name, label, choices }) =>
          html`<div class="setting">
            <span aria-hidden="true">${label}</span>
            <${Choice}
              label=${label}
              options=${Object.keys(choices).map((value) => ({ value, label: value === "auto" ? "Automatic" : pretty(value) }))}
              value=${chosen[name]}
              onChange=${(value) => settings.patch({ [name]: value })}
            />
          </div>`,
      )}
    </div>`;
}
