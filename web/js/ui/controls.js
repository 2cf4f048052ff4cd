// Small parts of pages: buttons, notices, panels, tabs, menus, headline numbers.
import { hints, places } from "../help.js";
import { html, useLayoutEffect, useRef, useState } from "./preact.js";
import { link, read } from "../address.js";
import { reason } from "../api.js";
import { announce } from "./announce.js";
import { useId } from "./hooks.js";
import { capital, pretty, words } from "../units.js";

// A button that is not pressed again while what it did goes on; what fails is shown behind it.
export function Button({ onClick, isPrimary, isQuiet, disabled, label, title, children }) {
  const [isBusy, setIsBusy] = useState(false);
  const [error, setError] = useState(null);
  const act = async (event) => {
    setError(null);
    const done = onClick?.(event);
    if (!(done instanceof Promise)) return;
    setIsBusy(true);
    try {
      await done;
    } catch (problem) {
      setError(problem);
    } finally {
      setIsBusy(false);
    }
  };
  return html`<button
      type="button"
      class=${(isPrimary && "primary") || (isQuiet && "quiet") || null}
      disabled=${disabled || isBusy}
      aria-busy=${isBusy || null}
      aria-label=${label}
      title=${title}
      onClick=${act}
    >
      ${children}</button
    >${error && html`<${Failure} error=${error} />`}`;
}

// A small quiet button; `label` says what it does where its text is an abbreviation.
export const IconButton = ({ label, onClick, pressed, disabled, children }) =>
  html`<button
    type="button"
    class="icon"
    aria-label=${label}
    title=${label}
    aria-pressed=${pressed}
    disabled=${disabled}
    onClick=${onClick}
  >
    ${children}
  </button>`;

// Puts a text, or what a function returns, on the clipboard.
export function CopyButton({ text, label = "Copy" }) {
  const [state, setState] = useState(null);
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(typeof text === "function" ? text() : text);
      setState("Copied");
      announce("Copied");
    } catch {
      setState("Select and copy it by hand"); // a page without TLS may not
    }
    setTimeout(() => setState(null), 2000);
  };
  return html`<button type="button" class="quiet" onClick=${copy}>${state ?? label}</button>`;
}

// Rows of cells as spreadsheets take them.
export const tabbed = (rows) => rows.map((cells) => cells.join("\t")).join("\n");

// Lines to copy, with the button that copies them.
export const CodeBlock = ({ text }) =>
  html`<div class="code-box">
    <pre tabindex="0">${text}</pre>
    <${CopyButton} text=${text} />
  </div>`;

// A box with a heading: kind is "info", "ok", "warn" or "bad"; "bad" is announced at once.
export const Notice = ({ kind = "info", title, children }) =>
  html`<div class=${`notice ${kind}`} role=${kind === "bad" ? "alert" : null}>
    <strong>${title}</strong>${children}
  </div>`;

export const sentence = (text) =>
  capital(text)
    .replaceAll("+-", "±")
    .replace(/(?<![.!?])$/, ".");

const faultPlace = ({ pointer, row, column }) => (row ? `row ${row}, ${column}` : pointer);
export const faultText = ({ detail, did_you_mean: meant }) =>
  `${detail}${meant ? ` (did you mean "${meant}"?)` : ""}`;

// What went wrong, with every fault and its place, as the service said it.
export const Failure = ({ error, onRetry }) => {
  if (error.name === "AbortError") return null; // its page was left
  const { title, errors, message, detail, status } = reason(error);
  return html`<${Notice} kind="bad" title=${title ?? "That did not work"}>
    ${
      errors?.length > 0
        ? html`<ul>
            ${errors.map((fault) => html`<li><code>${faultPlace(fault)}</code> ${faultText(fault)}</li>`)}
          </ul>`
        : html`<p>${sentence(message ?? detail ?? title)}</p>`
    }
    ${status === 0 && onRetry && html`<p><${Button} onClick=${onRetry}>Try again<//></p>`}
  <//>`;
};

