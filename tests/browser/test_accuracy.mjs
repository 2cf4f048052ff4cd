// How exact a run is to be: the measured trade as a slider.
import assert from "node:assert/strict";
import { says, test, until } from "./support.mjs";

test("The trade is measured on the scene, chosen from by keyboard, kept in the URL, and another scene's is called so", async ({ page: first, newPage, url }) => {
  let page = first;
  await page.goto(url("#/scene"));
  await page.getByLabel("Duration [s]").fill("1");
  const measure = page.getByRole("button", { name: "Measure the trade on this scene" });
  await measure.click();
  let slider = page.getByRole("slider", { name: /From the crudest/ });
  await slider.waitFor();
  await says(page.locator("body"), /Worth having: exact\. /);
  const before = page.url();
  await slider.focus();
  await page.keyboard.press("Home");
  assert.match(await slider.getAttribute("aria-valuetext"), /wrong by .* of the peak, .*s\. Beaten: another way errs less and costs less\./);
  assert.match(await page.getByLabel("Solver", { exact: true }).inputValue(), /newmark|rk4|precise/);
  assert.equal(await page.getByLabel("Step").inputValue(), "0.001");
  await until("the URL to follow", () => page.url() !== before);
  const shared = page.url();
  page = await newPage();
  await page.goto(shared);
  await page.getByRole("button", { name: "Measure the trade on this scene" }).click();
  slider = page.getByRole("slider", { name: /From the crudest/ });
  await slider.waitFor();
  assert.match(await slider.getAttribute("aria-valuetext"), /Beaten/);
  await page.getByLabel("Solver", { exact: true }).selectOption("auto");
  assert.match(await slider.getAttribute("aria-valuetext"), /^exact: wrong by/);
  await page.getByRole("textbox", { name: "Clearance" }).fill("0.016");
  await says(page.locator("main"), /Measured on another scene/);
});

test("A measurement is given up half way", async ({ page, daemon, url }) => {
  await page.goto(url("#/scene"));
  await page.getByLabel("Duration [s]").fill("21");
  await page.getByRole("button", { name: "Measure the trade on this scene" }).click();
  await page.getByRole("button", { name: "Cancel" }).click();
  await says(page.locator("main"), /nothing was measured/i);
  const { jobs } = await daemon.get("v1/jobs");
  assert.equal(jobs[0].status, "dismissed");
});
