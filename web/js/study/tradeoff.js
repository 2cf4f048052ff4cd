// Error against CPU time of every way to run a scene, and which to take. In the address: way (a name).
import { html, useMemo } from "../ui/preact.js";
import { Chart } from "../chart/chart.js";
import { useResult } from "../result/context.js";
import { Table } from "../ui/table.js";
import { capital, number, quantity, readable, share, words } from "../units.js";
import { Decision, SceneLink, plainScene } from "./parts.js";

// The scene run this way.
function applied(scene, way) {
  const known = (...names) =>
    Object.fromEntries(names.filter((name) => way[name] !== null).map((name) => [name, way[name]]));
  const { overlap, ...psd } = scene.output.psd ?? {};
  return {
    ...plainScene(scene),
    ...known("sample_rate", "duration"),
    accuracy: known("solver", "step", "tolerance", "modes"),
    ...(way.contact_model && { contact: { model: way.contact_model } }),
    ...(way.segment && {
      output: { ...scene.output, psd: { ...psd, segment: way.segment } },
    }),
  };
}

// Ways that differ in a number alone: "rk4, any step".
const familyOf = ({ name }) =>
  name.replace(
    /, (?:(step|tolerance) |(sampled) at )[\d.e-]+.*$/,
    (_, kind) => `, any ${kind ?? "sample rate"}`,
  );

function noteOf(point, taken) {
  if (point.why) return point.why;
  if (point === taken) return "recommended";
  return point.is_best || point.status !== "measured" ? "" : "another is faster and closer";
}

function decisionText(taken, metric, unit, recommendation) {
  if (!taken) return `${recommendation.why}.`;
  const error = taken.errors[metric];
  const size = unit === "dB" ? quantity(error, "dB", 2) : share(error, 2);
  return `Take ${readable(taken.name)}: ${words(metric)} wrong by ${size}, ${quantity(taken.cpu_minimum, "s", 2)} of CPU time a run.`;
}

export function TradeoffStudy() {
  const { result, query, change } = useResult();
  const { scene, study } = result;
  const { metric, points, recommendation, error: wanted } = study;
  const chosen = points.find(({ name }) => name === query.way);
  const unit = metric === "psd" ? "dB" : "1";
  const taken = points[recommendation.point - 1];
  const error = (point) => point.errors[metric];
  const measured = useMemo(
    () =>
      points
        .filter((point) => point.cpu_minimum > 0 && error(point) !== null)
        .sort((a, b) => a.cpu_minimum - b.cpu_minimum),
    [result.id],
  );
  // On a logarithmic axis an exact way stands at the lower end.
  const least = Math.min(...measured.map(error).filter((value) => value > 0));
  const shown = (point) => Math.max(error(point), least);
  const series = useMemo(() => {
    const best = measured.filter((point) => point.is_best);
    const families = [...Map.groupBy(measured, familyOf)];
    return [
      {
        label: "no way is better in both",
        color: "ok",
        ways: best,
        x: best.map((point) => point.cpu_minimum),
        y: best.map(shown),
      },
      ...families.map(([name, ways], at) => ({
        kind: "points",
        size: 9,
        label: name,
        color: `c${(at % 8) + 1}`,
        ways,
        x: ways.map((point) => point.cpu_minimum),
        y: ways.map(shown),
      })),
    ];
  }, [measured]);
  const marked = [taken, chosen].filter((point) => measured.includes(point));
  const marker = (plot) => [...new Set(marked)].map((point) => markerOf(point, plot));
  const markerOf = (point, plot) => {
    const [x, y] = [plot.x.to(point.cpu_minimum), plot.y.to(shown(point))];
    const isLate = x > (plot.left + plot.right) / 2;
    return html`<g class="pointer">
      <circle cx=${x} cy=${y} r="9" />
      <text x=${isLate ? x - 14 : x + 14} y=${y - 12} text-anchor=${isLate ? "end" : "start"}>
        ${point === taken ? `take ${readable(point.name)}` : readable(point.name)}
      </text>
    </g>`;
  };
  const errorLabel = `${unit === "dB" ? "Error" : "Relative error"} of the ${words(metric)}`;
  const columns = [
    {
      label: "Way",
      value: ({ name }) => name,
      cell: (point) =>
        html`<${SceneLink}
          label=${readable(point.name)}
          load=${() => applied(scene, point)}
          keys=${[result.id]}
        />`,
    },
    { label: "CPU time", unit: "s", value: (point) => point.cpu_minimum },
    { label: errorLabel, unit, digits: 3, value: error },
    { label: "Steps", isNumeric: true, value: (point) => point.steps },
    { label: "Note", value: (point) => noteOf(point, taken) },
  ];
  // The rest repeats the numbers of the way that is taken.
  const [, why] = recommendation.why.split("; ");
  return html`<${Decision}
      more=${[taken && why && `${capital(readable(why))}.`, `Errors are relative to ${study.reference.solver}, whose own is ${number(study.reference.error_estimate, 2)}.`]}
      actions=${taken && html`<${SceneLink} className="button primary" label="Use it in the scene" load=${() => applied(scene, taken)} keys=${[result.id]} />`}
    >
      ${decisionText(taken, metric, unit, recommendation)}
    <//>
    <${Chart}
      title="Error against cost"
      description="Down and to the left is better; a click on a point names it."
      height=${340}
      x=${{ label: "CPU time of a run", unit: "s", log: true }}
      y=${{ label: errorLabel, unit, log: true }}
      series=${series}
      rules=${wanted > 0 ? [{ y: wanted, label: "wanted error", color: "quiet" }] : []}
      onPick=${(line, index) => change({ way: line.ways[index].name }, true)}
    >
      ${marker}
    <//>
    ${
      chosen
        ? html`<p role="status">
            ${`${readable(chosen.name)}: error ${number(error(chosen), 3)}, ${quantity(chosen.cpu_minimum, "s", 3)}. `}
            <${SceneLink}
              className="button"
              label="Use this way in the scene"
              load=${() => applied(scene, chosen)}
              keys=${[chosen]}
            />
          </p>`
        : html`<p class="hint">Down and to the left is better. A click on a point names it.</p>`
    }
    <${Table}
      caption="Ways to run this scene, each a link to use it"
      columns=${columns}
      rows=${[...points].sort((a, b) => Number(b === taken) - Number(a === taken))}
      keyOf=${({ name }) => name}
      chosenKey=${taken?.name}
    />`;
}
