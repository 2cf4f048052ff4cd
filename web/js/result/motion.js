// The motion over time: charts on one time axis, impacts as ticks, the structure without its damper, the free mass between
// its stops.
import { html, useEffect, useLayoutEffect, useMemo, useRef, useState } from "../ui/preact.js";
import { Chart, MARGIN } from "../chart/chart.js";
import { wallsOf } from "../chart/marks.js";
import { Button, Failure, Notice } from "../ui/controls.js";
import { useLoaded } from "../ui/hooks.js";
import { go } from "../address.js";
import { post } from "../api.js";
import { number, quantity, title, words } from "../units.js";
import { useBare } from "./bare.js";
import { channelNames, useResult, windowOf } from "./context.js";
import { isWhole, quietTime, seriesOf, useSeries, windowChanges, wordOf } from "./series.js";

const MAX_MARKERS = 300;
const MAX_LINES = 4; // of one chart

// One colour for each quantity, from the drawing to the legend: variables of style.css.
export const quantityColor = (channel) =>
  ({
    displacement: "displacement",
    velocity: "velocity",
    acceleration: "acceleration",
    mean_acceleration: "acceleration",
    base_acceleration: "base",
    damper_displacement: "damper",
    damper_velocity: "damper",
    relative: "damper",
    contact_force: "force",
    penetration: "penetration",
    base_shear: "shear",
    storey_drift: "drift",
  })[wordOf(channel)] ?? "accent";

// Whose channel it is: "storey 2", "damper 1".
const ownerOf = (channel) =>
  channel.replace(/^(damper|contact|penetration)?.*_(?=\d+$)/, (_, damper) =>
    damper ? "damper " : "storey ",
  );

// The charts of a result: {key, title, unit, channels, kind}. "relative" is the free mass as the structure sees it.
function chartsOf(result) {
  const names = channelNames(result);
  const { scene, units, channels } = result;
  const charts = [];
  const add = (word, heading) => {
    const all = channels.filter((channel) => wordOf(channel) === word);
    if (all.length > 0)
      charts.push({ key: word, title: heading ?? title(word), unit: units[all[0]], channels: all });
  };
  add("displacement");
  scene.dampers.forEach((damper, index) => {
    const own = names.of("damper_displacement", index + 1);
    const carrier = names.of("displacement", damper.storey);
    if (!names.has(own) || !names.has(carrier)) return;
    const which = scene.dampers.length > 1 ? ` ${index + 1}` : "";
    charts.push({
      key: `relative_${index + 1}`,
      title: `Free mass${which} between its stops`,
      unit: "m",
      channels: [own, carrier],
      damper,
    });
  });
  add("contact_force");
  const taken = new Set(["displacement", "contact_force"]);
  for (const word of new Set(channels.map(wordOf))) if (!taken.has(word)) add(word);
  return charts;
}

// Impulses have no force over time, and press no buffer.
const isImpulse = ({ plan }) => plan.contact_model === "impulse";
const usual = (charts, result) =>
  charts
    .filter(
      ({ key }) =>
        key === "displacement" ||
        /^relative_[12]$/.test(key) ||
        (key === "contact_force" && !isImpulse(result)),
    )
    .map(({ key }) => key);

// Peaks of contacts that are too short for the samples to show them.
const SHORT = 5; // sample intervals
function unseenPeaks({ key, channels }, { sample_rate: rate }, impacts) {
  const short = impacts.filter(
    ({ start, end, peak_force: force }) => force > 0 && (end - start) * rate < SHORT,
  );
  if (key !== "contact_force" || channels.length > 1 || short.length === 0) return [];
  const y = short.map(({ side, peak_force: force }) => (side === "right" ? force : -force));
  const x = short.map(({ start, end }) => (start + end) / 2);
  return [{ kind: "points", label: "peaks between samples", color: "force", x, y }];
}

