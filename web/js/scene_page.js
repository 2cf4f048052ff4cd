// A scene: described at the left, drawn at the right, run from here.
import { accuracyWidget } from "./accuracy.js";
import { go } from "./address.js";
import { check, schema, submit } from "./api.js";
import { button, failure, faults, fill, h, help, once, panel } from "./dom.js";
import { makeDraft } from "./draft.js";
import { examplesDialog } from "./examples.js";
import { focusField } from "./form.js";
import { outcome, places } from "./outcome.js";
import { bufferWidget } from "./picker.js";
import { recordWidget } from "./record_widget.js";
import { sceneForm } from "./scene_form.js";
import { keep, open, sponge } from "./scene_state.js";
import { drawing } from "./scene/editor.js";
import { makeHistory } from "./scene/history.js";
import { showLive } from "./scene/live.js";

const widgets = [[/^\/dampers.*buffer$/, bufferWidget], [/^\/excitation\/name$/, recordWidget], [/^\/accuracy$/, accuracyWidget]];

// The scene as text to edit, in step with the form while it is not typed in.
function jsonView(draft) {
  const name = "The scene as JSON", fault = h("p.fault", { role: "status" });
  const area = h("textarea.code", { rows: "28", spellcheck: "false", "aria-label": name, oninput() {
    fault.textContent = "";
    try {
      draft.replace(Object.assign({}, JSON.parse(area.value)));
    } catch (error) {
      fault.textContent = `No scene yet: ${error.message}`; // browsers name the line
    }
  } });
  const element = h("details.panel", null, h("summary", null, h("h2", null, name)), fault, area);
  return { element, refresh() {
    if (document.activeElement === area) return;
    fault.textContent = "";
    area.value = JSON.stringify(draft.scene, null, 2);
  } };
}

async function show(host, address, signal) {
  const draft = makeDraft(sponge(), signal), json = jsonView(draft);
  const steps = h("div", null, "The form is on its way …"), drawn = h("div.panel.drawn");
  const live = h("div"), told = h("div"), state = h("p.hint", { role: "status" }), comes = h("div");
  const run = button("Run", () => runScene(), { class: "primary run", title: "Ctrl + Enter", "aria-keyshortcuts": "Control+Enter" });
  fill(host, help("Scene"), h("h1", null, "Scene"),
    h("p", null, "A free mass between two buffered stops in a structure: change what you like. ",
      button("Examples", examplesDialog), " ", run), told,
    h("div.scene", null, h("div", null, steps), h("div.beside", null, drawn, live,
      panel("Estimate", state, comes))));
  const past = makeHistory(draft);
  showLive(live, draft, past, signal);
  const picture = drawing(drawn, draft, past), draw = picture.show;
  draw();

  let timer, turn = 0, isEdited = false, isUnkept = false, loading;
  const goTo = (pointer) => focusField(steps, pointer);

  // Keeps the scene and asks the service; only the last question's answer counts.
  async function ask(question, answered) {
    const mine = ++turn, isLast = () => mine === turn && !signal.aborted;
    clearTimeout(timer);
    try {
      const fits = !isEdited || await keep(draft.scene, isLast);
      if (isLast()) isUnkept = false;
      const answer = await question(draft.scene);
      if (!isLast()) return;
      state.textContent = fits ? "" : "Too long for a link: copy the JSON to keep it.";
      answered(answer);
    } catch (error) {
      if (!isLast()) return;
      const { errors = [] } = error;
      draft.say(null, errors);
      state.textContent = "";
      fill(comes, errors.length > 0 ? places("bad", "To be mended before it runs", errors, goTo) : failure(error));
    }
  }
  function settle() {
    state.textContent = "Being worked out …";
    ask(check, (answer) => {
      draft.say(answer, []);
      outcome(comes, answer, goTo);
      draw();
    });
  }
  draft.onChange(({ pointer }) => {
    if (pointer === undefined) return;
    isEdited = isUnkept = true;
    draw();
    json.refresh();
    clearTimeout(timer);
    timer = setTimeout(settle, 250); // ms without a change
  });

  const runScene = once(async () => {
    run.ariaBusy = "true"; // not disabled: it keeps the focus
    state.textContent = "Running …";
    await loading;
    await ask(submit, ({ id, status, result }) => go(status === "successful" ? `results/${result}` : `jobs/${id}`));
    run.ariaBusy = "false";
    comes.querySelector(".bad")?.focus();
  });
  addEventListener("keydown", (event) => {
    const isCommand = event.ctrlKey || event.metaKey;
    // A field undoes what was typed in it by itself.
    if (isCommand && event.key.toLowerCase() === "z" && !event.target.matches("input:not([type=range]), textarea")) {
      event.preventDefault();
      if (event.shiftKey) past.redo();
      else past.undo();
    }
    if (event.key !== "Enter" || !isCommand) return;
    event.preventDefault();
    runScene();
  }, { signal });
  // Leaving a field keeps it at once: a link may be followed before the URL has it.
  steps.addEventListener("change", () => isUnkept && (history.replaceState(draft.scene, ""), settle()));

  async function load(query) {
    fill(told);
    turn++;
    isEdited = false;
    const mine = loading = open(query, history.state).catch((error) => faults(told)(error) ?? sponge()), scene = await mine;
    if (mine !== loading) return; // another one was asked for since
    const wasEdited = isEdited || history.state; // the URL may hold what was there before
    draft.replace(scene);
    isEdited = wasEdited;
    isUnkept = false;
    past.restart();
  }
  Promise.all([schema("scene"), load(address.query)]).then(([scene]) => {
    fill(steps);
    sceneForm(steps, { schema: scene, draft, widgets });
    steps.after(json.element);
  }).catch(faults(steps));
  return {
    change: ({ query }) => load(query),
    leave: () => (clearTimeout(timer), picture.leave()),
  };
}

export const page = { title: () => "Scene", show };
