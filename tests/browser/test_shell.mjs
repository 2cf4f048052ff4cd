// What stands around all pages: navigation, theme, the page for the shell.
import assert from "node:assert/strict";
import { axe, says, test } from "./support.mjs";

test("The page for the shell shows the lines that curl gets", async ({ page, daemon, url }) => {
  await page.goto(url("#/shell"));
  await says(page.locator("pre").first(), /curl/);
  const text = await (await fetch(daemon.url, { headers: { Accept: "text/plain" } })).text();
  const lines = text.split("\n").filter((line) => line && !line.startsWith("#"));
  assert.deepEqual((await page.locator("pre").allTextContents()).join("\n").split("\n"), lines);
});

test("A server that is away is named as such where a page needs another module, and is tried again", async ({ page, url, refused }) => {
  refused(0);
  await page.goto(url("#/shell"));
  await page.route(/js\/library\/records\.js|\/version$/, (route) => route.abort());
  await page.getByRole("link", { name: "Records" }).click();
  await says(page.getByRole("alert"), /The server does not answer/);
  await page.unrouteAll();
  await page.getByRole("button", { name: "Try again" }).click();
  await says(page.getByRole("heading", { level: 1 }), /Ground motions/);
});