// What lies behind the stops, shaded: the free mass is there while it presses a buffer.
const buffers = ({ clearance, offset }) =>
  function Buffers({ y, left, right, top, bottom }) {
    const upper = Math.max(top, y.to(offset + clearance / 2));
    const lower = Math.min(bottom, y.to(offset - clearance / 2));
    return html`<g class="buffers">
      <rect x=${left} y=${top} width=${right - left} height=${Math.max(0, upper - top)} />
      <rect x=${left} y=${lower} width=${right - left} height=${Math.max(0, bottom - lower)} />
    </g>`;
  };

// Of many storeys the lowest, the middle and the highest.
function picked(channels) {
  const last = channels.length - 1;
  return last < MAX_LINES
    ? channels
    : [channels[0], channels[Math.round(last / 2)], channels[last]];
}

function seriesFor(chart, { time, columns }, bare) {
  if (chart.damper) {
    const [own, carrier] = chart.channels.map((channel) => columns.get(channel));
    const relative = own.values.map((value, at) => value - carrier.values[at]);
    return [{ label: "free mass", color: "damper", x: time, y: relative }];
  }
  const drawn = picked(chart.channels);
  const ghost = chart.key === "displacement" && bare !== null;
  const series = drawn.map((channel, at) => {
    const shade = drawn.length > 1 ? ` ${at / (drawn.length - 1)}` : "";
    const single = ghost ? "with the damper" : words(chart.key);
    const label = drawn.length > 1 ? ownerOf(channel) : single;
    return seriesOf(label, quantityColor(channel) + shade, time, columns.get(channel));
  });
  if (!ghost) return series;
  const bareLabel =
    drawn.length > 1 ? `${ownerOf(drawn.at(-1))} without dampers` : "without damper";
  return [seriesOf(bareLabel, "ghost", bare.time, bare.column), ...series];
}

