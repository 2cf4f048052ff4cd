// A button that puts a text into the clipboard.
import { button, tell } from "./dom.js";

// `text` may be a function that makes it.
export function copyButton(text, label = "Copy") {
  const pressed = button(label, copy, { class: "quiet" });
  async function copy() {
    try {
      await navigator.clipboard.writeText(typeof text === "function" ? text() : text);
      pressed.textContent = "Copied";
    } catch {
      pressed.textContent = "Select and copy it by hand"; // a page without TLS may not
    }
    tell(pressed.textContent);
    setTimeout(() => (pressed.textContent = label), 2000);
  }
  return pressed;
}
