// A page whose view is a component: View({address, signal}) is drawn again when the query of its address or the units change.
import { html, render } from "./preact.js";

export const pageOf = (title, View) => ({
  title,
  show(host, address, signal) {
    let current = address;
    const redraw = () => render(html`<${View} address=${current} signal=${signal} />`, host);
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
