// The ground motions that the server keeps: listed, and new ones uploaded.
import { go, link } from "../address.js";
import { get, post } from "../api.js";
import { Loaded, Panel } from "../ui/controls.js";
import { useId, useLoaded } from "../ui/hooks.js";
import { pageOf, PageTitle } from "../ui/page.js";
import { html } from "../ui/preact.js";
import { Table } from "../ui/table.js";
import { SchemaForm, widgetOf } from "./schema_form.js";

const LIMIT = 500;
const COLUMNS = [
  {
    label: "Name",
    value: (row) => row.name,
    cell: (row) => html`<a href=${link(`records/${row.name}`)}>${row.name}</a>`,
  },
  { label: "Earthquake", isOptional: true, value: (row) => row.earthquake },
  { label: "Station", isOptional: true, value: (row) => row.station },
  { label: "Duration", unit: "s", value: (row) => row.duration },
  { label: "Peak acceleration", unit: "m/s^2", digits: 3, value: (row) => row.peak },
  { label: "Peak velocity", unit: "m/s", digits: 3, value: (row) => row.peak_velocity },
  { label: "Interval", unit: "s", value: (row) => row.interval },
];

const TEXT = { type: "string" };
const IF_UNSTATED = "if the file does not state it";
const UPLOAD = {
  required: ["file", "name"],
  properties: {
    file: {},
    name: { ...TEXT, description: "letters, digits, . _ -" },
    unit: { enum: ["m/s^2", "g", "cm/s^2"], description: IF_UNSTATED },
    interval: {
      type: "number",
      exclusiveMinimum: 0,
      "x-unit": "s",
      description: `between samples, ${IF_UNSTATED}`,
    },
    source: TEXT,
    processing: TEXT,
    earthquake: TEXT,
    station: TEXT,
    notes: TEXT,
  },
};

function FileField({ pointer, label, draft }) {
  const id = useId("file");
  const choose = (event) => {
    const [file] = event.currentTarget.files;
    draft.set(pointer, file);
    draft.set("/name", file?.name.replace(/\.\w*$/, "").replace(/\W+/g, "_"));
  };
  return html`<div class="field">
    <label for=${id}>${label}</label>
    <input type="file" id=${id} aria-describedby=${`${id}-hint`} onChange=${choose} />
    <p class="hint at-value" id=${`${id}-hint`}>
      PEER's AT2, times with accelerations, or one column
    </p>
  </div>`;
}

const WIDGETS = [[/^.file$/, widgetOf(FileField)]];

async function upload({ file, ...query }) {
  if (!file) throw new Error("Choose a file.");
  const options = { query, body: file, type: "text/plain" };
  go(`records/${(await post("v1/records", undefined, options)).name}`);
}

function RecordsPage() {
  const loaded = useLoaded((signal) => get("v1/records", { limit: LIMIT }, signal), []);
  return html`<${PageTitle} title="Ground motions" />
    <p class="lead">Records that shake the base of a scene; one never changes.</p>
    <section class="panel" aria-label="List">
      <${Loaded} loaded=${loaded}>
        ${({ records }) => html`
          <${Table}
            caption="Records"
            columns=${COLUMNS.filter(({ isOptional, value }) => !isOptional || records.some(value))}
            rows=${records}
            keyOf=${(row) => row.name}
            filter=${records.length > 8 ? "Filter by words" : null}
            empty="There are none yet. Upload one below; a scene names it as its base motion."
          />
          ${records.length === LIMIT && html`<p class="hint">${`The first ${LIMIT} by name.`}</p>`}
        `}
      <//>
    </section>
    <${Panel} title="Upload one">
      <${SchemaForm}
        schema=${UPLOAD}
        value=${{}}
        label="Upload"
        send=${upload}
        widgets=${WIDGETS}
        shows=${(pointer) => /unit|interval/.test(pointer)}
      />
    <//>`;
}

export const page = pageOf(() => "Ground motions", RecordsPage);
