// All materials: searched by words and ranges, seen as e over contact time, added, imported and exported.
import { go, link } from "../address.js";
import { get, post } from "../api.js";
import { Chart } from "../chart/chart.js";
import { Button, Failure, FileInput, Loaded, Panel } from "../ui/controls.js";
import { pageOf, PageTitle } from "../ui/page.js";
import { html, useState } from "../ui/preact.js";
import { save } from "../ui/files.js";
import { useCount, useLoaded } from "../ui/hooks.js";
import { Table } from "../ui/table.js";
import { figureColumns, range, statusColumn } from "./format.js";
import { NamedForm } from "./schema_form.js";

const LIMIT = 1000;
const MS = 1000; // in a second
const MAX_NAMES = 25; // written into the chart
const COLORS = { approved: "ok", draft: "c2", deprecated: "bad" };

// One of some values, or any.
const Select = ({ name, label, values, value = "" }) =>
  html`<label class="filter"
    >${label}
    <select name=${name}>
      <option value="">any</option>
      ${[...new Set([...values, value])]
        .filter(Boolean)
        .map((one) => html`<option selected=${one === value}>${one}</option>`)}
    </select></label
  >`;

const scaled = (text, factor) => {
  const value = Number(text.replace(",", ".")) * factor;
  return text === "" || Number.isNaN(value) ? text : String(Number(value.toPrecision(12)));
};
const boundsOf = (texts, factor = 1) =>
  texts.some(Boolean) ? texts.map((text) => scaled(text.trim(), factor)).join("..") : "";

// Two bounds, either of them empty; the address has "0.4..0.7" in units of the service, of which `per` shown ones are one.
function Bounds({ name, label, value = "", per = 1 }) {
  const [low, high = low] = value.split("..");
  const input = (text, part) =>
    html`<input
      name=${name}
      inputmode="decimal"
      aria-label=${`${label}, ${part}`}
      defaultValue=${scaled(text, per)}
    />`;
  return html`<div class="filter">
    <span class="label">${label}</span>
    <span class="bounds">${input(low, "at least")} to ${input(high, "at most")}</span>
  </div>`;
}

function Search({ query, kinds }) {
  const submit = (event) => {
    event.preventDefault();
    const form = new FormData(event.currentTarget);
    const e = boundsOf(form.getAll("e"));
    const time = boundsOf(form.getAll("T_c"), 1 / MS);
    go("materials", { ...Object.fromEntries(form), e, T_c: time });
  };
  return html`<form class="row level" role="search" onSubmit=${submit}>
    <label class="filter"
      >Search <input type="search" name="q" size="14" defaultValue=${query.q ?? ""}
    /></label>
    <${Select} name="kind" label="Kind" values=${kinds} value=${query.kind} />
    <${Bounds} name="e" label="Restitution e" value=${query.e} />
    <${Bounds} name="T_c" label="Contact time [ms]" value=${query.T_c} per=${MS} />
    <${Select} name="status" label="Status" values=${Object.keys(COLORS)} value=${query.status} />
    <button>Search</button>
  </form>`;
}

// Where materials lie between hard and soft, lively and dull; a click opens one.
function Overview({ materials }) {
  const rows = materials.filter((row) => row.restitution !== null && row.contact_time !== null);
  if (rows.length < 2) return null;
  const isNamed = rows.length <= MAX_NAMES;
  const statuses = Object.keys(COLORS).filter((status) =>
    rows.some((row) => row.status === status),
  );
  const of = (status) => rows.filter((row) => row.status === status);
  const series = statuses.map((status) => ({
    kind: "points",
    label: status,
    color: COLORS[status],
    size: 10,
    x: of(status).map((row) => MS * row.contact_time),
    y: of(status).map((row) => row.restitution),
  }));
  const open = (shown, index) => go(`materials/${of(shown.label)[index].slug}`);
  const names = ({ x, y, right }) =>
    rows.map((row) => {
      const at = x.to(MS * row.contact_time);
      const isLate = at > right - 90;
      return html`<text
        x=${isLate ? at - 9 : at + 9}
        y=${y.to(row.restitution) + 4}
        text-anchor=${isLate ? "end" : "start"}
        >${row.name}</text
      >`;
    });
  return html`<${Chart}
    title="Restitution e over contact time"
    height=${190}
    isShort
    x=${{ label: "Contact time T_c", unit: "ms", log: true }}
    y=${{ label: "Restitution e", unit: "1" }}
    series=${series}
    onPick=${open}
  >
    ${isNamed && names}
  <//>`;
}

