// A run: the six numbers, the motion beside its animation and the selected impact, and everything else in tabs.
import { html } from "../ui/preact.js";
import { Notice } from "../ui/controls.js";
import { ResultContext, useResultContext } from "./context.js";
import { ResultHeadlines } from "./headlines.js";
import { Motion } from "./motion.js";
import { readable } from "../units.js";

// `rest` is the module rest.js once it is loaded: it is not waited for until onDrawn() says that the motion is there.
export function ResultView({ result, signal, jobs, rest, onDrawn }) {
  const context = useResultContext(result, signal, jobs);
  return html`<${ResultContext.Provider} value=${context}>
    <${ResultHeadlines} />
    ${rest && html`<${rest.MeasuredPanel} id=${result.id} />`}
    <div class="panel-grid">
      <${Motion} onDrawn=${onDrawn} />
      <aside>${rest && html`<${rest.Aside} />`}</aside>
    </div>
    <${Warnings} warnings=${result.warnings} />
    ${rest && html`<${rest.More} />`}
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
      ${warnings.map((warning) => html`<li>${readable(warning.detail)}</li>`)}
    </ul>
  <//>`;
