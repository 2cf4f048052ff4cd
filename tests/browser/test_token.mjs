// Where the service knows its readers by tokens.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import { says, test, until } from "./support.mjs";

test("A service with tokens asks for one, refuses a wrong one, works with a right one, and its files can be saved", async ({ page, daemon, url, refused }) => {
  if (!daemon.program) return; // a service that runs already has its own
  const ran = await daemon.run("paper_free_sponge");
  const made = spawnSync(daemon.program, ["token", "create", "--name", "reader", "--scopes", "read,submit,materials", "--data", daemon.data]);
  const right = made.stdout.toString().trim();
  assert.equal(made.status, 0, made.stderr.toString());
  await daemon.stop();
  await daemon.start();
  refused(401);
  await page.goto(url(`#/results/${ran.result}`));
  const dialog = page.getByRole("dialog");
  await dialog.getByLabel("Token").fill("wröng €");
  await page.keyboard.press("Enter");
  assert.equal(await dialog.getByLabel("Token").evaluate((input) => input.validity.patternMismatch), true);
  await dialog.getByLabel("Token").fill("wrong");
  await page.keyboard.press("Enter");
  await says(page.getByRole("alert").first(), /token/i);

  await page.getByRole("button", { name: "Token" }).click();
  await dialog.getByLabel("Token").fill(right);
  await dialog.getByRole("button", { name: "Use it" }).click();
  await says(page.getByRole("heading", { level: 1 }), /sponge/);
  await page.getByRole("tab", { name: "Files and code" }).click();
  const saving = page.waitForEvent("download");
  await page.getByRole("link", { name: "impacts.csv" }).click();
  assert.match(fs.readFileSync(await (await saving).path(), "utf8"), /approach/);

  await page.getByRole("button", { name: "Token" }).click();
  await dialog.getByRole("button", { name: "Forget the one in use" }).click();
  await until("it to be forgotten", () => page.evaluate(() => !sessionStorage.getItem("impactd.token")));
  await page.reload();
  await dialog.getByRole("button", { name: "Not now" }).click();
  await says(page.getByRole("alert").first(), /token/i);
  assert.equal(spawnSync(daemon.program, ["token", "revoke", "reader", "--data", daemon.data]).status, 0);
  assert.equal(spawnSync(daemon.program, ["token", "forget", "reader", "--data", daemon.data]).status, 0);
});
