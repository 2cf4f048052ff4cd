// A result's ledger of impacts, in windows, for it may be long. Each has its `number` from 1.
import { get } from "../api.js";

export class Ledger {
  kept = new Map();
  constructor(context) {
    this.context = context;
  }

  get isListed() {
    return Boolean(this.context.result.links.impacts);
  }

  async ask(query) {
    const {
        kept,
        context: { path, result },
      } = this,
      key = JSON.stringify(query);
    if (!this.isListed)
      return { count: result.summary?.impacts ?? 0, resting: 0, impacts: [], matching: 0 };
    if (kept.size > 60) kept.clear();
    if (!kept.has(key)) kept.set(key, get(`${path}/impacts.json`, query));
    kept.get(key).catch(() => kept.delete(key));
    return kept.get(key);
  }

  count() {
    return this.ask({ limit: 1 });
  }

  // The first so many contacts that meet [from, to], and how many there are.
  async window(from, to, limit) {
    const { impacts, matching: count } = await this.ask({ from, to, limit });
    return { impacts, count };
  }

  // By its number, else null.
  async at(number) {
    return number >= 1
      ? ((await this.ask({ first: Math.round(number), limit: 1 })).impacts[0] ?? null)
      : null;
  }
}
