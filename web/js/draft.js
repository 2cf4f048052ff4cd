// A document while it is edited: values by JSON Pointer, what the service said of it, and who wants to know.
export const parts = (pointer) => pointer.split("/").slice(1).map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));
const isHolder = (value) => value !== null && typeof value === "object";

// undefined takes a member out, and what is then empty around it. Holders that are missing are made.
function put(holder, [name, ...deeper], value) {
  if (deeper.length > 0) {
    if (!isHolder(holder[name])) holder[name] = {};
    put(holder[name], deeper, value);
    if (value !== undefined || Array.isArray(holder) || Object.keys(holder[name]).length > 0) return;
  } else if (value !== undefined) return (holder[name] = value);
  delete holder[name];
}

// A listener gets {pointer, isMoving} after a change ("" is all of it), {check} after a dry run's answer or the service's faults.
export function makeDraft(scene, signal = null) {
  const listeners = new Set();
  const news = (what) => [...listeners].forEach((listener) => listener(what));
  const draft = {
    scene, faults: [], check: null, signal,
    get: (pointer) => parts(pointer)
      .reduce((at, name) => (isHolder(at) && Object.hasOwn(at, name) ? at[name] : undefined), draft.scene),
    set(pointer, value) {
      put(draft.scene, parts(pointer), value);
      news({ pointer });
    },
    // A change of many that follow each other, as of what is dragged.
    move(pointer, value) {
      put(draft.scene, parts(pointer), value);
      news({ pointer, isMoving: true });
    },
    replace(next) {
      draft.scene = next;
      news({ pointer: "" });
    },
    say(check, faults) {
      Object.assign(draft, { check, faults });
      news({ check });
    },
    faultsAt: (pointer) => draft.faults.filter((fault) => `${fault.pointer}/`.startsWith(`${pointer}/`)),
    onChange(listener) {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },
  };
  return draft;
}
