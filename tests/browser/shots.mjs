// Pictures of every page, at 1280 and 360 px, light and dark, for someone's eyes:
//   node tests/browser/shots.mjs FOLDER [--build DIR] [WORD...]     only pages whose name holds a WORD
import fs from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { chromium } from "playwright-core";
import { Daemon } from "./daemon.mjs";
import { pages, settle } from "./pages.mjs";

const here = path.dirname(fileURLToPath(import.meta.url));
const { values, positionals: [folder, ...words] } = parseArgs({
  allowPositionals: true, options: { build: { type: "string", default: path.join(here, "..", "..", "build") } },
});
if (!folder) throw new Error("Say into which folder: node tests/browser/shots.mjs FOLDER");
fs.mkdirSync(folder, { recursive: true });
const daemon = new Daemon(path.resolve(values.build));
await daemon.start();
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium-headless-shell", args: ["--no-sandbox"] });
try {
  const list = (await pages(daemon)).filter(({ name }) => words.length === 0 || words.some((word) => name.includes(word)));
  for (const width of [1280, 360])
    for (const theme of ["light", "dark"]) {
      const page = await (await browser.newContext({ viewport: { width, height: 900 }, colorScheme: theme })).newPage();
      for (const one of list) {
        await settle(page, `${daemon.url}/${one.hash}`, one);
        await page.screenshot({ path: path.join(folder, `${one.name}-${width}-${theme}.png`), fullPage: true, animations: "disabled" });
      }
      await page.context().close();
    }
  // The README's picture: what one sees of a result first.
  const result = list.find(({ name }) => name === "result");
  if (result) {
    const page = await (await browser.newContext({ viewport: { width: 1280, height: 900 }, colorScheme: "light" })).newPage();
    await settle(page, `${daemon.url}/${result.hash}?t=0.122`, result); // in a contact
    await page.screenshot({ path: path.join(folder, "dashboard.png"), animations: "disabled" });
  }
  console.log(`${list.length} pages in ${folder}`);
} finally {
  await browser.close();
  await daemon.end();
}
