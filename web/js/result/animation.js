// A result in slow motion. The instant is the address' t, else the start of its impact, else that of the window; while it plays
// the charts' cursor goes along.
import { read } from "../address.js";
import { html, useEffect, useMemo, useRef, useState } from "../ui/preact.js";
import { cursorOf } from "../chart/cursor.js";
import { Picture } from "../scene/drawing.js";
import { useRedraw, useStore, useWidth } from "../ui/hooks.js";
import { channelsOf, makeFrames } from "../scene/frames.js";
import { layoutOf } from "../scene/layout.js";
import { limit, modelOf } from "../scene/model.js";
import { settings } from "../settings.js";
import { Failure, Figures, IconButton } from "../ui/controls.js";
import { quantity } from "../units.js";
import { channelNames, useResult, windowOf } from "./context.js";
import { FilmTools } from "./film_tools.js";

// Seconds on the screen for one of the motion.
const PACES = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const PERIOD = 1.5; // s on the screen, of the first mode at the pace that is chosen at first
const TRAIL = { pixels: 40, seconds: 1.2, states: 72 }; // s on the screen
const NOTE = 500; // ms between changes of the address while it plays
const CALM = 250; // ms between frames for readers who prefer reduced motion
const HEIGHT = 230; // pixels of the drawing of several storeys

const isCalm = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

function paceText(pace) {
  return pace > 1 ? `1/${pace} ×` : `${Math.round(1 / pace)} ×`;
}

function usualPace({ plan }) {
  const period = 1 / (plan.modes?.[0]?.frequency || 1);
  const distance = (pace) => Math.abs(Math.log((period * pace) / PERIOD));
  return PACES.reduce((best, pace) => (distance(pace) < distance(best) ? pace : best));
}

// The motion's states and trails: {missing, stateAt(t), trailAt(t, pace)}; null while data are on their way.
function useMotion({ result, path, signal }, model, { onPiece, onFailure, onPause }) {
  return useMemo(() => {
    const made = channelsOf(model, channelNames(result));
    if (made.missing.length > 0) return made;
    const frames = makeFrames({
      path,
      rate: result.sample_rate,
      channels: made.channels,
      end: (result.count - 1) / result.sample_rate,
      signal,
      onPiece,
      onFailure,
      onPause,
    });
    const stateAt = (t, isAhead) => {
      const value = frames.at(t, isAhead);
      return value && made.stateOf(value);
    };
    const trailAt = (t, pace) => {
      const span = TRAIL.seconds / pace;
      const states = [];
      for (let at = 0; at <= TRAIL.states; at++) {
        const age = (at / TRAIL.states) * span;
        const state = age <= t && stateAt(t - age, false);
        if (!state) break;
        states.push({ ...state, age });
      }
      return { span, states };
    };
    return { ...made, stateAt, trailAt };
  }, [result.id]);
}

// What is played: the window of the address, else what the charts show, where the instant is in it.
function useWindow({ result, query, shown }) {
  const range = useStore(shown);
  const whole = windowOf(result, query);
  const isAuto = query.from === undefined && query.to === undefined;
  if (!isAuto || !range || Number(query.t) > range[1]) return whole;
  return { from: range[0], to: range[1], end: whole.end };
}

