// A result's motion at any instant: samples in pieces, fetched when they are needed and the next one ahead.
import { ask } from "../api.js";
import { readNpy } from "../result/series.js";
import { limit } from "./model.js";

const PIECE = 6000; // numbers, few so that the first piece comes soon
const MAX_PIECES = 8; // kept
const PAUSE = 3000; // ms between two tries

// `channels` are names; at(t) is null while the piece is on its way, then (name) -> value at t; `onPiece()` is called when one
// has come, `onFailure(error)` when none does, `onPause()` when it is time to ask again.
export function makeFrames({ path, rate, channels, end, signal, onPiece, onFailure, onPause }) {
  const length = Math.max(1, Math.floor(PIECE / Math.max(1, channels.length))) / rate; // of a piece (s)
  const pieces = new Map(); // by number: null while on its way
  let pausedUntil = 0; // after a failure
  async function load(number) {
    pieces.set(number, null);
    const from = number * length;
    const query = { channels: channels.join(), from, to: Math.min(end, from + length + 1 / rate) };
    try {
      const response = await ask("GET", `${path}/series.npy`, { query, signal });
      const [time, ...columns] = readNpy(await response.arrayBuffer());
      pieces.set(number, { start: time[0], columns });
      for (const old of pieces.keys()) {
        if (pieces.size <= MAX_PIECES) break;
        if (pieces.get(old) && Math.abs(old - number) > 2) pieces.delete(old);
      }
      onPiece();
    } catch (error) {
      pieces.delete(number);
      if (error.name === "AbortError") return;
      // A server that is away is asked again after a while, one that refuses is not.
      const isAway = error.status === 0 || error.status >= 500;
      pausedUntil = isAway ? performance.now() + PAUSE : Infinity;
      if (isAway) setTimeout(() => signal.aborted || onPause(), PAUSE + 50);
      onFailure(error);
    }
  }
  function piece(number) {
    if (number < 0 || number * length > end) return undefined;
    if (!pieces.has(number) && performance.now() >= pausedUntil) load(number);
    return pieces.get(number);
  }
  return {
    at(t, isAhead = true) {
      const number = Math.floor(limit(t, 0, end) / length);
      const held = piece(number);
      if (!held) return null;
      if (isAhead && t > (number + 0.5) * length) piece(number + 1);
      const place = (t - held.start) * rate;
      const last = held.columns[0].length - 1;
      const low = limit(Math.floor(place), 0, last);
      const part = limit(place - low, 0, 1);
      return (name) => {
        const values = held.columns[channels.indexOf(name)];
        return values[low] + part * (values[Math.min(low + 1, last)] - values[low]);
      };
    },
  };
}

// What a drawing needs of a result: {channels, missing, stateOf(value)}, the state from the values of these channels.
export function channelsOf(model, names) {
  const displacement = (index) => names.of("displacement", index + 1);
  const own = (index) => names.of("damper_displacement", index + 1);
  const force = (index) => names.of("contact_force", index + 1);
  const storeys = model.storeys.map(({ index }) => index);
  const drawn = model.dampers.map(({ index }) => index);
  const needed = [...storeys.map(displacement), ...drawn.map(own)];
  const forces = drawn.filter((index) => names.has(force(index)));
  function stateOf(value) {
    const state = { displacements: [], positions: [], forces: [] };
    for (const index of storeys) state.displacements[index] = value(displacement(index));
    for (const index of drawn)
      state.positions[index] =
        value(own(index)) -
        state.displacements[model.dampers.find((one) => one.index === index).storey];
    for (const index of forces) state.forces[index] = value(force(index));
    return state;
  }
  return {
    channels: [...new Set([...needed, ...forces.map(force)])],
    missing: needed.filter((name) => !names.has(name)),
    stateOf,
  };
}
