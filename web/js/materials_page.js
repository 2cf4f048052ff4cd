// All materials: found by words and ranges, added, brought in and out as files.
import { go, link, swap } from "./address.js";
import { get, post, save, schema } from "./api.js";
import { button, faults, fill, folded, h, help, hint, table } from "./dom.js";
import { schemaForm } from "./material_form.js";
import { FIGURES, range, STATUS } from "./material_parts.js";

const MOST = 1000;
const FILTERS = { q: ["Words", ""], kind: ["Kind", "rubber"], e: ["Restitution e", "0.4..0.7"],
  T_c: ["Contact time [s]", "..0.02"], status: ["Status", "draft"] };
const COLUMNS = [
  { label: "Material", value: (row) => row.name, cell: (row) => h("a", { href: link(`materials/${row.slug}`) }, row.name) },
  { label: "Kind", value: (row) => row.kind }, ...FIGURES,
  { label: "Measured at", numeric: true, value: (row) => row.most_speed, cell: (row) => range(row.least_speed, row.most_speed, "m/s") }, STATUS,
];

const search = (query) => h("form.row.level", { role: "search", onsubmit(event) {
  event.preventDefault();
  go("materials", Object.fromEntries(new FormData(event.target)));
} }, Object.entries(FILTERS).map(([name, [label, placeholder]]) =>
  h("label", null, label, h("br"), h("input", { name, placeholder, size: 12, value: query[name] ?? "" }))),
h("button", null, "Search"));

const adding = async () => [
  hint("e may be a guess, if its source says so."),
  await schemaForm(schema("new_material"), {}, "Add it",
    async (value) => go(`materials/${(await post("v1/materials", value)).slug}`)),
];

// A file comes in whole or, with a fault, not at all.
function importing() {
  const outcome = h("div");
  const file = h("input", { type: "file", accept: ".csv,.json", onclick: () => (file.value = ""), onchange() {
    const [body] = file.files, type = body.name.endsWith(".json") ? "application/json" : "text/csv";
    post("v1/materials/import", undefined, { body, type }).then(() => swap("materials"), faults(outcome));
  } });
  return [h("label", null, "A table (CSV) with slug, name, restitution and source, or an export (JSON)", file), outcome];
}

export const page = {
  title: () => "Materials",
  show(host, { query }) {
    const list = h("div"), count = h("div.quiet", { role: "status" }, "Loading …");
    const exporting = ["materials.csv", "materials.json"].map((name) => button(`Export ${name}`, () => save(`v1/${name}`, name)));
    fill(host, help("Materials"), h("h1", null, "Materials"), h("p", null, "What a lab measured of its buffers."),
      h("div.panel", null, search(query), count, list), h("div.panel", null,
        folded("Add a material", adding), folded("Import", importing), h("div.row", null, exporting)));
    get("v1/materials", { ...query, limit: MOST }).then(({ materials }) => {
      fill(count, `${materials.length} found${materials.length === MOST ? ", perhaps more: narrow the search" : ""}`);
      fill(list, table("Materials", COLUMNS, materials, { sort: true }));
    }).catch(faults(count));
  },
};
