// The service's examples to choose a scene from, the paper's figures first.
import { link } from "../address.js";
import { get } from "../api.js";
import { Loaded } from "../ui/controls.js";
import { html, useEffect, useRef } from "../ui/preact.js";
import { useLoaded } from "../ui/store.js";

const GROUPS = [
  ["The paper", /Li and Darby/],
  [
    "Studies",
    /^(sweep|ensemble|sensitivity|compare|tradeoff|optimize|calibrate|response|fragility)_/,
  ],
  ["Others", /./],
];

const groupOf = ({ name, title }) =>
  GROUPS.find(([, pattern]) => pattern.test(`${name} ${title}`))[0];

export function ExamplesDialog({ onClose }) {
  const dialog = useRef(null);
  const loaded = useLoaded(async (signal) => {
    const { examples } = await get("v1/examples", null, signal);
    return examples.sort((a, b) => a.title.localeCompare(b.title, "en", { numeric: true }));
  }, []);
  useEffect(() => dialog.current.showModal(), []);
  const close = () => dialog.current.close();
  return html`<dialog class="wide" aria-label="Examples" ref=${dialog} onClose=${onClose}>
    <button type="button" onClick=${close}>Close</button>
    <${Loaded} loaded=${loaded}>
      ${(examples) =>
        GROUPS.map(
          ([heading]) =>
            html`<h3>${heading}</h3>
              <ul>
                ${examples
                  .filter((one) => groupOf(one) === heading)
                  .map(
                    ({ name, title }) =>
                      html`<li>
                        <a href=${link("scene", { example: name })} onClick=${close}>${title}</a>
                      </li>`,
                  )}
              </ul>`,
        )}
    <//>
  </dialog>`;
}
