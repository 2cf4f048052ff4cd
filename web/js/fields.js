// One value, one control, {element, refresh()}, by its schema: what is typed, and choices.
import { fill, fresh, h, sentence } from "./dom.js";
import { pretty, quantity, scale, words } from "./units.js";

// "1e-3", "0,015" (not "1,500": thousands?). What is no number stays text, for the service to refuse.
function toNumber(text) {
  const value = Number(text.trim().replace("−", "-").replace(/(?<=^-?0*),|,(?!\d{3}$)/, "."));
  return Number.isNaN(value) ? text.trim() : value;
}

const isJson = ({ type, anyOf, items }) => (items ? items.items !== undefined : !anyOf && !/string|number|integer/.test(type));

function read(text, schema) {
  const { type, items, anyOf } = schema;
  if (type === "string") return text;
  if (anyOf) { // a number or a list of them
    const values = read(text, anyOf[1]);
    return values.length > 1 ? values : values[0];
  }
  if (/number|integer/.test(type)) return toNumber(text);
  if (!isJson(schema))
    return text.split(items.type === "string" ? /,\s*/ : /[,;\s]+/).filter(Boolean).map((each) => read(each, items));
  try {
    return JSON.parse(text);
  } catch {
    return text;
  }
}

function write(value, schema) {
  if (Array.isArray(value) && !isJson(schema)) return value.map((one) => write(one, {})).join(", ");
  return typeof value === "string" ? value : JSON.stringify(value) ?? "";
}

function bounds({ minimum, exclusiveMinimum, maximum }) {
  if (exclusiveMinimum !== undefined) return `above ${exclusiveMinimum}`;
  if (minimum === undefined) return "";
  return maximum < 2 ** 52 ? `${minimum} to ${maximum}` : `at least ${minimum}`;
}

export function frame({ pointer, schema, label }, control, ...help) {
  const id = fresh("field"), unit = schema["x-unit"], fault = h("p.fault", { id: `${id}-fault` });
  const hint = h("p.hint", { id: `${id}-hint` }, help.filter(Boolean).join("; "));
  control.id = id;
  control.setAttribute("aria-describedby", `${hint.id} ${fault.id}`);
  return {
    hint,
    element: h("div.field", { "data-pointer": pointer },
      h("label", { for: id }, label, unit && h("span.unit", null, ` [${pretty(unit)}]`)),
      h("div.typed", null, control), hint, fault),
    tell(faults) {
      fault.textContent = faults.slice(0, 3).map(sentence).join("; ");
      control.setAttribute("aria-invalid", faults.length > 0);
    },
  };
}

const say = (value) => ({ true: "yes", false: "no" })[value] ?? words(value);
const byDefault = ({ default: value }) => (value === undefined ? undefined : say(value));

export function typed(context) {
  const { pointer, schema, required, draft } = context, { items } = schema, unit = schema["x-unit"];
  const isLong = isJson(schema) || schema.maxLength > 500;
  let last;
  const input = h(isLong ? "textarea" : "input", { autocomplete: "off", spellcheck: "false", rows: isLong && "3",
    placeholder: byDefault(schema) ?? (required ? null : "not set"), "aria-required": required && "true",
    oninput() {
      last = input.value.trim() === "" ? undefined : read(input.value, schema);
      draft.set(pointer, last);
    } });
  const aside = h("span.hint");
  const { element, tell } = frame(context, input, schema.description, bounds(schema), items?.enum?.join(", "),
    isJson(schema) && "as JSON");
  input.after(aside);
  return { element, refresh() {
    const value = draft.get(pointer);
    if (value !== last) input.value = write(last = value, schema);
    aside.textContent = typeof value === "number" && scale(Math.abs(value), unit)[0] !== 1 ? `= ${quantity(value, unit)}` : "";
    tell(draft.faultsAt(pointer));
  } };
}

// One of a few: of the schema's, or `options()`, a list of [value, text].
export function choice(context, options = () => (context.schema.enum ?? [true, false]).map((value) => [value, say(value)])) {
  const { pointer, schema, required, draft } = context, initial = byDefault(schema);
  const select = h("select", { onchange: () => draft.set(pointer, select.value === "" ? undefined : JSON.parse(select.value)) });
  const { element, tell } = frame(context, select, schema.description);
  let drawn = "";
  return { element, refresh() {
    const now = JSON.stringify(draft.get(pointer)) ?? "";
    const all = [["", initial ? `${initial} (default)` : required ? "choose" : "not set"],
      ...options().map(([value, text]) => [JSON.stringify(value), text])];
    if (!all.some(([value]) => value === now)) all.push([now, now]);
    if (drawn !== (drawn = all.join())) fill(select, all.map(([value, text]) => h("option", { value }, text)));
    select.value = now;
    tell(draft.faultsAt(pointer));
  } };
}
