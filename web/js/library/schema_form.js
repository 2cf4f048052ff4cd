// Forms by a schema that are sent as a whole, and those that change a material.
import { replace } from "../address.js";
import { post, getSchema } from "../api.js";
import { makeDraft, useNews } from "../form/draft.js";
import { FaultList } from "../form/fault_list.js";
import { focusField, Form } from "../form/form.js";
import { Failure, Loaded, Notice } from "../ui/controls.js";
import { html, useLayoutEffect, useMemo, useRef, useState } from "../ui/preact.js";
import { useLoaded } from "../ui/hooks.js";
import { Differences, materialPath, readMaterial } from "./format.js";

// A component as a widget of a form: drawn again with each of the draft's news.
export const widgetOf = (Component) =>
  function Widget(context) {
    useNews(context.draft);
    return html`<${Component} ...${context} />`;
  };

const isUsual = (pointer) => /^.(restitution|contact_time|comment)$/.test(pointer);

// The fields of a schema over a draft; `onReady(element)` is called once they are there.
export function Fields({ schema, draft, onReady, ...options }) {
  const box = useRef(null);
  useLayoutEffect(() => onReady?.(box.current), [schema, draft]);
  return html`<div ref=${box}>
    <${Form} schema=${schema} draft=${draft} shows=${isUsual} ...${options} />
  </div>`;
}

// The faults of a refusal, each with a button to its field.
export function Faults({ error, onGo }) {
  const { title: heading, errors = [] } = error;
  if (!errors.some(({ pointer }) => pointer)) return html`<${Failure} error=${error} />`;
  return html`<${FaultList}
    heading=${heading}
    faults=${errors}
    whole="form"
    onGo=${onGo}
    role="alert"
  />`;
}

// Marks the faults of a refusal at their fields.
export function markFaults(draft, error) {
  draft.setCheck(null, error.errors ?? []);
}

const focusFault = (box) =>
  requestAnimationFrame(() => box.querySelector("[aria-invalid=true]")?.focus());

// A form by a schema: send(value) when it is submitted; what it rejects with is shown, as is what it returns (a view).
// `isFocused` gives the button the focus. Further options are Form's.
export function SchemaForm({ schema, value, label, send, isFocused, ...options }) {
  const draft = useMemo(() => makeDraft(structuredClone(value)), []);
  const box = useRef(null);
  const isSending = useRef(false);
  const [outcome, setOutcome] = useState(null);
  const goTo = (pointer) => focusField(box.current, pointer);
  const submit = async (event) => {
    event.preventDefault();
    if (isSending.current) return;
    isSending.current = true;
    setOutcome("Wait …");
    try {
      setOutcome((await send(draft.scene)) ?? null);
    } catch (error) {
      if (error.name === "AbortError") return;
      markFaults(draft, error);
      setOutcome(html`<${Faults} error=${error} onGo=${goTo} />`);
      focusFault(box.current);
    } finally {
      isSending.current = false;
    }
  };
  const focus = (element) => isFocused && element.closest("form").querySelector(".send").focus();
  return html`<form novalidate onSubmit=${submit} ref=${box}>
    <${Fields} schema=${schema} draft=${draft} onReady=${focus} ...${options} />
    <button class="send primary">${label}</button>
    <div role="status">${outcome}</div>
  </form>`;
}

// The same by the name of a schema.
export function NamedForm({ name, ...more }) {
  const loaded = useLoaded(() => getSchema(name), [name]);
  return html`<${Loaded} loaded=${loaded}>
    ${(schema) => html`<${SchemaForm} schema=${schema} ...${more} />`}
  <//>`;
}

// A form that posts to a part of a material, under the entity tag that was read; then the revision of the answer is shown. A
// client that comes second sees what the first one has changed, and can repeat its own change.
export function WriteForm({ name, material, part, ...more }) {
  const seen = useRef(material);
  const send = async (json) => {
    const { slug, latest, etag } = seen.current;
    try {
      const { revision } = await post(materialPath(slug, part), json, {
        headers: { "If-Match": etag },
      });
      replace(`materials/${slug}`, { revision });
      return null;
    } catch (error) {
      if (error.status !== 412) throw error;
      seen.current = await readMaterial(slug);
      return html`<${Notice} kind="warn" title="Another client changed it meanwhile">
        <p>Your change is not lost. Since you read the material:</p>
        <${Differences} slug=${slug} first=${latest} second=${seen.current.latest} />
        <button>Make my change all the same</button>
      <//>`;
    }
  };
  return html`<${NamedForm} name=${name} send=${send} ...${more} />`;
}
