// What stands at a damper's stops: a material, or numbers of one's own, and the stiffness and damping that follow here.
import { get } from "../api.js";
import { useDraft, useNews } from "../form/draft.js";
import { ChoiceField } from "../form/fields.js";
import { Form } from "../form/form.js";
import { figure, materialPath, range } from "../library/format.js";
import { Failure, withSubscripts } from "../ui/controls.js";
import { html, useMemo, useRef } from "../ui/preact.js";
import { useLoaded } from "../ui/hooks.js";
import { quantity } from "../units.js";

// Numbers of one's own, and what they begin with: the stop as it is now.
const WAYS = {
  "own stiffness": ({ stiffness, damping, exponent, restitution }) => ({
    stiffness: stiffness ?? 1e4,
    ...(exponent ? { restitution } : { damping: damping ?? 1 }),
  }),
  "own e and contact time": ({ restitution, contact_time: time }) => ({
    restitution: restitution ?? 0.6,
    contact_time: time ?? 0.02,
  }),
};

function wayOf(buffer) {
  if (buffer?.constructor !== Object || buffer.material) return undefined;
  return "stiffness" in buffer ? "own stiffness" : "own e and contact time";
}

function materialText({ name, table, restitution, contact_time: time, status }) {
  const numbers =
    table.length > 0
      ? `e and contact time at ${table.length} speeds`
      : `e ${restitution ?? "–"}, contact time ${quantity(time, "s")}`;
  return `${name}: ${numbers}, ${status}`;
}

// The choice of a material, of its revision, or of numbers.
function BufferFields({ pointer, label, schema, draft, stop }) {
  const value = useDraft(draft, pointer);
  const materials = useLoaded(
    async () => (await get("v1/materials", { limit: 200 })).materials,
    [],
  );
  const way = wayOf(value);
  const given = way ?? String(value?.material ?? value ?? "");
  const [slug, revision] = [given.split("@")[0] || undefined, given.split(/(?=@)/)[1]];
  const hasRevisions = !way && given !== "";
  const revisions = useLoaded(
    async (signal) =>
      hasRevisions
        ? {
            slug,
            list: (await get(materialPath(slug, "/revisions"), { limit: 100 }, signal)).revisions,
          }
        : null,
    [slug, hasRevisions],
  );
  const known = revisions.data && revisions.data.slug === slug ? revisions.data.list : [];
  const { material: _, ...properties } = schema.anyOf.find((each) => each.properties).properties;
  const own = useMemo(() => ({ properties }), [schema]);
  const error = materials.error ?? (hasRevisions ? revisions.error : null);
  return html`<div class="fields">
      <${ChoiceField}
        pointer=${pointer}
        schema=${{}}
        label="Material"
        required
        draft=${draft}
        isWide
        value=${slug}
        onChoose=${(chosen) => draft.set(pointer, WAYS[chosen]?.(stop() ?? {}) ?? chosen)}
        choices=${[
          ...(materials.data ?? []).map((one) => [one.slug, materialText(one)]),
          ...Object.keys(WAYS).map((one) => [one, one]),
        ]}
      />
      ${
        hasRevisions &&
        html`<${ChoiceField}
          pointer=${pointer}
          schema=${{ default: "newest" }}
          label="Revision"
          draft=${draft}
          isWide
          faults=${[]}
          value=${revision}
          onChoose=${(chosen = "") => draft.set(pointer, slug + chosen)}
          choices=${known.map((one) => [`@${one.revision}`, `@${one.revision}, ${one.status}`])}
        />`
      }
    </div>
    ${way && html`<${Form} key=${way} schema=${own} draft=${draft} pointer=${pointer} label=${label} />`}
    ${error && html`<${Failure} error=${error} />`}`;
}

