// Measured data brought to a result: chosen with a button or dropped on the page. What shows them is loaded when there are some.
import { html, useEffect, useRef, useState } from "../ui/preact.js";
import { Button, FileInput, IconButton, Loaded, Panel } from "../ui/controls.js";
import { useLoaded, useStore } from "../ui/hooks.js";
import { tabStorage } from "../storage.js";
import { createStore } from "../store.js";

const KEY = "impactd.measured.";
const stores = new Map(); // by the result: {name, text} or null

// What was chosen for a result; the browser keeps it until the tab is closed.
function storeOf(id) {
  if (!stores.has(id)) stores.set(id, createStore(JSON.parse(tabStorage.get(KEY + id) ?? "null")));
  return stores.get(id);
}

async function bring(id, file) {
  const measured = { name: file.name, text: await file.text() };
  storeOf(id).set(measured);
  tabStorage.set(KEY + id, JSON.stringify(measured)); // a large one is not kept over a reload
}

function forget(id) {
  tabStorage.remove(KEY + id);
  storeOf(id).set(null);
}

// Takes files that are dropped anywhere on the page; whether one is held over it.
function useDrop(id) {
  const [isOver, setIsOver] = useState(false);
  useEffect(() => {
    const hasFiles = (event) => event.dataTransfer?.types.includes("Files");
    const stop = new AbortController();
    const listen = (name, act) => addEventListener(name, act, { signal: stop.signal });
    listen("dragover", (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      setIsOver(true);
    });
    listen("dragleave", (event) => event.relatedTarget === null && setIsOver(false));
    listen("drop", (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      setIsOver(false);
      if (event.dataTransfer.files[0]) bring(id, event.dataTransfer.files[0]);
    });
    return () => stop.abort();
  }, [id]);
  return isOver;
}

export function MeasuredButton({ id }) {
  const input = useRef(null);
  const isOver = useDrop(id);
  const choose = (event) => {
    const [file] = event.currentTarget.files;
    if (file) bring(id, file);
  };
  return html`<${Button} onClick=${() => input.current.click()}>Measured data …<//>
    <${FileInput}
      inputRef=${input}
      hidden
      accept=".csv,.txt,.dat,.asc,.tsv,text/*"
      onChange=${choose}
    />
    ${isOver && html`<div class="drop-area"><p>Drop a text file of times and values</p></div>`}`;
}

export function MeasuredPanel({ id }) {
  const measured = useStore(storeOf(id));
  const loaded = useLoaded(
    async () => (measured ? (await import("./measured.js")).MeasuredText : null),
    [measured !== null],
  );
  if (!measured) return null;
  const actions = html`<${IconButton} label="Close the measured data" onClick=${() => forget(id)}
    >Close<//
  >`;
  return html`<${Panel} title="Measured data" help="Compare" actions=${actions}>
    <${Loaded} loaded=${loaded}>${(View) => html`<${View} ...${measured} />`}<//>
  <//>`;
}
