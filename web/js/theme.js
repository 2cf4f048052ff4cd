// Light or dark: the system's until the reader chooses; also of the guide.
const KEY = "impactd.theme";

export function themed(button) {
  const root = document.documentElement,
    system = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : system.matches);
  function set(theme) {
    if (theme) root.dataset.theme = theme;
    button.hidden = false;
    button.textContent = isDark() ? "Light" : "Dark";
    button.ariaLabel = `Use ${isDark() ? "light" : "dark"} colours`;
    dispatchEvent(new Event("themechange")); // plots draw themselves anew
  }
  button.onclick = () => {
    set(isDark() ? "light" : "dark");
    localStorage.setItem(KEY, root.dataset.theme);
  };
  system.onchange = () => set();
  set(localStorage.getItem(KEY));
}
