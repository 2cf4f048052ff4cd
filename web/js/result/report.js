// A result on paper: what was asked, what came out, its charts, how it was computed. The browser prints it or saves a PDF.
import { html } from "../ui/preact.js";
import { link } from "../address.js";
import { get, getSchema } from "../api.js";
import { Button, Loaded, sentence, withSubscripts } from "../ui/controls.js";
import { useLoaded } from "../ui/hooks.js";
import { pageOf } from "../ui/page.js";
import { Table } from "../ui/table.js";
import { inputsOf, place, unitAt } from "../scene/inputs.js";
import { KINDS } from "../study/kinds.js";
import { brief, moment, pretty, quantity, readable, title } from "../units.js";
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
    getSchema("scene"),
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

const VARIED = /^(from|to|values|mean|deviation|median|mode)$/;

// A study's own inputs: a place of the scene that it varies stands in words, its values have the unit of that place.
function studyInputs(study, schema) {
  const memberAt = (names) => names.reduce((value, name) => value[name], study);
  return inputsOf({ study }, schema).map((row) => {
    const names = row.pointer.split("/").slice(2);
    const name = names.pop();
    const { pointer, pointers } = memberAt(names);
    const label = title(place(row.pointer.replace("/study", "")).replace(/pointers?$/, "member"));
    if (/^pointers?$/.test(name))
      return { label, text: title([row.value].flat().map(place).join("; ")) };
    const unit = VARIED.test(name) ? unitAt(schema, pointer ?? pointers?.[0] ?? "") : row.unit;
    return { ...row, label, unit };
  });
}

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
  const remarks = warnings.map(
    ({ detail }) => html`<li>${withSubscripts(sentence(readable(detail)))}</li>`,
  );
  return html`<${ResultContext.Provider} value=${context}>
    <h1>${pretty(job?.title ?? "Result")}</h1>
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
    ${
      asked &&
      html`<${Part} title="Inputs of the study"
        ><${Table}
          caption="Inputs of the study"
          columns=${inputColumns}
          rows=${studyInputs(asked, schema)}
      /><//>`
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
    <${Loaded} loaded=${loaded} heading="Report">${show}<//>
  </div>`;
}

export const page = pageOf(({ path }) => `Report ${path[1].slice(0, 10)}`, ReportPage);
