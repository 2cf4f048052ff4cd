// What the pages of materials share: paths, numbers with their deviations, columns of tables, what differs between revisions.
import { ask, get } from "../api.js";
import { Loaded, sentence, withSubscripts } from "../ui/controls.js";
import { html } from "../ui/preact.js";
import { useLoaded } from "../ui/hooks.js";
import { Table } from "../ui/table.js";
import { number, pretty, quantity, scale, title } from "../units.js";

export const materialPath = (slug, rest = "") => `v1/materials/${encodeURIComponent(slug)}${rest}`;

const TONES = { approved: "ok", draft: "warn", deprecated: "bad" };
export const Badge = ({ status }) => html`<span class=${`badge ${TONES[status]}`}>${status}</span>`;

// "25 ± 1 ms", "0.61"
export function figure(value, deviation, unit) {
  if (deviation === null || deviation === undefined) return quantity(value, unit);
  const [factor, scaled] = scale(Math.abs(value), unit);
  const shownUnit = scaled === "1" ? "" : pretty(scaled);
  return `${number(value / factor)} ± ${number(deviation / factor, 2)} ${shownUnit}`.trim();
}

// "0.15 to 1 m/s"
export function range(low, high, unit) {
  if (low === high) return quantity(high, unit);
  const [factor] = scale(Math.abs(high), unit);
  return `${number(low / factor)} to ${quantity(high, unit)}`;
}

// e or T_c of a material; of a table over approach speed what it spans.
export function measured(material, name, unit) {
  const values = (material.table ?? []).map((row) => row[name]).filter((value) => value !== null);
  return values.length > 0
    ? `${range(Math.min(...values), Math.max(...values), unit)} by speed`
    : figure(material[name], material[`${name}_deviation`], unit);
}

export const QUANTITIES = [
  { name: "restitution", label: "Restitution e", unit: "1", color: "restitution" },
  { name: "contact_time", label: "Contact time T_c", unit: "s", color: "contact-time" },
];

// Columns of e and T_c, with their deviations where a row has one; what depends on the speed stands as a range.
export const figureColumns = (rows) =>
  QUANTITIES.flatMap(({ name, label, unit }) => {
    const key = `${name}_deviation`;
    const column = {
      label,
      unit,
      value: (row) => row[name],
      cell: (row) => (row.table?.length > 0 ? measured(row, name, unit) : null),
    };
    const hasDeviation = rows.some((row) => typeof row[key] === "number");
    const deviation = { label: `± ${label.split(" ").at(-1)}`, unit, digits: 2 };
    return hasDeviation ? [column, { ...deviation, value: (row) => row[key] }] : [column];
  });

export const statusColumn = {
  label: "Status",
  value: (row) => row.status,
  cell: (row) => html`<${Badge} status=${row.status} />`,
};

// A material as it stands, with the entity tag that a change of it needs.
export async function readMaterial(slug, revision, signal) {
  const part = revision ? `@${encodeURIComponent(revision)}` : "";
  const answer = await ask("GET", materialPath(slug, part), { signal });
  return { ...(await answer.json()), etag: answer.headers.get("ETag") };
}

// A member's value as text, at most 400 letters of it.
export function memberText(value, unit) {
  if (typeof value === "number") return quantity(value, unit, 6);
  const text = typeof value?.[0] === "object" ? JSON.stringify(value) : `${value ?? ""}`;
  return text.slice(0, 400) || "–";
}

export const Remarks = ({ warnings }) =>
  warnings.length > 0 &&
  html`<ul class="remarks hint">
    ${warnings.map(({ detail }) => html`<li>${withSubscripts(sentence(detail))}</li>`)}
  </ul>`;

// What the second of two revisions has changed.
export function Differences({ slug, first, second }) {
  const loaded = useLoaded(
    (signal) => get(materialPath(slug, "/diff"), { from: first, to: second }, signal),
    [slug, first, second],
  );
  const columns = [
    { label: "What", value: (row) => title(row.pointer.slice(1)) },
    { label: `Revision ${first}`, value: (row) => memberText(row.from, row.unit) },
    { label: `Revision ${second}`, value: (row) => memberText(row.to, row.unit) },
  ];
  return html`<${Loaded} loaded=${loaded}>
    ${({ to, differences }) =>
      html`<p>${`Revision ${second}, ${to.status}: ${to.comment}`}</p>
        <${Table}
          caption=${`From revision ${first} to revision ${second}`}
          columns=${columns}
          rows=${differences}
          empty="They have the same content."
        />`}
  <//>`;
}
