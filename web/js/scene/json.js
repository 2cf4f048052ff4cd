// The scene as text to edit, in step with the form while it is not typed in.
import { useNews } from "../form/draft.js";
import { html, useRef, useState } from "../ui/preact.js";

export function JsonView({ draft }) {
  const [isOpen, setIsOpen] = useState(false);
  return html`<details class="panel">
    <summary onClick=${() => setIsOpen(true)}><h2>The scene as JSON</h2></summary>
    ${isOpen && html`<${JsonText} draft=${draft} />`}
  </details>`;
}

function JsonText({ draft }) {
  const area = useRef(null);
  const typed = useRef("");
  const [fault, setFault] = useState("");
  useNews(draft, ({ pointer }) => pointer !== undefined);
  const isTyping = area.current !== null && document.activeElement === area.current;
  if (!isTyping) typed.current = JSON.stringify(draft.scene, null, 2);
  const input = (event) => {
    typed.current = event.currentTarget.value;
    setFault("");
    try {
      draft.replace(Object.assign({}, JSON.parse(typed.current)));
    } catch (error) {
      setFault(`No scene yet: ${error.message}`); // browsers name the line
    }
  };
  return html`<p class="fault" role="status">${fault}</p>
    <textarea
      class="code"
      rows="28"
      spellcheck="false"
      aria-label="The scene as JSON"
      ref=${area}
      value=${typed.current}
      onInput=${input}
    ></textarea>`;
}
