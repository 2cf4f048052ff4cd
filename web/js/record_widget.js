// A scene's ground motion by name: one of the daemon's records.
import { link } from "./address.js";
import { get } from "./api.js";
import { failure, h } from "./dom.js";
import { choice } from "./fields.js";
import { quantity } from "./units.js";

export function recordWidget(context) {
  const { pointer, draft } = context, more = h("a", { href: link("records") }, "All records, and new ones");
  let listed = [];
  const { element, refresh } = choice(context, () => listed.map(({ name, duration, peak }) =>
    [name, `${name}: ${quantity(duration, "s")}, peak ${quantity(peak, "m/s^2")}`]));
  // Samples of the scene's own, and another record's digest, would contradict it.
  element.addEventListener("change", () => ["samples", "interval", "digest"]
    .forEach((member) => draft.set(pointer.replace(/[^/]*$/, member), undefined)));
  element.append(more);
  get("v1/records", { limit: 500 }).then(({ records }) => {
    listed = records;
    refresh();
  }).catch((error) => more.append(failure(error)));
  return { element, refresh };
}
