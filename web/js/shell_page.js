// How to begin from a shell: the lines that curl gets at the service's root.
import { ask } from "./api.js";
import { copied, fill, h } from "./dom.js";

export const page = {
  title: () => "For the shell",
  async show(host) {
    const text = await (await ask("GET", "", { headers: { Accept: "text/plain" } })).text();
    fill(host, h("h1", null, "For the shell"),
      h("p", null, "Scripts can do everything that this page can. These lines run as printed; ",
        h("a", { href: "openapi.json" }, "openapi.json"), " has the whole contract."),
      copied(text));
  },
};
