// How a result was computed: how exact it is, what was decided and why, what the buffers came to, the structure's modes.
import { html } from "../ui/preact.js";
import { link } from "../address.js";
import { Figures, Help } from "../ui/controls.js";
import { useLoaded } from "../ui/hooks.js";
import { Table } from "../ui/table.js";
import { number, quantity, share, title, words } from "../units.js";
import { useResult } from "./context.js";

const DERIVED = [
  ["e", "restitution", "1"],
  ["T_c", "contact_time", "s"],
  ["k_b", "stiffness", "N/m"],
  ["c_b", "damping", "N s/m"],
  ["ζ", "damping_ratio", "1"],
  ["n (k_b in N/mⁿ)", "exponent", "1"],
  ["e reached", "reached_restitution", "1"],
  ["T_c reached", "reached_contact_time", "s"],
];

function accuracyText({
  error_estimate: error,
  trust_horizon: horizon,
  energy_residual: residual,
}) {
  const size = error === 0 ? "the last digit" : `about ${share(error, 2)} of its largest value`;
  let text = "How exact it is, is not known.";
  if (error !== null && horizon === null)
    text = `The displacement is right to ${size}, from beginning to end.`;
  else if (error !== null)
    text =
      `To ${quantity(horizon, "s")}, the trust horizon, the displacement is right to a millionth of its largest value. ` +
      `At the end its error is ${size}: there spectra, statistics and energies count, no single peak or instant.`;
  const balance =
    residual === null
      ? ""
      : ` The energy balance closes to ${number(residual, 2)} of the largest energy.`;
  return text + balance;
}

// The job that computed it tells the time; others found it ready, and a study's made more.
function useCost({ result, jobs }) {
  const { count, sample_rate: rate, work, study } = result;
  const all = useLoaded(() => jobs, [result.id]);
  const run = !study && all.data?.find((job) => !job.cached)?.timing.run;
  const made = run ? `, computed in ${quantity(run, "s", 3)}` : "";
  return `${quantity((count - 1) / rate, "s")} of motion, ${number(work.contacts + work.bounces)} contacts and ${number(count)} samples${made}.`;
}

export function Method() {
  const context = useResult();
  const { result } = context;
  const { plan, summary, engine } = result;
  const cost = useCost(context);
  const shown = DERIVED.filter(([, key]) =>
    plan.derived.some((row) => row[key] !== null && row[key] !== undefined),
  );
  const material = (row) =>
    row.material
      ? html`<a href=${link(`materials/${row.material.split("@")[0]}`)}>${row.material}</a>`
      : "its own numbers";
  const stops = [
    { label: "Damper, stop", value: ({ damper, side }) => `${damper}, ${side}` },
    { label: "Material", value: (row) => row.material, cell: material },
    ...shown.map(([label, key, unit]) => ({ label, unit, value: (row) => row[key] })),
  ];
  const modes = [
    { label: "Mode", isNumeric: true, value: (row) => plan.modes.indexOf(row) + 1 },
    { label: "Frequency", unit: "Hz", value: (row) => row.frequency },
    { label: "Damping ratio", unit: "1", value: (row) => row.damping_ratio },
  ];
  const { error_estimate: error, trust_horizon: horizon } = summary;
  const named = (name) => html`${name} <${Help} name=${name} />`;
  const accuracy = [
    [named("Error estimate"), error === null ? "–" : share(error, 2)],
    [named("Trust horizon"), horizon === null ? "the whole run" : quantity(horizon, "s")],
  ];
  return html`<${Figures} pairs=${accuracy} />
    <p>${accuracyText(summary)}</p>
    <p>${cost}</p>
    <dl class="decisions">
      ${plan.decisions.map(
        ({ about, chose, why, value, unit }) =>
          html`<dt>${title(about)}</dt>
            <dd>
              <b>${words(chose)}</b>: ${why}${value === null ? "" : ` (${quantity(value, unit)})`}
            </dd>`,
      )}
    </dl>
    ${
      plan.derived.length > 0
        ? html`<${Table}
            caption="Each stop, for its pair of masses"
            isHeaded
            columns=${stops}
            rows=${plan.derived}
          />`
        : html`<p>No damper.</p>`
    }
    <${Table} caption="Modes of the structure" isHeaded columns=${modes} rows=${plan.modes} />
    <p class="quiet">Engine ${engine}</p>`;
}
