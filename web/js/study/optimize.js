// The best values: the search as it went, what they gain, how far they may vary, what comes close; for two objectives the
// front of compromises.
import { labelOf } from "../runs/names.js";
import { valueText } from "../runs/scene_name.js";
import { html, useMemo } from "../ui/preact.js";
import { get, getSchema } from "../api.js";
import { Chart } from "../chart/chart.js";
import { useResult } from "../result/context.js";
import { unitAt } from "../scene/inputs.js";
import { useLoaded } from "../ui/hooks.js";
import { Table } from "../ui/table.js";
import { quantity, title, words } from "../units.js";
import { UpwardTitle, levelsOf, shade } from "./contours.js";
import {
  Bars,
  Decision,
  SceneLink,
  between,
  compared,
  intervals,
  pointerOf,
  quantities,
  remarksOf,
} from "./parts.js";
import { extentOf } from "../chart/scale.js";

export function OptimizeStudy() {
  const { result, path } = useResult();
  const { study, units } = result;
  const schema = useLoaded(() => getSchema("scene"), []);
  const unitOf = (one) => (schema.data ? unitAt(schema.data, pointerOf(one)) : undefined);
  const values = (list) =>
    list.map((one) => `${labelOf(pointerOf(one))} ${valueText(one.value, unitOf(one))}`).join(", ");
  const { best, objectives, front, region, rivals, candidates, runs } = study;
  const [goal] = objectives;
  const remarks = [`${candidates} candidates, ${runs} runs.`, ...remarksOf(study)];
  const use = html`<${SceneLink}
    className="button primary"
    label="Run the scene with these values"
    load=${() => get(`${path}/optimum/scene`)}
    keys=${[result.id]}
  />`;
  return html`<${Decision} more=${remarks} actions=${best && use}>
      ${decisionOf(study, units, values)}
    <//>
    ${objectives.length > 1 && front.length > 0 && html`<${Front} study=${study} units=${units} values=${values} />`}
    <${Gain} study=${study} units=${units} />
    ${objectives.length === 1 && html`<${Search} study=${study} unit=${units[goal.metric]} unitOf=${unitOf} />`}
    ${region.some(({ low }) => low !== null) && html`<${Region} region=${region} unitOf=${unitOf} />`}
    ${rivals.length > 0 && html`<${Rivals} rivals=${rivals} unit=${units[goal.metric]} values=${values} />`}`;
}

function decisionOf({ best, given, undamped, objectives }, units, values) {
  if (!best) return "No candidate keeps the constraints.";
  const [{ metric, value, interval_95: interval }] = best.objectives;
  const unit = units[metric];
  const against = [
    [given.metrics[metric], "the given scene"],
    [undamped?.metrics[metric], "the structure without dampers"],
  ]
    .map(([reference, name]) => compared(value, reference, name))
    .filter(Boolean);
  const range = interval ? ` (95 %: ${between(...interval, unit)})` : "";
  const isSingle = objectives.length === 1;
  const lead = isSingle ? "Best" : "A good compromise";
  const others = best.objectives.slice(1).map((one) => {
    const before = given.metrics[one.metric];
    return ` ${title(one.metric)} ${quantity(one.value, units[one.metric])}, given ${quantity(before, units[one.metric])}.`;
  });
  return `${lead}: ${values(best.values)}. ${title(metric)} ${quantity(value, unit)}${range}, ${against.join(" and ")}.${others.join("")}`;
}

// Metrics of the best, the given scene and the structure without dampers, each as a part of the last.
function Gain({ study: { best, given, undamped }, units }) {
  const metrics = Object.keys(given.metrics).filter(
    (metric) => Number.isFinite(given.metrics[metric]) && !metric.endsWith("_reduction"),
  );
  const rows = metrics
    .filter((metric) => undamped?.metrics[metric] > 0 && Number.isFinite(best?.metrics[metric]))
    .flatMap((metric) =>
      [
        ["best", best, "ok"],
        ["given", given, "c8"],
      ].map(([name, { metrics: of }, color]) => ({
        label: `${title(metric)}, ${name}`,
        from: 0,
        to: (100 * of[metric]) / undamped.metrics[metric],
        color,
        text: quantity(of[metric], units[metric], 3),
      })),
    );
  const of = (label, source) =>
    quantities(
      label,
      (metric) => source?.metrics[metric],
      4,
      (metric) => units[metric],
    );
  const columns = [
    { label: "Metric", value: title },
    of("Best", best),
    of("Given", given),
    of("Without dampers", undamped),
  ];
  return html`${rows.length > 0 && html`<${Bars} title="Against the structure without dampers" x=${{ label: "Of the structure without dampers [%]", unit: "1" }} rows=${rows} origin=${100} />`}
    <${Table}
      caption="Against the structure without dampers"
      columns=${columns}
      rows=${metrics}
    />`;
}