const LISTS = { materials: "All materials", records: "All ground motions", jobs: "All runs" };

// Where a page of something that is not there leads on to.
function ListLink() {
  const [first] = read().path;
  const name = first === "results" ? "jobs" : first;
  return LISTS[name] && html`<p><a href=${link(name)}>${LISTS[name]}</a></p>`;
}

// What waits for `loaded` ({data, error, isLoading, retry} of useLoaded) before it shows anything; a whole page has a `heading`
// until then.
export function Loaded({ loaded, heading, children }) {
  const { data, error, retry } = loaded;
  if (data !== null) return children(data);
  return html`${heading && html`<h1>${heading}</h1>`}
  ${
    error
      ? html`<${Failure}
            error=${error}
            onRetry=${retry}
          />${error.status === 404 && html`<${ListLink} />`}`
      : html`<p class="quiet">Loading …</p>`
  }`;
}

const guideLink = (place) => `guide/${place.replace(/#|$/, ".html$&")}`;

// A "?" on what a heading names: it opens a sentence where help.js has one, else it leads to the guide.
export function Help({ name, place = places[name] }) {
  if (hints[name]) return html`<${Hint} name=${name} />`;
  if (!place) return null;
  return html`<a class="help" href=${guideLink(place)} aria-label=${`Guide: ${name}`}>?</a>`;
}

// One sentence in a box beside its "?"; Escape and a click elsewhere close it.
function Hint({ name }) {
  const id = useId("hint");
  const [sentence, place] = hints[name];
  const put = ({ newState, currentTarget: box }) => {
    if (newState !== "open") return;
    const { left, bottom } = box.previousElementSibling.getBoundingClientRect();
    box.style.left = `${Math.max(8, Math.min(left, innerWidth - box.offsetWidth - 8))}px`;
    box.style.top = `${Math.min(bottom + 6, innerHeight - box.offsetHeight - 8)}px`;
  };
  return html`<button
      type="button"
      class="help"
      popovertarget=${id}
      aria-label=${`What is it: ${name}`}
    >
      ?
    </button>
    <div class="hint-box" popover="auto" id=${id} onToggle=${put}>
      <p>${sentence}</p>
      <a href=${guideLink(place)}>More in the guide</a>
    </div>`;
}

export const Panel = ({ title, help = title, actions, children }) =>
  html`<section class="panel" aria-label=${title}>
    <div class="panel-head">
      <h2>${title}</h2>
      <${Help} name=${help} />
      ${actions && html`<div class="actions">${actions}</div>`}
    </div>
    ${children}
  </section>`;

// Tabs over panels: [{name, title, view()}]; only the chosen one is made. Arrow keys move between tabs.
export function Tabs({ label, tabs, chosen, onChoose }) {
  const id = useId("tabs");
  const at = Math.max(
    0,
    tabs.findIndex((tab) => tab.name === chosen),
  );
  const move = (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const next = (at + step + tabs.length) % tabs.length;
    onChoose(tabs[next].name);
    event.currentTarget.children[next].focus();
  };
  return html`<section class="tabs" aria-label=${label}>
    <div role="tablist" aria-label=${label} onKeyDown=${move}>
      ${tabs.map(
        (tab, index) =>
          html`<button
            type="button"
            role="tab"
            id=${`${id}-${tab.name}`}
            aria-selected=${index === at}
            aria-controls=${`${id}-panel`}
            tabindex=${index === at ? 0 : -1}
            onClick=${() => onChoose(tab.name)}
          >
            ${tab.title}
          </button>`,
      )}
    </div>
    <div
      role="tabpanel"
      id=${`${id}-panel`}
      aria-labelledby=${`${id}-${tabs[at].name}`}
      tabindex="0"
    >
      ${tabs[at].view()}
    </div>
  </section>`;
}

const MAX_BUTTONS = 8;

// Of buttons side by side, about, in pixels.
const widthOf = (options) => options.reduce((sum, { label }) => sum + 7 * label.length + 22, 60);

