// One impact at full detail: the numbers, the force over time and over penetration, the part that pulls.
import { html } from "../ui/preact.js";
import { get } from "../api.js";
import { Chart } from "../chart/chart.js";
import { Help, IconButton, Loaded } from "../ui/controls.js";
import { useLoaded } from "../ui/hooks.js";
import { number, quantity, share } from "../units.js";
import { useResult, windowOf } from "./context.js";

const FACTS = [
  ["Approach", "approach_speed", "m/s"],
  ["Separation", "separation_speed", "m/s"],
  ["Restitution e", "restitution", "1"],
  ["Contact time", "duration", "s"],
  ["Peak force", "peak_force", "N"],
  ["Energy lost", "energy_lost", "J"],
];

function placeOf(row, { scene }) {
  const damper = scene.dampers.length > 1 ? `damper ${row.damper}, ` : "";
  const kind = row.kind === "resting" ? ", persistent contact" : "";
  return `At ${quantity(row.start, "s", 6)}, ${damper}${row.side} stop${kind}.`;
}

// The impact that the address names, else the hardest one in view.
function useImpact() {
  const { result, query, ledger, path } = useResult();
  const { from, to } = windowOf(result, query);
  return useLoaded(
    async (signal) => {
      const { count, resting } = await ledger.count();
      const total = count + resting;
      if (!ledger.isListed || total === 0) return { total: 0, count };
      const asked = Number(query.impact);
      let row = asked >= 1 && asked <= total ? await ledger.at(asked) : null;
      if (!row) {
        const { impacts } = await ledger.window(from, to, 500);
        const force = (impact) => impact.peak_force ?? impact.impulse;
        row = impacts.reduce(
          (best, impact) => (best && force(best) >= force(impact) ? best : impact),
          null,
        );
        row ??= await ledger.at(1);
      }
      const isImpulse = row.kind === "impact" && result.plan.contact_model === "impulse";
      const history = isImpulse
        ? null
        : await get(`${path}/impacts/${row.number}/force.json`, null, signal);
      return { total, count, row, history };
    },
    [result.id, query.impact, query.impact ? 0 : from, query.impact ? 0 : to],
  );
}

export function ImpactPanel() {
  const { change, result, query } = useResult();
  const loaded = useImpact();
  return html`<section class="impact" aria-label="Selected impact">
    <${Loaded} loaded=${loaded}>
      ${({ total, count, row, history }) => {
        if (!row)
          return html`<p class="quiet">
            ${count === 0 ? "The free mass never met a stop." : `${number(count)} impacts, not listed.`}
          </p>`;
        const asked = Number(query.impact);
        const at = asked >= 1 && asked <= total ? asked : row.number; // it may be on its way
        const choose = (next) => change({ impact: Math.min(total, Math.max(1, next)) }, true);
        const around = 4 * (row.duration ?? 0) || 40 / result.sample_rate;
        const see = () =>
          change(
            {
              impact: row.number,
              from: Math.max(0, row.start - around),
              to: (row.end ?? row.start) + around,
            },
            true,
          );
        return html`
          <div class="impact-head">
            <h3>Impact ${row.number} <span class="quiet">of ${number(total)}</span></h3>
            <${Help} name="Impacts" />
            <span class="actions">
              <${IconButton}
                label="Previous impact"
                disabled=${at <= 1}
                onClick=${() => choose(at - 1)}
                >◀<//
              >
              <${IconButton}
                label="Next impact"
                disabled=${at >= total}
                onClick=${() => choose(at + 1)}
                >▶<//
              >
              <${IconButton} label="Zoom to this impact" onClick=${see}>Zoom<//>
            </span>
          </div>
          <p class="hint">${placeOf(row, result)}</p>
          <dl class="facts">
            ${FACTS.map(
              ([label, key, unit]) =>
                html`<div>
                  <dt>${label} <${Help} name=${label} /></dt>
                  <dd>${quantity(row[key], unit)}</dd>
                </div>`,
            )}
          </dl>
          ${history ? html`<${ForceCharts} row=${row} history=${history} />` : html`<p class="quiet">An impulse takes no time and has no force.</p>`}
        `;
      }}
    <//>
  </section>`;
}

function ForceCharts({ row, history }) {
  const { time, channels } = history;
  const force = channels.contact_force.values;
  const depth = channels.penetration.values;
  const at = time.values.map((value) => value - row.start);
  const push = Math.max(...force);
  const pull = -Math.min(0, ...force);
  const pulls = pull > 1e-9 * push;
  const pulling = {
    kind: "band",
    label: "pulls",
    color: "bad",
    x: at,
    low: force.map((value) => Math.min(value, 0)),
    high: force.map(() => 0),
  };
  const series = [{ label: "force", color: "force", x: at, y: force }, ...(pulls ? [pulling] : [])];
  const note = pulls
    ? `The contact pulls with up to ${share(pull / push)} of the push; a real buffer would let go.`
    : "";
  return html`
    <${Chart}
      title="Contact force over time"
      height=${100}
      isShort
      x=${{ label: "Time", unit: "s" }}
      y=${{ label: "Force", unit: "N" }}
      series=${series}
    />
    ${
      row.kind === "impact" &&
      html`<${Chart}
        title="Contact force over penetration"
        height=${100}
        isShort
        x=${{ label: "Penetration", unit: "m" }}
        y=${{ label: "Force", unit: "N" }}
        series=${[{ label: "force", color: "force", x: depth, y: force }]}
      />`
    }
    ${note && html`<p class="hint">${note}</p>`}
  `;
}
