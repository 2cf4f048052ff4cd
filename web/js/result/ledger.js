// A result's ledger of impacts, in windows, for it may be long. Each has its `number` from 1.
import { get } from "../api.js";

const MAX_ANSWERS = 60; // kept

export function makeLedger(path, { links, summary }) {
  const kept = new Map(); // promises of answers, by their queries
  const isListed = Boolean(links.impacts);
  async function ask(query) {
    if (!isListed) return { count: summary?.impacts ?? 0, resting: 0, impacts: [], matching: 0 };
    const key = JSON.stringify(query);
    if (kept.size > MAX_ANSWERS) kept.clear();
    if (!kept.has(key)) kept.set(key, get(`${path}/impacts.json`, query));
    kept.get(key).catch(() => kept.delete(key));
    return kept.get(key);
  }
  return {
    isListed,
    count: () => ask({ limit: 1 }),
    // The first so many contacts that meet [from, to], and how many there are.
    async window(from, to, limit) {
      const { impacts, matching: count } = await ask({ from, to, limit });
      return { impacts, count };
    },
    // By its number, else null.
    async at(number) {
      if (!(number >= 1)) return null;
      return (await ask({ first: Math.round(number), limit: 1 })).impacts[0] ?? null;
    },
  };
}
