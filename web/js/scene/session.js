// A scene while it is edited: kept in the address, checked by the service a moment after each change, run from here.
import { go } from "../address.js";
import { check, submit } from "../api.js";
import { makeDraft } from "../form/draft.js";
import { createStore } from "../ui/store.js";
import { makeHistory } from "./history.js";
import { keep, open, sponge } from "./state.js";

const PAUSE = 250; // ms without a change

// `status` is a store of {text, outcome: {answer}, {faults} or {error}, loadError, isRunning}.
export function makeSession(signal) {
  const draft = makeDraft(sponge(), signal);
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
      draft.say(null, errors);
      status.patch({ text: "", outcome: errors.length > 0 ? { faults: errors } : { error } });
    }
  }
  function settle() {
    status.patch({ text: "Being worked out …" });
    ask(check, (answer) => {
      draft.say(answer, []);
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
    await ask(submit, ({ id, status: state, result }) =>
      go(state === "successful" ? `results/${result}` : `jobs/${id}`),
    );
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
        return sponge();
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
