// Which page is shown, and what stands around it: navigation, theme, units, token. Without Preact: what the page begins with
// is asked for before that is here.
import { read } from "./address.js";
import { prefetch, get, onUnauthorised, setPageSignal, tokenChanges, token } from "./api.js";
import { storage } from "./storage.js";
import { settings } from "./settings.js";
import { connectTheme } from "./theme.js";
import { announce } from "./ui/announce.js";

// [path of the address, its module, what its page begins with: asked for while its modules are loaded].
// A module's `page` is {title(address), show(host, address, signal) -> {change(address), redraw(), leave()}}: for a new query on
// the same path, for other units, and for the end, when `signal` is aborted.
const pages = [
  [/^(scene)?$/, () => import("./scene/page.js")],
  [/^jobs$/, () => import("./runs/runs.js")],
  [/^jobs\/[^/]+$/, () => import("./runs/run.js")],
  [/^results\/[^/]+$/, () => import("./result/page.js"), (id) => `v1/results/${id}`],
  [/^results\/[^/]+\/report$/, () => import("./result/report.js")],
  [/^compare$/, () => import("./runs/compare.js")],
  [/^materials$/, () => import("./library/materials.js")],
  [/^materials\/[^/]+$/, () => import("./library/material.js")],
  [/^materials\/[^/]+\/measure$/, () => import("./library/drop_test.js")],
  [/^records$/, () => import("./library/records.js")],
  [/^records\/[^/]+$/, () => import("./library/record.js")],
  [/^shell$/, () => import("./shell.js")],
];

const [main, tokenButton, skip, version, hint, units] = [
  "main",
  "token",
  "skip",
  "version",
  "welcome",
  "units-menu",
].map((id) => document.getElementById(id));
let current = null; // {path, stop, controller: promise}

async function show() {
  const last = current;
  if (last?.path === read().path.join("/")) {
    const controller = await last.controller;
    if (last !== current) return; // another one has come meanwhile
    if (controller) {
      controller.change(read());
      return;
    }
  }
  last?.stop.abort();
  last?.controller.then((controller) => controller?.leave());
  const address = read();
  const stop = new AbortController();
  current = {
    path: address.path.join("/"),
    stop,
    controller: open(address, stop.signal, last !== null),
  };
}

// The hint of a first visit stands above the scene until it is closed or the reader goes on.
const WELCOME = "impactd.welcome";
function welcome(isScene) {
  hint.hidden = !isScene || storage.get(WELCOME) !== null;
  if (!isScene) storage.set(WELCOME, "seen");
}
hint.querySelector("button").onclick = () => welcome(false);

function element(name, className, text) {
  const made = document.createElement(name);
  if (className) made.className = className;
  made.textContent = text;
  return made;
}

async function open(address, signal, isNext) {
  setPageSignal(signal);
  if (isNext) main.replaceChildren("Loading …"); // what is left takes no clicks
  const [top = "scene"] = address.path;
  const section = top === "results" ? "jobs" : top;
  for (const anchor of document.querySelectorAll("#pages a"))
    anchor.ariaCurrent = anchor.hash === `#/${section}` ? "page" : null;
  welcome(top === "scene");
  try {
    const path = address.path.join("/");
    const found = pages.find(([pattern]) => pattern.test(path));
    if (!found)
      throw Object.assign(
        new Error(`There is no page "${path}" here. The links above lead to all pages.`),
        { title: "No such page" },
      );
    const [, load, first] = found;
    if (first) prefetch(first(encodeURIComponent(address.path[1])));
    const { page } = await load();
    if (signal.aborted) return null;
    const title = page.title(address);
    const host = element("div", "page", "Loading …");
    document.title = `${title} · impactd`;
    main.replaceChildren(host);
    if (isNext) {
      scrollTo(0, 0);
      main.focus({ preventScroll: true });
      announce(title);
    }
    return page.show(host, address, signal);
  } catch (error) {
    if (signal.aborted) return null;
    if (main.querySelector(".page h1") === null)
      main.replaceChildren(element("h1", null, "This page could not be shown"));
    const box = main.appendChild(element("div", null, ""));
    const retry = () => get("version").then(() => location.reload());
    // Both are preloaded, also when the server is away by now.
    const [{ html, render }, { Failure }] = await Promise.all([
      import("./ui/preact.js"),
      import("./ui/controls.js"),
    ]);
    render(html`<${Failure} error=${error} onRetry=${retry} />`, box);
    return null;
  }
}

connectTheme(document.getElementById("theme"));
addEventListener("hashchange", show);
show();
settings.subscribe(async () => (await current.controller)?.redraw());

const updateTokenButton = () => {
  tokenButton.hidden = !token();
};
const signIn = async () => {
  const { askToken } = await import("./ui/token_dialog.js");
  return askToken().finally(updateTokenButton);
};
onUnauthorised(signIn);
updateTokenButton();
tokenButton.onclick = async () => {
  await signIn();
  tokenChanges.set((count) => count + 1);
  show();
};

units.addEventListener(
  "beforetoggle",
  async () => (await import("./ui/units_menu.js")).showUnits(units),
  { once: true },
);

skip.onclick = (event) => {
  event.preventDefault();
  main.focus();
};
get("version").then(
  (answer) => {
    version.textContent = `impactd ${answer.version}, engine ${answer.engine}`;
  },
  () => {}, // the page itself says so
);
