// A result: its title and what can be done with it, above the view of a run or of a study.
import { html, useMemo, useState } from "../ui/preact.js";
import { link } from "../address.js";
import { get } from "../api.js";
import { sceneName } from "../runs/scene_name.js";
import { Failure, Loaded, withSubscripts } from "../ui/controls.js";
import { pageOf } from "../ui/page.js";
import { useLoaded } from "../ui/hooks.js";
import { jobsOf } from "./context.js";
import { ResultView } from "./view.js";

function ResultPage({ address, signal }) {
  const id = address.path[1];
  const loaded = useLoaded(() => get(`v1/results/${encodeURIComponent(id)}`, null, signal), [id]);
  const asked = useMemo(() => jobsOf(id), [id]);
  const jobs = useLoaded(() => asked, [id]);
  const own = jobs.data?.find((job) => job.title)?.title;
  const name = own ?? (loaded.data && jobs.data ? sceneName(loaded.data.scene) : "Result");
  const [chosen, setChosen] = useState(null); // a study, before it starts
  const [isDrawn, setIsDrawn] = useState(false);
  const isStudy = Boolean(loaded.data?.study);
  const study = useLoaded(() => (isStudy ? import("../study/view.js") : null), [isStudy]);
  const rest = useLoaded(
    () => (isStudy || isDrawn ? import("./rest.js") : null),
    [isStudy || isDrawn],
  );
  const View = isStudy ? study.data?.StudyView : ResultView;
  return html`<div class="result">
    <div class="title-row">
      <h1>${withSubscripts(name)}</h1>
      ${
        loaded.data &&
        html`<div class="actions">
          <a class="button primary" href=${link("scene", { result: loaded.data.id })}
            >Change this scene</a
          >
          ${rest.data && html`<${rest.data.Actions} result=${loaded.data} onChoose=${setChosen} />`}
        </div>`
      }
    </div>
    ${chosen && html`<${rest.data.StudyStart} scene=${loaded.data.scene} chosen=${chosen} onClose=${() => setChosen(null)} />`}
    ${jobs.error && html`<${Failure} error=${jobs.error} />`}
    ${study.error && html`<${Failure} error=${study.error} />`}
    ${rest.error && html`<${Failure} error=${rest.error} />`}
    <${Loaded} loaded=${loaded}>
      ${(result) =>
        View &&
        html`<${View}
          result=${result}
          signal=${signal}
          jobs=${asked}
          rest=${rest.data}
          onDrawn=${() => setIsDrawn(true)}
        />`}
    <//>
  </div>`;
}

export const page = pageOf(({ path }) => `Result ${path[1].slice(0, 10)}`, ResultPage);