// As the dry run derived it, with the ± that the material's deviations leave of it.
function Derived({ draft, damper, stop }) {
  useNews(draft, ({ check }) => check !== undefined);
  const now = stop();
  const last = useRef(null); // of the last scene without faults
  if (now) last.current = { stop: now, check: draft.check };
  const held = last.current;
  const query = held && queryOf(held, damper);
  const key = held && JSON.stringify([held.stop, query]);
  const model = held?.check.plan.contact_model;
  const loaded = useLoaded(
    async (signal) => {
      if (!held?.stop.material || model !== "spring_damper") return { key };
      const material = `v1/materials/${held.stop.material}/derived`;
      const found = await get(material, query, signal).catch(() => ({})); // the values stand without ±
      return { key, ...found };
    },
    [key],
  );
  if (!held || model !== "spring_damper") return null;
  const found = loaded.data?.key === key ? loaded.data : {};
  return html`<div class=${now ? "derived" : "derived stale"}>
    <${DerivedValues} stop=${held.stop} found=${found} />
  </div>`;
}

function queryOf({ stop, check }, damper) {
  const { dampers, contact } = check.scene;
  return {
    damper_mass: stop.effective_mass,
    identified_for: dampers[damper].identified_for,
    separation: contact.separation,
  };
}

function DerivedValues({ stop, found }) {
  const { contacts = [], warnings, least_speed: least, most_speed: most } = found;
  const first = contacts[0];
  const last = contacts.at(-1); // several where they depend on the speed
  const isSame = Math.abs(first?.stiffness.value / stop.stiffness - 1) < 1e-6;
  const value = (name, unit) =>
    stop[name] === null
      ? range(first?.[name].value, last?.[name].value, unit)
      : figure(stop[name], (isSame && first[name].uncertainty) || null, unit);
  const text = `k_b ${value("stiffness", "N/m")}, c_b ${value("damping", "N s/m")}, ζ ${value("damping_ratio")} for an effective mass of ${quantity(stop.effective_mass, "kg")}`;
  return html`<p>
      ${withSubscripts(text)}${isSame && first.stiffness.uncertainty ? " (± one deviation)" : ""}
    </p>
    ${
      first &&
      html`<details>
        <summary>
          ${`Measured from ${range(least, most, "m/s")}, ${warnings.length} warnings`}
        </summary>
        <ul class="hint">
          ${warnings.map(({ detail }) => html`<li>${detail}</li>`)}
        </ul>
      </details>`
    }`;
}

// At /dampers/N/buffer (with the box that parts the sides), left_buffer and right_buffer.
export function Buffer({ pointer, label, schema, draft }) {
  const [, around, damper, name] = /^(.*\/(\d+)\/)(.*)$/.exec(pointer);
  const isBoth = name === "buffer";
  const sides = ["left", "right"].map((side) => `${around}${side}_buffer`);
  const value = useDraft(draft, pointer, false);
  const own = sides.map((side) => useDraft(draft, side, false));
  const isOne = own.every((one) => one === undefined);
  const side = name === "right_buffer" ? "right" : "left";
  const stop = () =>
    draft.check?.plan?.derived?.find(
      (one) => one.damper === Number(damper) + 1 && one.side === side,
    );
  const part = (event) => {
    const joins = event.currentTarget.checked;
    const now = [pointer, ...sides].map(draft.get).find(Boolean);
    for (const each of sides) draft.set(each, joins ? undefined : structuredClone(now));
    draft.set(pointer, joins ? now : undefined);
  };
  const hasFields = value !== undefined || (isBoth && isOne);
  return html`${
    hasFields &&
    html`<fieldset>
      <legend>${isBoth ? "Buffers" : label}</legend>
      <${BufferFields}
        pointer=${pointer}
        label=${label}
        schema=${schema}
        draft=${draft}
        stop=${stop}
      />
      <${Derived} draft=${draft} damper=${damper} stop=${stop} />
    </fieldset>`
  }
  ${
    isBoth &&
    html`<label class="same"
      ><input type="checkbox" checked=${isOne} onChange=${part} /> The same on both sides</label
    >`
  }`;
}
