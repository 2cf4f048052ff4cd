// What all parts of a result's page share: the result, its impacts, the view that the address holds, and how to change it.
import { setQuery, read } from "../address.js";
import { get } from "../api.js";
import { createContext, useContext, useMemo, useState } from "../ui/preact.js";
import { createStore } from "../ui/store.js";
import { Ledger } from "./ledger.js";

export const ResultContext = createContext(null);
export const useResult = () => useContext(ResultContext);

// The latest jobs of a result.
export async function jobsOf(id, signal) {
  return (await get("v1/jobs", { result: id, limit: 20 }, signal)).jobs;
}

// {result, path, query, change, ledger, jobs (a promise of the latest), signal}: `query` is the address as it is now; change()
// writes to it, and what shows the context is drawn again. `shown` is a store of the part of the time that charts show, null is all.
export function useResultContext(result, signal, jobs) {
  const [, redraw] = useState(0);
  const path = `v1/results/${result.id}`;
  const kept = useMemo(() => {
    return { ledger: new Ledger({ path, result }), shown: createStore(null) };
  }, [result.id]);
  const change = (changes, push = false) => {
    setQuery(changes, push);
    redraw((count) => count + 1);
  };
  return { result, path, query: read().query, change, signal, jobs, ...kept };
}

// The window of time in view: {from, to, end}; the whole unless the query says otherwise.
export function windowOf(result, query) {
  const end = (result.count - 1) / result.sample_rate;
  const within = (text, initial) => {
    const value = text === undefined || text === "" ? initial : Number(text);
    return Math.min(end, Math.max(0, Number.isFinite(value) ? value : initial));
  };
  const from = within(query.from, 0);
  const to = within(query.to, end);
  return from < to ? { from, to, end } : { from: 0, to: end, end };
}

// Names of channels: with several storeys or dampers each has its number.
export function channelNames({ scene, channels }) {
  const storeys = [scene.structure.masses ?? scene.structure.mass].flat().length;
  const { dampers } = scene;
  const isNumbered = storeys > 1 || dampers.length > 1;
  const name = (word, number) => (isNumbered ? `${word}_${number}` : word);
  return {
    storeys,
    has: (channel) => channels.includes(channel),
    ofStorey: (word, number) => name(word, number),
    ofDamper: (word, number) => name(word, number),
  };
}
