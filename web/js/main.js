// Which page is shown, and what stands around it: navigation, theme, token.
import { read } from "./address.js";
import { get, onUnauthorised, readUntil, setToken, token } from "./api.js";
import { failure, fill, h, tell } from "./dom.js";

// A module's `page` is {title(address), show(host, address, signal)}; show may return, or promise, {change(address)?, leave()?}:
// for a new query on the same path (false: show it anew), and for the end, when `signal` is aborted.
const pages = new Map(Object.entries({ // by its path, the module's name before "_page.js"
  "": "scene", scene: "scene", jobs: "jobs", "jobs/*": "job", "results/*": "result", compare: "compare", materials: "materials",
  "materials/*": "material", "materials/*/measure": "measure", records: "records", "records/*": "record", shell: "shell",
}));

const main = document.getElementById("main");
let shown = null; // {path, controller: promise, stop}

async function show() {
  const last = shown;
  if (last?.path === read().path.join("/")) {
    const controller = await last.controller;
    if (last !== shown) return; // another page has come meanwhile, or this one anew
    if (controller?.change && controller.change(read()) !== false) return;
  }
  last?.stop.abort();
  last?.controller.then((controller) => controller?.leave?.());
  const address = read(), path = address.path.join("/"), stop = new AbortController(), { signal } = stop;
  readUntil(signal);
  if (last) fill(main, "Loading …"); // what is left takes no clicks
  const name = pages.get(path.replace(/\/[^/]+/, "/*")), [within = "scene"] = address.path;
  for (const anchor of document.querySelectorAll("#pages a"))
    anchor.ariaCurrent = anchor.getAttribute("href") === `#/${within === "results" ? "jobs" : within}` ? "page" : null;
  const { promise: controller, resolve: settle } = Promise.withResolvers();
  shown = { path, controller, stop };
  try {
    if (!name) throw new Error(`There is no page "${path}" here.`);
    const { page } = await import(`./${name}_page.js`);
    if (signal.aborted) return settle(null);
    const title = page.title(address);
    document.title = `${title} · impactd`;
    const host = h("div", { class: "page" });
    fill(main, host);
    if (last) {
      scrollTo(0, 0);
      main.focus({ preventScroll: true });
      tell(title);
    }
    settle(await page.show(host, address, signal));
  } catch (error) {
    settle(null);
    if (!signal.aborted) {
      if (main.querySelector(".page h1") === null) fill(main, h("h1", null, "This page could not be shown"));
      main.append(failure(error));
    }
  }
}

// The theme: the system's until the reader chooses.
const themeButton = document.getElementById("theme");
const root = document.documentElement, system = matchMedia("(prefers-color-scheme: dark)");
const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : system.matches);
function setTheme(theme) {
  if (theme) root.dataset.theme = theme;
  themeButton.hidden = false;
  themeButton.textContent = isDark() ? "Light" : "Dark";
  themeButton.ariaLabel = `Use ${isDark() ? "light" : "dark"} colours`;
  dispatchEvent(new Event("themechange")); // plots draw themselves anew
}
themeButton.addEventListener("click", () => {
  setTheme(isDark() ? "light" : "dark");
  localStorage.setItem("impactd.theme", root.dataset.theme);
});
system.addEventListener("change", () => setTheme());
setTheme(localStorage.getItem("impactd.theme"));

// The token, asked for where the service wants one, kept until the tab is closed.
const tokenButton = document.getElementById("token");
let asking = null;
function askToken() {
  asking ??= new Promise((resolve) => {
    const input = h("input", { type: "password", autocomplete: "off", required: true });
    const button = (text, value) => h("button", { value, formnovalidate: true }, text);
    const dialog = h("dialog", { onclose }, h("form", { method: "dialog" }, h("h2", null, "A token is asked for"),
      h("p", null, "Whoever runs this service makes one with ", h("code", null, "impactd token create"), "."),
      h("label", null, "Token ", input), h("div", { class: "row" }, h("button", { class: "primary", value: "use" }, "Use it"),
        button("Not now", ""), token() && button("Forget the one in use", "forget"))));
    function onclose() {
      const isUsed = dialog.returnValue === "use";
      if (dialog.returnValue) setToken(isUsed ? input.value.trim() : "");
      tokenButton.hidden = !token();
      dialog.remove();
      asking = null;
      resolve(isUsed);
    }
    document.body.append(dialog);
    dialog.showModal();
  });
  return asking;
}
onUnauthorised(askToken);
tokenButton.hidden = !token();
tokenButton.addEventListener("click", () => askToken().then(show));

document.getElementById("skip").addEventListener("click", (event) => {
  event.preventDefault();
  main.focus();
});
get("version").then(({ version, engine }) =>
  (document.getElementById("version").textContent = `impactd ${version}, engine ${engine}`), () => {});
addEventListener("hashchange", show);
show();
