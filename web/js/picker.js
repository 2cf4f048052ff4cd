// What stands at a damper's stops: a material, or numbers of one's own, and what that comes to here.
import { get } from "./api.js";
import { faults, fill, folded, h } from "./dom.js";
import { choice } from "./fields.js";
import { form } from "./form.js";
import { figure, path, range } from "./library/format.js";
import { quantity } from "./units.js";

// Numbers of one's own, and what they begin with: the stop as it is now.
const WAYS = {
  "own stiffness": ({ stiffness, damping, exponent, restitution }) =>
    ({ stiffness: stiffness ?? 1e4, ...(exponent ? { restitution } : { damping: damping ?? 1 }) }),
  "own e and T_c": ({ restitution, contact_time }) => ({ restitution: restitution ?? 0.6, contact_time: contact_time ?? 0.02 }),
};
const wayOf = (buffer) => (buffer?.constructor !== Object || buffer.material ? undefined
  : "stiffness" in buffer ? "own stiffness" : "own e and T_c");

const tell = ({ name, table, restitution, contact_time, status }) => `${name}: ${table.length > 0
  ? `e and T_c at ${table.length} speeds` : `e ${restitution ?? "–"}, T_c ${quantity(contact_time, "s")}`}, ${status}`;

// At /dampers/N/buffer (with the box that parts the sides), left_buffer and right_buffer.
export function bufferWidget({ pointer, label, schema, draft }) {
  const [, around, damper, name] = /^(.*\/(\d+)\/)(.*)$/.exec(pointer), isBoth = name === "buffer";
  const sides = ["left", "right"].map((side) => `${around}${side}_buffer`), side = name === "right_buffer" ? "right" : "left";
  const stop = () => draft.check?.plan?.derived?.find((one) => one.damper === Number(damper) + 1 && one.side === side);
  const { material: _, ...properties } = schema.anyOf.find((each) => each.properties).properties;
  const given = () => wayOf(draft.get(pointer)) ?? String(draft.get(pointer)?.material ?? draft.get(pointer) ?? "");
  const slug = () => given().split("@")[0] || undefined;
  let materials = null, revisions = [], shown, fields, known;

  const set = (_, chosen) => draft.set(pointer, WAYS[chosen]?.(stop() ?? {}) ?? chosen);
  const material = choice({ pointer, schema: {}, label: "Material", required: true, draft: { ...draft, get: slug, set } },
    () => [...(materials ?? []).map((one) => [one.slug, tell(one)]), ...Object.keys(WAYS).map((way) => [way, way])]);
  const ofSlug = { get: () => given().split(/(?=@)/)[1], set: (_, chosen = "") => draft.set(pointer, slug() + chosen) };
  const revision = choice({ pointer, schema: { default: "newest" }, label: "Revision",
    draft: { ...draft, ...ofSlug, faultsAt: () => [] } },
    () => revisions.map((one) => [`@${one.revision}`, `@${one.revision}, ${one.status}`]));
  const inner = h("div"), derived = h("div.derived");
  const box = h("fieldset", null, h("legend", null, isBoth ? "Buffers" : label),
    material.element, revision.element, inner, derived);
  const same = h("input", { type: "checkbox", onchange() {
    const now = [pointer, ...sides].map(draft.get).find(Boolean), isOne = same.checked;
    for (const side of sides) draft.set(side, isOne ? undefined : structuredClone(now));
    draft.set(pointer, isOne ? now : undefined);
  } });

  function refresh() {
    const way = wayOf(draft.get(pointer)), text = given();
    same.checked = sides.every((place) => draft.get(place) === undefined);
    box.hidden = draft.get(pointer) === undefined && !(isBoth && same.checked);
    if (box.hidden) return;
    if (text !== shown) {
      if (shown?.split("@")[0] !== slug()) revisions = [];
      shown = text;
      revision.element.hidden = way || !text;
      fill(inner);
      fields = way && form(inner, { schema: { properties }, draft, pointer });
      fields?.leave(); // refreshed with this widget
      list(text).catch(faults(derived));
    }
    for (const part of [material, revision, fields]) part?.refresh();
    derive();
  }

  async function list(text) {
    materials ??= (await get("v1/materials", { limit: 200 })).materials;
    const answer = revision.element.hidden ? {} : await get(path(slug(), "/revisions"), { limit: 100 });
    if (shown !== text) return;
    revisions = answer.revisions ?? [];
    material.refresh();
    revision.refresh();
  }

  // As the dry run derived it, with the ± that the material's deviations leave of it.
  async function derive() {
    const one = stop();
    derived.classList.toggle("stale", !one); // of the last scene without faults
    if (!one) return;
    const { scene: { dampers, contact }, plan } = draft.check, { identified_for } = dampers[damper];
    const query = { damper_mass: one.effective_mass, identified_for, separation: contact.separation };
    const key = JSON.stringify([one, query, plan.contact_model]);
    if (key === known) return;
    known = key;
    if (plan.contact_model !== "spring_damper") return void fill(derived);
    const { contacts = [], warnings, least_speed, most_speed } = one.material === null ? {}
      : await get(`v1/materials/${one.material}/derived`, query).catch(() => ({})); // the values stand without ±
    if (key !== known) return;
    const [first] = contacts, last = contacts.at(-1); // several where they depend on the speed
    const same = Math.abs(first?.stiffness.value / one.stiffness - 1) < 1e-6 ? first : null;
    const value = (name, unit) => (one[name] === null ? range(first?.[name].value, last?.[name].value, unit)
      : figure(one[name], same?.[name].uncertainty ?? null, unit));
    fill(derived, h("p", null, `k_b ${value("stiffness", "N/m")}, c_b ${value("damping", "N s/m")}, ζ ${value("damping_ratio")}`,
      ` for an effective mass of ${quantity(one.effective_mass, "kg")}`, same?.stiffness.uncertainty && " (± one deviation)"),
    first && folded(`Measured from ${range(least_speed, most_speed, "m/s")}, ${warnings.length} warnings`,
      () => h("ul.hint", null, warnings.map(({ detail }) => h("li", null, detail)))));
  }
  return { refresh, element: h("div", null, box, isBoth && h("label", null, same, " The same on both sides")) };
}