// The instant: {t, isPlaying, play(on), scrub(t), writeInstant() to the address, step(side)}. A change of the address moves it.
function usePlayer(
  { query, ledger, change, signal },
  window,
  pace,
  isLooped,
  isReady,
  onFrame,
  onFailure,
) {
  const [t, setT] = useState(window.from);
  const [isPlaying, setPlaying] = useState(false);
  const isRunning = useRef(false); // at once, before it is drawn
  const now = useRef(t);
  const noted = useRef(null); // what this player wrote to the address
  const followed = useRef({});
  const pending = useRef(null); // the impact whose start is on its way
  const latest = useRef(null);
  latest.current = { window, pace, isLooped, isReady };

  const setIsPlaying = (on) => {
    isRunning.current = on;
    setPlaying(on);
  };
  const seek = (wanted) => {
    const { from, to } = latest.current.window;
    now.current = Number(limit(Number(wanted) || 0, from, to).toPrecision(12)); // digits for the address
    setT(now.current);
  };
  const writeInstant = () => {
    noted.current = now.current;
    change({ t: now.current });
  };
  useEffect(() => {
    const before = followed.current;
    followed.current = { t: query.t, impact: query.impact };
    if (read().query.t !== query.t) return; // it has moved on before this effect ran: what is drawn next follows
    const isChosen = query.impact !== before.impact && query.t === before.t; // in another part of the page
    if (query.t !== undefined && !isChosen) {
      if (Number(query.t) === noted.current) return;
      pending.current = null;
      noted.current = null;
      setIsPlaying(false);
      seek(query.t);
      return;
    }
    if (!query.impact) {
      seek(window.from);
      return;
    }
    if (before.impact !== undefined) setIsPlaying(false);
    pending.current = query.impact;
    ledger
      .at(Number(query.impact))
      .catch(() => null)
      .then((row) => {
        if (pending.current !== query.impact || signal.aborted) return;
        pending.current = null;
        seek(row?.start ?? latest.current.window.from);
        if (followed.current.t !== undefined) writeInstant();
      });
  }, [query.t, query.impact, window.from, window.to]);

  useEffect(() => {
    if (!isPlaying) return undefined;
    let frame = 0;
    let last = performance.now();
    let written = last;
    const step = (time) => {
      if (!isRunning.current) return;
      frame = requestAnimationFrame(step);
      const { from, to } = latest.current.window;
      if (isCalm() && time - last < CALM) return;
      const passed = Math.min(isCalm() ? 2 * CALM : 100, time - last) / 1000;
      last = time;
      if (!latest.current.isReady(now.current)) return;
      const next = now.current + passed / latest.current.pace;
      if (next < to) seek(next);
      else if (latest.current.isLooped) seek(from);
      else {
        seek(to);
        setIsPlaying(false);
        writeInstant();
        return;
      }
      onFrame(now.current);
      if (time - written > NOTE) {
        written = time;
        writeInstant();
      }
    };
    frame = requestAnimationFrame(step);
    return () => {
      cancelAnimationFrame(frame);
      onFrame(null);
    };
  }, [isPlaying]);

  const play = (on) => {
    if (on && now.current >= Number(window.to.toPrecision(12))) seek(window.from);
    setIsPlaying(on);
    if (!on) writeInstant();
  };
  const scrub = (wanted) => {
    pending.current = null;
    setIsPlaying(false);
    seek(wanted);
  };
  // To the next contact or the one before: one step after the other.
  const queue = useRef(Promise.resolve());
  const step = (side) => {
    queue.current = queue.current.then(async () => {
      const row = await neighbour(ledger, now.current, side).catch(onFailure);
      if (!row || signal.aborted) return;
      const { from, to } = latest.current.window;
      const isAway = row.start < from || row.start > to; // then no part of the time is chosen
      pending.current = null;
      setIsPlaying(false);
      now.current = row.start;
      noted.current = row.start;
      setT(row.start);
      const all = isAway ? { from: null, to: null } : {};
      change({ impact: row.number, t: row.start, ...all }, true);
    });
  };
  return { t, isPlaying, play, scrub, writeInstant, step };
}

// The number of the contact that begins next after t, or last before it.
async function neighbour(ledger, t, step) {
  const { count } = await ledger.window(0, t, 1);
  const at = count > 0 ? await ledger.at(count) : null;
  const isHere = at && Math.abs(at.start - t) < 1e-9;
  if (step > 0) return ledger.at(count + 1);
  return isHere || !at ? ledger.at(count - 1) : at;
}

