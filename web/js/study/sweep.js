// A sweep: the metric that varies most with its best point, the others small below, and every point a step from its run. In
// the address: metric, point (an index).
import { html, useMemo } from "../ui/preact.js";
import { get, post, submit } from "../api.js";
import { Chart } from "../chart/chart.js";
import { Choice, Loaded, Notice } from "../ui/controls.js";
import { useLoaded } from "../ui/hooks.js";
import { number, quantity } from "../units.js";
import { useResult } from "../result/context.js";
import { Contours } from "./contours.js";
import { Decision, JobButton, SceneLink, compared } from "./parts.js";
import { Point, Points } from "./sweep_points.js";
import {
  bestRow,
  edgeOf,
  pictureOf,
  placeText,
  positionsOf,
  rowAt,
  sweepModel,
  tellingMetric,
} from "./sweep_model.js";

const MAX_POINTS = 100000; // that a page takes
const MAX_LINES = 8;

// Loads the table at `path`; `again` changes while a job adds points. `given` is the result of the unchanged scene, `jobId`
// the job that makes it.
export function Sweep({ path, points, given, jobId, query, change, again }) {
  const loaded = useLoaded((signal) => get(path, null, signal), [path], again);
  if (points > MAX_POINTS)
    return html`<p>Too many points to draw: save them as CSV or NPZ below.</p>`;
  return html`<${Loaded} loaded=${loaded}>
    ${(answer) =>
      html`<${SweepView}
        answer=${answer}
        given=${given}
        jobId=${jobId}
        query=${query}
        change=${change}
      />`}
  <//>`;
}

export function SweepStudy() {
  const { result, path, query, change } = useResult();
  return html`<${Sweep}
    path=${`${path}/table.json`}
    points=${result.study.points}
    given=${result}
    query=${query}
    change=${change}
  />`;
}

// What the summary of the scene itself has of a metric, with and without its damper.
function referencesOf(metric, given) {
  const value = given?.summary?.[metric.key];
  if (!Number.isFinite(value)) return {};
  const reduction = given.summary[`${metric.key}_reduction`];
  const bare = Number.isFinite(reduction) && reduction < 1 ? value / (1 - reduction) : undefined;
  return { value, bare };
}

