// A result in slow motion. What it shows follows from the address: the instant t, else the start of the impact, else that of
// the window of time.
import { html, useEffect, useMemo, useRef, useState } from "../ui/preact.js";
import { Button, Failure, IconButton } from "../ui/controls.js";
import { fileName, saveBlob, standaloneSvg } from "../ui/files.js";
import { canRecord, recordVideo } from "../ui/video.js";
import { Drawing } from "../scene/drawing.js";
import { drawnParts, limit } from "../scene/layout.js";
import { number, quantity } from "../units.js";
import { channelNames, useResult, windowOf } from "./context.js";
import { Pieces } from "./pieces.js";
import { paintSvg } from "./frames.js";

const PACES = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const PERIOD = 1.2; // s that a cycle of the first mode takes at least on the screen
const NOTED_MS = 500; // between two writes of the instant into the address
const TRAIL = 0.045; // s on the screen between two places of a trail
const GHOSTS = 5;
const LONGEST_VIDEO = 120; // s

const usualPace = (frequency) => PACES.find((pace) => pace >= PERIOD * frequency) ?? PACES.at(-1);

// What is posed and which channels that needs.
function useChannels(result) {
  return useMemo(() => {
    const names = channelNames(result);
    const drawn = drawnParts(result.scene);
    const displacement = (index) => names.ofStorey("displacement", index + 1);
    const position = (index) => names.ofDamper("damper_displacement", index + 1);
    const force = (index) => names.ofDamper("contact_force", index + 1);
    const needed = [...drawn.storeys.map(displacement), ...drawn.dampers.map(position)];
    return {
      drawn,
      displacement,
      position,
      force,
      storeys: names.storeys,
      missing: needed.filter((name) => !names.has(name)),
      channels: [...needed, ...drawn.dampers.map(force).filter(names.has)],
    };
  }, [result.id]);
}

// The state of everything at an instant, for the drawing.
function poseAt(pieces, wanted, { scene, summary }, instant, pace) {
  const pose = { displacements: [], positions: [], trails: [], strengths: [], forces: [] };
  const { drawn, displacement, position, force } = wanted;
  for (const index of drawn.storeys)
    pose.displacements[index] = pieces.value(displacement(index), instant);
  const relative = (index, when) =>
    pieces.value(position(index), when) -
    pieces.value(displacement(scene.dampers[index].storey - 1), when);
  for (const index of drawn.dampers) {
    pose.positions[index] = relative(index, instant);
    pose.trails[index] = Array.from({ length: GHOSTS }, (_, at) => {
      const when = instant - ((GHOSTS - at) * TRAIL) / pace;
      const place = when >= 0 ? relative(index, when) : NaN;
      return Number.isNaN(place) ? undefined : place;
    });
    if (!wanted.channels.includes(force(index))) continue;
    pose.forces[index] = pieces.value(force(index), instant);
    pose.strengths[index] = pose.forces[index] / (summary.peak_contact_force || 1);
  }
  return pose;
}

// What a pose says in numbers.
function figuresOf(pose, { drawn, storeys }, { dampers }, instant) {
  const figures = [["Time", `${instant.toFixed(5)} s`]];
  const last = pose.displacements.length - 1;
  figures.push([
    storeys > 1 ? "Displacement, top" : "Displacement",
    quantity(pose.displacements[last], "m", 3),
  ]);
  for (const index of drawn.dampers.slice(0, 3)) {
    const which = dampers.length > 1 ? ` ${index + 1}` : "";
    const off = pose.positions[index] - dampers[index].offset;
    figures.push([`Free mass${which} off its middle`, quantity(off, "m", 3)]);
    if (pose.forces[index] !== undefined)
      figures.push([`Contact force${which}`, quantity(pose.forces[index], "N", 3)]);
  }
  return figures;
}

