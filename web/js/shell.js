// How to begin from a shell: the lines that curl gets at the service's root.
import { ask } from "./api.js";
import { CodeBlock, Loaded } from "./ui/controls.js";
import { pageOf } from "./ui/page.js";
import { html } from "./ui/preact.js";
import { useLoaded } from "./ui/hooks.js";

const load = async (signal) =>
  (await ask("GET", "", { headers: { Accept: "text/plain" }, signal })).text();

function Shell() {
  const loaded = useLoaded(load, []);
  // A block is a comment, "# What it does:", and its lines.
  const block = (text) => {
    const [comment, ...lines] = text.trim().split("\n");
    return (
      lines.length > 0 &&
      html`<p>${comment.slice(2)}</p>
        <${CodeBlock} text=${lines.join("\n")} />`
    );
  };
  const blocks = (text) => text.split("\n\n").map(block);
  return html`<h1>For the shell</h1>
    <p>
      Scripts can do everything that this page can. These lines run as printed;${" "}
      <a href="openapi.json">openapi.json</a> has the whole contract.
    </p>
    <${Loaded} loaded=${loaded}>${blocks}<//>`;
}

export const page = pageOf(() => "For the shell", Shell);
