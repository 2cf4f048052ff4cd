// Values that several views share: a store tells its readers of every change.
import { useEffect, useReducer, useRef } from "./preact.js";

export function createStore(initial) {
  let value = initial;
  const listeners = new Set();
  return {
    get: () => value,
    // set(next) or set((value) => next); readers are told where the value is another one.
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

// The part of a store that a view shows; the view is drawn again when that part changes.
export function useStore(store, select = (value) => value) {
  const [, redraw] = useReducer((count) => count + 1, 0);
  const selected = select(store.get());
  const latest = useRef(null);
  latest.current = { selected, select };
  useEffect(() => {
    const compare = () => {
      if (!Object.is(latest.current.select(store.get()), latest.current.selected)) redraw();
    };
    compare(); // it may have changed between drawing and subscribing
    return store.subscribe(compare);
  }, [store]);
  return selected;
}

// What a promise brings: {data, error, isLoading, retry()}. `load(signal)` runs when `keys` change; the earlier one is aborted, its
// data stay until the new ones are here.
export function useLoaded(load, keys, again = 0) {
  const [turn, retry] = useReducer((count) => count + 1, 0);
  const [state, setState] = useReducer((_, next) => next, {
    data: null,
    error: null,
    isLoading: true,
    retry,
  });
  const held = useRef(state);
  const set = (next) => {
    held.current = next;
    setState(next);
  };
  useEffect(() => {
    const stop = new AbortController();
    set({ ...held.current, error: null, isLoading: true });
    Promise.resolve()
      .then(() => load(stop.signal))
      .then(
        (data) => !stop.signal.aborted && set({ data, error: null, isLoading: false, retry }),
        (error) => !stop.signal.aborted && set({ data: null, error, isLoading: false, retry }),
      );
    return () => stop.abort();
  }, [...keys, again, turn]);
  return state;
}
