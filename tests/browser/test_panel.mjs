// A result's first screen: what is answered there without scrolling, how much of it plots cover, how soon the first chart is there.
import assert from "node:assert/strict";
import { leads, says, test, until } from "./support.mjs";

const inView = (locator) => locator.evaluate((node) => {
  const { top, bottom, left, right, height } = node.getBoundingClientRect();
  return height > 0 && top >= 0 && left >= 0 && bottom <= innerHeight && right <= innerWidth;
});

test("Whether the damper helps is read without scrolling, on a screen and on a phone", async ({ daemon, newPage, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  for (const viewport of [{ width: 1280, height: 900 }, { width: 390, height: 844 }]) {
    const page = await newPage({ viewport });
    await page.goto(url(`#/results/${result}`));
    for (const [label, value] of [["Motion, rms", "−30.8 %"], ["Motion, peak", "no change"], ["Acceleration, rms", "−36.3 %"], ["Impacts", "22"],
      ["Largest force", "5.718 N"], ["Accuracy", "× 10"]]) {
      const item = page.locator(".headlines > div").filter({ hasText: label });
      await says(item, new RegExp(value.replace(".", "\\.")));
      assert.ok(await inView(item), `${label} at ${viewport.width} px`);
    }
  }
});

test("Plots cover at least 45 % of the first screen", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}`));
  await until("the charts", async () => (await page.locator(".plot svg path.line").count()) >= 5);
  const share = await page.evaluate(() => {
    let area = 0;
    for (const node of document.querySelectorAll(".plot, .drawing")) {
      const { top, bottom, width } = node.getBoundingClientRect();
      area += Math.max(0, Math.min(bottom, innerHeight) - Math.max(top, 0)) * width;
    }
    return area / (innerWidth * innerHeight);
  });
  console.log(`      plots and the drawing cover ${(100 * share).toFixed(1)} % of 1280 x 900`);
  assert.ok(share >= 0.45, `${share}`);
});

test("The first chart of a result comes with the processor slowed down 4 times", async ({ newPage, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  const times = [];
  for (let visit = 0; visit < 5; visit++) {
    const page = await newPage();
    const session = await page.context().newCDPSession(page);
    await session.send("Emulation.setCPUThrottlingRate", { rate: 4 });
    // Told by the page: asking it would cost some of its time.
    await page.addInitScript(() => {
      const observer = new MutationObserver(() => {
        if (!document.querySelector(".plot path.line")) return;
        observer.disconnect();
        requestAnimationFrame(() => console.info(`first chart ${Math.round(performance.now())}`));
      });
      observer.observe(document, { childList: true, subtree: true });
    });
    const chart = page.waitForEvent("console", { predicate: (message) => message.text().startsWith("first chart") });
    await page.goto(url(`#/results/${result}`));
    times.push(Number((await chart).text().split(" ").at(-1)));
    await page.close();
  }
  times.sort((one, other) => one - other);
  console.log(`      the first chart came after ${times[2]} ms, of 5 visits ${times[0]} to ${times[4]} ms`);
});

test("The best clearance is two clicks away: the cost of the sweep, then its answer", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}`));
  await page.getByRole("button", { name: "Sweep the clearance" }).click();
  await says(page.getByRole("status").filter({ hasText: "runs" }), /58 runs with clearances from 3 mm to 60 mm: about [\d.]+ .?s of processor time/);
  await page.getByRole("button", { name: "Start", exact: true }).click();
  await leads(page, /#\/results\/r-(?!.*\?)/);
  await says(page.getByRole("main"), /Least RMS displacement: [\d.]+ mm at clearance [\d.]+ mm/);
});

test("Further studies are in a menu, which Escape closes; a result without a damper offers what it can", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}`));
  await page.getByRole("button", { name: "More studies" }).click();
  await page.getByRole("button", { name: "Compare contact models" }).waitFor();
  await page.keyboard.press("Escape");
  await until("the menu to close", async () => (await page.getByRole("button", { name: "Compare contact models" }).count()) === 0);
  await page.getByRole("button", { name: "More studies" }).click();
  await page.getByRole("button", { name: "Compare contact models" }).click();
  await says(page.getByRole("status").filter({ hasText: "contact model" }), /of processor time/);
  await page.getByRole("button", { name: "Not now" }).click();
  const bare = await daemon.run("no_damper");
  await page.goto(url(`#/results/${bare.result}`));
  await page.getByRole("button", { name: "Error against cost" }).waitFor();
  assert.equal(await page.getByRole("button", { name: "Sweep the clearance" }).count(), 0);
});
