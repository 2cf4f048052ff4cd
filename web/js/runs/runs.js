// The runs, newest first: their inputs where these vary, their metrics, what became of each. In the address: q (words), status,
// kind (of study), sort ("-impacts" downwards), before (a page of older ones).
import { jobPath, link } from "../address.js";
import { ask, remove, getSchema } from "../api.js";
import { announce } from "../ui/announce.js";
import { Button, Loaded } from "../ui/controls.js";
import { pageOf, PageTitle } from "../ui/page.js";
import { html, useEffect, useState } from "../ui/preact.js";
import { useCount, useLoaded, useQuery } from "../ui/hooks.js";
import { Table } from "../ui/table.js";
import { metricOf, moment, title } from "../units.js";
import { KINDS } from "../study/kinds.js";
import { Actions, isOpen, StateBadge, STATES } from "./actions.js";
import { namesOf, varyingInputs } from "./names.js";
import { valueText } from "./scene_name.js";

const LIMIT = 100;
const MAX_INPUTS = 3; // columns of them
const AGAIN_MS = 1500; // between looks at what goes on
const METRICS = [
  { key: "rms_displacement", label: "Motion, rms", unit: "m", digits: 4 },
  { key: "peak_displacement", label: "Motion, peak", unit: "m", digits: 4 },
  { key: "impacts", label: "Impacts", unit: "1" },
  { key: "peak_contact_force", label: "Largest force", unit: "N", digits: 4 },
];

// {jobs, next}: a page of jobs, and what the address of the next one has as `before`.
async function listJobs(query, signal) {
  const response = await ask("GET", "v1/jobs", { query: { limit: LIMIT, ...query }, signal });
  const next = /[?&]before=([^&>]+).*rel="next"/.exec(response.headers.get("Link"))?.[1];
  return { ...(await response.json()), next };
}

// Words are looked for in what the page shows; with older pages the service looks through their titles too.
async function loadJobs({ q, status, kind, before }, signal) {
  const query = { status, kind, before, details: 1 };
  const [list, schema] = await Promise.all([listJobs(query, signal), getSchema("scene")]);
  const more = q && list.next ? await listJobs({ ...query, q }, signal) : { jobs: [] };
  const known = new Set(list.jobs.map((job) => job.id));
  return {
    schema,
    next: list.next,
    jobs: [...list.jobs, ...more.jobs.filter((job) => !known.has(job.id))],
  };
}

// What goes on is looked at again, without scenes; what has begun or ended brings the whole list anew.
function useProgress(loaded, query, reload) {
  const [latest, setLatest] = useState(new Map());
  const hasOpen = loaded.data?.jobs.some(isOpen) ?? false;
  useEffect(() => {
    if (!hasOpen) return undefined;
    const look = async () => {
      if (document.hidden) return;
      const answer = await listJobs(query, null).catch(() => null);
      if (!answer) return; // the next look may have one
      const found = new Map(answer.jobs.map((job) => [job.id, job]));
      setLatest(found);
      const known = new Map(loaded.data.jobs.map((job) => [job.id, job]));
      const isOther = (job) => !known.has(job.id) || isOpen(known.get(job.id)) !== isOpen(job);
      // One that has ended may not be in a list of those that run.
      const isGone = (job) => isOpen(job) && !found.has(job.id);
      if (answer.jobs.some(isOther) || loaded.data.jobs.some(isGone)) reload();
    };
    const timer = setInterval(look, AGAIN_MS);
    return () => clearInterval(timer);
  }, [hasOpen, loaded.data]);
  return (loaded.data?.jobs ?? []).map((job) => {
    const now = latest.get(job.id);
    return isOpen(job) && now ? { ...job, status: now.status, progress: now.progress } : job;
  });
}

// Of inputs that vary among all rows, and what the shown ones have of the rest.
function columnsOf(rows, shown, schema, onCancel) {
  const withScene = rows.filter(({ scene }) => scene);
  const all = varyingInputs(
    withScene.map(({ scene }) => scene),
    schema,
  );
  const isCommon = ({ values }) =>
    2 * values.filter((value) => value !== undefined).length > values.length;
  const at = new Map(withScene.map(({ id }, index) => [id, index]));
  const inputs = all
    .filter(isCommon)
    .slice(0, MAX_INPUTS)
    .map(({ pointer, label, unit, values }) => {
      const of = (row) => values[at.get(row.id)] ?? null;
      const isNumeric = values.every((value) => typeof (value ?? 0) === "number");
      const plain = (row) => of(row) && valueText(of(row));
      const numeric = { unit: unit ?? "1", digits: 4, value: of };
      return { key: pointer, label: title(label), ...(isNumeric ? numeric : { value: plain }) };
    });
  const valueOf = (row, key) => (row.summary ? metricOf(row.summary, key) : null);
  const metrics = METRICS.filter(({ key }) => shown.some((row) => valueOf(row, key) !== null)).map(
    (metric) => ({ ...metric, value: (row) => valueOf(row, metric.key) }),
  );
  const study = {
    key: "study",
    label: "Study",
    value: (row) => (row.study ? title(row.study) : null),
    cell: (row) => (row.study ? title(row.study) : ""),
  };
  return [
    {
      key: "name",
      label: "Run",
      value: (row) => [row.name, row.detail].filter(Boolean).join(", "),
      cell: (row) => html`<${NameCell} row=${row} onCancel=${onCancel} />`,
    },
    ...(shown.some((row) => row.study) ? [study] : []),
    ...inputs,
    ...metrics,
    ...(shown.every((row) => row.status === "successful") ? [] : [STATE]),
    {
      key: "created",
      label: "Submitted",
      value: (row) => row.created,
      cell: (row) => html`<span class="moment">${moment(row.created)}</span>`,
    },
  ];
}

