// What drop tests gave: e and T_c as headline numbers and as charts of all readings over the approach speed.
import { Chart } from "../chart/chart.js";
import { extentOf, paddedDomain } from "../chart/scale.js";
import { Headlines, sentence } from "../ui/controls.js";
import { html } from "../ui/preact.js";
import { quantity } from "../units.js";
import { QUANTITIES, range, Remarks } from "./format.js";

// e and T_c with their intervals: [{label, value, note}].
function headlinesOf(evaluation) {
  return QUANTITIES.filter(({ name }) => evaluation?.[name].count > 0).map(
    ({ name, label, unit }) => {
      const { mean, low, high, why, count, outliers } = evaluation[name];
      const interval = low === null ? why : `95 %: ${range(low, high, unit)}`;
      const note = `${interval}; readings: ${count}, far off: ${outliers}`;
      return { label, value: quantity(mean, unit), note };
    },
  );
}

// The series of a chart: readings that count, far off and excluded, with their uncertainties, over the mean's interval.
function seriesOf({ name, color }, rows, statistics, domain) {
  const uncertainty = `${name}_uncertainty`;
  const of = (label, tone, chosen) => ({
    kind: "points",
    label,
    color: tone,
    size: 8,
    x: chosen.map((row) => row.approach_speed),
    y: chosen.map((row) => row[name]),
  });
  const isOut = (row) => row[`${name}_is_outlier`] && !row.excluded;
  const counting = rows.filter((row) => row[`${name}_counts`] && !isOut(row));
  const uncertain = rows.filter((row) => row[uncertainty] > 0);
  const { mean, low, high } = statistics;
  const across = (value) => domain.map(() => value);
  return [
    low !== null && {
      kind: "band",
      label: "mean and its 95 % interval",
      color: "ghost",
      x: domain,
      low: across(low),
      high: across(high),
    },
    mean !== null && {
      label: "mean and its 95 % interval",
      color: "quiet",
      dash: true,
      x: domain,
      y: across(mean),
    },
    uncertain.length > 0 && {
      kind: "errors",
      label: "uncertainty",
      color: "quiet",
      x: uncertain.map((row) => row.approach_speed),
      low: uncertain.map((row) => row[name] - row[uncertainty]),
      high: uncertain.map((row) => row[name] + row[uncertainty]),
    },
    of("readings", color, counting),
    of("far off", "bad", rows.filter(isOut)),
    of(
      "excluded",
      "ghost",
      rows.filter((row) => !row[`${name}_counts`] && !isOut(row)),
    ),
  ].filter((series) => series && series.x.length > 0);
}

function ReadingsChart({ quantity: shown, evaluation, isSaid }) {
  const { name, label, unit } = shown;
  const isNumber = (value) => typeof value === "number";
  const rows = evaluation.rows.filter((row) => isNumber(row[name]) && isNumber(row.approach_speed));
  if (rows.length === 0) return null;
  const domain = paddedDomain(extentOf([rows.map((row) => row.approach_speed)]), false, 0.08);
  const { detail } = evaluation[name].trend;
  return html`<${Chart}
      title=${label}
      height=${150}
      isShort
      x=${{ label: "Approach speed", unit: "m/s", domain }}
      y=${{ label, unit }}
      series=${seriesOf(shown, rows, evaluation[name], domain)}
    />
    ${detail && !isSaid(detail) && html`<p class="hint">${sentence(detail)}</p>`}`;
}

export function Readings({ evaluation, warnings = [] }) {
  const isSaid = (text) => warnings.some(({ detail }) => detail === text);
  const items = headlinesOf(evaluation);
  return html`${
      items.length > 0 ? html`<${Headlines} items=${items} />` : html`<p>Nothing counts yet.</p>`
    }
    ${
      evaluation &&
      QUANTITIES.map(
        (shown) =>
          html`<${ReadingsChart}
            key=${shown.name}
            quantity=${shown}
            evaluation=${evaluation}
            isSaid=${isSaid}
          />`,
      )
    } <${Remarks} warnings=${warnings} />`;
}
