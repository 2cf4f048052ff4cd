// A scene while it is edited: kept in the address, checked by the service a moment after each change, run from here.
import { go, jobPath } from "../address.js";
import { check, submit } from "../api.js";
import { makeDraft } from "../form/draft.js";
import { createStore } from "../store.js";
import { keep, open, initialScene } from "./url.js";

const PAUSE = 250; // ms without a change

// `status` is a store of {text, outcome: {answer}, {faults} or {error}, loadError, isRunning}.
export function makeSession(signal) {
  const draft = makeDraft(initialScene());
  const past = makeHistory(draft);
  const status = createStore({ text: "", outcome: null, loadError: null, isRunning: false });
  let timer = null;
  let turn = 0;
  let edits = 0;
  let isEdited = false;
  let isUnkept = false;
  let loading = null;
  let running = null;

  // Keeps the scene and asks the service; only the last question's answer counts.
  async function ask(question, answered) {
    const mine = ++turn;
    const asked = edits;
    const isCurrent = () => question !== check || asked === edits; // what was checked is still there
    const isLast = () => mine === turn && isCurrent() && !signal.aborted;
    clearTimeout(timer);
    try {
      const fits = !isEdited || (await keep(draft.scene, isLast));
      if (isLast()) isUnkept = false;
      const answer = await question(draft.scene);
      if (!isLast()) return;
      status.patch({ text: fits ? "" : "Too long for a link: copy the JSON to keep it." });
      answered(answer);
    } catch (error) {
      if (!isLast()) return;
      const { errors = [] } = error;
      draft.setCheck(null, errors);
      status.patch({ text: "", outcome: errors.length > 0 ? { faults: errors } : { error } });
    }
  }
  function settle() {
    status.patch({ text: "Being worked out …" });
    ask(check, (answer) => {
      draft.setCheck(answer, []);
      status.patch({ outcome: { answer } });
    });
  }
  draft.onChange(({ pointer }) => {
    if (pointer === undefined) return;
    edits++;
    isEdited = true;
    isUnkept = true;
    clearTimeout(timer);
    timer = setTimeout(settle, PAUSE);
  });
  signal.addEventListener("abort", () => clearTimeout(timer));

  async function start() {
    status.patch({ isRunning: true, text: "Running …" });
    await loading;
    await ask(submit, (job) => go(jobPath(job)));
    status.patch({ isRunning: false });
  }
  return {
    draft,
    past,
    status,
    // Not begun again while it goes on: some click twice.
    run() {
      running ??= start().finally(() => {
        running = null;
      });
      return running;
    },
    // Leaving a field keeps it at once: a link may be followed before the address has it.
    keepNow() {
      if (!isUnkept) return;
      history.replaceState(draft.scene, "");
      settle();
    },
    async load(query) {
      status.patch({ loadError: null });
      turn++;
      isEdited = false;
      const mine = open(query, history.state).catch((error) => {
        if (error.name !== "AbortError") status.patch({ loadError: error });
        return initialScene();
      });
      loading = mine;
      const scene = await mine;
      if (mine !== loading || signal.aborted) return; // another one was asked for since
      const wasEdited = isEdited || history.state; // the address may hold what was there before
      draft.replace(scene);
      isEdited = wasEdited;
      isUnkept = false;
      past.restart();
    },
  };
}

const STEP_PAUSE = 600; // ms without a change: what follows is another step
const MAX_STEPS = 100;

function makeHistory(draft) {
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
    if (now - last > STEP_PAUSE) past = [...past, present].slice(-MAX_STEPS);
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
