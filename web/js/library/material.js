// One material: its numbers and how sure they are, k_b and c_b for a pair of masses, drop tests, revisions and their history.
import { link } from "../address.js";
import { get, getSchema } from "../api.js";
import { Facts, Headlines, Loaded, Panel } from "../ui/controls.js";
import { pageOf } from "../ui/page.js";
import { html } from "../ui/preact.js";
import { useLoaded } from "../ui/hooks.js";
import { Table } from "../ui/table.js";
import { moment, number, quantity, title } from "../units.js";
import { Chart } from "../chart/chart.js";
import {
  Badge,
  Differences,
  figureColumns,
  measured,
  memberText,
  materialPath,
  QUANTITIES,
  range,
  readMaterial,
  statusColumn,
} from "./format.js";
import { PairPanel } from "./pair.js";
import { Readings } from "./readings.js";
import { WriteForm } from "./schema_form.js";

const IN_HEADLINES =
  /^(name|comment|measurements|table|restitution|contact_time|least_speed|most_speed|impactor_mass)/;

// {material, revisions, steps, used, tests, properties}
async function load(slug, revision, signal) {
  const material = await readMaterial(slug, revision, signal);
  const list = (part) => get(materialPath(slug, part), { limit: 100 }, signal);
  const [{ revisions }, { history }, used, tests, { properties }] = await Promise.all([
    list("/revisions"),
    list("/history"),
    list(`@${material.revision}/used-by`),
    list("/measurements"),
    getSchema("material_revision"),
  ]);
  return { material, revisions, steps: history, used, tests, properties };
}

function Numbers({ material, tests, used }) {
  const { least_speed: least, most_speed: most, impactor, impactor_mass: mass } = material;
  const note = (name) => {
    if (material.table?.length > 0) return "over approach speed, see below";
    return material[`${name}_deviation`] === null
      ? "no deviation stated"
      : "± one standard deviation";
  };
  const items = [
    ...QUANTITIES.map(({ name, label, unit }) => ({
      label,
      value: measured(material, name, unit),
      note: note(name),
    })),
    {
      label: "Approach speeds",
      value: most === null ? "–" : range(least ?? most, most, "m/s"),
      note: "of the test",
    },
    { label: "Impactor", value: quantity(mass, "kg"), note: impactor },
    { label: "Drop tests", value: number(tests.count) },
    { label: "Results", value: number(used.total), note: "made with this revision" },
  ];
  return html`<${Headlines} items=${items} />`;
}

function MaterialFacts({ material, properties, used }) {
  const names = Object.keys(properties).filter((name) => !IN_HEADLINES.test(name));
  const facts = names
    .map((name) => [title(name), memberText(material[name], properties[name]["x-unit"])])
    .filter(([, value]) => value !== "–");
  return html`<${Panel} title="What is known">
    <${Facts} pairs=${facts} />
    <details>
      <summary>${`Results made with it: ${number(used.total)}`}</summary>
      <ul>
        ${used.results.map(
          ({ id, created }) =>
            html`<li><a href=${link(`results/${id}`)}>${moment(created)}</a></li>`,
        )}
      </ul>
    </details>
  <//>`;
}

// A table over approach speed, as lines.
function SpeedTable({ rows }) {
  const x = rows.map((row) => row.approach_speed);
  const columns = [
    { label: "Speed", unit: "m/s", value: (row) => row.approach_speed },
    ...figureColumns(rows),
  ];
  return html`<${Panel} title="Over approach speed">
    ${QUANTITIES.filter(({ name }) => rows.some((row) => row[name] !== null)).map(
      ({ name, label, unit, color }) => {
        const y = rows.map((row) => row[name]);
        return html`<${Chart}
          key=${name}
          title=${label}
          height=${120}
          isShort
          x=${{ label: "Approach speed", unit: "m/s" }}
          y=${{ label, unit }}
          series=${[
            { label: "linear between", color, x, y },
            { kind: "points", label: "rows", color, size: 7, x, y },
          ]}
        />`;
      },
    )}
    <${Table} caption="Over approach speed" columns=${columns} rows=${rows} />
  <//>`;
}

// All tests of the material together, as a proposal would combine them.
function DropTests({ slug, count }) {
  const loaded = useLoaded(
    (signal) => get(materialPath(slug, "/proposal"), null, signal),
    [slug, count],
  );
  return html`<${Panel} title="Drop tests" help="What was read">
    <${Loaded} loaded=${loaded}>${(found) => html`<${Readings} ...${found} />`}<//>
  <//>`;
}

