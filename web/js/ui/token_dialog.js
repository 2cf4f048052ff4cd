// The token, asked for where the service wants one, kept until the tab is closed.
import { setToken, token } from "../api.js";
import { html, render, useEffect, useRef } from "./preact.js";

function TokenDialog({ onClose }) {
  const dialog = useRef(null);
  const input = useRef(null);
  useEffect(() => dialog.current.showModal(), []);
  const close = () => {
    const { returnValue } = dialog.current;
    const isUsed = returnValue === "use";
    if (returnValue) setToken(isUsed ? input.current.value.trim() : "");
    onClose(isUsed);
  };
  return html`<dialog ref=${dialog} onClose=${close}>
    <form method="dialog">
      <h2>A token is asked for</h2>
      <p>The administrator of this server creates one with <code>impactd token create</code>.</p>
      <label
        >Token
        <input
          type="password"
          autocomplete="off"
          required
          pattern="\\s*[!-~]+\\s*"
          title="A token has only letters, digits and signs of ASCII, without spaces"
          ref=${input}
      /></label>
      <div class="row">
        <button class="primary" value="use">Use it</button>
        <button value="" formnovalidate>Not now</button>
        ${token() && html`<button value="forget" formnovalidate>Forget the one in use</button>`}
      </div>
    </form>
  </dialog>`;
}

let pending = null; // several requests ask at once

// A promise of whether there is a token now.
export function askToken() {
  pending ??= new Promise((resolve) => {
    const host = document.body.appendChild(document.createElement("div"));
    const close = (isUsed) => {
      pending = null;
      render(null, host);
      host.remove();
      resolve(isUsed);
    };
    render(html`<${TokenDialog} onClose=${close} />`, host);
  });
  return pending;
}
