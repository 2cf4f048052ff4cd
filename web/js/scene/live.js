// The scene as it is edited, running: sliders for what matters most, the damper's effect, and the motion as it changes.
import { html, useEffect, useMemo, useRef, useState } from "../ui/preact.js";
import { Chart } from "../chart/chart.js";
import { useNews } from "../form/draft.js";
import { timesOf } from "../result/series.js";
import { wallsOf } from "../chart/marks.js";
import { number, quantity } from "../units.js";
import { limit } from "./model.js";
import { isObject } from "./inputs.js";
import { bareScene, isTooLong, makePreview, previewScene, samplesOf, tooLong } from "./preview.js";

const SPAN = 5; // a slider goes from a fifth of the value to five times it
const STEPS = 400;
const MAX_BUCKET = 0.03; // cycles of the first mode
const POINTS = [1200, 3000]; // of a preview: as few as show the free mass between its stops

// The sliders of a scene: {label, pointer, unit, most}.
function slidersOf({ dampers, excitation }) {
  const found = [];
  const damper = dampers?.[0];
  const add = (label, place, unit, most) => {
    const which = dampers.length > 1 ? ", damper 1" : "";
    found.push({ label: label + which, pointer: `/dampers/0/${place}`, unit, most });
  };
  if (isObject(damper)) {
    add("Clearance", "clearance", "m");
    add("Free mass", "mass", "kg");
    if (isObject(damper.buffer) && !damper.buffer.material) {
      add("Restitution e", "buffer/restitution", "1", 1);
      add("Contact time", "buffer/contact_time", "s");
    }
  }
  const units = { displacement: "m", velocity: "m/s" };
  const base = units[excitation?.quantity] ?? "m/s^2";
  for (const [label, name, unit] of [
    ["Released at", "displacement", "m"],
    ["Base amplitude", "amplitude", base],
    ["Base rms", "rms", base],
    ["Base frequency", "frequency", "Hz"],
  ])
    if (typeof excitation?.[name] === "number")
      found.push({ label, pointer: `/excitation/${name}`, unit });
  return found;
}

// A slider in equal ratios about the value that was there when it was last changed elsewhere.
function Slider({ slider, draft }) {
  const { label, pointer, unit, most = Infinity } = slider;
  const value = draft.get(pointer);
  const center = useRef(value);
  const own = useRef(value);
  if (value !== own.current) center.current = value || center.current || 0.01;
  own.current = value;
  if (!(value >= 0)) return null;
  const place = Math.round((Math.log(value / center.current) / Math.log(SPAN)) * STEPS);
  const move = (event) => {
    const next = Number(
      (center.current * SPAN ** (event.currentTarget.value / STEPS)).toPrecision(4),
    );
    own.current = Math.min(next, most);
    draft.move(pointer, own.current);
  };
  return html`<div class="live-slider">
    <span>${label}</span>
    <input
      type="range"
      min=${-STEPS}
      max=${STEPS}
      step="4"
      value=${Math.max(-STEPS, place)}
      aria-label=${`Slide: ${label}`}
      aria-valuetext=${quantity(value, unit)}
      onInput=${move}
    />
    <output>${quantity(value, unit)}</output>
  </div>`;
}

// The free mass as the structure sees it, from the middles of buckets; null where these are too long for that.
function relativeOf({ series, plan }, [carrier, own]) {
  const { bucket = 1, sample_rate: rate } = series;
  if ((bucket / rate) * (plan.modes[0]?.frequency ?? 0) > MAX_BUCKET) return null;
  const middles = ({ values, min, max }) => values ?? min.map((low, at) => (low + max[at]) / 2);
  const [a, b] = [carrier, own].map((channel) => middles(series.channels[channel]));
  return { x: timesOf(series), y: b.map((value, at) => value - a[at]) };
}

function effectText({ summary }) {
  const change = (part) => {
    if (part === null || part === undefined) return "not known";
    return Math.abs(part) < 5e-4
      ? "unchanged"
      : `${part > 0 ? "−" : "+"}${number(Math.abs(100 * part), 3)} %`;
  };
  const parts = [
    `rms ${change(summary.rms_displacement_reduction)}`,
    `peak ${change(summary.peak_displacement_reduction)}`,
  ];
  if (summary.impacts > 0) parts.push(`${number(summary.impacts)} impacts`);
  if (summary.peak_contact_force > 0)
    parts.push(`largest force ${quantity(summary.peak_contact_force, "N", 3)}`);
  return parts.join(", ");
}

