// One value, one control, on one line: what is typed, and choices. What a place is for is seen while it has the focus.
import { faultText } from "../ui/controls.js";
import { useId } from "../ui/hooks.js";
import { html, useRef } from "../ui/preact.js";
import { pretty, quantity, scale, words } from "../units.js";
import { useDraft } from "./draft.js";

const LONG = 500; // letters of a text of several lines

// "1e-3", "0,015" (not "1,500": thousands?). What is no number stays text, for the service to refuse.
function toNumber(text) {
  const value = Number(
    text
      .trim()
      .replace("−", "-")
      .replace(/(?<=^-?0*),|,(?!\d{3}$)/, "."),
  );
  return Number.isNaN(value) ? text.trim() : value;
}

function isJson({ type, anyOf, items }) {
  if (items) return items.items !== undefined;
  return !anyOf && !/string|number|integer/.test(type);
}

function parse(text, schema) {
  const { type, items, anyOf } = schema;
  if (type === "string") return text;
  if (anyOf) {
    // a number or a list of them
    const values = parse(text, anyOf[1]);
    return values.length > 1 ? values : values[0];
  }
  if (/number|integer/.test(type)) return toNumber(text);
  if (!isJson(schema)) {
    const separator = items.type === "string" ? /,\s*/ : /[,;\s]+/;
    return text
      .split(separator)
      .filter(Boolean)
      .map((each) => parse(each, items));
  }
  try {
    return JSON.parse(text);
  } catch {
    return text;
  }
}

function write(value, schema) {
  if (Array.isArray(value) && !isJson(schema)) return value.map((one) => write(one, {})).join(", ");
  return typeof value === "string" ? value : (JSON.stringify(value) ?? "");
}

function bounds({ minimum, exclusiveMinimum, maximum }) {
  if (exclusiveMinimum !== undefined) return `above ${exclusiveMinimum}`;
  if (minimum === undefined) return "";
  return maximum < 2 ** 52 ? `${minimum} to ${maximum}` : `at least ${minimum}`;
}

const valueText = (value) => ({ true: "yes", false: "no" })[value] ?? words(value);
const defaultText = ({ default: value }) => (value === undefined ? undefined : valueText(value));

// A line: `control` is a function of the attributes {id, aria-describedby, aria-invalid}.
export function Field({ pointer, schema, label, faults, hint, isWide, aside, control }) {
  const id = useId("field");
  const unit = schema["x-unit"];
  const attributes = {
    id,
    "aria-describedby": `${id}-hint ${id}-fault`,
    "aria-invalid": faults.length > 0,
  };
  return html`<div class=${isWide ? "field wide" : "field"} data-pointer=${pointer}>
    <label for=${id}>
      ${label}${unit && html`<span class="unit">${` [${pretty(unit)}]`}</span>`}
    </label>
    <div class="typed">
      ${control(attributes)}${aside && html`<span class="aside">${aside}</span>`}
      <p class="hint" id=${`${id}-hint`}>${hint}</p>
    </div>
    <p class="fault" id=${`${id}-fault`}>
      ${faults
        .slice(0, 3)
        .map((fault) => faultText(fault))
        .join("; ")}
    </p>
  </div>`;
}

const joined = (...texts) => texts.filter(Boolean).join("; ");

export function TypedField({ pointer, schema, label, required, draft }) {
  const value = useDraft(draft, pointer);
  const typed = useRef({ text: "" }); // {text, value}: as it was typed, until the value is another one
  if (!Object.hasOwn(typed.current, "value") || value !== typed.current.value)
    typed.current = { text: write(value, schema), value };
  const { items } = schema;
  const unit = schema["x-unit"];
  const isLong = isJson(schema) || schema.maxLength > LONG;
  const input = (event) => {
    const text = event.currentTarget.value;
    const next = text.trim() === "" ? undefined : parse(text, schema);
    typed.current = { text, value: next };
    draft.set(pointer, next);
  };
  const tag = isLong ? "textarea" : "input";
  const isScaled = typeof value === "number" && scale(Math.abs(value), unit)[0] !== 1;
  return html`<${Field}
    pointer=${pointer}
    schema=${schema}
    label=${label}
    faults=${draft.faultsAt(pointer)}
    hint=${joined(schema.description, bounds(schema), items?.enum?.join(", "), isJson(schema) && "as JSON")}
    isWide=${isLong || (Boolean(items) && schema.maxItems !== 2) || schema.maxLength > 128}
    aside=${isScaled && `= ${quantity(value, unit)}`}
    control=${(attributes) =>
      html`<${tag}
        ...${attributes}
        autocomplete="off"
        spellcheck="false"
        rows=${isLong ? 3 : null}
        placeholder=${defaultText(schema) ?? (required ? null : "not set")}
        aria-required=${required ? "true" : null}
        value=${typed.current.text}
        onInput=${input}
      />`}
  />`;
}

const firstChoice = (initial, required) => {
  if (initial) return `${initial} (default)`;
  return required ? "choose" : "not set";
};

// One of a few: of the schema's, or `choices`, a list of [value, text]. `value` and `onChoose(value)` in place of the draft's.
export function ChoiceField({ pointer, schema, label, required, draft, choices, isWide, ...own }) {
  const held = useDraft(draft, pointer);
  const value = own.onChoose ? own.value : held;
  const choose = own.onChoose ?? ((next) => draft.set(pointer, next));
  const given = choices ?? (schema.enum ?? [true, false]).map((one) => [one, valueText(one)]);
  const now = JSON.stringify(value) ?? "";
  const all = [
    ["", firstChoice(defaultText(schema), required)],
    ...given.map(([one, text]) => [JSON.stringify(one), text]),
  ];
  if (!all.some(([one]) => one === now)) all.push([now, now]);
  const change = (event) => {
    const text = event.currentTarget.value;
    choose(text === "" ? undefined : JSON.parse(text));
  };
  return html`<${Field}
    pointer=${pointer}
    schema=${schema}
    label=${label}
    faults=${own.faults ?? draft.faultsAt(pointer)}
    hint=${schema.description}
    isWide=${isWide}
    control=${(attributes) =>
      html`<select ...${attributes} value=${now} onChange=${change}>
        ${all.map(([one, text]) => html`<option key=${one} value=${one} selected=${one === now}>${pretty(text)}</option>`)}
      </select>`}
  />`;
}