const columnsOf = (materials) => [
  {
    label: "Material",
    value: (row) => row.name,
    cell: (row) => html`<a href=${link(`materials/${row.slug}`)}>${row.name}</a>`,
  },
  { label: "Kind", value: (row) => row.kind },
  ...figureColumns(materials),
  {
    label: "Speeds",
    unit: "m/s",
    value: (row) => row.most_speed,
    cell: (row) =>
      row.most_speed === null ? "–" : range(row.least_speed, row.most_speed, "").trim(),
  },
  { label: "Source", value: (row) => row.source },
  statusColumn,
];

function Found({ materials }) {
  const more = materials.length === LIMIT ? ", perhaps more: narrow the search" : "";
  return html`<p class="quiet" role="status">${`${materials.length} found${more}`}</p>
    <${Overview} materials=${materials} />
    <${Table}
      caption="Materials"
      columns=${columnsOf(materials)}
      rows=${materials}
      keyOf=${(row) => row.slug}
      empty="No material matches. Widen the search, or add a material below."
    />`;
}

// A file is imported whole or, with a fault, not at all.
function Import({ onDone }) {
  const [error, setError] = useState(null);
  const read = async (event) => {
    const [body] = event.currentTarget.files;
    if (!body) return;
    const type = body.name.endsWith(".json") ? "application/json" : "text/csv";
    setError(null);
    try {
      await post("v1/materials/import", undefined, { body, type });
      onDone();
    } catch (problem) {
      setError(problem);
    }
  };
  return html`<label
      >A table (CSV) with slug, name, restitution and source, or an export (JSON)
      <${FileInput} accept=".csv,.json" onChange=${read} />
    </label>
    ${error && html`<${Failure} error=${error} />`}`;
}

function AddForm() {
  const add = async (value) => go(`materials/${(await post("v1/materials", value)).slug}`);
  return html`<p class="hint">e may be a guess, if its source says so.</p>
    <${NamedForm} name="new_material" value=${{}} label="Add it" send=${add} />`;
}

function MaterialsPage({ address: { query } }) {
  const [isAdding, setIsAdding] = useState(false);
  const [isImporting, setIsImporting] = useState(false);
  const [imports, countImport] = useCount();
  const loaded = useLoaded(
    (signal) => get("v1/materials", { ...query, limit: LIMIT }, signal),
    [JSON.stringify(query)],
    imports,
  );
  const kinds = useLoaded(
    async (signal) => {
      const { materials } = await get("v1/materials", { limit: LIMIT }, signal);
      return [...new Set(materials.map(({ kind }) => kind))].sort();
    },
    [],
    imports,
  );
  const files = ["materials.csv", "materials.json"];
  return html`<${PageTitle} title="Materials" />
    <p class="lead">What a laboratory measured of its buffers.</p>
    <section class="panel" aria-label="Search">
      <${Search} key=${JSON.stringify(query)} query=${query} kinds=${kinds.data ?? []} />
      <${Loaded} loaded=${loaded}>${(data) => html`<${Found} ...${data} />`}<//>
    </section>
    <${Panel} title="Add and exchange">
      <details onToggle=${(event) => setIsAdding(event.currentTarget.open)}>
        <summary>Add a material</summary>
        ${isAdding && html`<${AddForm} />`}
      </details>
      <details onToggle=${(event) => setIsImporting(event.currentTarget.open)}>
        <summary>Import</summary>
        ${isImporting && html`<${Import} onDone=${countImport} />`}
      </details>
      <div class="row">
        ${files.map((name) => html`<${Button} onClick=${() => save(`v1/${name}`, name)}>${`Export ${name}`}<//>`)}
      </div>
    <//>`;
}

export const page = pageOf(() => "Materials", MaterialsPage);
