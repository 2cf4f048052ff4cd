// A document while it is edited: values by JSON Pointer, what the service said of it, and who wants to know.
import { useEffect, useRef } from "../ui/preact.js";
import { useRedraw } from "../ui/hooks.js";

export const parts = (pointer) =>
  pointer
    .split("/")
    .slice(1)
    .map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));
const isHolder = (value) => value !== null && typeof value === "object";

// undefined takes a member out, and what is then empty around it. Holders that are missing are made.
function put(holder, [name, ...deeper], value) {
  if (deeper.length === 0) {
    if (value === undefined) delete holder[name];
    else holder[name] = value;
    return;
  }
  if (!isHolder(holder[name])) holder[name] = {};
  put(holder[name], deeper, value);
  const isEmpty = !Array.isArray(holder) && Object.keys(holder[name]).length === 0;
  if (value === undefined && isEmpty) delete holder[name];
}

const isWithin = (inner, outer) => `${inner}/`.startsWith(`${outer}/`);

// A listener gets {pointer, isMoving} after a change ("" is all of it), {check} after a dry run's answer or the service's faults.
export function makeDraft(scene) {
  const listeners = new Set();
  const draft = {
    scene,
    faults: [],
    check: null,
    version: 0, // counts all news
    epoch: 0, // counts what replaced all of it
    get: (pointer) =>
      parts(pointer).reduce(
        (at, name) => (isHolder(at) && Object.hasOwn(at, name) ? at[name] : undefined),
        draft.scene,
      ),
    // `isMoving`: one change of many that follow each other, as of what is dragged.
    set(pointer, value, isMoving = false) {
      put(draft.scene, parts(pointer), value);
      notify({ pointer, isMoving });
    },
    move: (pointer, value) => draft.set(pointer, value, true),
    replace(next) {
      draft.scene = next;
      draft.epoch++;
      notify({ pointer: "" });
    },
    setCheck(check, faults) {
      Object.assign(draft, { check, faults });
      notify({ check });
    },
    faultsAt: (pointer) => draft.faults.filter((fault) => isWithin(fault.pointer, pointer)),
    onChange(listener) {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },
  };
  function notify(news) {
    draft.version++;
    for (const listener of [...listeners]) listener(news);
  }
  return draft;
}

// The value at a place; the component is drawn again when that changes, or what is around it or the faults there, with `deep`
// also when what is in it does.
export function useDraft(draft, pointer, deep = true) {
  const redraw = useRedraw();
  const drawn = useRef(null);
  const faults = JSON.stringify(draft.faultsAt(pointer));
  drawn.current = { version: draft.version, faults };
  useEffect(() => {
    const follow = ({ pointer: changed }) => {
      if (changed === undefined) {
        if (JSON.stringify(draft.faultsAt(pointer)) !== drawn.current.faults) redraw();
      } else if (isWithin(pointer, changed) || (deep && isWithin(changed, pointer))) redraw();
    };
    if (drawn.current.version !== draft.version) redraw(); // it may have changed since it was drawn
    return draft.onChange(follow);
  }, [draft, pointer]);
  return draft.get(pointer);
}

// Draws a component again after each of these news of a draft.
export function useNews(draft, matters = () => true) {
  const redraw = useRedraw();
  useEffect(() => {
    redraw();
    return draft.onChange((news) => matters(news) && redraw());
  }, [draft]);
}
