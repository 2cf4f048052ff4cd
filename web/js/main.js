// Which page is shown, and what stands around it: navigation, theme, token.
import { read } from "./address.js";
import { get, onUnauthorised, readUntil, session, setToken, token } from "./api.js";
import { failure, fill, h, once, tell } from "./dom.js";
import { settings } from "./settings.js";
import { themed } from "./theme.js";
import { html, render } from "./ui/preact.js";
import { UnitsMenu } from "./ui/units_menu.js";

// A module's `page` is {title(address), show(host, address, signal)}; show may return, or promise, {change(address)?, redraw()?,
// leave()?}: for a new query on the same path (false: show it anew), for other units (without it: show it anew), and for the end,
// when `signal` is aborted.
// "materials/felt" is the page "material", "materials/felt/measure" the page "measure".
const pages = [
  "scene",
  "jobs",
  "job",
  "result",
  "compare",
  "materials",
  "material",
  "measure",
  "records",
  "record",
  "report",
  "shell",
];
const views = {
  result: () => import("./result/page.js"),
  report: () => import("./result/report.js"),
  materials: () => import("./library/materials.js"),
  material: () => import("./library/material.js"),
  measure: () => import("./library/drop_test.js"),
  records: () => import("./library/records.js"),
  record: () => import("./library/record.js"),
};

const [main, tokenButton, skip, version] = ["main", "token", "skip", "version"].map((id) =>
  document.getElementById(id),
);
let shown = null; // {path, stop, controller: promise}

async function show() {
  const last = shown;
  if (last?.path === read().path.join("/")) {
    const controller = await last.controller;
    if (last !== shown) return; // another one has come meanwhile
    if (controller?.change && controller.change(read()) !== false) return;
  }
  showAnew(last);
}

async function redraw() {
  const last = shown,
    controller = await last.controller;
  if (last !== shown) return;
  if (controller?.redraw) controller.redraw();
  else showAnew(last, true);
}

// With `isStill` the reader stays where the page and the focus are.
function showAnew(last, isStill = false) {
  last?.stop.abort();
  last?.controller.then((controller) => controller?.leave?.());
  const address = read(),
    path = address.path.join("/"),
    stop = new AbortController();
  shown = { path, stop, controller: open(address, path, stop.signal, last && !isStill) };
}

async function open(address, path, signal, isNext) {
  readUntil(signal);
  if (isNext) fill(main, "Loading …"); // what is left takes no clicks
  const [first = "scene", one, part] = address.path,
    name = part ?? (one ? first.slice(0, -1) : first);
  for (const anchor of document.querySelectorAll("#pages a"))
    anchor.ariaCurrent =
      anchor.hash === `#/${first === "results" ? "jobs" : first}` ? "page" : null;
  try {
    if (!pages.includes(name)) throw new Error(`There is no page "${path}" here.`);
    const { page } = await (views[name]?.() ?? import(`./${name}_page.js`));
    if (signal.aborted) return null;
    const title = page.title(address),
      host = h("div.page", null, "Loading …");
    document.title = `${title} · impactd`;
    fill(main, host);
    if (isNext) {
      scrollTo(0, 0);
      main.focus({ preventScroll: true });
      tell(title);
    }
    return await page.show(host, address, signal);
  } catch (error) {
    if (signal.aborted) return null;
    if (main.querySelector(".page h1") === null)
      fill(main, h("h1", null, "This page could not be shown"));
    main.append(failure(error));
  }
}

themed(document.getElementById("theme"));
render(html`<${UnitsMenu} />`, document.getElementById("units"));
settings.subscribe(redraw);

// The token, asked for where the service wants one, kept until the tab is closed.
const askToken = once(
  () =>
    new Promise((resolve) => {
      const input = h("input", { type: "password", autocomplete: "off", required: true });
      const button = (text, value) => h("button", { value, formnovalidate: true }, text);
      const dialog = h(
        "dialog",
        { onclose },
        h(
          "form",
          { method: "dialog" },
          h("h2", null, "A token is asked for"),
          h(
            "p",
            null,
            "The administrator of this server creates one with ",
            h("code", null, "impactd token create"),
            ".",
          ),
          h("label", null, "Token ", input),
          h(
            "div.row",
            null,
            h("button.primary", { value: "use" }, "Use it"),
            button("Not now", ""),
            token() && button("Forget the one in use", "forget"),
          ),
        ),
      );
      function onclose() {
        const isUsed = dialog.returnValue === "use";
        if (dialog.returnValue) setToken(isUsed ? input.value.trim() : "");
        tokenButton.hidden = !token();
        dialog.remove();
        resolve(isUsed);
      }
      document.body.append(dialog);
      dialog.showModal();
    }),
);
onUnauthorised(askToken);
tokenButton.hidden = !token();
tokenButton.onclick = () =>
  askToken()
    .then(() => session.set((count) => count + 1))
    .then(show);

skip.onclick = (event) => {
  event.preventDefault();
  main.focus();
};
get("version").then(
  (is) => (version.textContent = `impactd ${is.version}, engine ${is.engine}`),
  () => {},
);
addEventListener("hashchange", show);
show();
