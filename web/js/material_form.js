// Forms that write what is said of materials, by the service's schemas.
import { swap } from "./address.js";
import { post, schema } from "./api.js";
import { makeDraft } from "./draft.js";
import { failure, fill, h, notice, once } from "./dom.js";
import { form } from "./form.js";
import { differences, path, readMaterial } from "./material_parts.js";

// A form by a schema's name: send(value, outcome) when it is submitted.
export async function schemaForm(name, value, label, send) {
  const draft = makeDraft(value), fields = h("div"), outcome = h("div", { role: "status" });
  form(fields, { schema: await schema(name), draft, shows: (pointer) => /^.(restitution|contact_time|comment)$/.test(pointer) });
  const submit = once(() => send(draft.scene, outcome).catch((error) => {
    draft.say(null, error.errors ?? []);
    fill(outcome, failure(error));
  }));
  return h("form", { novalidate: true, onsubmit(event) {
    event.preventDefault();
    submit();
  } }, fields, h("button", null, label), outcome);
}

// One that posts to a part of a material, under the ETag that it was `seen` with; then the revision of the answer is shown. Who
// comes second is told what was said meanwhile, and can do it again.
export const writeForm = (name, value, label, seen, part) => schemaForm(name, value, label, async (json, outcome) => {
  try {
    const { revision } = await post(path(seen.slug, part), json, { headers: { "If-Match": seen.etag } });
    swap(`materials/${seen.slug}`, { revision });
  } catch (error) {
    if (error.status !== 412) throw error;
    const now = await readMaterial(seen.slug);
    fill(outcome, notice("warn", "Somebody wrote meanwhile", h("p", null, "Yours is not lost. Since you read it:"),
      await differences(seen.slug, seen.latest, now.latest), h("button", null, "Do mine all the same")));
    outcome.querySelector("button").focus();
    seen = now;
  }
});
