// Undo and redo of a draft: scenes as they were, a series of quick changes being one step.
const PAUSE = 600; // ms without a change: what follows is another step
const MOST = 100;

export function makeHistory(draft) {
  let past = [];
  let future = [];
  let present = JSON.stringify(draft.scene);
  let last = -Infinity;
  let isMoving = false;
  let isHeld = false;
  const listeners = new Set();
  const notify = () => listeners.forEach((listener) => listener());
  draft.onChange(({ pointer }) => {
    if (pointer === undefined || isMoving) return;
    const next = JSON.stringify(draft.scene);
    if (next === present) return;
    const now = performance.now();
    if (now - last > PAUSE) past = [...past, present].slice(-MOST);
    last = isHeld ? Infinity : now;
    present = next;
    future = [];
    notify();
  });
  function move(from, to) {
    if (from.length === 0) return;
    to.push(present);
    present = from.pop();
    last = -Infinity;
    isMoving = true;
    draft.replace(JSON.parse(present));
    isMoving = false;
    notify();
  }
  return {
    undo: () => move(past, future),
    redo: () => move(future, past),
    get canUndo() {
      return past.length > 0;
    },
    get canRedo() {
      return future.length > 0;
    },
    // While it is held all changes are one step, however long it takes.
    hold(on) {
      isHeld = on;
      last = -Infinity;
    },
    // What is there now is where it begins: the scene was loaded.
    restart() {
      past = [];
      future = [];
      present = JSON.stringify(draft.scene);
      last = -Infinity;
      notify();
    },
    onChange(listener) {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },
  };
}