// The first objective of every candidate: over two numbers colours of the places, else over the first number, by what else was
// chosen.
function Search({ study: { history, best, objectives }, unit, unitOf }) {
  const [{ metric }] = objectives;
  const variables = history[0]?.values ?? [];
  const numbers = [...variables.keys()].filter((at) => typeof variables[at].value === "number");
  const isMap = numbers.length === 2 && variables.length === 2;
  const [across, up] = numbers;
  const known = history.filter(({ objectives: [value] }) => Number.isFinite(value));
  const levels = levelsOf(...(extentOf([known.map((one) => one.objectives[0])]) ?? [0, 0]), 7);
  const groups = useMemo(() => {
    const named = ({ values, objectives: [value] }) =>
      isMap
        ? levels.findLastIndex((level) => level <= value)
        : values
            .filter((one) => typeof one.value !== "number")
            .map((one) => valueText(one.value))
            .join(", ") || "candidates";
    return [...Map.groupBy(known, named)].slice(0, 8);
  }, [history]);
  if (numbers.length === 0) return null;
  const colorOf = (at) => shade(0.2 + (0.8 * at) / Math.max(1, levels.length - 1)); // also on a dark ground
  if (isMap) groups.sort(([a], [b]) => b - a); // the best ones above
  const series = groups.map(([group, rows], index) => ({
    kind: "points",
    size: isMap ? 10 : 7,
    label: isMap ? `from ${quantity(levels[group], unit, 3)}` : group,
    color: isMap ? `level-${group}` : `c${index + 1}`,
    x: rows.map(({ values }) => values[across].value),
    y: rows.map((one) => (isMap ? one.values[up].value : one.objectives[0])),
    notes: isMap && rows.map((one) => quantity(one.objectives[0], unit)),
  }));
  const axisOf = (at) => ({
    label: title(labelOf(pointerOf(variables[at]))),
    unit: unitOf(variables[at]) ?? "1",
  });
  const label = `${title(metric)} of every candidate`;
  const y = isMap ? axisOf(up) : { label, unit };
  const colors = levels.map((_, at) => [`--level-${at}`, colorOf(at)]);
  const found = best?.values.map(({ value }) => value);
  const rules = found
    ? [{ x: found[across], label: "best", color: "ok" }, isMap && { y: found[up], color: "ok" }]
    : [];
  return html`<div style=${Object.fromEntries(colors)}>
    <${Chart}
      title="The search"
      heading=${isMap ? label : null}
      height=${260}
      x=${axisOf(across)}
      y=${y}
      series=${series}
      rules=${rules.filter(Boolean)}
    >
      ${isMap ? (plot) => html`<${UpwardTitle} axis=${y} plot=${plot} />` : null}
    <//>
  </div>`;
}

function Front({ study: { front, objectives, best }, units, values }) {
  const [first, second] = objectives;
  const sorted = front.toSorted((a, b) => a.objectives[0] - b.objectives[0]);
  const [x, y] = [0, 1].map((at) => sorted.map((one) => one.objectives[at]));
  const series = [
    { label: "best compromises", color: "ok", x, y },
    { kind: "points", size: 8, label: "candidates on the front", color: "ok", x, y },
  ];
  const rules = best
    ? [{ x: best.objectives[0].value, label: "recommended", color: "accent" }]
    : [];
  const columns = [
    { label: "Values", value: (one) => values(one.values) },
    ...objectives.map(({ metric }, at) => ({
      label: title(metric),
      unit: units[metric],
      value: (one) => one.objectives[at],
    })),
  ];
  return html`<${Chart}
      title="Best compromises"
      height=${280}
      x=${{ label: title(first.metric), unit: units[first.metric] }}
      y=${{ label: title(second.metric), unit: units[second.metric] }}
      series=${series}
      rules=${rules}
    />
    <p class="hint">
      ${`No candidate has both less ${words(first.metric)} and less ${words(second.metric)} than one of these.`}
    </p>
    <${Table} caption="Best compromises" columns=${columns} rows=${sorted} />`;
}

function Region({ region, unitOf }) {
  const columns = [
    { label: "Member", value: (one) => title(labelOf(pointerOf(one))) },
    quantities("From", ({ low }) => low, 4, unitOf),
    quantities("To", ({ high }) => high, 4, unitOf),
  ];
  const rows = region.filter(({ low }) => low !== null);
  return html`<${Table}
    caption="Within 2 % of the best"
    isHeaded
    columns=${columns}
    rows=${rows}
  />`;
}

function Rivals({ rivals, unit, values }) {
  const columns = [
    { label: "Values", value: (one) => values(one.values) },
    { label: "Worse by", unit, value: ({ difference }) => difference },
    intervals(
      "95 %",
      (one) => one.interval_95,
      () => unit,
    ),
  ];
  return html`<${Table} caption="What comes close" isHeaded columns=${columns} rows=${rivals} />`;
}
