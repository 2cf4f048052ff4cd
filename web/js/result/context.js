// What all parts of a result's page share: the result, its impacts, the view that the address holds, and how to change it.
import { get } from "../api.js";
import { useQuery } from "../ui/hooks.js";
import { createContext, useContext, useMemo } from "../ui/preact.js";
import { createStore } from "../store.js";
import { channelNamer } from "../scene/channels.js";
import { makeLedger } from "./ledger.js";

export const ResultContext = createContext(null);
export const useResult = () => useContext(ResultContext);

// The latest jobs of a result.
export async function jobsOf(id, signal) {
  return (await get("v1/jobs", { result: id, limit: 20 }, signal)).jobs;
}

// {result, path, query, change, ledger, jobs (a promise of the latest), signal}: `query` is the address as it is now; change()
// writes to it, and what shows the context is drawn again. `shown` is a store of the part of the time that charts show, null is all.
export function useResultContext(result, signal, jobs) {
  const path = `v1/results/${result.id}`;
  const kept = useMemo(
    () => ({ ledger: makeLedger(path, result), shown: createStore(null) }),
    [result.id],
  );
  return { result, path, ...useQuery(), signal, jobs, ...kept };
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

export const channelNames = ({ scene, channels }) => ({
  has: (channel) => channels.includes(channel),
  of: channelNamer(scene),
});
