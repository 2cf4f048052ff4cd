// Values that several parts share: a store tells its readers of every change.
export function createStore(initial) {
  let value = initial;
  const listeners = new Set();
  return {
    get: () => value,
    // set(next) or set((value) => next); readers are called where the value is another one.
    set(next) {
      const changed = typeof next === "function" ? next(value) : next;
      if (Object.is(changed, value)) return;
      value = changed;
      for (const listener of [...listeners]) listener(value);
    },
    // Merges members into an object.
    patch(members) {
      this.set({ ...value, ...members });
    },
    // Returns a function that ends the subscription.
    subscribe(listener) {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },
  };
}
