// Stores and loaded data as the state of views.
import { useEffect, useLayoutEffect, useReducer, useRef } from "./preact.js";

export { createStore } from "../store.js";

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
  // Before the browser paints: what is asked for is on its way meanwhile.
  useLayoutEffect(() => {
    const stop = new AbortController();
    if (!held.current.isLoading) set({ ...held.current, error: null, isLoading: true });
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
