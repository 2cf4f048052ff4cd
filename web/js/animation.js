// A result in slow motion, piece by piece. What it shows follows from the view: the instant t, else the start of the impact,
// else that of the window.
import { get } from "./api.js";
import { button, faults, figures, fill, h } from "./dom.js";
import { drawing, limit } from "./drawing.js";
import { quantity } from "./units.js";

const PACES = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const PIECE = 3000; // numbers, few so that the first piece comes soon

function show(host, context) {
  const { ledger, path, result, signal } = context, { scene, summary, plan, sample_rate: rate } = result, { dampers } = scene;
  const stage = h("div"), view = drawing(stage), drawn = view.show(scene, { plan, stroke: summary.peak_displacement });
  const storeys = [scene.structure.masses ?? scene.structure.mass].flat().length;
  const channel = (word) => (k) => (storeys > 1 || dampers.length > 1 ? `${word}_${k + 1}` : word);
  const [displacement, ofDamper, force] = ["displacement", "damper_displacement", "contact_force"].map(channel);
  const needed = [...drawn.storeys.map(displacement), ...drawn.dampers.map(ofDamper)];
  const isHeld = (name) => result.channels.includes(name), missing = needed.filter((name) => !isHeld(name));
  if (missing.length) return host.append(`Nothing to play: this result does not contain ${missing.join(", ")}.`);
  const channels = [...needed, ...drawn.dampers.map(force).filter(isHeld)];
  const length = Math.floor(PIECE / channels.length) / rate; // of a piece (s)
  let from = 0, to = 0, t = 0, seen = {}, held = null, playing = false, noted = 0;

  const play = button("Play", () => run(!playing), { class: "primary" }), readout = h("div");
  const speed = h("select", null, PACES.map((pace) => h("option", { value: pace }, `1/${pace}`)));
  const scrub = h("input", { type: "range", "aria-label": "Instant", onchange: say,
    oninput: () => (run(false), seek(scrub.value)),
    onkeydown: (event) => event.key === " " && (event.preventDefault(), run(!playing)) });
  fill(host, h("div", { role: "group", "aria-label": "Player" }, stage, scrub,
    h("div.row", null, play, h("label", null, "Speed ", speed)), readout));

  // The piece with the instant, once here.
  function piece() {
    const from = Math.floor(t / length) * length, to = from + length + 1 / rate; // with the next one's first sample
    if (held?.from !== from) {
      const made = (held = { from });
      get(`${path}/series.json`, { channels: channels.join(), from, to }, signal)
        .then((found) => draw(Object.assign(made, found)), fails);
    }
    return held.channels;
  }
  function value(name) {
    const { values } = held.channels[name], place = limit((t - held.start) * rate, 0, values.length - 1), low = Math.floor(place);
    return values[low] + (place - low) * ((values[low + 1] ?? 0) - values[low]);
  }
  function fails(error) {
    held = null;
    if (!signal.aborted) run(false);
    faults(readout)(error);
  }

  const within = (wanted) => Number(limit(Number(wanted) || 0, from, to).toPrecision(12)); // digits for the URL
  function draw() {
    const isHere = piece(), time = `${t.toFixed(5)} s`, told = [["Time", isHere ? time : "loading …"]];
    scrub.value = t;
    scrub.ariaValueText = time;
    if (isHere) {
      const displacements = [], positions = [], tell = (label, figure, unit) => told.push([label, quantity(figure, unit, 3)]);
      for (const k of drawn.storeys) displacements[k] = value(displacement(k));
      tell(storeys > 1 ? "Displacement, top" : "Displacement", displacements[storeys - 1], "m");
      for (const k of drawn.dampers) {
        const { storey, offset } = dampers[k], which = dampers.length > 1 ? ` ${k + 1}` : "";
        positions[k] = value(ofDamper(k)) - displacements[storey - 1];
        tell(`Free mass${which} off its middle`, positions[k] - offset, "m");
        if (isHeld(force(k))) tell(`Contact force${which}`, value(force(k)), "N");
      }
      view.pose(displacements, positions);
    }
    fill(readout, figures(told));
  }

  function say() {
    noted = performance.now();
    context.change({ t });
  }
  function seek(wanted) {
    t = within(wanted);
    draw();
    if (performance.now() - noted > 500) say();
  }
  function turn(on) {
    playing = on;
    play.textContent = on ? "Pause" : "Play";
  }
  function run(on) {
    if (playing === on) return;
    turn(on);
    if (!on) return void say();
    if (t >= within(to)) t = from;
    requestAnimationFrame(frame);
  }
  function frame(now, last = now) {
    if (!playing || signal.aborted) return;
    if (piece()) seek(t + Math.min(0.1, (now - last) / 1000) / speed.value);
    if (t >= within(to)) run(false);
    requestAnimationFrame((next) => frame(next, now));
  }
  async function follow(next) {
    const isHere = next.t === seen.t, wasPlaying = playing;
    const isChosen = isHere && next.impact !== seen.impact; // by another section
    seen = next;
    ({ from, to } = context.window);
    Object.assign(scrub, { min: from, max: to, step: (to - from) / 1000 });
    if (playing && !isChosen && (isHere || within(next.t) === t)) return;
    turn(false);
    const row = isChosen || !next.t ? await ledger.at(next.impact).catch(() => null) : null;
    if (seen.impact !== next.impact || signal.aborted) return;
    t = within(row?.start ?? next.t ?? from);
    draw();
    if (wasPlaying || (row && seen.t)) say();
  }
  speed.value = PACES.find((pace) => pace >= 2.5 * (plan.modes?.[0]?.frequency ?? 1)) ?? 1000;
  follow(context.view);
  return { follow };
}

export const section = { title: "In slow motion", show };
