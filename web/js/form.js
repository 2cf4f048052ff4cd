// A JSON Schema as a form over a draft: objects, their kinds, lists; single values are fields.js. What need not be said
// waits under "More"; what the schema does not know is kept.
import { button, fill, h, hint, sentence } from "./dom.js";
import { parts } from "./draft.js";
import { choice, frame, typed } from "./fields.js";
import { title, words } from "./units.js";

// Options: only (these members), widgets ([[/of pointers/, (context) -> {element, refresh()}]]), shows(pointer) (never under
// "More"), start(pointer, kind) (what a new item or kind begins with).
export function form(host, { schema, draft, pointer = "", label = title(parts(pointer).at(-1) ?? ""), only, required = true, ...options }) {
  let root;
  function build() {
    root = node({ pointer, schema, draft, label, required, options, only, isPlain: true });
    fill(host, root.element);
    refresh();
  }
  function refresh() {
    root.refresh();
    host.querySelectorAll("[aria-invalid=true]").forEach(uncover);
  }
  build();
  return { refresh, leave: draft.onChange(({ pointer: changed }) => (changed === "" ? build() : refresh())) };
}

function uncover(element) {
  for (let box = element.closest("details"); box; box = box.parentElement.closest("details")) box.open = true;
}

// To the control of a place, or to the nearest around it.
export function focusField(root, pointer) {
  const place = [...root.querySelectorAll("[data-pointer]:not([hidden])")]
    .filter((element) => `${pointer}/`.startsWith(`${element.dataset.pointer}/`))
    .sort((a, b) => b.dataset.pointer.length - a.dataset.pointer.length)[0] ?? root;
  uncover(place);
  focusIn(place);
}

const focusIn = (element) => element.querySelector("input, select, textarea, button, summary")?.focus();

const constant = ({ properties = {} }) => Object.keys(properties).find((name) => properties[name].const !== undefined);

function node(context) {
  const { pointer, schema, options, draft } = context;
  const widget = options.widgets?.find(([pattern]) => pattern.test(pointer))?.[1];
  if (widget) {
    const made = widget(context);
    made.element.dataset.pointer = pointer;
    if (!made.element.matches(".field")) made.element.classList.add("wide");
    return made;
  }
  if (schema.oneOf?.every(constant)) return kinds(context);
  if (schema.anyOf && schema.anyOf[0].type !== "number") { // the type that is there now
    const value = draft.get(pointer), type = value === null ? "null" : Array.isArray(value) ? "array" : typeof value;
    const chosen = schema.anyOf.find((each) => each.type === type) ?? schema.anyOf[0];
    return node({ ...context, schema: { ...chosen, description: schema.description } });
  }
  if (schema.enum || schema.type === "boolean") return choice(context);
  if (schema.properties) return object(context);
  return schema.items?.properties ? list(context) : typed(context);
}

// A place with its name and help; a plain one has them from what is around it.
const group = ({ pointer, schema, label, isPlain }, ...content) =>
  h(isPlain ? "div" : "fieldset", { class: isPlain ? null : "wide", "data-pointer": pointer },
    !isPlain && [h("legend", null, label), hint(schema.description)], content);

function object(context) {
  const { pointer, schema, draft, options, only } = context, { properties, required = [] } = schema;
  const members = Object.keys(properties).filter((name) => properties[name].const === undefined && (only?.includes(name) ?? true))
    .map((name) => {
      const place = `${pointer}/${name}`, needed = required.includes(name);
      const made = node({ draft, options, pointer: place, schema: properties[name], label: title(name), required: needed });
      return { ...made, name, waits: !needed && draft.get(place) === undefined && !options.shows?.(place) };
    });
  const fields = (waits) => h("div.fields", null, members.map((one) => one.waits === waits && one.element));
  const summary = h("summary"), more = h("details", null, summary, fields(true));
  return { element: group(context, fields(false), more), refresh() {
    for (const one of members) one.refresh();
    const later = members.filter((one) => one.waits && !one.element.hidden);
    summary.textContent = `More: ${later.map(({ name }) => words(name)).join(", ")}`;
    more.hidden = later.length === 0;
  } };
}

// One of several kinds of object, told apart by a constant member.
function kinds(context) {
  const { pointer, schema, draft, options, label, isPlain } = context;
  const mark = constant(schema.oneOf[0]), left = {}; // what was entered for kinds that are not chosen now
  const variants = new Map(schema.oneOf.map((each) => [each.properties[mark].const, each])), all = [...variants.keys()];
  if (schema.oneOf[0].required.includes(mark)) all.unshift("none"); // the first is what is there where none is said
  let shown, inner;
  const select = h("select", { onchange() {
    const kind = select.value;
    left[shown] = draft.get(pointer);
    draft.set(pointer, kind === "none" ? undefined : left[kind] ?? { [mark]: kind, ...options.start?.(pointer, kind) });
  } }, all.map((kind) => h("option", { value: kind }, words(kind))));
  const { element, hint, tell } = frame({ ...context, label: title(`${label} ${mark}`.trim()) }, select), place = h("div");
  function refresh() {
    const kind = draft.get(pointer)?.[mark] ?? all[0], chosen = variants.get(kind);
    if (shown !== kind) {
      shown = kind;
      inner = chosen && object({ ...context, schema: chosen, isPlain: true });
      hint.textContent = (chosen ?? schema).description;
      fill(place, inner?.element);
    }
    select.value = kind;
    tell(draft.faults.filter((one) => [pointer, `${pointer}/${mark}`].includes(one.pointer)));
    inner?.refresh();
  }
  return { element: h("div", { class: isPlain ? null : "wide" }, element, place), refresh };
}

const MOST = 100; // drawn
function list(context) {
  const { pointer, schema, draft, options, label, required } = context;
  const one = label.replace("Axes", "Axis").replace(/(?<!i)s$/, "");
  const add = button(`Add ${one.toLowerCase()}`, () => put(value().length, 0, options.start?.(`${pointer}/N`) ?? {}));
  const holder = h("div"), note = hint(), value = () => [draft.get(pointer) ?? []].flat();
  let nodes = [];
  function put(at, gone, ...items) {
    const next = value().toSpliced(at, gone, ...items);
    draft.set(pointer, next.length === 0 && !required ? undefined : next);
    focusIn(holder.children[Math.min(at, nodes.length - 1)] ?? add.parentElement);
  }
  function build() {
    nodes = value().slice(0, MOST)
      .map((_, at) => object({ ...context, pointer: `${pointer}/${at}`, schema: schema.items, isPlain: true }));
    fill(holder, nodes.map(({ element }, at) => h("fieldset", null, h("legend", null, `${one} ${at + 1}`), element,
      button("Remove", () => put(at, 1), { class: "quiet", "aria-label": `Remove ${one} ${at + 1}` }))));
    refresh();
  }
  function refresh() {
    const count = value().length;
    if (nodes.length !== Math.min(MOST, count)) return build();
    note.textContent = [count > MOST && `${MOST} of ${count} are shown`,
      ...draft.faults.filter((fault) => fault.pointer === pointer).map(sentence)].filter(Boolean).join("; ");
    for (const each of nodes) each.refresh();
  }
  return { element: group(context, holder, note, add), refresh };
}
