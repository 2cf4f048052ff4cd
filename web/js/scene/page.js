// A scene: described at the left, drawn and live at the right, run from here.
import { getSchema } from "../api.js";
import { FaultList } from "../form/fault_list.js";
import { focusField } from "../form/form.js";
import { Failure, Figures, Help, IconButton, Loaded, Panel } from "../ui/controls.js";
import { pageOf } from "../ui/page.js";
import { html, useEffect, useMemo, useRef, useState } from "../ui/preact.js";
import { useLoaded, useRedraw, useStore } from "../ui/hooks.js";
import { Accuracy } from "./accuracy.js";
import { Buffer } from "./buffer.js";
import { SceneDrawing } from "./handles.js";
import { ExamplesDialog } from "./examples.js";
import { Live } from "./live.js";
import { RecordField } from "./record_field.js";
import { makeSession } from "./session.js";
import { SceneForm } from "./steps.js";
import { useNews } from "../form/draft.js";
import { link } from "../address.js";
import { isObject } from "./inputs.js";
import { number, quantity, words } from "../units.js";

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
  const schema = useLoaded(() => getSchema("scene"), []);
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
        <${Steps} past=${past} />
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
        <${Live} draft=${draft} signal=${signal} />
        <${EstimatePanel} session=${session} onGo=${goTo} />
      </div>
    </div>`;
}

function Steps({ past }) {
  const redraw = useRedraw();
  useEffect(() => past.onChange(redraw), [past]);
  return html`<${IconButton} label="Undo (Ctrl+Z)" disabled=${!past.canUndo} onClick=${past.undo}
      >Undo<//
    >
    <${IconButton} label="Redo (Ctrl+Shift+Z)" disabled=${!past.canRedo} onClick=${past.redo}
      >Redo<//
    >`;
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

function JsonView({ draft }) {
  const [isOpen, setIsOpen] = useState(false);
  return html`<details class="panel">
    <summary onClick=${() => setIsOpen(true)}><h2>The scene as JSON</h2></summary>
    ${isOpen && html`<${JsonText} draft=${draft} />`}
  </details>`;
}

function JsonText({ draft }) {
  const area = useRef(null);
  const typed = useRef("");
  const [fault, setFault] = useState("");
  useNews(draft, ({ pointer }) => pointer !== undefined);
  const isTyping = area.current !== null && document.activeElement === area.current;
  if (!isTyping) typed.current = JSON.stringify(draft.scene, null, 2);
  const input = (event) => {
    typed.current = event.currentTarget.value;
    setFault("");
    try {
      const scene = JSON.parse(typed.current);
      if (!isObject(scene)) throw new Error("a scene is an object");
      draft.replace(scene);
    } catch (error) {
      setFault(`No scene yet: ${error.message}`); // browsers name the line
    }
  };
  return html`<p class="fault" role="status">${fault}</p>
    <textarea
      class="code"
      rows="28"
      spellcheck="false"
      aria-label="The scene as JSON"
      ref=${area}
      value=${typed.current}
      onInput=${input}
    ></textarea>`;
}

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
    ${warnings.length > 0 && html`<${FaultList} kind="warn" heading="Before you rely on it" faults=${warnings} whole="scene" onGo=${onGo} />`}`;
}

// `outcome` is {answer}, {faults} or {error}, or null.
function Estimate({ outcome, onGo }) {
  if (outcome === null) return null;
  const { answer, faults, error } = outcome;
  if (faults)
    return html`<${FaultList}
      heading="To be mended before it runs"
      faults=${faults}
      whole="scene"
      onGo=${onGo}
      tabindex="-1"
    />`;
  return error
    ? html`<${Failure} error=${error} />`
    : html`<${Answer} answer=${answer} onGo=${onGo} />`;
}

export const page = pageOf(() => "Scene", ScenePage);
