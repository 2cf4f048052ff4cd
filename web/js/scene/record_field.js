// A scene's ground motion by name: one of the service's records.
import { link } from "../address.js";
import { get } from "../api.js";
import { ChoiceField } from "../form/fields.js";
import { Failure } from "../ui/controls.js";
import { html } from "../ui/preact.js";
import { useLoaded } from "../ui/hooks.js";
import { quantity } from "../units.js";

export function RecordField(context) {
  const { pointer, draft } = context;
  const records = useLoaded(async () => (await get("v1/records", { limit: 500 })).records, []);
  const choose = (name) => {
    draft.set(pointer, name);
    // Samples of the scene's own, and another record's digest, would contradict it.
    for (const member of ["samples", "interval", "digest"])
      draft.set(pointer.replace(/[^/]*$/, member), undefined);
  };
  const choices = (records.data ?? []).map(({ name, duration, peak }) => [
    name,
    `${name}: ${quantity(duration, "s")}, peak ${quantity(peak, "m/s^2")}`,
  ]);
  return html`<${ChoiceField}
      ...${context}
      isWide
      value=${draft.get(pointer)}
      onChoose=${choose}
      choices=${choices}
    />
    <a href=${link("records")}>All records, and new ones</a>
    ${records.error && html`<${Failure} error=${records.error} />`}`;
}