// What is done as it should be catches no eye.
const STATE = {
  key: "state",
  label: "State",
  value: (row) => STATES[row.status],
  cell: (row) =>
    row.status === "successful"
      ? html`<span class="quiet">${STATES[row.status]}</span>`
      : html`<${StateBadge} job=${row} />`,
};

const NameCell = ({ row, onCancel }) =>
  html`<a id=${row.id} href=${link(jobPath(row))}
      >${row.name}${row.detail && html` <span class="hint subtitle">${row.detail}</span>`}</a
    >
    ${row.labels && html`<span class="hint subtitle">${row.labels.join(", ")}</span>`}
    ${isOpen(row) && html`<${Button} label=${`Cancel ${row.name}`} onClick=${() => onCancel(row)}>Cancel<//>`}`;

const textOf = (row) =>
  [row.name, row.detail, ...(row.labels ?? []), STATES[row.status], row.study, row.words]
    .join("\n")
    .toLowerCase();

function matching(rows, q) {
  const wanted = (q ?? "").toLowerCase().split(/\s+/).filter(Boolean);
  return rows.filter((row) => wanted.every((word) => textOf(row).includes(word)));
}

const Chooser = ({ name, label, query, values, onChange }) =>
  html`<label class="filter">
    ${label}
    <select name=${name} onChange=${(event) => onChange({ [name]: event.currentTarget.value })}>
      <option value="">All</option>
      ${values.map(
        (value) =>
          html`<option value=${value} selected=${query[name] === value}>
            ${STATES[value] ?? title(value)}
          </option>`,
      )}
    </select>
  </label>`;

function Filters({ query, onChange }) {
  return html`<form class="row level" role="search" onSubmit=${(event) => event.preventDefault()}>
    <label class="filter">
      Search
      <input
        name="q"
        type="search"
        value=${query.q ?? ""}
        onInput=${(event) => onChange({ q: event.currentTarget.value })}
      />
    </label>
    <${Chooser}
      name="status"
      label="State"
      query=${query}
      values=${Object.keys(STATES)}
      onChange=${onChange}
    />
    <${Chooser}
      name="kind"
      label="Study"
      query=${query}
      values=${["none", ...Object.keys(KINDS)]}
      onChange=${onChange}
    />
  </form>`;
}

// The order of the table from the address, and back.
function orderOf(sort, columns) {
  const key = (sort ?? "").replace(/^-/, "");
  const column = columns.findIndex((one) => one.key === key);
  return { column, direction: sort?.startsWith("-") ? -1 : 1 };
}

function RunsTable({ rows, schema, query, change, chosen, setChosen, onToggle, onCancel, onDone }) {
  const shown = matching(rows, query.q);
  const columns = columnsOf(rows, shown, schema, onCancel);
  const chosenRows = shown.filter((row) => chosen.has(row.id)); // what is not seen is not acted on
  const setOrder = ({ column, direction }) =>
    change({ sort: `${direction < 0 ? "-" : ""}${columns[column].key}` });
  return html`<${Table}
    caption="Runs, newest first"
    columns=${columns}
    rows=${shown}
    keyOf=${(row) => row.id}
    selection=${{ chosen, toggle: onToggle }}
    tools=${html`<${Actions}
      rows=${chosenRows}
      hidden=${chosen.size - chosenRows.length}
      isAll=${chosenRows.length === shown.length}
      onAll=${() => setChosen(new Set(shown.map((row) => row.id)))}
      onNone=${() => setChosen(new Set())}
      onDone=${onDone}
    />`}
    order=${orderOf(query.sort, columns)}
    onOrder=${setOrder}
    empty="There is no such run."
  />`;
}

function RunsPage() {
  const [loads, reload] = useCount();
  const [chosen, setChosen] = useState(new Set());
  const { query, change } = useQuery();
  const { q, status, kind, before } = query;
  const loaded = useLoaded(
    (signal) => loadJobs(query, signal),
    [q, status, kind, before].map(String),
    loads,
  );
  const jobs = useProgress(loaded, { status, kind, before }, reload);
  const toggle = (row) =>
    setChosen((last) => {
      const next = new Set(last);
      if (!next.delete(row.id)) next.add(row.id);
      return next;
    });
  const cancel = async (row) => {
    document.getElementById(row.id)?.focus();
    await remove(`v1/jobs/${row.id}`);
    announce(`Cancelled: ${row.name}`);
    reload();
  };
  const done = () => {
    setChosen(new Set());
    reload();
  };
  return html`<${PageTitle} title="Runs" />
    <${Filters} query=${query} onChange=${(changes) => change({ ...changes, before: null })} />
    <div class="runs">
      <${Loaded} loaded=${loaded}>
        ${({ schema, next }) => {
          const names = namesOf(jobs, schema);
          const rows = jobs.map((job) => ({ ...job, ...names.get(job.id) }));
          return html`<${RunsTable}
              rows=${rows}
              schema=${schema}
              query=${query}
              change=${change}
              chosen=${chosen}
              setChosen=${setChosen}
              onDone=${done}
              onToggle=${toggle}
              onCancel=${cancel}
            />
            <p>
              ${next && html`<a href=${link("jobs", { ...query, before: next })}>Older runs</a>`}
              ${jobs.length === 0 && html`<a href="#/scene">Begin with a scene</a>`}
            </p>`;
        }}
      <//>
    </div>`;
}

export const page = pageOf(() => "Runs", RunsPage);
