// Studies that begin from a result: what is asked, what it costs, and the way to its answer.
import { html } from "../ui/preact.js";
import { check, submit } from "../api.js";
import { Button, Failure, Menu } from "../ui/controls.js";
import { JobButton } from "../study/parts.js";
import { quantity } from "../units.js";

const SWEEP_POINTS = 58;
const round = (value) => Number(value.toPrecision(3));

// {name, label, text(scene), make(scene), isFor(scene)}: the member "study" of the scene.
const STUDIES = [
  {
    name: "sweep",
    label: "Sweep the clearance",
    isFor: ({ dampers }) => dampers[0]?.clearance > 0,
    text: ({ dampers: [{ clearance }] }) =>
      `${SWEEP_POINTS} runs with clearances from ${quantity(round(0.2 * clearance), "m")} to ${quantity(round(4 * clearance), "m")}`,
    make: ({ dampers: [{ clearance }] }) => {
      const ends = { from: round(0.2 * clearance), to: round(4 * clearance) };
      return {
        kind: "sweep",
        axes: [{ pointer: "/dampers/0/clearance", ...ends, count: SWEEP_POINTS }],
      };
    },
  },
  {
    name: "compare",
    label: "Compare contact models",
    isFor: ({ dampers }) => dampers.length > 0,
    text: () => "The same scene with every contact model and rule of separation",
    make: () => ({ kind: "compare" }),
  },
  {
    name: "sensitivity",
    label: "What each input changes",
    isFor: ({ dampers }) => dampers.length > 0,
    text: () => "How the response changes with e, the contact time and the masses",
    make: () => ({ kind: "sensitivity" }),
  },
  {
    name: "tradeoff",
    label: "Error against cost",
    isFor: () => true,
    text: () => "Every solver and step, measured on this scene",
    make: () => ({ kind: "tradeoff", repeats: 2 }),
  },
];

// A button for the first study, a menu for the others; what is chosen says its cost before it starts.
export function StudyButtons({ scene, onChoose }) {
  const [first, ...others] = STUDIES.filter((study) => study.isFor(scene));
  const choose = async (study) => {
    const { study: _, title, labels, ...rest } = scene;
    const body = { ...rest, study: study.make(scene) };
    try {
      onChoose({ study, body, cost: (await check(body)).cost });
    } catch (error) {
      onChoose({ error }); // the menu may be closed by now
    }
  };
  return html`<${Button} onClick=${() => choose(first)}>${first.label}<//> ${
      others.length > 0 &&
      html`<${Menu} label="More studies">
        ${others.map((study) => html`<${Button} isQuiet onClick=${() => choose(study)}>${study.label}<//>`)}
      <//>`
    }`;
}

export function StudyStart({ scene, chosen, onClose }) {
  const { study, body, cost, error } = chosen;
  if (error) return html`<${Failure} error=${error} />`;
  return html`<div class="notice study-start" role="status">
    <span
      >${`${study.text(scene)}: about ${quantity(cost.cpu_seconds, "s", 2)} of processor time.`}</span
    >
    <${JobButton} isPrimary label="Start" make=${() => submit(body)} />
    <${Button} isQuiet onClick=${onClose}>Not now<//>
  </div>`;
}
