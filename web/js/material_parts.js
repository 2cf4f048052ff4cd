// What the pages of materials share: figures with their ±, status, what differs between revisions.
import { ask, get } from "./api.js";
import { h, table } from "./dom.js";
import { number, pretty, quantity, scale, title } from "./units.js";

export const path = (slug, rest = "") => `v1/materials/${encodeURIComponent(slug)}${rest}`;
const KINDS = { approved: "ok", draft: "warn", deprecated: "bad" };
export const badge = (status) => h(`span.badge.${KINDS[status]}`, null, status);

// "25 ± 1 ms", "0.61"
export function figure(value, deviation, unit) {
  const [factor, scaled] = scale(Math.abs(value), unit);
  return deviation === null ? quantity(value, unit)
    : `${number(value / factor)} ± ${number(deviation / factor, 2)} ${pretty(scaled)}`.trim();
}

export const range = (least, most, unit) => (least === most ? quantity(most, unit)
  : `${number(least / scale(Math.abs(most), unit)[0])} to ${quantity(most, unit)}`);

// e or T_c of a material; of a table over approach speed what it spans.
function measured(material, name, unit) {
  const values = (material.table ?? []).map((row) => row[name]).filter((value) => value !== null);
  return values.length > 0 ? `${range(Math.min(...values), Math.max(...values), unit)} by speed`
    : figure(material[name], material[`${name}_deviation`], unit);
}

export const QUANTITIES = [["restitution", "Restitution e", ""], ["contact_time", "Contact time", "s"]];
// Their columns, for materials, revisions and rows of a table over approach speed.
export const FIGURES = QUANTITIES.map(([name, label, unit]) =>
  ({ label, numeric: true, value: (row) => row[name], cell: (row) => measured(row, name, unit) }));
export const STATUS = { label: "Status", value: (row) => row.status, cell: (row) => badge(row.status) };

// A material as it stands, with the ETag that a write after it needs.
export async function readMaterial(slug, revision) {
  const answer = await ask("GET", path(slug, revision ? `@${encodeURIComponent(revision)}` : ""));
  return { ...(await answer.json()), etag: answer.headers.get("ETag") };
}

// A member's value as text, at most 400 letters of it.
export const shown = (value, unit) => (typeof value === "number" ? quantity(value, unit, 6)
  : (typeof value?.[0] === "object" ? JSON.stringify(value) : `${value ?? ""}`).slice(0, 400) || "–");

// What the second of two revisions says otherwise.
export async function differences(slug, first, second) {
  const { to, differences: rows } = await get(path(slug, "/diff"), { from: first, to: second });
  return [h("p", null, `Revision ${second}, ${to.status}: ${to.comment}`), table(`From revision ${first} to revision ${second}`, [
    { label: "What", value: (row) => title(row.pointer.slice(1)) },
    { label: `Revision ${first}`, value: (row) => shown(row.from, row.unit) },
    { label: `Revision ${second}`, value: (row) => shown(row.to, row.unit) },
  ], rows)];
}
