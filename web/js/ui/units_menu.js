// What is in the menu of the header in which units are chosen: loaded when it is opened.
import { settings, unitSettings } from "../settings.js";
import { pretty } from "../units.js";
import { Choice } from "./controls.js";
import { html, render } from "./preact.js";
import { useStore } from "./hooks.js";

function Settings() {
  const chosen = useStore(settings);
  return unitSettings.map(
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
  );
}

export const showUnits = (host) => render(html`<${Settings} />`, host);