// In a sweep of loads alone there is nothing to choose: what it leads to is the worst one.
const isOfLoads = (model) =>
  model.varying.length > 0 && model.varying.every(({ pointer }) => /^\/excitation\//.test(pointer));

function worstText(model, metric) {
  const worst = metric.values.indexOf(metric.high);
  return `Largest ${lower(metric.label)}: ${quantity(metric.high, metric.unit)} at ${placeText(model, worst)}.`;
}

const lower = (label) => label.toLowerCase().replace(/\brms\b/, "RMS");

function decisionOf(model, metric, best, given) {
  const value = metric.values[best];
  const place = placeText(model, best);
  const { value: reference, bare } = referencesOf(metric, given);
  const against = [
    compared(value, reference, "the given scene"),
    compared(value, bare, "the structure without its damper"),
  ].filter(Boolean);
  const text = `Least ${lower(metric.label)}: ${quantity(value, metric.unit)} at ${place}`;
  return against.length > 0 ? `${text}, ${against.join(" and ")}.` : `${text}.`;
}

function SweepView({ answer, given, jobId, query, change }) {
  const model = useMemo(() => sweepModel(answer), [answer]);
  const telling = tellingMetric(model);
  const metric = model.metrics.find(({ key }) => key === query.metric) ?? telling;
  const isLoads = isOfLoads(model);
  const best = isLoads ? -1 : bestRow(metric);
  const chosen = model.rows.get(Number(query.point ?? NaN));
  const pick = (row) => change({ point: model.indices[row] }, true);
  const others = model.metrics.filter((one) => one !== metric && one.spread > 0);
  const picture = pictureOf(model);
  const isDrawn = picture.kind !== "table";
  const edge = best >= 0 ? edgeOf(model, best) : null;
  const sceneOf = (row) => () => get(answer.links.scene.replace("{index}", model.indices[row]));
  const isDone = answer.done === answer.points;
  return html`
    ${!isDone && html`<p role="status">${`${answer.done} of ${answer.points} points.`}</p>`}
    ${answer.failed > 0 && html`<${Failures} answer=${answer} jobId=${jobId} />`}
    ${isLoads && metric.spread > 0 && html`<${Decision}>${worstText(model, metric)}<//>`}
    ${
      best >= 0 &&
      html`<${Decision}
        more=${[
          edge &&
            `It lies at the edge of the range of the ${edge.label.toLowerCase()}: a wider range may have a better one.`,
          `${number(answer.done, 7)} runs.`,
        ]}
        actions=${html`<${JobButton}
            isPrimary
            label="Run the best point"
            make=${async () => submit(await sceneOf(best)())}
          />
          <${SceneLink}
            className="button"
            label="Open it as a scene"
            load=${sceneOf(best)}
            keys=${[best, answer]}
          />`}
      >
        ${decisionOf(model, metric, best, given)}
      <//>`
    }
    ${
      model.metrics.length > 1 &&
      html`<div class="row">
        <${Choice}
          label="Metric"
          options=${model.metrics.map(({ key, label }) => ({ value: key, label }))}
          value=${metric.key}
          onChange=${(key) => change({ metric: key })}
        />
      </div>`
    }
    ${
      isDrawn &&
      html`<${Picture}
        model=${model}
        picture=${picture}
        metric=${metric}
        best=${best}
        chosen=${chosen}
        given=${isLoads ? null : given}
        pick=${pick}
        height=${320}
      />`
    }
    <${Point}
      answer=${answer}
      model=${model}
      chosen=${chosen}
      best=${best}
      sceneOf=${sceneOf}
      pick=${pick}
      isDrawn=${isDrawn}
    />
    ${
      isDrawn &&
      others.length > 0 &&
      html`<div class="multiples">
        ${others.map(
          (one) =>
            html`<div key=${one.key}>
              <${Picture}
                model=${model}
                picture=${picture}
                metric=${one}
                best=${isLoads ? -1 : bestRow(one)}
                chosen=${chosen}
                given=${isLoads ? null : given}
                pick=${pick}
                height=${110}
                isSmall
              />
              <button
                type="button"
                class="link no-print"
                onClick=${() => change({ metric: one.key }, true)}
              >
                ${`Enlarge: ${one.label}`}
              </button>
            </div>`,
        )}
      </div>`
    }
    <${Points} answer=${answer} model=${model} chosen=${chosen} pick=${pick} isOpen=${!isDrawn} />
  `;
}

function Failures({ answer, jobId }) {
  const retry = async () => {
    const id = jobId ?? (await get("v1/jobs", { result: answer.result, kind: "sweep" })).jobs[0].id;
    return post(`v1/jobs/${id}/retry`);
  };
  return html`<${Notice} kind="warn" title=${`${answer.failed} failed`}>
    ${answer.failures.map((one) => html`<p>${`${one.count} from point ${one.first_point} on: ${one.detail}`}</p>`)}
    <${JobButton} label="Make the failed ones again" make=${retry} />
  <//>`;
}

// The series of a metric over the axis across: one, or one for each value of the other axis.
function seriesOf(model, { kind, x, over, fixed }, metric, chosen) {
  if (kind === "list") {
    const rows = [...model.indices.keys()].sort(
      (a, b) => model.columns[x.pointer].values[a] - model.columns[x.pointer].values[b],
    );
    return [
      {
        label: metric.label,
        color: "accent",
        rows,
        x: rows.map((row) => model.columns[x.pointer].values[row]),
        y: rows.map((row) => metric.values[row]),
      },
    ];
  }
  const start = chosen === undefined ? model.axes.map(() => 0) : positionsOf(model, chosen);
  for (const axis of model.varying) if (!fixed.includes(axis)) start[axis.index] = 0;
  const lines = over ? over.values.slice(0, MAX_LINES) : [null];
  return lines.map((_, line) => {
    const rows = x.values.map((_value, at) => {
      const positions = [...start];
      positions[x.index] = at;
      if (over) positions[over.index] = line;
      return rowAt(model, positions);
    });
    return {
      label: over ? over.texts[line] : metric.label,
      color: over ? `c${line + 1}` : "accent",
      rows,
      x: x.isNumeric ? x.values : x.values.map((_value, at) => at),
      y: rows.map((row) => metric.values[row]),
    };
  });
}

const isLogarithmic = (values) => {
  const [first, second] = values;
  const last = values.at(-1);
  const before = values.at(-2);
  return values.length > 3 && first > 0 && Math.abs(second / first / (last / before) - 1) < 1e-6;
};

function Picture(props) {
  const { model, picture, metric, best, chosen, given, pick, height, isSmall } = props;
  const series = useMemo(
    () => (picture.kind === "contours" ? [] : seriesOf(model, picture, metric, chosen)),
    [model, metric, picture.fixed?.length > 0 && chosen],
  );
  if (picture.kind === "contours")
    return html`<${Contours}
      ...${props}
      fixedAt=${chosen === undefined ? null : positionsOf(model, chosen)}
    />`;
  const { x } = picture;
  const { value, bare } = referencesOf(metric, given);
  const rules = [
    value !== undefined && { y: value, label: "given scene", color: "quiet" },
    bare !== undefined &&
      bare < 2.5 * metric.high && { y: bare, label: "without damper", color: "ghost" },
  ].filter(Boolean);
  const placed = (row, label, color) => {
    if (row === undefined || row < 0) return null;
    const line = series.find(({ rows }) => rows.includes(row));
    return line && { x: line.x[line.rows.indexOf(row)], y: metric.values[row], label, color };
  };
  const marks = [placed(best, "best", "ok"), placed(chosen, "", "accent")].filter(Boolean);
  if (marks[0]?.label === "best" && !isSmall)
    rules.push({ x: marks[0].x, label: "best", color: "ok" });
  const dots = ({ x: across, y: up }) =>
    marks
      .filter((mark) => mark.x >= across.domain[0] && mark.x <= across.domain[1])
      .map(
        (mark) =>
          html`<circle
            class="spot"
            cx=${across.to(mark.x)}
            cy=${up.to(mark.y)}
            r="5"
            style=${{ "--ink": `var(--${mark.color})` }}
          />`,
      );
  const isBars = picture.kind === "bars";
  const shown = series.map((one) => (isBars ? { ...one, kind: "bars", width: 0.6 } : one));
  const isLogY = !isBars && metric.low > 0 && metric.high > 50 * metric.low; // bars begin at 0
  const description =
    best >= 0
      ? `Least ${quantity(metric.low, metric.unit)} at ${placeText(model, best)}, largest ${quantity(metric.high, metric.unit)}.`
      : undefined;
  return html`<${Chart}
    title=${metric.label}
    description=${description}
    height=${height}
    isShort=${isSmall}
    x=${{ label: x.label, unit: x.unit ?? "1", categories: x.isNumeric ? undefined : x.texts, log: x.isNumeric && isLogarithmic(x.values) }}
    y=${{ label: metric.label, unit: metric.unit ?? "1", log: isLogY }}
    series=${shown}
    rules=${isSmall ? [] : rules}
    onPick=${(line, at) => line.rows?.[at] !== undefined && pick(line.rows[at])}
  >
    ${dots}
  <//>`;
}
