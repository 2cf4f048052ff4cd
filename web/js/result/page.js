// A result: the six numbers, the motion beside its animation and the selected impact, and everything else in tabs.
import { html, useMemo, useState } from "../ui/preact.js";
import { link } from "../address.js";
import { get } from "../api.js";
import { Failure, Loaded, Notice, Panel, Tabs } from "../ui/controls.js";
import { useLoaded } from "../ui/store.js";
import { pageOf } from "../ui/page.js";
import { Animation } from "./animation.js";
import { CompareMenu } from "./compare_menu.js";
import { ResultContext, jobsOf, useResultContext } from "./context.js";
import { Energy } from "./energy.js";
import { Files } from "./files.js";
import { ResultHeadlines } from "./headlines.js";
import { ImpactPanel } from "./impact.js";
import { ImpactTable } from "./impacts.js";
import { sceneName } from "../runs/scene_name.js";
import { KINDS } from "../study/kinds.js";
import { StudyButtons, StudyStart } from "./studies.js";
import { MeasuredButton, MeasuredPanel } from "./measured_button.js";
import { Method } from "./method.js";
import { Motion } from "./motion.js";
import { Spectrum } from "./spectrum.js";

export function ResultView({ result, signal, jobs }) {
  const context = useResultContext(result, signal, jobs);
  const { query: view, change } = context;
  const tabs = [
    { name: "impacts", title: "Impacts", view: () => html`<${ImpactTable} />` },
    { name: "spectrum", title: "Spectrum", view: () => html`<${Spectrum} />` },
    { name: "energy", title: "Energy", view: () => html`<${Energy} />` },
    {
      name: "accuracy",
      title: "How it was computed",
      view: () => html`<${Method} />`,
    },
    { name: "files", title: "Files and code", view: () => html`<${Files} />` },
  ];
  const hasDamper = result.scene.dampers.length > 0;
  return html`<${ResultContext.Provider} value=${context}>
    <${ResultHeadlines} />
    <${MeasuredPanel} id=${result.id} />
    <div class="panel-grid">
      <${Motion} />
      <aside>
        <${Animation} />
        ${hasDamper && html`<${ImpactPanel} />`}
      </aside>
    </div>
    <${Warnings} warnings=${result.warnings} />
    <${Tabs}
      label="More of this result"
      tabs=${tabs}
      chosen=${view.tab ?? "impacts"}
      onChoose=${(name) => change({ tab: name })}
    />
  <//>`;
}

// Remarks: none of them changes the numbers above.
const Warnings = ({ warnings }) =>
  warnings.length > 0 &&
  html`<${Notice}
    kind="info"
    title=${warnings.length === 1 ? "A remark" : `${warnings.length} remarks`}
  >
    <ul>
      ${warnings.map((warning) => html`<li>${warning.detail}</li>`)}
    </ul>
  <//>`;

// A study: its own view; the run of the scene without it can be opened below.
function StudyView({ result, signal, jobs }) {
  const [isOpen, setIsOpen] = useState(false);
  const { kind } = result.study;
  const { title, load } = KINDS[kind];
  const loaded = useLoaded(load, [kind]);
  const context = useResultContext(result, signal, jobs);
  return html`<${ResultContext.Provider} value=${context}>
      <${Panel} title=${title} help=${title}>
        <${Loaded} loaded=${loaded}>${(View) => html`<${View} />`}<//>
        <p>
          <a class="button" href=${link("scene", { result: result.id })}>Change the study</a>
          ${" "}<a class="button" href=${`guide/study-${kind}.html`}>Guide to this study</a>
        </p>
      <//>
      <${Panel} title="Files and code"><${Files} /><//>
    <//>
    <details onToggle=${(event) => setIsOpen(event.currentTarget.open)}>
      <summary>The run of the unchanged scene, without the study</summary>
      ${isOpen && html`<${ResultView} result=${result} signal=${signal} jobs=${jobs} />`}
    </details>`;
}

function ResultPage({ address, signal }) {
  const id = address.path[1];
  const loaded = useLoaded(() => get(`v1/results/${encodeURIComponent(id)}`, null, signal), [id]);
  const asked = useMemo(() => jobsOf(id), [id]);
  const jobs = useLoaded(() => asked, [id]);
  const own = jobs.data?.find((job) => job.title)?.title;
  const name = own ?? (loaded.data && jobs.data ? sceneName(loaded.data.scene) : "Result");
  const [chosen, setChosen] = useState(null); // a study, before it starts
  const hasStudies = loaded.data && !loaded.data.study;
  return html`<div class="result">
    <div class="title-row">
      <h1>${name}</h1>
      ${
        loaded.data &&
        html`<div class="actions">
          <a class="button primary" href=${link("scene", { result: loaded.data.id })}
            >Change this scene</a
          >
          <${CompareMenu} key=${loaded.data.id} result=${loaded.data} />
          <a class="button" href=${link(`results/${loaded.data.id}/report`)}>Report</a>
          ${hasStudies && html`<${MeasuredButton} key=${loaded.data.id} id=${loaded.data.id} />`}
          ${hasStudies && html`<${StudyButtons} scene=${loaded.data.scene} onChoose=${setChosen} />`}
        </div>`
      }
    </div>
    ${chosen && html`<${StudyStart} scene=${loaded.data.scene} chosen=${chosen} onClose=${() => setChosen(null)} />`}
    ${jobs.error && html`<${Failure} error=${jobs.error} />`}
    <${Loaded} loaded=${loaded}>
      ${(result) => html`<${result.study ? StudyView : ResultView} result=${result} signal=${signal} jobs=${asked} />`}
    <//>
  </div>`;
}

export const page = pageOf(({ path }) => `Result ${path[1].slice(0, 10)}`, ResultPage);
