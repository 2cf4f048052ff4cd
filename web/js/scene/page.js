// A scene: described at the left, drawn and live at the right, run from here.
import { schema as schemaNamed } from "../api.js";
import { focusField } from "../form/form.js";
import { Failure, Help, Loaded, Panel } from "../ui/controls.js";
import { pageOf } from "../ui/page.js";
import { html, useEffect, useMemo, useRef, useState } from "../ui/preact.js";
import { useLoaded, useStore } from "../ui/store.js";
import { Accuracy } from "./accuracy.js";
import { Buffer } from "./buffer.js";
import { SceneDrawing } from "./editor.js";
import { Estimate } from "./estimate.js";
import { ExamplesDialog } from "./examples.js";
import { JsonView } from "./json.js";
import { Live } from "./live.js";
import { RecordField } from "./record_field.js";
import { makeSession } from "./session.js";
import { SceneForm } from "./steps.js";

const WIDGETS = [
  [/^\/dampers.*buffer$/, Buffer],
  [/^\/excitation\/name$/, RecordField],
  [/^\/accuracy$/, Accuracy],
];

// Ctrl with Enter runs, with Z undoes, with Shift and Z redoes.
function listen({ past, run }, signal) {
  const press = (event) => {
    if (!event.ctrlKey && !event.metaKey) return;
    // A field undoes what was typed in it by itself.
    const isTyped = event.target.matches("input:not([type=range]), textarea");
    if (event.key.toLowerCase() === "z" && !isTyped) {
      event.preventDefault();
      if (event.shiftKey) past.redo();
      else past.undo();
    }
    if (event.key !== "Enter") return;
    event.preventDefault();
    run();
  };
  addEventListener("keydown", press, { signal });
}

function ScenePage({ address, signal }) {
  const session = useMemo(() => makeSession(signal), []);
  const schema = useLoaded(() => schemaNamed("scene"), []);
  const [hasExamples, setHasExamples] = useState(false);
  const steps = useRef(null);
  const { draft, past } = session;
  const goTo = (pointer) => focusField(steps.current, pointer);
  useEffect(() => {
    session.load(address.query);
  }, [address]);
  return html`<div class="title-row scene-title">
      <h1>Scene</h1>
      <${Help} name="Scene" />
      <p class="lead">
        A free mass between two buffered stops in a structure: change what you like.
      </p>
      <div class="actions">
        <button type="button" onClick=${() => setHasExamples(true)}>Examples</button>
        <${RunButton} session=${session} signal=${signal} />
      </div>
    </div>
    <${LoadError} session=${session} />
    ${hasExamples && html`<${ExamplesDialog} onClose=${() => setHasExamples(false)} />`}
    <div class="scene">
      <div ref=${steps} onChange=${session.keepNow}>
        <${Loaded} loaded=${schema}>
          ${(found) =>
            html`<${SceneForm} schema=${found} draft=${draft} widgets=${WIDGETS} />
              <${JsonView} draft=${draft} />`}
        <//>
      </div>
      <div class="beside">
        <div class="panel drawn"><${SceneDrawing} draft=${draft} history=${past} /></div>
        <${Live} draft=${draft} history=${past} signal=${signal} />
        <${EstimatePanel} session=${session} onGo=${goTo} />
      </div>
    </div>`;
}

function RunButton({ session, signal }) {
  const { isRunning } = useStore(session.status);
  const run = async () => {
    await session.run();
    document.querySelector(".estimate .bad")?.focus();
  };
  useEffect(() => listen({ past: session.past, run }, signal), []);
  // Not disabled while it runs: it keeps the focus.
  return html`<button
    type="button"
    class="primary run"
    title="Ctrl + Enter"
    aria-keyshortcuts="Control+Enter"
    aria-busy=${isRunning}
    onClick=${run}
  >
    Run
  </button>`;
}

function LoadError({ session }) {
  const { loadError } = useStore(session.status);
  return loadError && html`<${Failure} error=${loadError} />`;
}

function EstimatePanel({ session, onGo }) {
  const { text, outcome } = useStore(session.status);
  return html`<${Panel} title="Estimate">
    <p class="hint" role="status">${text}</p>
    <div class="estimate"><${Estimate} outcome=${outcome} onGo=${onGo} /></div>
  <//>`;
}

export const page = pageOf(() => "Scene", ScenePage);
