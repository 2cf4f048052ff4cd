// Where the energy came from and where it went: a waterfall and its numbers.
import { html } from "../ui/preact.js";
import { get } from "../api.js";
import { Loaded } from "../ui/controls.js";
import { useLoaded } from "../ui/hooks.js";
import { Table } from "../ui/table.js";
import { share, title } from "../units.js";
import { useResult } from "./context.js";

// Whether the service counts what comes or what goes; each part goes on where the last one ended.
const SIGNS = {
  initial: 1,
  input: 1,
  structural_damping: -1,
  contact: -1,
  kinetic: -1,
  strain: -1,
};
const MEANINGS = {
  initial: "at the start",
  input: "by the base's motion",
  structural_damping: "lost in the structure",
  contact: "lost in the contacts",
  kinetic: "kinetic at the end",
  strain: "strain at the end",
};

function partsOf(energies) {
  let level = 0;
  return Object.entries(SIGNS)
    .filter(([name]) => energies[name] !== 0)
    .map(([name, sign]) => {
      const flow = sign * energies[name];
      const start = level;
      level += flow;
      return { name, flow, start, end: level };
    });
}

export function Energy() {
  const { path, result } = useResult();
  const loaded = useLoaded((signal) => get(`${path}/energy.json`, null, signal), [result.id]);
  return html`<${Loaded} loaded=${loaded}>
    ${(energies) => {
      const parts = partsOf(energies);
      const whole = parts.reduce((sum, { flow }) => sum + Math.max(0, flow), 0);
      if (whole === 0) return html`<p>Nothing moved: there was no energy.</p>`;
      const percent = (size) => `${(100 * size) / whole}%`;
      const bar = ({ start, end, flow }) =>
        html`<div class="strip" aria-hidden="true">
          <span
            class=${flow > 0 ? "came" : "went"}
            style=${{ left: percent(Math.min(start, end)), width: percent(Math.abs(end - start)) }}
          ></span>
        </div>`;
      const columns = [
        { label: "Part", value: ({ name }) => title(name) },
        { label: "Meaning", value: ({ name }) => MEANINGS[name] },
        { label: "Balance", value: ({ flow }) => flow, cell: bar },
        { label: "Energy", unit: "J", value: ({ flow }) => flow },
        {
          label: "Share",
          isNumeric: true,
          value: ({ flow }) => flow / whole,
          cell: ({ flow }) => share(flow / whole),
        },
      ];
      return html`<${Table}
        caption="What came and, negative, what went"
        columns=${columns}
        rows=${parts}
      />`;
    }}
  <//>`;
}
