// The service's examples as cards to choose a scene from, the paper's figures first.
import { link } from "../address.js";
import { get } from "../api.js";
import { Loaded, withSubscripts } from "../ui/controls.js";
import { html, useEffect, useRef } from "../ui/preact.js";
import { useLoaded } from "../ui/hooks.js";
import { capital, pretty, words } from "../units.js";
import { KINDS } from "../study/kinds.js";
import { modelOf } from "./model.js";

const GROUPS = [
  ["Li and Darby (2009)", /Li and Darby/],
  ["Studies", new RegExp(`^(${Object.keys(KINDS).join("|")})_`)],
  ["Others", /./],
];

const groupOf = ({ name, title }) =>
  GROUPS.find(([, pattern]) => pattern.test(`${name} ${title}`))[0];

// "Figure 6(b)" and "Free vibration from 15 mm, sponge" of a title.
function partsOf(title) {
  const [, head, rest] = /^(?:Li and Darby 2009[,:] )?(?:([^:]+): )?(.+)$/.exec(pretty(title));
  return head ? [head, rest] : [rest];
}

// The structure, the stops and the excitation in a few words.
function factsOf({ scene }) {
  const { count, dampers, base } = modelOf(scene);
  const stops = dampers.flatMap((damper) => damper.stops.map(({ name }) => name));
  return [
    count > 1 ? `${count} storeys` : "One mass",
    [...new Set(stops)].join(", ") || "no damper",
    base || "free vibration",
    scene.study && `study: ${words(scene.study.kind)}`,
  ];
}

const Card = ({ example, onChoose }) =>
  html`<li>
    <a href=${link("scene", { example: example.name })} onClick=${onChoose}>
      ${partsOf(example.title).map((part, at) => (at === 0 ? html`<strong>${capital(part)}</strong>` : html`<span>${withSubscripts(capital(part))}</span>`))}
      <small>${factsOf(example).filter(Boolean).join(" · ")}</small>
    </a>
  </li>`;

// Arrow keys go from card to card.
function moveOn(event) {
  const step = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1 }[event.key];
  if (!step) return;
  event.preventDefault();
  const cards = [...event.currentTarget.querySelectorAll("a")];
  cards.at((cards.indexOf(document.activeElement) + step) % cards.length).focus();
}

export function ExamplesDialog({ onClose }) {
  const dialog = useRef(null);
  const loaded = useLoaded(async (signal) => {
    const { examples } = await get("v1/examples", null, signal);
    return examples.sort((a, b) => a.title.localeCompare(b.title, "en", { numeric: true }));
  }, []);
  useEffect(() => dialog.current.showModal(), []);
  const close = () => dialog.current.close();
  return html`<dialog
    class="wide examples"
    aria-label="Examples"
    ref=${dialog}
    onClose=${onClose}
    onKeyDown=${moveOn}
  >
    <div class="panel-head">
      <h2>Examples</h2>
      <div class="actions"><button type="button" onClick=${close}>Close</button></div>
    </div>
    <${Loaded} loaded=${loaded}>
      ${(examples) =>
        GROUPS.map(
          ([heading]) =>
            html`<h3>${heading}</h3>
              <ul class="cards">
                ${examples
                  .filter((one) => groupOf(one) === heading)
                  .map((one) => html`<${Card} key=${one.name} example=${one} onChoose=${close} />`)}
              </ul>`,
        )}
    <//>
  </dialog>`;
}