export function Animation() {
  const context = useResult();
  const { result, query, ledger, change } = context;
  const units = useStore(settings);
  const box = useRef(null);
  const width = useWidth(box, 240, 720);
  const redraw = useRedraw();
  const [error, setError] = useState(null);
  const [pace, setPace] = useState(() => usualPace(result));
  const [isLooped, setIsLooped] = useState(false);
  const model = useMemo(() => modelOf(result.scene, result.plan), [result.id, units]);
  const motion = useMotion(context, model, {
    onPiece: () => {
      setError(null);
      redraw();
    },
    onFailure: setError,
    onPause: redraw,
  });
  const window = useWindow(context);
  const cursor = cursorOf("time");
  const follow = (x) => cursor.set(x === null ? null : { x, y: null, owner: null });
  const isReady = (t) => motion.stateAt?.(t);
  const player = usePlayer(context, window, pace, isLooped, isReady, follow, setError);
  const { t, isPlaying } = player;

  if (motion.missing.length > 0)
    return html`<section aria-label="In slow motion" ref=${box}>
      <p class="quiet">
        ${`Nothing to play: this result does not contain ${motion.missing.join(", ")}.`}
      </p>
    </section>`;

  const stroke = result.summary.peak_displacement;
  const peak = result.summary.peak_contact_force ?? 0;
  const hasTrail = !isCalm();
  const layout =
    width > 0 &&
    layoutOf(model, {
      width,
      stroke,
      height: HEIGHT,
      isCompact: true,
      trail: hasTrail ? TRAIL.pixels : 0,
    });
  const state = motion.stateAt(t);
  const frameAt = (time) => {
    const held = motion.stateAt(time);
    const text = `t = ${time.toFixed(4)} s, ${paceText(pace)}`;
    return held && { state: held, trail: hasTrail ? motion.trailAt(time, pace) : null, text };
  };
  const handleKey = (event) => {
    const actions = {
      " ": () => player.play(!isPlaying),
      n: () => player.step(1),
      p: () => player.step(-1),
    };
    if (event.target.matches("select, button") && event.key === " ") return;
    if (!actions[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    actions[event.key]();
  };
  const time = `${t.toFixed(5)} s`;
  const hasImpacts = result.summary.impacts > 0 && ledger.isListed;
  return html`<section aria-label="In slow motion">
    <div role="group" aria-label="Player" class="player" onKeyDown=${handleKey}>
      <div class="drawing" ref=${box}>
        ${layout && html`<${Picture} model=${model} layout=${layout} state=${state ?? { displacements: [] }} peak=${peak} trail=${state && hasTrail && motion.trailAt(t, pace)} />`}
      </div>
      <div class="player-time">
        <input
          type="range"
          aria-label="Instant"
          aria-valuetext=${time}
          min=${window.from}
          max=${window.to}
          step=${(window.to - window.from) / 1000}
          value=${t}
          onInput=${(event) => player.scrub(event.currentTarget.value)}
          onChange=${player.writeInstant}
        />
        <${FilmTools}
          scene=${{ model, stroke, peak, hasTrail }}
          frame=${() => frameAt(t)}
          frameAt=${frameAt}
          window=${window}
          t=${t}
          pace=${pace}
          signal=${context.signal}
        />
      </div>
      <div class="player-tools">
        <button type="button" class="primary" onClick=${() => player.play(!isPlaying)}>
          ${isPlaying ? "Pause" : "Play"}
        </button>
        ${
          hasImpacts &&
          html`<${IconButton} label="Impact before (p)" onClick=${() => player.step(-1)}>❘◀<//>
            <${IconButton} label="Impact after (n)" onClick=${() => player.step(1)}>▶❘<//>`
        }
        <${IconButton} label="Loop" pressed=${isLooped} onClick=${() => setIsLooped(!isLooped)}
          >Loop<//
        >
        <select
          aria-label="Speed"
          title="Speed"
          value=${pace}
          onChange=${(event) => setPace(Number(event.currentTarget.value))}
        >
          ${PACES.map((one) => html`<option value=${one}>${paceText(one)}</option>`)}
        </select>
      </div>
      <${Readout} time=${state ? time : "loading …"} state=${state} model=${model} />
    </div>
    ${error && html`<${Failure} error=${error} />`}
  </section>`;
}

// What is seen, in numbers.
function Readout({ time, state, model }) {
  const rows = [["Time", time]];
  if (state) {
    const top = model.count - 1;
    const several = model.dampers.length > 1;
    const add = (label, value, unit) => rows.push([label, quantity(value, unit, 3)]);
    add(model.count > 1 ? "Top storey" : "Displacement", state.displacements[top], "m");
    for (const { index, offset } of model.dampers) {
      const which = several ? ` ${index + 1}` : "";
      add(`Free mass${which}`, state.positions[index] - offset, "m");
      if (state.forces[index] !== undefined) add(`Contact force${which}`, state.forces[index], "N");
    }
  }
  return html`<${Figures}
    pairs=${rows}
    className="readout"
    title="Free masses: from the middle between their stops"
  />`;
}
