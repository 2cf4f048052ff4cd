// A page whose view is a component: View({address, signal}) is drawn again when the query of its address changes.
import { html, render } from "./preact.js";

export const pageOf = (title, View) => ({
  title,
  show(host, address, signal) {
    const draw = (next) => render(html`<${View} address=${next} signal=${signal} />`, host);
    host.replaceChildren();
    draw(address);
    return { change: draw, leave: () => render(null, host) };
  },
});
