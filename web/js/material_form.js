// Forms by a schema that are sent as a whole: what is said of materials, and others.
import { swap } from "./address.js";
import { post, schema } from "./api.js";
import { makeDraft } from "./draft.js";
import { failure, fill, h, notice, once } from "./dom.js";
import { focusField, form } from "./form.js";
import { differences, path, readMaterial } from "./material_parts.js";
import { places } from "./outcome.js";

// Says a refusal's faults at their fields, and in `outcome` with the way there; with `moves` the focus goes to the first.
export const refusal = (draft, fields, outcome) => (error, moves) => {
  const { title, errors = [] } = error;
  draft.say(null, errors);
  fill(outcome, errors.some(({ pointer }) => pointer)
    ? places("bad", title, errors, (pointer) => focusField(fields, pointer)) : failure(error));
  if (moves) fields.querySelector("[aria-invalid=true]")?.focus();
};

// A form by a schema or a promise of it: send(value, outcome) when it is submitted. Options are form()'s.
export async function schemaForm(of, value, label, send, options) {
  const draft = makeDraft(value), fields = h("div"), outcome = h("div", { role: "status" });
  form(fields, { schema: await of, draft,
    shows: (pointer) => /^.(restitution|contact_time|comment)$/.test(pointer), ...options });
  const refused = refusal(draft, fields, outcome), submit = once(() => {
    fill(outcome, "Wait …");
    return send(draft.scene, outcome).catch((error) => refused(error, true));
  });
  return h("form", { novalidate: true, onsubmit(event) {
    event.preventDefault();
    submit();
  } }, fields, h("button", null, label), outcome);
}

// One that posts to a part of a material, under the ETag that it was `seen` with; then the revision of the answer is shown. Who
// comes second is told what was said meanwhile, and can do it again.
export const writeForm = (name, value, label, seen, part, options) => schemaForm(schema(name), value, label, async (json, outcome) => {
  try {
    const { revision } = await post(path(seen.slug, part), json, { headers: { "If-Match": seen.etag } });
    swap(`materials/${seen.slug}`, { revision });
  } catch (error) {
    if (error.status !== 412) throw error;
    const now = await readMaterial(seen.slug);
    fill(outcome, notice("warn", "Another client changed it meanwhile", h("p", null, "Yours is not lost. Since you read it:"),
      await differences(seen.slug, seen.latest, now.latest), h("button", null, "Do mine all the same")));
    outcome.querySelector("button").focus();
    seen = now;
  }
}, options);
