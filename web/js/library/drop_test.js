// From a drop test to a revision that can be simulated with: readings typed, evaluated while they are typed, kept, and proposed
// as the next revision.
import { go, link } from "../address.js";
import { ask, post, getSchema } from "../api.js";
import { makeDraft } from "../form/draft.js";
import { focusField } from "../form/form.js";
import { Loaded, Notice, Panel, withSubscripts } from "../ui/controls.js";
import { pageOf } from "../ui/page.js";
import { html, useEffect, useMemo, useRef, useState } from "../ui/preact.js";
import { useLoaded } from "../ui/hooks.js";
import { capital } from "../units.js";
import { DropGrid } from "./drop_grid.js";
import { materialPath, readMaterial } from "./format.js";
import { Readings } from "./readings.js";
import { Faults, Fields, markFaults, widgetOf, WriteForm } from "./schema_form.js";
import { TraceField } from "./trace.js";

const WAIT_MS = 400; // without a change, before the service is asked

const WIDGETS = [
  [/^.drops$/, widgetOf(DropGrid)],
  [/^.traces.\d+.force$/, widgetOf(TraceField)],
  [/interval$/, widgetOf(() => null)], // a trace's file states it
];
const isShown = (pointer) => /^.(drops|traces)/.test(pointer);

// The readings as they are typed and what the service answers: {answer, error, state, keep()}.
function useEvaluation(slug, draft, fields) {
  const [result, setResult] = useState({ answer: null, error: null, state: "" });
  const turn = useRef(0);
  const timer = useRef(0);
  const isKeeping = useRef(false);

  // Whether it was answered; of readings that have changed since then nothing is shown.
  async function send(query, onAnswer) {
    const mine = ++turn.current;
    clearTimeout(timer.current);
    setResult((last) => ({ ...last, state: "Wait …" }));
    try {
      const answer = await post(materialPath(slug, "/measurements"), draft.scene, { query });
      if (mine === turn.current) onAnswer(answer);
      return true;
    } catch (error) {
      if (mine !== turn.current || error.name === "AbortError") return false;
      setResult((last) => ({ ...last, error, state: "" }));
      markFaults(draft, error);
      return false;
    }
  }

  // A test that is kept stays for good: it is sent once.
  async function keep() {
    if (isKeeping.current) return;
    isKeeping.current = true;
    const open = ({ measurement }) => go(`materials/${slug}/measure`, { measurement });
    isKeeping.current = await send({}, open);
    if (!isKeeping.current)
      requestAnimationFrame(() => fields.current?.querySelector("[aria-invalid=true]")?.focus());
  }

  useEffect(() => {
    const evaluate = () =>
      send({ dry_run: 1 }, (answer) => {
        setResult({ answer, error: null, state: "" });
        draft.setCheck(answer, []);
      });
    const leave = draft.onChange(({ pointer }) => {
      if (pointer === undefined || isKeeping.current) return;
      turn.current++;
      clearTimeout(timer.current);
      const isComplete = !draft.scene.traces?.some(({ force }) => !force); // its file is yet to be chosen
      if (isComplete) timer.current = setTimeout(evaluate, WAIT_MS);
    });
    return () => {
      leave();
      clearTimeout(timer.current);
    };
  }, [draft]);
  return { ...result, keep };
}

// The first step: the readings, and what they come to.
function Entry({ material, schema }) {
  const draft = useMemo(() => makeDraft({}), []);
  const fields = useRef(null);
  const { answer, error, state, keep } = useEvaluation(material.slug, draft, fields);
  const keepByKey = (event) => {
    if (event.key === "Enter" && event.ctrlKey) keep();
  };
  const focusFirst = (element) => {
    fields.current = element;
    element.querySelector("tbody input").focus();
  };
  return html`<div class="split even" onKeyDown=${keepByKey}>
    <${Panel} title="What was read">
      <${Fields}
        schema=${schema}
        draft=${draft}
        onReady=${focusFirst}
        shows=${isShown}
        widgets=${WIDGETS}
      />
    <//>
    <div class="sticky">
      <${Panel} title="Result">
        <div role="status">
          ${
            answer
              ? html`<${Readings} evaluation=${answer.evaluation} warnings=${answer.warnings} />`
              : html`<p>
                  ${withSubscripts("Heights or speeds give e, durations or force traces T_c.")}
                </p>`
          }
        </div>
        ${error && html`<${Faults} error=${error} onGo=${(pointer) => focusField(fields.current, pointer)} />`}
        <button type="button" class="primary" aria-keyshortcuts="Control+Enter" onClick=${keep}>
          Keep this test (Ctrl+Enter)
        </button>
        <p class="quiet" role="status">${state}</p>
      <//>
    </div>
  </div>`;
}

// The second step: the revision that a test, or a calibration, proposes, one click from being made.
function Proposal({ material, measurements, calibration }) {
  const loaded = useLoaded(
    async (signal) => {
      const answer = calibration
        ? await ask("POST", `v1/results/${encodeURIComponent(calibration)}/calibration/proposal`, {
            query: { material: material.slug },
            signal,
          })
        : await ask("GET", materialPath(material.slug, "/proposal"), {
            query: { measurements },
            signal,
          });
      return { found: await answer.json(), etag: answer.headers.get("ETag") };
    },
    [material.slug, measurements, calibration],
  );
  return html`<${Loaded} loaded=${loaded}>
    ${({ found, etag }) =>
      html`<div class="split even">
        <${Panel}
          title=${calibration ? "What comes of the calibration" : `What comes of test ${measurements}`}
          help="Proposal"
        >
          ${
            found.revision === null
              ? html`<${Notice} kind="warn" title="No revision"><p>${found.why}</p><//>`
              : html`<${WriteForm}
                  name="material_revision"
                  value=${found.revision}
                  label=${`Make it revision ${material.latest + 1}`}
                  material=${{ ...material, etag }}
                  part="/revisions"
                  isFocused
                />`
          }
        <//>
        <div class="sticky">
          ${
            found.evaluation
              ? html`<${Panel} title="Result">
                  <${Readings} evaluation=${found.evaluation} warnings=${found.warnings} />
                <//>`
              : found.warnings.map(
                  ({ detail }) => html`<p class="hint">${`${capital(detail)}.`}</p>`,
                )
          }
        </div>
      </div>`}
  <//>`;
}

function DropTestPage({ address: { path: parts, query } }) {
  const slug = parts[1];
  const { measurement, calibration } = query;
  const loaded = useLoaded(
    async (own) => {
      const material = await readMaterial(slug, null, own);
      return { material, schema: await getSchema("measurement") };
    },
    [slug, measurement],
  );
  return html`<${Loaded} loaded=${loaded} heading=${`Drop test of ${slug}`}>
    ${({ material, schema }) =>
      html`<h1>
          ${calibration ? "Calibration of" : "Drop test of"}${" "}<a
            href=${link(`materials/${slug}`)}
            >${material.name}</a
          >
        </h1>
        ${
          measurement || calibration
            ? html`<${Proposal}
                material=${material}
                measurements=${measurement}
                calibration=${calibration}
              />`
            : html`<${Entry} material=${material} schema=${schema} />`
        }`}
  <//>`;
}

export const page = pageOf(({ path: [, slug] }) => `Drop test of ${slug}`, DropTestPage);
