// The ground motions that the daemon keeps: listed, searched, and new ones uploaded.
import { go, link } from "./address.js";
import { ask, get } from "./api.js";
import { faults, fill, h, hint, once, panel, table } from "./dom.js";
import { makeDraft } from "./draft.js";
import { form } from "./form.js";
import { told } from "./record_page.js";

const MOST = 500; // listed
const COLUMNS = ["name", "earthquake", "station", "duration", "peak", "interval"].map((label) => ({ label,
  value: (row) => row[label], cell: ({ name, [label]: value }) =>
    (label === "name" ? h("a", { href: link(`records/${name}`) }, name) : told(label, value)) }));

const text = { type: "string" }, untold = "where the file does not tell it";
const QUERY = {
  name: { ...text, description: "letters, digits, . _ -" }, unit: { enum: ["m/s^2", "g", "cm/s^2"], description: untold },
  interval: { type: "number", exclusiveMinimum: 0, "x-unit": "s", description: `between samples, ${untold}` },
  source: text, processing: text, earthquake: text, station: text, notes: text,
};

function uploadForm() {
  const draft = makeDraft({}), fields = h("div"), news = h("div");
  const chooser = h("input", { type: "file", required: true, onchange() {
    draft.set("/name", chooser.files[0]?.name.replace(/\.\w*$/, "").replace(/\W+/g, "_"));
  } });
  form(fields, { schema: { properties: QUERY, required: ["name"] }, draft, shows: () => true });

  const upload = once(() => {
    fill(news, h("label", null, "Sending … ", h("progress")));
    return ask("POST", "v1/records", { query: draft.scene, body: chooser.files[0], type: "text/plain" })
      .then((answer) => answer.json()).then(({ name }) => go(`records/${name}`)).catch(faults(news));
  });
  return h("form", { onsubmit: (event) => (event.preventDefault(), upload()) }, h("label", null, "File ", chooser),
    hint("PEER's AT2, times beside accelerations, or one column"), fields, news,
    h("button", { class: "primary" }, "Upload"));
}

export const page = {
  title: () => "Ground motions",
  show(host) {
    const list = h("div");
    fill(host, h("h1", null, "Ground motions"), h("p", null, "Records that shake the base of a scene; one never changes."),
      list, panel("Upload one", uploadForm()));
    get("v1/records", { limit: MOST }).then(({ records }) => fill(list,
      records.length > 0 ? table("Records", COLUMNS, records, { sort: true }) : h("p", null, "There are none yet."),
      records.length === MOST && hint(`The first ${MOST} by name.`)))
      .catch(faults(list));
  },
};