// The instant, moved by hand, by time, by impact; written into the address now and then.
function usePlayer({ result, query, change, ledger }, pieces) {
  const window = windowOf(result, query);
  const [instant, setInstant] = useState(null); // null until it is known
  const [isPlaying, setIsPlaying] = useState(false);
  const [isLooping, setIsLooping] = useState(false);
  const [pace, setPace] = useState(() => usualPace(result.plan.modes?.[0]?.frequency ?? 1));
  const now = useRef({ t: 0, seen: {}, noted: 0, isPlaying: false });
  Object.assign(now.current, { window, pace, isLooping });
  const within = (value) =>
    Number(limit(Number(value) || 0, window.from, window.to).toPrecision(12)); // digits for the URL
  const place = (value) => {
    now.current.t = within(value);
    setInstant(now.current.t);
  };
  const write = () => {
    now.current.noted = performance.now();
    now.current.written = now.current.t;
    change({ t: now.current.t });
  };
  const seek = (value) => {
    place(value);
    if (performance.now() - now.current.noted > NOTED_MS) write();
  };
  const turn = (isOn) => {
    now.current.isPlaying = isOn;
    setIsPlaying(isOn);
  };
  const run = (isOn) => {
    if (now.current.isPlaying === isOn) return;
    turn(isOn);
    if (!isOn) write();
    else if (now.current.t >= window.to) place(window.from);
  };

  // A frame: real time divided by the pace; it waits where a piece is not here yet.
  useEffect(() => {
    if (!isPlaying) return undefined;
    let last = performance.now();
    let request = requestAnimationFrame(frame);
    function frame(time) {
      if (!now.current.isPlaying) return; // it was stopped, which is yet to be drawn
      const step = Math.min(0.1, Math.max(0, time - last) / 1000);
      last = time;
      const { t, window: view, pace: slowness, isLooping: repeats } = now.current;
      if (pieces.has(t, view.to)) {
        const next = t + step / slowness;
        if (next < view.to) seek(next);
        else if (repeats) seek(view.from);
        else {
          place(view.to);
          run(false);
          return;
        }
      }
      request = requestAnimationFrame(frame);
    }
    return () => cancelAnimationFrame(request);
  }, [isPlaying, pieces]);

  useEffect(() => {
    const { seen, isPlaying: wasPlaying } = now.current;
    const isSameInstant = query.t === seen.t;
    const isChosen = isSameInstant && query.impact !== seen.impact; // by another part of the page
    const isOwn = isSameInstant || Number(query.t) === now.current.written;
    now.current.seen = { t: query.t, impact: query.impact };
    if (wasPlaying && !isChosen && isOwn) return;
    turn(false);
    const settle = async () => {
      const needsRow = query.impact && (isChosen || !query.t);
      const row = needsRow ? await ledger.at(Number(query.impact)).catch(() => null) : null;
      if (now.current.isGone || now.current.seen.impact !== query.impact) return; // another one since
      place(row?.start ?? query.t ?? window.from);
      if (wasPlaying || (row && seen.t)) write();
    };
    settle();
  }, [query.t, query.impact, window.from, window.to]);

  useEffect(
    () => () => {
      now.current.isGone = true;
    },
    [],
  );

  return { instant, window, isPlaying, isLooping, pace, setPace, setIsLooping, seek, write, run };
}

// The number of the impact before or after an instant, null where there is none.
async function neighbour(ledger, { from, to }, instant, step) {
  const margin = 1e-9;
  const { impacts } = await ledger.window(instant + margin, to, 4);
  const next = impacts.find(({ start }) => start > instant + margin);
  if (step > 0) return next?.number ?? null;
  const { count } = await ledger.count();
  let number = (next?.number ?? count + 1) - 1;
  while (number >= 1) {
    const row = await ledger.at(number);
    if (row.start < instant - margin) return row.start >= from ? number : null;
    number--;
  }
  return null;
}

function Recorder({ seconds, name, getSvg, showAt }) {
  const [part, setPart] = useState(null);
  const stop = useRef(null);
  const record = async () => {
    stop.current = new AbortController();
    const canvas = document.createElement("canvas");
    const paint = async (at) => {
      showAt(at);
      await paintSvg(standaloneSvg(getSvg()), canvas);
    };
    try {
      const signal = stop.current.signal;
      const blob = await recordVideo({ canvas, seconds, paint, onProgress: setPart, signal });
      saveBlob(blob, `${fileName(name)}.webm`);
    } finally {
      setPart(null);
    }
  };
  useEffect(() => () => stop.current?.abort(), []);
  const isLong = seconds > LONGEST_VIDEO;
  const hint = isLong
    ? `The video would take ${Math.round(seconds)} s: choose a shorter window or a higher speed`
    : `Records ${number(seconds, 2)} s of video`;
  return html`${
      part !== null &&
      html`<progress max="1" value=${part} aria-label="Recording"></progress>
        <button type="button" onClick=${() => stop.current.abort()}>Cancel</button>`
    }
    <${Button} isQuiet onClick=${record} disabled=${isLong || part !== null} title=${hint}
      >WebM<//
    >`;
}

