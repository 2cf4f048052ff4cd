// A page whose view is a component: View({address, signal}) is drawn again when the query of its address or the units change.
import { session } from "../api.js";
import { html, render } from "./preact.js";

export const pageOf = (title, View) => ({
  title,
  show(host, address, signal) {
    let current = address;
    // A new token is a new start: what was refused is asked for again.
    const redraw = () =>
      render(html`<${View} key=${session.get()} address=${current} signal=${signal} />`, host);
    signal.addEventListener("abort", session.subscribe(redraw));
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