export function Motion({ onDrawn }) {
  const context = useResult();
  const { result, query, change, ledger, path } = context;
  const box = useRef(null);
  const [pixels, setPixels] = useState(0);
  useLayoutEffect(() => {
    if (isWhole(result)) return; // nothing depends on it
    const width = box.current.clientWidth - MARGIN.left - MARGIN.right;
    setPixels(Math.max(200, Math.round(width * (globalThis.devicePixelRatio ?? 1))));
  }, []);
  const charts = useMemo(() => chartsOf(result), [result.id]);
  const named = query.channels?.split(",");
  const chosen = charts.filter(({ key }) => (named ?? usual(charts, result)).includes(key));
  const shown = chosen.length > 0 || named ? chosen : charts.slice(0, 1);
  const channels = [...new Set(shown.flatMap((chart) => chart.channels))];
  const isAuto = query.from === undefined && query.to === undefined;
  const window = windowOf(result, query);
  const loaded = useSeries({ path, result, channels, window, pixels });
  useEffect(() => {
    if (!loaded.isLoading) onDrawn?.();
  }, [loaded.isLoading]);
  const bare = useBare(
    result,
    channels.findLast((channel) => wordOf(channel) === "displacement") ?? "displacement",
  );
  const impacts = useLoaded(
    () => ledger.window(window.from, window.to, MAX_MARKERS),
    [result.id, window.from, window.to],
  );

  // At first as much as holds the energy of a decaying motion.
  const quiet = useMemo(() => {
    const column = loaded.data?.columns.get(channels[0]);
    if (!column?.values || result.count > column.values.length) return null;
    return quietTime([{ time: loaded.data.time, values: column.values }], window.end);
  }, [loaded.data]);
  const range = isAuto ? quiet && [0, quiet] : [window.from, window.to];
  useEffect(() => context.shown.set(range), [range?.[0], range?.[1]]);
  const setRange = (next) => change(windowChanges(next, quiet, window.end), true);

  const horizon = result.summary.trust_horizon;
  const spans =
    horizon === null ? [] : [{ from: horizon, to: window.end, label: "only statistics hold here" }];
  const unlabelled = spans.map((span) => ({ ...span, label: "" }));
  const isCut = impacts.data && impacts.data.count > impacts.data.impacts.length;
  const markers =
    isCut || !impacts.data
      ? []
      : impacts.data.impacts.map((impact) => ({
          x: impact.start,
          color: "force",
          isChosen: String(impact.number) === query.impact,
          label: `${impact.kind} ${impact.number}, ${impact.side} stop, ${quantity(impact.peak_force, "N")}`,
          onPick: () => change({ impact: impact.number }, true),
        }));
  const instant = Number(query.t);
  const rules =
    query.t !== undefined && Number.isFinite(instant)
      ? [{ x: instant, label: "", color: "accent" }]
      : [];
  // Data of charts that were just chosen may be on their way.
  const isEnvelope = loaded.data?.isEnvelope ?? false;
  const drawable = shown.filter(
    (chart) =>
      chart.channels.every((name) => loaded.data?.columns.has(name)) &&
      !(chart.damper && isEnvelope), // of a difference buckets know no bounds
  );
  const many = drawable.find((chart) => picked(chart.channels) !== chart.channels);
  const remarks = [
    isAuto &&
      quiet &&
      `The first ${quantity(quiet, "s")} of ${quantity(window.end, "s")} hold almost all of the motion.`,
    isEnvelope &&
      shown.some((chart) => chart.damper) &&
      "Zoom in to see the free mass between its stops.",
    many && `The lowest, the middle and the highest of ${many.channels.length} are drawn.`,
    charts.length === 0 && "The scene asked for no channels.",
    isEnvelope &&
      `Each pixel shows the least and the largest of ${number(loaded.data.bucket)} samples.`,
    isCut && `${number(impacts.data.count)} contacts: zoom to ${MAX_MARKERS} to see them marked.`,
  ]
    .filter(Boolean)
    .join(" ");
  const heights = shown.length <= 3 ? [180, 160, 160] : [160];

  return html`<section class="motion" aria-label="Motion over time" ref=${box}>
    ${loaded.error && html`<${SeriesFailure} error=${loaded.error} path=${path} />`}
    ${!loaded.error && impacts.error && html`<${Failure} error=${impacts.error} />`}
    ${
      loaded.data &&
      drawable.map((chart, at) => {
        const isLast = at === drawable.length - 1;
        return html`<${Chart}
          key=${chart.key}
          title=${chart.title}
          help=${chart.title}
          x=${{ label: "Time", unit: "s", domain: [0, window.end] }}
          y=${{ label: chart.title, unit: chart.unit }}
          height=${heights[Math.min(at, heights.length - 1)]}
          series=${[
            ...seriesFor(chart, loaded.data, bare.data),
            ...unseenPeaks(chart, result, isCut ? [] : (impacts.data?.impacts ?? [])),
          ]}
          range=${range}
          onRange=${setRange}
          group="time"
          isCompact=${!isLast}
          spans=${at === 0 ? spans : unlabelled}
          rules=${[...rules, ...(chart.damper ? wallsOf(chart.damper) : [])]}
          markers=${at === 0 ? markers : []}
          underlay=${chart.damper && !isImpulse(result) ? buffers(chart.damper) : null}
        />`;
      })
    }
    <div class="motion-foot">
      <div class="chips" role="group" aria-label="Charts">
        ${charts.map(
          ({ key, title: name }) =>
            html`<button
              type="button"
              class="chip"
              aria-pressed=${shown.some((one) => one.key === key)}
              onClick=${() => change({ channels: toggled(charts, shown, key) }, true)}
            >
              ${name}
            </button>`,
        )}
      </div>
      <p class="hint">${remarks}</p>
    </div>
  </section>`;
}

function toggled(charts, shown, key) {
  const keys = new Set(shown.map((one) => one.key));
  if (!keys.delete(key)) keys.add(key);
  return (
    charts
      .map((one) => one.key)
      .filter((one) => keys.has(one))
      .join() || "none"
  );
}

function SeriesFailure({ error, path }) {
  if (error.status !== 410) return html`<${Failure} error=${error} />`;
  const again = () => post(`${path}/again`).then(({ id }) => go(`jobs/${id}`));
  return html`<${Notice} kind="warn" title="The series of this result is not stored any more">
    <p><${Button} onClick=${again}>Run the scene again<//></p>
  <//>`;
}