const NOTHING = { data: null, error: null, channels: [], damper: null, name: "" };

// What the service answers to the scene as it is now: {answer, bare}.
function usePreviews(draft, signal) {
  const [answer, setAnswer] = useState(NOTHING);
  const [bare, setBare] = useState(null);
  useEffect(() => {
    let last = ""; // what was asked, unless it was refused
    let lastBare = "";
    let frequency = Infinity; // of the first mode, once it is known
    const follow = ({ asked, ...found }) => {
      frequency = found.data?.plan.modes[0]?.frequency ?? frequency;
      if (found.error) last = "";
      setAnswer({ ...asked, ...found });
    };
    const preview = makePreview(follow, signal);
    const show = ({ asked, data }) => setBare(data && { ...asked, data });
    const barePreview = makePreview(show, signal);
    const ask = () => {
      const now = JSON.stringify(draft.scene);
      if (now === last) return;
      last = now;
      const cycles = draft.scene.duration * frequency;
      const points = Math.round(limit((1.1 * cycles) / MAX_BUCKET, ...POINTS)) || POINTS[1];
      preview.ask({ ...previewScene(draft.scene), points });
      const next = bareScene(draft.scene);
      const text = JSON.stringify(next.scene);
      if (text === lastBare) return;
      lastBare = text;
      barePreview.ask({ ...next, points });
    };
    // What is typed is run once the service has found no fault in it; what a slider or a handle sets, at once.
    return draft.onChange(({ check, isMoving }) => {
      if (isMoving) ask();
      if (!check) return;
      if (!isTooLong(check)) ask();
      else {
        last = "";
        setAnswer({ ...NOTHING, error: tooLong() });
      }
    });
  }, [draft]);
  return { answer, bare };
}

function Sliders({ draft }) {
  useNews(draft);
  return html`<div class="live-sliders">
    ${slidersOf(draft.scene).map((slider) => html`<${Slider} key=${slider.pointer} slider=${slider} draft=${draft} />`)}
  </div>`;
}

export function Live({ draft, signal }) {
  const { answer, bare } = usePreviews(draft, signal);
  const { data, error, damper } = answer;
  return html`<section class="panel live" aria-label="Live">
    <div class="panel-head">
      <h2>Live</h2>
      <p class="live-effect" role="status">
        ${data && damper ? `With the damper: ${effectText(data)}.` : ""}
      </p>
    </div>
    <${Sliders} draft=${draft} />
    ${error && html`<p class="hint">${(error.status === 422 ? tooLong() : error).message}</p>`}
    <${LiveCharts} answer=${answer} bare=${bare} />
  </section>`;
}

function LiveCharts({ answer, bare }) {
  const [range, setRange] = useState(null);
  const { data, channels, damper, name } = answer;
  const isComplete = data && channels.every((channel) => data.series.channels[channel]);
  const motion = useMemo(() => isComplete && samplesOf(data, channels[0]), [data]);
  const ghost = useMemo(() => bare && samplesOf(bare.data, bare.channel), [bare]);
  const relative = useMemo(() => isComplete && damper && relativeOf(data, channels), [data]);
  if (!isComplete) return null;
  const end = (data.series.samples - 1) / data.series.sample_rate;
  const shared = {
    x: { label: "Time", unit: "s", domain: [0, end] },
    range,
    onRange: setRange,
    group: "live",
  };
  return html`<${Chart}
      ...${shared}
      title="Displacement"
      height=${130}
      y=${{ label: "Displacement", unit: "m" }}
      isCompact=${Boolean(relative)}
      series=${[
        ...(ghost && damper ? [{ label: "without damper", color: "ghost", ...ghost }] : []),
        { label: damper ? "with the damper" : "displacement", color: "displacement", ...motion },
      ]}
    />
    ${
      relative &&
      html`<${Chart}
        ...${shared}
        title=${`${name} between its stops`}
        height=${110}
        y=${{ label: `${name} between its stops`, unit: "m" }}
        rules=${wallsOf(damper)}
        series=${[{ label: "free mass", color: "damper", ...relative }]}
      />`
    }`;
}
