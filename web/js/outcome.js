// What a scene comes to, from a dry run: modes, cost, warnings. And faults by their places.
import { link } from "./address.js";
import { button, figures, fill, h, sentence } from "./dom.js";
import { place } from "./scene_form.js";
import { number, quantity, title, words } from "./units.js";

// Faults or warnings, each leading to its place by go(pointer); the box can take the focus.
export const places = (kind, heading, list, go) => h("div", { class: `notice ${kind}`, tabindex: "-1" },
  h("strong", null, heading), h("ul", null, list.map(({ pointer = "", ...fault }) => h("li", null,
    button(title(place(pointer || "/scene")), () => go(pointer), { class: "quiet" }), " ", sentence(fault)))));

export function outcome(host, { plan: { modes, contact_model: model, solver }, cost, warnings, cached, result }, go) {
  const each = (tell) => modes.slice(0, 3).map(tell).join(", ") + (modes.length > 3 ? ` … (${modes.length})` : "");
  fill(host, figures([
    ["Natural frequency", each(({ frequency }) => quantity(frequency, "Hz", 3))],
    ["Damping ratio", each((mode) => `${number(mode.damping_ratio * 100, 2)} %`)],
    ["Contact, solver", `${words(model ?? "none")}, ${solver ?? "by target"}`],
    ["Predicted cost", `${quantity(cost.cpu_seconds, "s", 2)} of CPU`],
  ]),
    cached && h("p", null, "Run before: ", h("a", { href: link(`results/${result}`) }, "its result"), "."),
    warnings.length > 0 && places("warn", "Before you rely on it", warnings, go));
}
