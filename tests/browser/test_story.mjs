// The way of a lab member through the whole: why the sponge beats bare aluminium. Parts have tests of their own.
import assert from "node:assert/strict";
import { leads, says, tabTo, test, until } from "./support.mjs";

const button = (page, name) => page.getByRole("button", { name, exact: true });
const section = (page, name) => page.getByRole("region", { name, exact: true });
const main = (page) => page.getByRole("main");
const RESULT = /#\/results\/(r-[0-9a-f]+)/;

test("From the first sight to why the sponge beats aluminium: run, zoom to an impact, change the buffer, compare, share", async ({ page, newPage, url }) => {
  await page.goto(url());
  await says(main(page), /1\.656 kN\/m/);
  await button(page, "Run").click();
  const [, sponge] = await leads(page, RESULT);
  await says(main(page), /Largest force[^]*5\.718 N/);
  // The hardest impact, seen close.
  await says(section(page, "Selected impact"), /contact pulls with up to/);
  await button(page, "Zoom to this impact").click();
  const [, from, to] = await until("the window in the URL", () => /[?&]from=([\d.]+)&to=([\d.]+)/.exec(page.url()));
  assert.ok(from < 0.1159 && to > 0.1439 && to - from < 0.5, `${from} to ${to}`);
  await says(page.getByRole("tabpanel"), /^2 in this window/);
  await page.goBack();
  await says(section(page, "Motion over time"), /The first 3\.6 s of 10 s/);
  // The same with aluminium.
  await page.getByRole("link", { name: "Change this scene" }).click();
  const material = page.getByRole("combobox", { name: "Material" }).first();
  await material.selectOption(await material.locator("option", { hasText: "Aluminium" }).getAttribute("value"));
  await says(main(page), /300 µs/);
  await button(page, "Run").click();
  const [, aluminium] = await until("another result", () => RESULT.exec(page.url())?.[1] !== sponge && RESULT.exec(page.url()));
  await says(main(page), /Largest force[^]*401/);
  // Side by side.
  await page.getByRole("button", { name: /^Compare with/ }).click();
  await page.getByRole("link", { name: "An earlier run …" }).click();
  await leads(page, new RegExp(`compare\\?a=${aluminium}`));
  await page.getByRole("combobox", { name: "Add a result" }).selectOption(sponge);
  await page.getByRole("button", { name: "Add it" }).click();
  await leads(page, new RegExp(`b=${sponge}`));
  await says(main(page), /70[\d.]* times as/);
  await says(main(page), /Peak acceleration[\s\S]*0\.0331 ×/);
  const other = await newPage();
  await other.goto(page.url());
  await until("the same in a fresh profile", async () => (await main(other).innerText()) === (await main(page).innerText()));
});

test("By keyboard alone: run, look at another impact, zoom and back, play, download, compare, spectrum, theme", async ({ page, url }) => {
  const press = async (where, key = "Enter") => {
    await tabTo(page, where);
    await page.keyboard.press(key);
  };
  await page.goto(url());
  await says(main(page), /1\.656 kN\/m/);
  await page.keyboard.press("Control+Enter");
  await leads(page, RESULT);
  await says(section(page, "Selected impact"), /Peak force/);
  const chart = section(page, "Motion over time").getByRole("application").first();
  await tabTo(page, chart);
  await page.keyboard.press("+");
  await until("a window in the URL", () => /from=/.test(page.url()));
  await press(section(page, "In slow motion").getByRole("button", { name: "Play" }), "Space");
  await button(page, "Pause").waitFor();
  await page.keyboard.press("Space");
  await button(page, "Play").waitFor();
  await press(button(page, "Next impact"));
  await until("another impact", () => /impact=\d/.test(page.url()));
  await press(page.getByRole("tab", { name: "Impacts" }), "ArrowRight");
  await press(page.getByRole("tabpanel").getByRole("application").first(), "+");
  await until("a part of the spectrum", () => /psd_from=/.test(page.url()));
  const saved = page.waitForEvent("download");
  await press(page.getByRole("tab", { name: "Spectrum" }), "ArrowRight");
  for (const name of ["Energy", "How it was computed"]) await press(page.getByRole("tab", { name }), "ArrowRight");
  await press(page.getByRole("link", { name: /csv/i }).first());
  assert.match((await saved).suggestedFilename(), /csv$/);
  await page.keyboard.press("Control+Home");
  await page.evaluate(() => document.activeElement.blur());
  await press(page.getByRole("button", { name: /^Compare with/ }));
  await press(page.getByRole("link", { name: "An earlier run …" }));
  await leads(page, /#\/compare\?a=/);
  await page.getByRole("heading", { name: "Compare", level: 1 }).waitFor();
  await tabTo(page, page.getByRole("combobox", { name: "Add a result" }));
  await page.evaluate(() => document.activeElement.blur());
  await press(page.getByRole("navigation").getByRole("link", { name: "Records" }));
  await leads(page, /#\/records/);
  await page.getByRole("heading", { name: "Ground motions", level: 1 }).waitFor(); // the page takes the focus before it
  await page.evaluate(() => document.activeElement.blur());
  await press(button(page, "Use dark colours"));
  await button(page, "Use light colours").waitFor();
});
