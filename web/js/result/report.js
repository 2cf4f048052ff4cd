// A result on paper: what was asked, what came out, its charts, how it was computed. The browser prints it or saves a PDF.
import { html } from "../ui/preact.js";
import { link } from "../address.js";
import { get, schema as schemaNamed } from "../api.js";
import { Button, Loaded } from "../ui/controls.js";
import { useLoaded } from "../ui/store.js";
import { pageOf } from "../ui/page.js";
import { Table } from "../ui/table.js";
import { inputsOf } from "../scene/inputs.js";
import { KINDS } from "../study/kinds.js";
import { brief, moment, pretty, quantity } from "../units.js";
import { ResultContext, jobsOf, useResultContext } from "./context.js";
import { Energy } from "./energy.js";
import { ResultHeadlines } from "./headlines.js";
import { ImpactTable } from "./impacts.js";
import { Method } from "./method.js";
import { Motion } from "./motion.js";
import { Spectrum } from "./spectrum.js";

const load = async (id, signal) => {
  const [result, jobs, version, schema] = await Promise.all([
    get(`v1/results/${encodeURIComponent(id)}`, null, signal),
    jobsOf(id, signal),
    get("version", null, signal),
    schemaNamed("scene"),
  ]);
  const View = result.study && (await KINDS[result.study.kind].load());
  return {
    result,
    job: jobs.find((one) => one.title) ?? jobs[0],
    jobs: Promise.resolve(jobs),
    version,
    schema,
    View,
  };
};

const inputColumns = [
  { label: "Input", value: ({ label }) => label },
  {
    label: "Value",
    value: ({ value, text }) => (typeof value === "number" ? value : text),
    cell: ({ value, unit, text }) =>
      typeof value === "number" ? quantity(value, unit, 6) : `${text} ${pretty(unit ?? "")}`,
  },
];

const Part = ({ title, children }) =>
  html`<section>
    <h2>${title}</h2>
    ${children}
  </section>`;

const Run = ({ links }) =>
  html`<${ResultHeadlines} />
    <${Part} title="Motion"><${Motion} /><//>
    ${links.psd && html`<${Part} title="Spectrum"><${Spectrum} /><//>`}
    ${links.impacts && html`<${Part} title="Impacts"><${ImpactTable} /><//>`}
    ${links.energy && html`<${Part} title="Energy"><${Energy} /><//>`}`;

function Report({ result, job, jobs, version, schema, View, signal }) {
  const context = useResultContext(result, signal, jobs);
  const { study } = result;
  const { study: asked, ...scene } = result.scene;
  const { warnings, links } = result;
  const remarks = warnings.map(({ detail }) => html`<li>${detail}</li>`);
  return html`<${ResultContext.Provider} value=${context}>
    <h1>${job?.title ?? "Result"}</h1>
    <p class="quiet">
      ${`Computed ${moment(job?.finished)} by impactd ${version.version}, engine ${result.engine}. `}
      <a href=${link(`results/${result.id}`)}>${`Result ${brief(result.id)}`}</a>
    </p>
    ${View ? html`<${Part} title=${KINDS[study.kind].title}><${View} /><//>` : html`<${Run} links=${links} />`}
    <${Part} title="How it was computed"><${Method} /><//>
    ${
      remarks.length > 0 &&
      html`<${Part} title="Remarks"
        ><ul>
          ${remarks}
        </ul><//
      >`
    }
    <${Part} title="Inputs">
      <${Table} caption="Inputs" columns=${inputColumns} rows=${inputsOf(scene, schema)} />
    <//>
  <//>`;
}

function ReportPage({ address, signal }) {
  const id = address.path[1];
  const loaded = useLoaded(() => load(id, signal), [id]);
  const show = (data) => html`<${Report} signal=${signal} ...${data} />`;
  return html`<div class="report">
    <div class="row no-print">
      <${Button} isPrimary onClick=${() => print()}>Print or save as PDF<//>
      <a class="button" href=${link(`results/${id}`)}>Back to the result</a>
    </div>
    <${Loaded} loaded=${loaded}>${show}<//>
  </div>`;
}

export const page = pageOf(({ path }) => `Report ${path[1].slice(0, 10)}`, ReportPage);
