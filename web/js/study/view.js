// A study: its own view; the run of the scene without it can be opened below.
import { link } from "../address.js";
import { ResultContext, useResultContext } from "../result/context.js";
import { ResultView } from "../result/view.js";
import { Loaded, Panel } from "../ui/controls.js";
import { html, useState } from "../ui/preact.js";
import { useLoaded } from "../ui/hooks.js";
import { KINDS } from "./kinds.js";

export function StudyView({ result, signal, jobs, rest }) {
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
      <${Panel} title="Files and code">${rest && html`<${rest.Files} />`}<//>
    <//>
    <details onToggle=${(event) => setIsOpen(event.currentTarget.open)}>
      <summary>The run of the unchanged scene, without the study</summary>
      ${isOpen && html`<${ResultView} result=${result} signal=${signal} jobs=${jobs} rest=${rest} />`}
    </details>`;
}
