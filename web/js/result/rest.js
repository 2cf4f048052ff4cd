// The rest of a result, beside its numbers and its motion: loaded when these are drawn.
import { link } from "../address.js";
import { Tabs } from "../ui/controls.js";
import { html } from "../ui/preact.js";
import { Animation } from "./animation.js";
import { CompareMenu } from "./compare_menu.js";
import { useResult } from "./context.js";
import { Energy } from "./energy.js";
import { Files } from "./files.js";
import { ImpactPanel } from "./impact.js";
import { ImpactTable } from "./impacts.js";
import { MeasuredButton, MeasuredPanel } from "./measured_button.js";
import { Method } from "./method.js";
import { Spectrum } from "./spectrum.js";
import { StudyButtons, StudyStart } from "./studies.js";

export { Files, MeasuredPanel, StudyStart };

const TABS = [
  { name: "impacts", title: "Impacts", view: () => html`<${ImpactTable} />` },
  { name: "spectrum", title: "Spectrum", view: () => html`<${Spectrum} />` },
  { name: "energy", title: "Energy", view: () => html`<${Energy} />` },
  { name: "accuracy", title: "How it was computed", view: () => html`<${Method} />` },
  { name: "files", title: "Files and code", view: () => html`<${Files} />` },
];

export function Actions({ result, onChoose }) {
  return html`<${CompareMenu} key=${result.id} result=${result} />
    <a class="button" href=${link(`results/${result.id}/report`)}>Report</a>
    ${
      !result.study &&
      html`<${MeasuredButton} key=${result.id} id=${result.id} />
        <${StudyButtons} scene=${result.scene} onChoose=${onChoose} />`
    }`;
}

export function Aside() {
  const { result } = useResult();
  return html`<${Animation} /> ${result.scene.dampers.length > 0 && html`<${ImpactPanel} />`}`;
}

export function More() {
  const { query, change } = useResult();
  return html`<${Tabs}
    label="More of this result"
    tabs=${TABS}
    chosen=${query.tab ?? "impacts"}
    onChoose=${(name) => change({ tab: name })}
  />`;
}
