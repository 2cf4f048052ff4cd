// One material: what is known of it and how surely, its drop tests, and how it came to be said.
import { link } from "./address.js";
import { get, schema } from "./api.js";
import { figures, fill, folded, h, hint, panel, table } from "./dom.js";
import { writeForm } from "./material_form.js";
import { badge, differences, FIGURES, path, readMaterial, shown, STATUS } from "./material_parts.js";
import { moment, title } from "./units.js";

const to = (text, page, query) => h("a", { href: link(`materials/${page}`, query) }, text);

function facts(material, properties) {
  const others = Object.keys(properties).filter((name) => !/^(name|comment|measurem|table|restitution|contact_time)/.test(name));
  const pairs = [...FIGURES.map(({ label, cell }) => [label, cell(material)]),
    ...others.map((name) => [title(name), shown(material[name], properties[name]["x-unit"])])];
  return panel("What is known", figures(pairs.filter(([, value]) => value !== "–")),
    hint("± is one standard deviation; a drop test gives it."),
    material.table?.length > 0 && table("Over approach speed",
      [{ label: "Speed", value: (row) => shown(row.approach_speed, "m/s") }, ...FIGURES], material.table));
}

// What can be written of it: a review; a revision, from what it says without what it does not.
function changes(material, properties) {
  const known = JSON.parse(JSON.stringify(material, (_, value) => (value === null || value.length === 0 ? undefined : value)));
  const { comment, ...said } = Object.fromEntries(Object.keys(properties).map((name) => [name, known[name]]));
  return panel("Review and change",
    folded("Approve or deprecate it", () => writeForm("material_review", { status: "approved" }, "Review it", material,
      `@${material.revision}/review`), material.status === "draft"),
    folded("Edit it", () => writeForm("material_revision", said, "Make it a revision", material, "/revisions")));
}

const DONE = { measure: "Kept", approve: "Approved", deprecate: "Deprecated", revert: "Reverted by", import: "Took in" };
const trail = (slug, steps) => panel("Trail", h("ul", null, steps.map(({ action, revision, measurement, who, why, when }) =>
  h("li", null, DONE[action] ?? "Wrote", " ", measurement ? to(`test ${measurement}`, `${slug}/measure`, { measurement })
    : revision ? to(`revision ${revision}`, slug, { revision }) : "a file", `: ${why} (${who ?? "the local user"}, ${moment(when)})`))));

// What changed since the revision that is shown, or since the one before the newest, and the way back to it.
async function history(material, revisions) {
  const { slug, revision, latest } = material;
  return panel("Revisions", table("The newest first",
    [{ label: "Revision", cell: ({ revision }) => to(`Revision ${revision}`, slug, { revision }) }, ...FIGURES, STATUS], revisions),
  latest > 1 && await differences(slug, Math.min(revision, latest - 1), latest),
  revision < latest && await writeForm("material_revert", { to: revision, comment: `as revision ${revision}` },
    `Revert to revision ${revision}`, material, "/revert", { only: ["comment"] }));
}

export const page = {
  title: ({ path: [, slug] }) => slug,
  async show(host, { path: [, slug], query }) {
    const list = (part) => get(path(slug, part), { limit: 100 }), material = await readMaterial(slug, query.revision);
    const { revision, latest, status, name } = material, buffer = `${slug}@${revision}`;
    const [{ revisions }, { history: steps }, { total, results }, { properties }] = await Promise.all([list("/revisions"),
      list("/history"), list(`@${revision}/used-by`), schema("material_revision")]);
    fill(host, h("h1", null, name, " ", badge(status)),
      h("p.quiet", null, h("code", null, buffer), ` of ${latest}. Scenes without a revision take the newest approved.`),
      h("div.row", null, h("a.button", { href: link("scene", { buffer }) }, "Simulate with it"),
        h("a.button", { href: link(`materials/${slug}/measure`) }, "Enter a drop test")),
      folded(`Results made with it: ${total}`, () => h("ul", null, results.map(({ id, created }) =>
        h("li", null, h("a", { href: link(`results/${id}`) }, moment(created)))))),
      h("div.columns", null, facts(material, properties), changes(material, properties), trail(slug, steps)),
      await history(material, revisions));
  },
};
