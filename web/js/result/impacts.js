// The impacts in the window of time as a table; a click shows one at full detail.
import { html } from "../ui/preact.js";
import { Loaded } from "../ui/controls.js";
import { useLoaded } from "../ui/hooks.js";
import { Table } from "../ui/table.js";
import { number } from "../units.js";
import { useResult, windowOf } from "./context.js";

const MAX_ROWS = 500; // rows: some 50 kB as transferred

const placeOf = ({ damper, side, kind }) =>
  `${damper}, ${side}${kind === "resting" ? ", resting" : ""}`;

export function ImpactTable() {
  const { result, query, ledger, change } = useResult();
  const { from, to } = windowOf(result, query);
  const loaded = useLoaded(() => ledger.window(from, to, MAX_ROWS), [result.id, from, to]);
  const open = ({ number: nth }) => change({ impact: nth }, true);
  const columns = [
    {
      label: "Impact",
      isNumeric: true,
      value: (row) => row.number,
      cell: (row) =>
        html`<button
          type="button"
          class="link"
          aria-label=${`Show impact ${row.number}`}
          onClick=${() => open(row)}
        >
          ${row.number}
        </button>`,
    },
    { label: "Start", unit: "s", digits: 6, value: (row) => row.start },
    { label: "Damper, stop", value: placeOf },
    { label: "Approach", unit: "m/s", value: (row) => row.approach_speed },
    { label: "Separation", unit: "m/s", value: (row) => row.separation_speed },
    { label: "e", isNumeric: true, value: (row) => row.restitution },
    { label: "Contact time", unit: "s", value: (row) => row.duration },
    { label: "Peak force", unit: "N", value: (row) => row.peak_force },
    { label: "Impulse", unit: "N s", value: (row) => row.impulse },
    { label: "Energy lost", unit: "J", value: (row) => row.energy_lost },
  ];
  if (!ledger.isListed)
    return html`<p>No impact is listed; there were ${number(result.summary.impacts)}.</p>`;
  return html`<${Loaded} loaded=${loaded}>
    ${({ impacts, count }) => {
      const cut = count > impacts.length ? `, here the first ${MAX_ROWS}` : "";
      const caption = `${number(count)} in this window of time${cut}`;
      return html`<p class="hint">${caption}</p>
        <${Table}
          caption="Impacts"
          columns=${columns}
          rows=${impacts}
          keyOf=${(row) => row.number}
          chosenKey=${Number(query.impact)}
          onRow=${open}
          empty="The free mass met no stop in this window."
        />`;
    }}
  <//>`;
}
