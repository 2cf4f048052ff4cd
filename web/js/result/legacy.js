// A part of the page that is built from elements: {show(host, context) -> controller}.
import { html, useEffect, useRef } from "../ui/preact.js";
import { failure, fill } from "../dom.js";
import { settings } from "../settings.js";
import { useStore } from "../ui/store.js";
import { useResult } from "./context.js";

export function Section({ section }) {
  const { classic, query } = useResult();
  const units = useStore(settings);
  const box = useRef(null);
  const controller = useRef(null); // a promise of what show() returns
  const made = useRef(null);
  useEffect(() => {
    const host = document.createElement("div");
    box.current.append(host);
    controller.current = Promise.resolve()
      .then(() => section.show(host, classic))
      .then((shown) => (made.current = shown))
      .catch((error) => error.name !== "AbortError" && fill(host, failure(error)));
    return () => {
      controller.current.then((shown) => shown?.leave?.());
      host.remove();
    };
  }, [section, units]);
  // At once where a part of the page changes the address, later where the browser does ("back").
  const key = JSON.stringify(query);
  const last = useRef(key);
  useEffect(() => {
    const follow = (view) => {
      last.current = JSON.stringify(view);
      made.current?.follow?.(view);
    };
    classic.followers.add(follow);
    return () => classic.followers.delete(follow);
  }, [classic]);
  useEffect(() => {
    if (last.current === key) return;
    last.current = key;
    made.current?.follow?.(classic.view);
  }, [key]);
  return html`<div ref=${box}></div>`;
}