// A review; or a revision, from the members that this one has.
function Changes({ material, properties }) {
  const isEmpty = (value) => value === null || value.length === 0;
  const members = JSON.parse(
    JSON.stringify(material, (_, value) => (isEmpty(value) ? undefined : value)),
  );
  const known = Object.keys(properties).filter((name) => name !== "comment" && name in members);
  const revision = Object.fromEntries(known.map((name) => [name, members[name]]));
  return html`<${Panel} title="Review and change">
    <details open=${material.status === "draft"}>
      <summary>Approve or deprecate it</summary>
      <${WriteForm}
        name="material_review"
        value=${{ status: "approved" }}
        label="Review it"
        material=${material}
        part=${`@${material.revision}/review`}
      />
    </details>
    <details>
      <summary>Edit it</summary>
      <${WriteForm}
        name="material_revision"
        value=${revision}
        label="Make it a revision"
        material=${material}
        part="/revisions"
      />
    </details>
  <//>`;
}

const ACTIONS = {
  measure: "Kept",
  approve: "Approved",
  deprecate: "Deprecated",
  revert: "Reverted by",
  import: "Imported",
};

function subjectOf(slug, { revision, measurement }) {
  if (measurement !== null)
    return html`<a href=${link(`materials/${slug}/measure`, { measurement })}
      >${`test ${measurement}`}</a
    >`;
  if (revision === null) return "a file";
  return html`<a href=${link(`materials/${slug}`, { revision })}>${`revision ${revision}`}</a>`;
}

const Trail = ({ slug, steps }) =>
  html`<${Panel} title="History" help="Revisions">
    <ul class="trail">
      ${steps.map(
        (step) =>
          html`<li>
            <span>
              ${`${ACTIONS[step.action] ?? "Wrote"} `}${subjectOf(slug, step)}${`: ${step.why}`}
            </span>
            <span class="quiet">${`${step.who ?? "the local user"}, ${moment(step.when)}`}</span>
          </li>`,
      )}
    </ul>
  <//>`;

// The revisions; what changed since the one that is shown, or the last but one; the way back to an older one.
function Revisions({ material, revisions }) {
  const { slug, revision, latest } = material;
  const columns = [
    {
      label: "Revision",
      value: (row) => row.revision,
      cell: (row) =>
        html`<a href=${link(`materials/${slug}`, { revision: row.revision })}
          >${`Revision ${row.revision}`}</a
        >`,
    },
    ...figureColumns(revisions),
    statusColumn,
    { label: "Comment", value: (row) => row.comment },
    { label: "Written", value: (row) => row.created, cell: (row) => moment(row.created) },
  ];
  return html`<${Panel} title="Revisions" help="Revisions">
    <${Table}
      caption="Revisions, the newest first"
      columns=${columns}
      rows=${revisions}
      keyOf=${(row) => row.revision}
      chosenKey=${revision}
    />
    ${
      latest > 1 &&
      html`<${Differences} slug=${slug} first=${Math.min(revision, latest - 1)} second=${latest} />`
    }
    ${
      revision < latest &&
      html`<${WriteForm}
        name="material_revert"
        value=${{ to: revision, comment: `as revision ${revision}` }}
        label=${`Revert to revision ${revision}`}
        material=${material}
        part="/revert"
        only=${["comment"]}
      />`
    }
  <//>`;
}

function Material({ material, revisions, steps, used, tests, properties }) {
  const { slug, revision, latest, status, name, table } = material;
  const buffer = `${slug}@${revision}`;
  return html`<div class="title-row">
      <h1>${name} <${Badge} status=${status} /></h1>
      <div class="actions">
        <a class="button primary" href=${link("scene", { buffer })}>Simulate with it</a>
        <a class="button" href=${link(`materials/${slug}/measure`)}>Enter a drop test</a>
      </div>
    </div>
    <p class="quiet">
      <code>${buffer}</code>${` of ${latest}. Scenes without a revision take the newest approved.`}
    </p>
    <${Numbers} material=${material} tests=${tests} used=${used} />
    <div class="split">
      <div>
        <${PairPanel} material=${material} />
        ${table?.length > 0 && html`<${SpeedTable} rows=${table} />`}
        ${tests.count > 0 && html`<${DropTests} slug=${slug} count=${tests.count} />`}
        <${Revisions} material=${material} revisions=${revisions} />
      </div>
      <div>
        <${MaterialFacts} material=${material} properties=${properties} used=${used} />
        <${Changes} material=${material} properties=${properties} />
        <${Trail} slug=${slug} steps=${steps} />
      </div>
    </div>`;
}

function MaterialPage({ address }) {
  const slug = address.path[1];
  const { revision } = address.query;
  const loaded = useLoaded(
    (signal) => load(slug, revision, signal),
    [address], // a change leads to its revision, which may be the same one
  );
  const current = loaded.data?.material;
  return html`<${Loaded} loaded=${loaded} heading=${slug}>
    ${(data) => html`<${Material} key=${`${current.etag}@${current.revision}`} ...${data} />`}
  <//>`;
}

export const page = pageOf(({ path: [, slug] }) => slug, MaterialPage);
