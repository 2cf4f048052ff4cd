// A hint on the first visit: what to do here, until it is closed or the reader goes on. The browser remembers it.
import { html, render, useState } from "./preact.js";

const KEY = "impactd.welcome";
const isKnown = () => localStorage.getItem(KEY) !== null;
const remember = () => localStorage.setItem(KEY, "seen");

function Welcome() {
  const [isOpen, setIsOpen] = useState(true);
  if (!isOpen) return null;
  const close = () => {
    remember();
    setIsOpen(false);
  };
  return html`<section class="notice welcome" aria-label="First visit">
    <p>
      <strong>New here?</strong>
      ${" This scene runs while you change it: drag a stop, the ball or a pad in the drawing. Run keeps the result. "}
      <a href="guide/tutorial.html">Tutorial</a>
    </p>
    <button type="button" class="quiet" onClick=${close}>Close the hint</button>
  </section>`;
}

// Shows it in `host` while the first page is the scene; a reader who leaves that page knows the way.
export function welcome(host, isScene) {
  if (isKnown()) return;
  if (isScene) render(html`<${Welcome} />`, host);
  else {
    render(null, host);
    remember();
  }
}
