// The guide: every page for axe-core and in narrow windows, the search by keyboard, copied code, the list of pages.
import assert from "node:assert/strict";
import { axe, overflow, says, test } from "./support.mjs";

// Leaves only blocks with an element in a parent that no page before had: all pages have one style, and axe-core takes a second
// for a long one. Returns these shapes of all pages so far.
const trim = (page, known) => page.evaluate((known) => {
  const seen = new Set(known);
  for (const block of document.querySelectorAll("main > *, nav li, main tr")) {
    const shapes = [block, ...block.querySelectorAll("*")].map((node) =>
      [node.parentElement, node].map(({ localName, className }) => `${localName}.${className}`).join(" "));
    if (shapes.every((shape) => seen.has(shape)) && !block.matches("h1")) block.remove();
    shapes.forEach((shape) => seen.add(shape));
  }
  return [...seen];
}, known);

test("Every page of the guide, light and dark: nothing serious for axe-core, no sideways scrolling at 1200 and 360 px", async ({ page, url }) => {
  const found = [];
  let shapes = [];
  await page.setViewportSize({ width: 1200, height: 900 });
  await page.goto(url("guide/"));
  const targets = await page.getByRole("navigation", { name: "Pages of the guide" }).getByRole("link").evaluateAll((links) => links.map(({ href }) => href));
  assert.ok(targets.length > 8, targets.join());
  for (const target of targets) {
    await page.goto(target);
    const name = new URL(target).pathname;
    assert.equal(await page.locator("h1").count(), 1, name);
    if (await overflow(page)) found.push(`${name}: wider than 1200 px`);
    await page.setViewportSize({ width: 360, height: 800 });
    if (await overflow(page)) found.push(`${name}: ${await overflow(page)} px wider than 360 px`);
    const before = shapes.length;
    shapes = await trim(page, shapes);
    if (name.endsWith("/guide/")) found.push(...(await axe(page)).map((line) => `${name} at 360 px: ${line}`));
    await page.setViewportSize({ width: 1200, height: 900 });
    if (shapes.length === before) continue;
    found.push(...(await axe(page)).map((line) => `${name}: ${line}`));
    await page.emulateMedia({ colorScheme: "dark" });
    found.push(...(await axe(page, ["color-contrast"])).map((line) => `${name}, dark: ${line}`));
    await page.emulateMedia({ colorScheme: "light" });
  }
  assert.equal(found.join("\n"), "");
});

test("The search: / goes to its field, arrows choose, Enter leads to the section, Escape closes it", async ({ page, url }) => {
  await page.goto(url("guide/"));
  await page.keyboard.press("/");
  const field = page.getByRole("combobox", { name: "Search the guide" });
  assert.ok(await field.evaluate((node) => node === document.activeElement));
  await page.keyboard.type("precondition");
  const options = page.getByRole("option");
  await says(options.first(), /Problems › precondition-/); // a heading is before texts that have the word
  const second = await options.nth(1).innerText();
  await page.keyboard.press("ArrowDown");
  assert.equal(await page.getByRole("option", { selected: true }).innerText(), second);
  await page.keyboard.press("Enter");
  await page.waitForURL(/problems\.html#precondition-/);
  await page.keyboard.press("/");
  await page.keyboard.type("xyzzyx");
  await says(page.locator("body"), /Nothing has xyzzyx/);
  await page.keyboard.press("Escape");
  assert.equal(await page.getByText("Nothing has").isVisible(), false);
});

test("Code is copied whole by its button", async ({ newPage, url }) => {
  const page = await newPage({ permissions: ["clipboard-read", "clipboard-write"] });
  await page.goto(url("guide/commands.html"));
  const block = page.getByText("impactd run").locator("xpath=ancestor::pre").first();
  await block.hover();
  await block.locator("xpath=..").getByRole("button", { name: "Copy" }).click();
  await says(block.locator("xpath=.."), /Copied/);
  assert.equal(await page.evaluate(() => navigator.clipboard.readText()), await block.locator("code").evaluate((node) => node.textContent));
});

test("In a narrow window the pages and the headings of a page open from buttons, and a link closes them", async ({ newPage, url }) => {
  const page = await newPage({ viewport: { width: 360, height: 800 } });
  await page.goto(url("guide/problems.html"));
  const list = page.getByRole("navigation", { name: "On this page" });
  assert.equal(await list.isVisible(), false);
  await page.getByRole("button", { name: "On this page" }).press("Enter");
  await list.getByRole("link", { name: "gone" }).click();
  assert.equal(await list.isVisible(), false);
  assert.match(page.url(), /#gone$/);
  await page.getByRole("button", { name: "Pages" }).press("Enter");
  await page.getByRole("link", { name: "API reference", exact: true }).click();
  await says(page.getByRole("heading", { level: 1 }), /API reference/);
});

test("Light or dark is one choice for the dashboard and the guide", async ({ page, url }) => {
  await page.goto(url("guide/"));
  await page.getByRole("button", { name: "Use dark colours" }).click();
  await page.getByRole("navigation", { name: "Service" }).getByRole("link", { name: "Dashboard" }).click();
  await page.getByRole("button", { name: "Use light colours" }).waitFor();
  await page.getByRole("link", { name: "Guide: Estimate" }).click();
  await page.waitForURL(/studies\.html#cost-and-limits$/);
  assert.ok(await page.getByRole("heading", { name: "Cost and limits" }).isVisible());
});

test("A wrong address of the guide is named above its first page", async ({ page, url, refused }) => {
  refused(404);
  await page.goto(url("guide/nothing.html"));
  await says(page.getByRole("main"), /no page at this address.*Start/s);
  await page.goto(url("guide/concepts.html"));
  await says(page.getByRole("main"), /Concepts/);
  assert.equal(await page.locator(".notice").count(), 0);
});
