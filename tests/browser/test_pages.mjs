// Every page: names and contrast in light and dark, narrow and wide windows; no error, no other host (support.mjs).
import assert from "node:assert/strict";
import { pages, settle } from "./pages.mjs";
import { axe, overflow, test, until } from "./support.mjs";

let made = null;
const PARTS = 3;

for (let part = 0; part < PARTS; part++)
  test(`Every page, light and dark: nothing serious for axe-core, no sideways scrolling at 1280 and 360 px (${part + 1} of ${PARTS})`, async ({ page, daemon, url }) => {
    const found = [], list = (await (made ??= pages(daemon))).filter((_, at) => at % PARTS === part);
    for (const one of list) {
      await settle(page, url(one.hash), one);
      if ((await page.locator("h1").count()) !== 1) found.push(`${one.name}: ${await page.locator("h1").count()} headings of level 1`);
      if (await overflow(page)) found.push(`${one.name}: wider than 1280 px`);
      found.push(...(await axe(page)).map((line) => `${one.name}: ${line}`));
      await page.emulateMedia({ colorScheme: "dark" });
      found.push(...(await axe(page, ["color-contrast"])).map((line) => `${one.name}, dark: ${line}`)); // the one rule that sees colours
      await page.emulateMedia({ colorScheme: "light" });
      await page.setViewportSize({ width: 360, height: 900 });
      await until("the page to fit", async () => (await overflow(page)) === 0, 2000)
        .catch(async () => found.push(`${one.name}: ${await overflow(page)} px wider than 360 px`));
      await page.setViewportSize({ width: 1280, height: 900 });
    }
    assert.equal(found.join("\n"), "");
  });
