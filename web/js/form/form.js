// A JSON Schema as a form over a draft: objects, their kinds, lists; single values are fields.js. Optional members without a value
// are under "More"; members that the schema does not have are kept.
import { faultText } from "../ui/controls.js";
import { html, useEffect, useMemo, useRef } from "../ui/preact.js";
import { title, words } from "../units.js";
import { parts, useDraft } from "./draft.js";
import { ChoiceField, Field, TypedField } from "./fields.js";

const MAX_ITEMS = 100; // items of a list that are drawn

function uncover(element) {
  let box = element.closest("details");
  while (box) {
    box.open = true;
    box = box.parentElement.closest("details");
  }
}

const focusIn = (element) =>
  element.querySelector("input, select, textarea, button, summary")?.focus();

// To the control of a place, or to the nearest around it.
export function focusField(root, pointer) {
  const places = [...root.querySelectorAll("[data-pointer]:not(:empty)")]
    .filter((element) => `${pointer}/`.startsWith(`${element.dataset.pointer}/`))
    .sort((a, b) => b.dataset.pointer.length - a.dataset.pointer.length);
  const found = places[0] ?? root;
  uncover(found);
  focusIn(found);
}

// Options: only (these members), widgets ([[/of pointers/, Component]], a component of {pointer, schema, label, draft, options};
// its `isField` says that it is one line), shows(pointer) (never under "More"), start(pointer, kind) (what a new item or kind
// begins with).
export function Form({ schema, draft, pointer = "", label, only, required = true, ...options }) {
  const box = useRef(null);
  useEffect(() => {
    const show = () => box.current?.querySelectorAll("[aria-invalid=true]").forEach(uncover);
    return draft.onChange(({ check }) => check !== undefined && setTimeout(show));
  }, [draft]);
  const name = label ?? title(parts(pointer).at(-1) ?? "");
  return html`<div ref=${box}>
    <${Node}
      pointer=${pointer}
      schema=${schema}
      draft=${draft}
      label=${name}
      required=${required}
      options=${options}
      only=${only}
      isPlain
    />
  </div>`;
}

const constant = ({ properties = {} }) =>
  Object.keys(properties).find((name) => properties[name].const !== undefined);

function Node(context) {
  const { pointer, schema, options } = context;
  const Widget = options.widgets?.find(([pattern]) => pattern.test(pointer))?.[1];
  if (Widget)
    return html`<div class=${Widget.isField ? "widget" : "wide"} data-pointer=${pointer}>
      <${Widget} ...${context} />
    </div>`;
  if (schema.oneOf?.every(constant)) return html`<${KindNode} ...${context} />`;
  if (schema.anyOf && schema.anyOf[0].type !== "number") return html`<${AnyNode} ...${context} />`;
  if (schema.enum || schema.type === "boolean") return html`<${ChoiceField} ...${context} />`;
  if (schema.properties) return html`<${ObjectNode} ...${context} />`;
  return html`<${schema.items?.properties ? ListNode : TypedField} ...${context} />`;
}

// One of several types: the one that is there now.
function AnyNode(context) {
  const { pointer, schema, draft } = context;
  const value = useDraft(draft, pointer, false);
  const single = value === null ? "null" : typeof value;
  const type = Array.isArray(value) ? "array" : single;
  const chosen = schema.anyOf.find((each) => each.type === type) ?? schema.anyOf[0];
  return html`<${Node} ...${context} schema=${{ ...chosen, description: schema.description }} />`;
}

// A place with its name and help; a plain one has them from what is around it.
function Group({ pointer, schema, label, isPlain, children }) {
  if (isPlain) return html`<div data-pointer=${pointer}>${children}</div>`;
  return html`<fieldset class="wide" data-pointer=${pointer}>
    <legend>${label}</legend>
    <p class="hint">${schema.description}</p>
    ${children}
  </fieldset>`;
}

function ObjectNode(context) {
  const { pointer, schema, draft, options, only } = context;
  const { properties, required = [] } = schema;
  useDraft(draft, pointer, false);
  const { epoch } = draft;
  const names = Object.keys(properties);
  const shown = names.filter((name) => options.shows?.(`${pointer}/${name}`)).join();
  // What waits is decided once: a field stays where it is while it is filled in.
  const members = useMemo(
    () =>
      names
        .filter((name) => properties[name].const === undefined && (only?.includes(name) ?? true))
        .map((name) => {
          const place = `${pointer}/${name}`;
          const isNeeded = required.includes(name);
          const waits = !isNeeded && draft.get(place) === undefined && !options.shows?.(place);
          return { name, place, isNeeded, waits };
        }),
    [schema, pointer, draft, epoch, shown],
  );
  const fields = (list) =>
    html`<div class="fields">
      ${list.map(
        ({ name, place, isNeeded }) =>
          html`<${Node}
            key=${place}
            draft=${draft}
            options=${options}
            pointer=${place}
            schema=${properties[name]}
            label=${title(name)}
            required=${isNeeded}
          />`,
      )}
    </div>`;
  const later = members.filter(({ waits }) => waits);
  return html`<${Group} ...${context}>
    ${fields(members.filter(({ waits }) => !waits))}
    ${
      later.length > 0 &&
      html`<details class="more">
        <summary>${`More: ${later.map(({ name }) => words(name)).join(", ")}`}</summary>
        ${fields(later)}
      </details>`
    }
  <//>`;
}

