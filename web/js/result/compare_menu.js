// "Compare with …": the same scene with one thing changed is run, and both results are shown beside each other.
import { go, link } from "../address.js";
import { get, runScene } from "../api.js";
import { Button, Failure, Loaded, Menu } from "../ui/controls.js";
import { html, useState } from "../ui/preact.js";
import { useLoaded } from "../ui/hooks.js";

const MAX_MATERIALS = 30;

const plain = ({ study, title, labels, ...scene }) => scene;
const usedBy = (scene) =>
  scene.dampers
    .flatMap(({ buffer, left_buffer: left, right_buffer: right }) => [buffer, left, right])
    .map((buffer) => buffer?.material?.replace(/@.*/, ""));

// The scene with every stop of this material.
const withMaterial = (slug) => (scene) => ({
  ...scene,
  dampers: scene.dampers.map(({ left_buffer: left, right_buffer: right, buffer, ...damper }) => ({
    ...damper,
    buffer: slug,
  })),
});

const withContact = (model) => (scene) => ({ ...scene, contact: { ...scene.contact, model } });

// {label, change(scene)} for this scene.
function choicesOf(scene, plan, materials) {
  const used = usedBy(scene);
  const isImpulse = plan.contact_model === "impulse";
  return [
    ...materials
      .filter(
        ({ slug, restitution, status }) =>
          restitution !== null && status !== "deprecated" && !used.includes(slug),
      )
      .slice(0, MAX_MATERIALS)
      .map(({ slug, name }) => ({ label: name, change: withMaterial(slug) })),
    { label: "No damper", change: (whole) => ({ ...whole, dampers: [] }) },
    {
      label: isImpulse ? "Contacts that last" : "Contacts without duration",
      change: withContact(isImpulse ? "spring_damper" : "impulse"),
    },
  ];
}

// Made when the menu is opened: only then are materials asked for.
function Choices({ result, run }) {
  const { scene, plan, id } = result;
  const loaded = useLoaded(
    async (signal) => (await get("v1/materials", { limit: 200 }, signal)).materials,
    [id],
  );
  // The link comes first: preact takes what follows something that is loaded out of the page and puts it back, without the focus.
  return html`<a class="menu-link" href=${link("compare", { a: id })}>An earlier run …</a> ${
      scene.dampers.length > 0 &&
      html`<${Loaded} loaded=${loaded}>
        ${(materials) =>
          choicesOf(scene, plan, materials).map(
            (choice) =>
              html`<${Button} isQuiet onClick=${() => void run(choice)}>${choice.label}<//>`,
          )}
      <//>`
    }`;
}

export function CompareMenu({ result }) {
  const [state, setState] = useState({});
  const { scene, id } = result;
  const run = async ({ label, change }) => {
    setState({ running: label });
    try {
      go("compare", { a: id, b: await runScene(change(plain(scene))) });
    } catch (error) {
      setState({ error });
    }
  };
  if (state.running)
    return html`<span class="quiet" role="status">${`Running: ${state.running} …`}</span>`;
  return html`<${Menu} label="Compare with …"><${Choices} result=${result} run=${run} /><//>
    ${state.error && html`<${Failure} error=${state.error} />`}`;
}
