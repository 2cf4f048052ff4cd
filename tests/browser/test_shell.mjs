// What stands around all pages: navigation, theme, the page for the shell.
import assert from "node:assert/strict";
import { axe, says, test } from "./support.mjs";

test("The page for the shell shows the lines that curl gets", async ({ page, daemon, url }) => {
  await page.goto(url("#/shell"));
  await says(page.locator("pre"), /curl/);
  const text = await (await fetch(daemon.url, { headers: { Accept: "text/plain" } })).text();
  assert.equal((await page.locator("pre").textContent()).trim(), text.trim());
});