// One of several kinds of object, told apart by a constant member.
function KindNode(context) {
  const { pointer, schema, draft, options, label, isPlain } = context;
  const mark = constant(schema.oneOf[0]);
  const value = useDraft(draft, pointer, false);
  useDraft(draft, `${pointer}/${mark}`);
  const left = useRef({}); // what was entered for kinds that are not chosen now
  const variants = new Map(schema.oneOf.map((each) => [each.properties[mark].const, each]));
  const all = [...variants.keys()];
  if (schema.oneOf[0].required.includes(mark)) all.unshift("none"); // the first is what is there where none is said
  const kind = value?.[mark] ?? all[0];
  const chosen = variants.get(kind);
  const change = (event) => {
    const next = event.currentTarget.value;
    left.current[kind] = draft.get(pointer);
    const start = { [mark]: next, ...options.start?.(pointer, next) };
    draft.set(pointer, next === "none" ? undefined : (left.current[next] ?? start));
  };
  const faults = draft.faults.filter((fault) =>
    [pointer, `${pointer}/${mark}`].includes(fault.pointer),
  );
  return html`<div class=${isPlain ? null : "wide"}>
    <${Field}
      pointer=${pointer}
      schema=${{}}
      label=${title(`${label} ${mark}`.trim())}
      faults=${faults}
      hint=${(chosen ?? schema).description}
      isWide
      control=${(attributes) =>
        html`<select ...${attributes} value=${kind} onChange=${change}>
          ${all.map((one) => html`<option key=${one} value=${one} selected=${one === kind}>${words(one)}</option>`)}
        </select>`}
    />
    ${chosen && html`<${ObjectNode} key=${kind} ...${context} schema=${chosen} isPlain />`}
  </div>`;
}

function ListNode(context) {
  const { pointer, schema, draft, options, label, required } = context;
  const box = useRef(null);
  const focused = useRef(null); // the item that gets the focus once it is drawn
  const value = [useDraft(draft, pointer, false) ?? []].flat();
  const one = label.replace("Axes", "Axis").replace(/(?<!i)s$/, "");
  const keys = useRef({ epoch: draft.epoch, list: [], next: 0 }); // of the items, so that each keeps its own state
  if (keys.current.epoch !== draft.epoch)
    Object.assign(keys.current, { epoch: draft.epoch, list: [] });
  while (keys.current.list.length < value.length) keys.current.list.push(keys.current.next++);
  keys.current.list.length = value.length;
  const splice = (at, gone, ...items) => {
    const next = value.toSpliced(at, gone, ...items);
    keys.current.list.splice(at, gone, ...items.map(() => keys.current.next++));
    focused.current = Math.min(at, next.length - 1);
    draft.set(pointer, next.length === 0 && !required ? undefined : next);
  };
  useEffect(() => {
    if (focused.current === null) return;
    const items = box.current.querySelectorAll(":scope > fieldset");
    focusIn(items[focused.current] ?? box.current);
    focused.current = null;
  });
  const notes = [
    value.length > MAX_ITEMS && `${MAX_ITEMS} of ${value.length} are shown`,
    ...draft.faults.filter((fault) => fault.pointer === pointer).map(faultText),
  ].filter(Boolean);
  const add = () => splice(value.length, 0, options.start?.(`${pointer}/N`) ?? {});
  return html`<${Group} ...${context}>
    <div ref=${box}>
      ${value.slice(0, MAX_ITEMS).map(
        (_, at) =>
          html`<fieldset key=${keys.current.list[at]}>
            <legend>${`${one} ${at + 1}`}</legend>
            <button
              type="button"
              class="quiet remove"
              aria-label=${`Remove ${one} ${at + 1}`}
              onClick=${() => splice(at, 1)}
            >
              Remove
            </button>
            <${ObjectNode}
              ...${context}
              pointer=${`${pointer}/${at}`}
              schema=${schema.items}
              isPlain
            />
          </fieldset>`,
      )}
      <p class="hint">${notes.join("; ")}</p>
      <button type="button" onClick=${add}>${`Add ${one.toLowerCase()}`}</button>
    </div>
  <//>`;
}
