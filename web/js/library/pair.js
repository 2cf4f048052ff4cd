// The contact of a material between two masses: k_b and c_b with their uncertainty, where they hold, and the force of an impact.
import { setQuery, read } from "../address.js";
import { get, wait } from "../api.js";
import { Chart } from "../chart/chart.js";
import { Choice, Loaded, Panel } from "../ui/controls.js";
import { useId, useLoaded } from "../ui/hooks.js";
import { html, useLayoutEffect, useMemo, useState } from "../ui/preact.js";
import { Table } from "../ui/table.js";
import { pretty, quantity, words } from "../units.js";
import { materialPath, range, Remarks } from "./format.js";

const POINTS = 120;
const WAIT_MS = 250; // without a change, before the service is asked
const DEFAULT_MASS = 0.1; // [kg]

// "0,11" as 0.11; null for what is no mass.
function toMass(text) {
  const value = Number(String(text).trim().replace(",", "."));
  return value > 0 && Number.isFinite(value) ? value : null;
}

// The force of one contact of m x" + c x' + k x = 0 that begins with this speed, until its rule of separation ends it.
function pulse({ stiffness, damping, separation }, mass, speed) {
  const [k, c] = [stiffness.value, damping.value];
  const decay = c / (2 * mass);
  const omega = Math.sqrt(k / mass - decay ** 2);
  if (!(omega > 0)) return null;
  const isForce = separation === "zero_force";
  const end = isForce
    ? Math.atan2(2 * decay * omega, decay ** 2 - omega ** 2) / omega
    : Math.PI / omega;
  const x = Array.from({ length: POINTS + 1 }, (_, at) => (at * end) / POINTS);
  const y = x.map((time) => {
    const factor = speed * Math.exp(-decay * time);
    const depth = (factor * Math.sin(omega * time)) / omega;
    const rate = factor * (Math.cos(omega * time) - (decay / omega) * Math.sin(omega * time));
    return k * depth + c * rate;
  });
  return { x, y };
}

function PulseChart({ pair }) {
  const { contacts, effective_mass: mass, least_speed: least, most_speed: most } = pair;
  const speed = Number(Math.sqrt((least ?? 0.5) * (most ?? 0.5)).toPrecision(2));
  // Of a table over approach speed the row nearest to that speed.
  const nearest = (separation) =>
    contacts
      .filter((contact) => contact.separation === separation)
      .sort((a, b) => Math.abs(a.approach_speed - speed) - Math.abs(b.approach_speed - speed))[0];
  const rules = [...new Set(contacts.map((contact) => contact.separation))];
  const series = rules.flatMap((separation, at) => {
    const curve = pulse(nearest(separation), mass, speed);
    return curve ? [{ label: words(separation), color: at === 0 ? "force" : "c1", ...curve }] : [];
  });
  if (series.length === 0) return null;
  const title = `Force of an impact at ${quantity(speed, "m/s")}`;
  return html`<${Chart}
    title=${title}
    height=${150}
    isShort
    x=${{ label: "Time", unit: "s" }}
    y=${{ label: title, unit: "N" }}
    series=${series}
  />`;
}

function columnsOf(contacts) {
  const some = (test) => contacts.some(test);
  const columns = [{ label: "Separation", value: ({ separation }) => words(separation) }];
  if (some(({ approach_speed: speed }) => speed !== null))
    columns.push({ label: "Speed", unit: "m/s", value: (row) => row.approach_speed });
  const add = (label, name, unit) => {
    columns.push({ label, unit, value: (row) => row[name].value });
    if (!some((row) => row[name].uncertainty !== null)) return;
    columns.push({ label: `± ${label}`, unit, digits: 2, value: (row) => row[name].uncertainty });
    const interval = ({ [name]: { low, high } }) => (low === null ? null : range(low, high, unit));
    if (name !== "damping_ratio")
      columns.push({ label: `${label}, 95 %`, value: interval, cell: interval });
  };
  add("k_b", "stiffness", "N/m");
  add("c_b", "damping", "N s/m");
  add("ζ", "damping_ratio", "1");
  return columns;
}

function validity({
  effective_mass: mass,
  test_mass: tested,
  least_speed: least,
  most_speed: most,
}) {
  const parts = [`Effective mass ${quantity(mass, "kg")}`];
  if (tested !== null) parts.push(`that of the test ${quantity(tested, "kg")}`);
  if (least !== null && most !== null) parts.push(`measured from ${range(least, most, "m/s")}`);
  return `${parts.join("; ")}.`;
}

function Pair({ pair }) {
  const columns = useMemo(() => columnsOf(pair.contacts), [pair]);
  const isUncertain = columns.some(({ label }) => label.startsWith("±"));
  return html`<${Table}
      caption="Contact parameters of this pair"
      columns=${columns}
      rows=${pair.contacts}
    />
    <p class="hint">
      ${`${validity(pair)}${isUncertain ? " ± is one standard uncertainty." : ""}`}
    </p>
    <${PulseChart} pair=${pair} />
    <${Remarks} warnings=${pair.warnings} />`;
}

function MassField({ label, hint, value, isWrong, onInput }) {
  const id = useId("mass");
  return html`<div class="field">
    <label for=${id}>${label}<span class="unit">${` [${pretty("kg")}]`}</span></label>
    <input
      id=${id}
      value=${value}
      inputmode="decimal"
      autocomplete="off"
      placeholder=${hint}
      aria-invalid=${isWrong}
      onInput=${(event) => onInput(event.currentTarget.value)}
    />
  </div>`;
}

export function PairPanel({ material }) {
  const { slug, revision, impactor_mass: impactor } = material;
  const { query } = read();
  const initial = String(impactor ?? DEFAULT_MASS);
  const [own, setOwn] = useState(query.m ?? initial);
  const [other, setOther] = useState(query.M ?? "");
  const [carried, setCarried] = useState(query.for ?? "scene");
  const masses = { damper_mass: toMass(own), structure_mass: toMass(other) };
  const isValid = masses.damper_mass !== null && (other.trim() === "" || masses.structure_mass);
  const loaded = useLoaded(
    async (signal) => {
      if (!isValid) return null;
      await wait(WAIT_MS, signal);
      const asked = { ...masses, identified_for: carried };
      return get(materialPath(slug, `@${revision}/derived`), asked, signal);
    },
    [slug, revision, own, other, carried],
  );
  useLayoutEffect(() => {
    const isInitial = own === initial && !query.m;
    setQuery({ m: isInitial ? null : own, M: other, for: carried === "scene" ? null : carried });
  }, [own, other, carried]);
  return html`<${Panel} title="For a pair of masses" help="Derived">
    <div class="fields">
      <${MassField}
        label="Free mass"
        value=${own}
        isWrong=${masses.damper_mass === null}
        onInput=${setOwn}
      />
      <${MassField}
        label="Mass that it meets"
        hint="it does not move"
        value=${other}
        isWrong=${!isValid && masses.damper_mass !== null}
        onInput=${setOther}
      />
      <div class="field wide">
        <span class="label" aria-hidden="true">Carried over from the test</span>
        <${Choice}
          label="Carried over from the test"
          options=${[
            { value: "scene", label: "e and T_c" },
            { value: "rig", label: "k_b and c_b" },
          ]}
          value=${carried}
          onChange=${setCarried}
        />
      </div>
    </div>
    ${
      isValid
        ? html`<${Loaded} loaded=${loaded}>${(pair) => html`<${Pair} pair=${pair} />`}<//>`
        : html`<p class="fault">A mass is a number above 0 kg.</p>`
    }
  <//>`;
}