// One of many: [{value, label}] as a list that opens.
const ChoiceList = ({ label, options, value, onChange }) =>
  html`<select
    aria-label=${label}
    onChange=${(event) => onChange(options[event.currentTarget.selectedIndex].value)}
  >
    ${options.map(
      (option) => html`<option selected=${option.value === value}>${pretty(option.label)}</option>`,
    )}
  </select>`;

// One of a few: [{value, label}] as buttons side by side.
export const Choice = (props) =>
  props.options.length > MAX_BUTTONS || widthOf(props.options) > innerWidth
    ? html`<${ChoiceList} ...${props} />`
    : html`<${ChoiceButtons} ...${props} />`;

const ChoiceButtons = ({ label, options, value, onChange }) =>
  html`<div class="choice" role="group" aria-label=${label}>
    ${options.map(
      (option) =>
        html`<button
          type="button"
          aria-pressed=${option.value === value}
          onClick=${() => onChange(option.value)}
        >
          ${withSubscripts(option.label)}
        </button>`,
    )}
  </div>`;

// Actions behind a button; Escape, a click and the focus elsewhere close it.
export function Menu({ label, children }) {
  const [isOpen, setIsOpen] = useState(false);
  const box = useRef(null);
  useLayoutEffect(() => {
    if (!isOpen) return undefined;
    const close = (event) => {
      const isKey = event.type === "keydown";
      if (isKey ? event.key !== "Escape" : box.current.contains(event.target)) return;
      if (isKey) box.current.firstElementChild.focus();
      setIsOpen(false);
    };
    const all = ["pointerdown", "focusin", "keydown"];
    for (const name of all) addEventListener(name, close);
    return () => all.forEach((name) => removeEventListener(name, close));
  }, [isOpen]);
  return html`<div class="menu" ref=${box}>
    <button type="button" aria-expanded=${isOpen} onClick=${() => setIsOpen(!isOpen)}>
      ${label}
    </button>
    ${isOpen && html`<div class="menu-items" onClick=${() => setIsOpen(false)}>${children}</div>`}
  </div>`;
}

// "T_c" as T with the index c, "m/s^2" as "m/s²".
export const withSubscripts = (text) =>
  pretty(text)
    .split(/\b([A-Za-z])_([a-z])\b/)
    .map((part, at) => (at % 3 === 2 ? html`<sub>${part}</sub>` : part));

// A field for a file; the same file may be chosen again.
export const FileInput = ({ inputRef, ...attributes }) =>
  html`<input
    type="file"
    ref=${inputRef}
    ...${attributes}
    onClick=${(event) => {
      event.currentTarget.value = "";
    }}
  />`;

// {value, label} of values, for a choice among them.
export const optionsOf = (values, write = words) =>
  values.map((value) => ({ value, label: write(value) }));

// Headline numbers: [{label, value, note, tone, help, place}], `help` a name of help.js, `place` one of the guide.
export const Headlines = ({ items }) =>
  html`<dl class="headlines">
    ${items.map(
      ({ label, value, note, tone, help = label, place }) =>
        html`<div class=${tone}>
          <dt>
            <span>${withSubscripts(label)}</span>
            <${Help} name=${help} place=${place} />
          </dt>
          <dd>${value}${note && html`<small>${note}</small>`}</dd>
        </div>`,
    )}
  </dl>`;

// Facts, a line each: [[name, value]].
export const Facts = ({ pairs }) =>
  html`<dl class="list">
    ${pairs.map(
      ([name, value]) =>
        html`<dt>${name}</dt>
          <dd>${value}</dd>`,
    )}
  </dl>`;

// Names with their values beside each other: [[name, value]]. Further options are attributes of the list.
export const Figures = ({ pairs, className = "", ...attributes }) =>
  html`<dl class=${`figures ${className}`} ...${attributes}>
    ${pairs.map(
      ([label, value]) =>
        html`<div>
          <dt>${label}</dt>
          <dd>${value}</dd>
        </div>`,
    )}
  </dl>`;
