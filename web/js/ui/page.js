// Pages: their headings, and a page whose view is a component.
import { tokenChanges } from "../api.js";
import { Help } from "./controls.js";
import { html, render } from "./preact.js";

// The heading of a page with its "?"; `children` stand beside it.
export const PageTitle = ({ title, children }) =>
  html`<div class="title-row">
    <h1>${title}</h1>
    <${Help} name=${title} />
    ${children}
  </div>`;

// View({address, signal}) is drawn again when the query of its address or the units change.
export const pageOf = (title, View) => ({
  title,
  show(host, address, signal) {
    let current = address;
    // A new token is a new start: what was refused is asked for again.
    const redraw = () =>
      render(html`<${View} key=${tokenChanges.get()} address=${current} signal=${signal} />`, host);
    signal.addEventListener("abort", tokenChanges.subscribe(redraw));
    host.replaceChildren();
    redraw();
    return {
      change(next) {
        current = next;
        redraw();
      },
      redraw,
      leave: () => render(null, host),
    };
  },
});