export function Animation() {
  const context = useResult();
  const { result } = context;
  const wanted = useChannels(result);
  return html`<section aria-label="In slow motion">
    ${
      wanted.missing.length > 0
        ? html`<p>
            ${`Nothing to play: this result does not contain ${wanted.missing.join(", ")}.`}
          </p>`
        : html`<${Player} context=${context} wanted=${wanted} />`
    }
  </section>`;
}

function Player({ context, wanted }) {
  const { result, path, ledger, change, signal } = context;
  const { scene, summary, plan, sample_rate: rate } = result;
  const [, redraw] = useState(0);
  const [error, setError] = useState(null);
  const pieces = useMemo(
    () =>
      new Pieces({
        path,
        channels: wanted.channels,
        rate,
        signal,
        onChange: () => redraw((count) => count + 1),
        onError: setError,
      }),
    [result.id],
  );
  const player = usePlayer(context, pieces);
  const { instant, window, isPlaying, isLooping, pace } = player;
  const poser = useRef(null);
  const box = useRef(null);
  const isHere = instant !== null && error === null && pieces.has(instant, window.to);
  const pose = isHere ? poseAt(pieces, wanted, result, instant, pace) : null;
  useEffect(() => {
    if (pose) poser.current?.(pose);
  });
  useEffect(() => {
    if (error) player.run(false);
  }, [error]);
  const getSvg = () => box.current.querySelector("svg");
  const showAt = (part) => {
    const at = window.from + part * (window.to - window.from);
    if (pieces.has(at, window.to)) poser.current(poseAt(pieces, wanted, result, at, pace));
  };
  const goTo = (step) => async () => {
    const found = await neighbour(ledger, window, instant, step);
    if (found !== null) change({ impact: found, t: null }, true);
  };
  const onKey = (event) => {
    if (event.key !== " ") return;
    event.preventDefault();
    player.run(!isPlaying);
  };
  const time = instant === null ? "" : `${instant.toFixed(5)} s`;
  return html`<div role="group" aria-label="Player" class="player">
    <div ref=${box}>
      <${Drawing} scene=${scene} plan=${plan} stroke=${summary.peak_displacement} poser=${poser} />
    </div>
    <input
      type="range"
      aria-label="Instant"
      aria-valuetext=${time}
      min=${window.from}
      max=${window.to}
      step=${(window.to - window.from) / 1000}
      value=${instant ?? window.from}
      onInput=${(event) => {
        player.run(false);
        player.seek(event.currentTarget.value);
      }}
      onChange=${player.write}
      onKeyDown=${onKey}
    />
    <div class="row">
      <button type="button" class="primary play" onClick=${() => player.run(!isPlaying)}>
        ${isPlaying ? "Pause" : "Play"}
      </button>
      ${
        ledger.isListed &&
        html`<${IconButton} label="To the impact before" onClick=${goTo(-1)}>|◀<//>
          <${IconButton} label="To the impact after" onClick=${goTo(1)}>▶|<//>`
      }
      <${IconButton}
        label="Loop"
        pressed=${isLooping}
        onClick=${() => player.setIsLooping(!isLooping)}
        >Loop<//
      >
      <label class="pace"
        ><span class="visually-hidden">Speed</span>
        <select
          value=${pace}
          onChange=${(event) => player.setPace(Number(event.currentTarget.value))}
        >
          ${PACES.map((one) => html`<option value=${one}>${one === 1 ? "1" : `1/${one}`}</option>`)}
        </select></label
      >
      <span class="actions">
        ${canRecord() && html`<${Recorder} seconds=${(window.to - window.from) * pace} name="motion" getSvg=${getSvg} showAt=${showAt} />`}
      </span>
    </div>
    ${error && html`<${Failure} error=${error} />`}
    <dl class="figures">
      ${(pose ? figuresOf(pose, wanted, scene, instant) : [["Time", "loading …"]]).map(
        ([label, value]) =>
          html`<div>
            <dt>${label}</dt>
            <dd>${value}</dd>
          </div>`,
      )}
    </dl>
  </div>`;
}
