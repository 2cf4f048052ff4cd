// Light or dark: the system's until the reader chooses; also of the guide.
import { storage } from "./storage.js";

const KEY = "impactd.theme";

export function connectTheme(button) {
  const root = document.documentElement;
  const system = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : system.matches);
  function set(theme) {
    if (theme) root.dataset.theme = theme;
    button.hidden = false;
    button.ariaLabel = `Use ${isDark() ? "light" : "dark"} colours`;
    button.title = button.ariaLabel;
  }
  button.onclick = () => {
    set(isDark() ? "light" : "dark");
    storage.set(KEY, root.dataset.theme);
  };
  system.onchange = () => set();
  set(storage.get(KEY));
}
