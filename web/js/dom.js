// Elements from plain values: no page writes markup, text stays text.
import { places } from "./help.js";

const SVG = "http://www.w3.org/2000/svg";

function put(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if ((value ?? false) === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (name === "style") for (const [key, text] of Object.entries(value)) node.style.setProperty(key, text);
    else if (["value", "checked", "disabled", "selected"].includes(name)) node[name] = value;
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.flat(Infinity).filter((child) => (child ?? false) !== false));
  return node;
}

// h("p.quiet", {onclick, style: {width}}, "text", h("b", null, "bold")); null and false are left out.
export function h(name, attributes, ...children) {
  const [tag, ...classes] = name.split(".");
  return put(document.createElement(tag), { class: classes.join(" ") || null, ...attributes }, children);
}

// The same for SVG.
export const s = (tag, attributes, ...children) => put(document.createElementNS(SVG, tag), attributes, children);

export function fill(node, ...children) {
  node.replaceChildren();
  return put(node, null, children);
}

// Not begun again while it goes on: some click twice.
export function once(act) {
  let going = null;
  return () => (going ??= act().finally(() => (going = null)));
}

export const button = (text, onclick, more) => h("button", { type: "button", onclick, ...more }, text);

// [name, value] of what is to be seen at a glance.
export const figures = (pairs) => h("dl.figures", null, pairs.map(([name, value]) =>
  h("div", null, h("dt", null, name), h("dd", null, value))));

// Lines, and a button that puts them into the clipboard.
export function copied(lines) {
  const pressed = button("Copy", copy, { class: "quiet" });
  async function copy() {
    try {
      await navigator.clipboard.writeText(lines);
      pressed.textContent = "Copied";
    } catch {
      pressed.textContent = "Select and copy it by hand"; // a page without TLS may not
    }
    tell(pressed.textContent);
    setTimeout(() => (pressed.textContent = "Copy"), 2000);
  }
  return [pressed, h("pre", { tabindex: "0" }, lines)];
}

let count = 0;
export const fresh = (word) => `${word}-${++count}`; // an id that no other element has

// Told to whoever listens to the page rather than sees it.
export function tell(text) {
  document.getElementById("told").textContent = text;
}

// A box with a heading: kind is "info", "warn", "bad" or "ok". "bad" is told at once.
export const notice = (kind, title, ...more) =>
  h(`div.notice.${kind}`, { role: kind === "bad" && "alert" }, h("strong", null, title), more);

// A fault as a sentence, with the name that was meant.
export const sentence = ({ detail, did_you_mean: meant }) => `${detail}${meant ? ` (did you mean "${meant}"?)` : ""}`;

// What went wrong, as the service said it: with every fault and its place.
export function failure({ title, errors, message, detail }) {
  const place = ({ pointer, row, column }) => (row ? `row ${row}, ${column}` : pointer);
  const say = (fault) => h("li", null, h("code", null, place(fault)), " ", sentence(fault));
  return notice("bad", title ?? "That did not work",
    errors?.length > 0 ? h("ul", null, errors.map(say)) : h("p", null, message ?? detail));
}

// For catch(): says in `host` what went wrong. That the reader went away is no fault.
export const faults = (host) => (error) => void (error.name !== "AbortError" && fill(host, failure(error)));

// A table. A column is {label, numeric, value(row), cell(row)}: shown is `cell`, without it `value`, by which a click on
// a heading sorts where `sort` is set. The box around it scrolls, also by keyboard.
export function table(caption, columns, rows, { sort = false } = {}) {
  let by = null, up = true;
  const body = h("tbody"), kind = ({ numeric }) => (numeric ? "number" : null);
  const heads = columns.map((column) => {
    const { label } = column, isSorted = sort && column.value;
    const head = h("th", { scope: "col", class: kind(column), "aria-sort": isSorted && "none" },
      isSorted ? button(label, turn, { class: "sort" }) : label);
    function turn() {
      up = by !== column || !up;
      by = column;
      for (const other of heads) if (other.ariaSort) other.ariaSort = other !== head ? "none" : up ? "ascending" : "descending";
      draw();
    }
    return head;
  });
  function draw() {
    const order = (a, b) => (a === b ? 0 : (a ?? null) === null ? 1 : (b ?? null) === null || a < b ? -1 : 1);
    const sorted = by === null ? rows : rows.toSorted((a, b) => (up ? 1 : -1) * order(by.value(a), by.value(b)));
    fill(body, sorted.map((row) => h("tr", null, columns.map((column, at) => h(at === 0 ? "th" : "td",
      { scope: at === 0 && "row", class: kind(column) }, (column.cell ?? column.value)(row) ?? "–")))));
  }
  draw();
  return h("div.scroll", { tabindex: "0", role: "region", "aria-label": caption },
    h("table", null, h("caption", null, caption), h("thead", null, h("tr", null, heads)), body));
}

// A "?" that leads to the guide, where it has a place on what a heading names.
export const help = (name, place = places[name]) => place && h("a.help", { href: `guide/${place.replace(/#|$/, ".html$&")}`,
  "aria-label": `Guide: ${name}` }, "?");

export const panel = (name, ...children) => h("section.panel", { "aria-label": name }, help(name), h("h2", null, name), children);

// A quiet line of help.
export const hint = (...children) => h("p.hint", null, children);

// Something that opens: the content is made when it is first seen.
export function folded(summary, make, open = false) {
  const inner = h("div"), box = h("details", { open, ontoggle: show }, h("summary", null, summary), inner);
  async function show() {
    if (!box.open || inner.hasChildNodes()) return;
    fill(inner, "Loading …");
    fill(inner, await (async () => make())().catch(failure));
  }
  show();
  return box;
}
