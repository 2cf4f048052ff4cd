// The ground motions that the daemon keeps: listed, and new ones uploaded.
import { go, link } from "./address.js";
import { get, post } from "./api.js";
import { faults, fill, h, help, hint, panel, table } from "./dom.js";
import { frame } from "./fields.js";
import { schemaForm } from "./material_form.js";
import { told } from "./record_page.js";
import { title } from "./units.js";

const MOST = 500; // listed
const COLUMNS = ["name", "earthquake", "station", "duration", "peak", "interval"].map((name, at) => ({ label: title(name),
  numeric: at > 2, value: (row) => row[name],
  cell: (row) => (at === 0 ? h("a", { href: link(`records/${row.name}`) }, row.name) : told(name, row[name])) }));

const text = { type: "string" }, untold = "if the file does not state it";
const UPLOAD = { required: ["file", "name"], properties: {
  file: {},
  name: { ...text, description: "letters, digits, . _ -" }, unit: { enum: ["m/s^2", "g", "cm/s^2"], description: untold },
  interval: { type: "number", exclusiveMinimum: 0, "x-unit": "s", description: `between samples, ${untold}` },
  source: text, processing: text, earthquake: text, station: text, notes: text,
} };

function chooser(context) {
  const { pointer, draft } = context, input = h("input", { type: "file", onchange() {
    const [file] = input.files;
    draft.set(pointer, file);
    draft.set("/name", file?.name.replace(/\.\w*$/, "").replace(/\W+/g, "_"));
  } });
  const { element } = frame(context, input, "PEER's AT2, times with accelerations, or one column");
  return { element: h("div", null, element), refresh() {} };
}

async function upload({ file, ...query }) {
  if (!file) throw new Error("Choose a file.");
  go(`records/${(await post("v1/records", undefined, { query, body: file, type: "text/plain" })).name}`);
}

export const page = {
  title: () => "Ground motions",
  async show(host) {
    const list = h("div", null, "Loading …");
    fill(host, help("Ground motions"), h("h1", null, "Ground motions"), h("p", null, "Records that shake the base of a scene; one never changes."), list,
      panel("Upload one", await schemaForm(UPLOAD, {}, "Upload", upload,
        { widgets: [[/^.file$/, chooser]], shows: (pointer) => /unit|interval/.test(pointer) })));
    get("v1/records", { limit: MOST }).then(({ records }) => fill(list,
      records.length > 0 ? table("Records", COLUMNS, records, { sort: true }) : h("p", null, "There are none yet."),
      records.length === MOST && hint(`The first ${MOST} by name.`)))
      .catch(faults(list));
  },
};
