// The state of views: stores, loaded data, the address' query, the width of an element, ids.
import { read, setQuery } from "../address.js";
import { useEffect, useLayoutEffect, useReducer, useRef, useState } from "./preact.js";

// [count, increase()]: the view is drawn again with each increase.
export const useCount = () => useReducer((count) => count + 1, 0);

// A function that draws the view again.
export const useRedraw = () => useCount()[1];

// The part of a store that a view shows; the view is drawn again when that part changes.
export function useStore(store, select = (value) => value) {
  const redraw = useRedraw();
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

// The result of a promise: {data, error, isLoading, retry()}. `load(signal)` runs when `keys` or `again` change; the earlier one is
// aborted, its data stay until the new ones are here.
export function useLoaded(load, keys, again = 0) {
  const [turn, retry] = useCount();
  const [state, setState] = useState({ data: null, error: null, isLoading: true, retry });
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

// {query, change(changes, push)}: the address' query as it is now, and what writes to it and draws the view again.
export function useQuery() {
  const redraw = useRedraw();
  const change = (changes, push = false) => {
    setQuery(changes, push);
    redraw();
  };
  return { query: read().query, change };
}

// The width of an element in pixels, between bounds; the view is drawn again when it changes.
export function useWidth(ref, min = 0, max = Infinity) {
  const [width, setWidth] = useState(0);
  useLayoutEffect(() => {
    const measure = () => {
      const available = ref.current?.clientWidth ?? 0;
      setWidth(Math.round(Math.min(max, Math.max(min, available))));
    };
    measure();
    const observer = new ResizeObserver(measure);
    observer.observe(ref.current);
    return () => observer.disconnect();
  }, []);
  return width;
}

let ids = 0;

// The id of an element of this view: a word with a number of its own.
export function useId(word) {
  const id = useRef(null);
  id.current ??= `${word}-${++ids}`;
  return id.current;
}
