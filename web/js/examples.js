// The service's examples to choose a scene from, the paper's figures first.
import { link } from "./address.js";
import { get } from "./api.js";
import { button, faults, fill, h } from "./dom.js";

const groups = [["The paper", /Li and Darby/], ["Studies", /^(sweep|ensemble|sensitivity|compare|tradeoff)_/], ["Others", /./]];

export function examplesDialog() {
  const list = h("div", null, "Loading …"), close = () => dialog.close();
  const dialog = h("dialog.wide", { "aria-label": "Examples", onclose: () => dialog.remove() },
    button("Close", close), list);
  document.querySelector("main").append(dialog); // gone with the page
  dialog.showModal();
  get("v1/examples").then((answer) => {
    const examples = answer.examples.sort((a, b) => a.title.localeCompare(b.title, "en", { numeric: true }));
    const grouped = Map.groupBy(examples, ({ name, title }) => groups.find(([, pattern]) => pattern.test(`${name} ${title}`)));
    fill(list, groups.map((group) => [h("h3", null, group[0]), h("ul", null, grouped.get(group)?.map(({ name, title }) =>
      h("li", null, h("a", { href: link("scene", { example: name }), onclick: close }, title))))]));
  }).catch(faults(list));
}
