// The scene as it is edited: sliders, the preview that follows, undo and redo.
import assert from "node:assert/strict";
import { hold, says, test, until } from "./support.mjs";

const live = (page) => page.getByRole("region", { name: "Live", exact: true });
const slider = (page, name) => live(page).getByRole("slider", { name });
const clearance = (page) => page.getByRole("textbox", { name: "Clearance" }).first();

test("A slider runs the scene as it moves; undo and redo take steps back and forth", async ({ page, url }) => {
  await page.goto(url("#/scene"));
  await says(live(page), /With the damper: rms −30\.8 %, peak unchanged, 22 impacts, largest force 5\.72 N/);
  assert.equal(await live(page).getByRole("figure").count(), 2);
  await slider(page, "Clearance").focus();
  for (let press = 0; press < 20; press++) await page.keyboard.press("ArrowRight");
  await until("the field to follow", async () => Number(await clearance(page).inputValue()) > 0.02);
  const moved = await clearance(page).inputValue();
  await says(live(page), /rms −(?!30\.8)[\d.]+ %/);
  await live(page).getByRole("button", { name: "Undo" }).click();
  await until("the clearance of before", async () => (await clearance(page).inputValue()) === "0.015");
  await says(live(page), /rms −30\.8 %/);
  await page.getByRole("heading", { name: "Live" }).click();
  await page.keyboard.press("Control+Shift+z");
  await until("it to be done again", async () => (await clearance(page).inputValue()) === moved);
});

test("One preview is on its way at a time, and the newest scene wins", async ({ page, url }) => {
  await page.goto(url("#/scene"));
  await says(live(page), /22 impacts/);
  const preview = await hold(page, /v1\/preview/, 1);
  let sent = 0;
  page.on("request", (request) => /v1\/preview/.test(request.url()) && sent++);
  await slider(page, "Free mass").focus();
  for (let press = 0; press < 30; press++) await page.keyboard.press("ArrowRight");
  await preview.asked();
  assert.equal(sent, 1);
  await preview.letGo();
  const wanted = /Free mass\s+([\d.]+) kg/.exec(await live(page).innerText())?.[1];
  assert.ok(Number(wanted) > 0.12, wanted);
  await until("the newest", async () => sent === 2 && /rms −(?!30\.8)/.test(await live(page).innerText()));
});

test("A run that is too long for a preview says so; a frame of the live view is quick", async ({ page, url }) => {
  await page.goto(url("#/scene"));
  await says(live(page), /22 impacts/);
  const times = await page.evaluate(async () => {
    const input = document.querySelector(".live-slider input");
    const frames = [];
    for (let step = 0; step < 40; step++) {
      const began = performance.now();
      input.value = String(4 * step);
      input.dispatchEvent(new Event("input", { bubbles: true }));
      await new Promise((resolve) => setTimeout(resolve));
      document.body.offsetHeight; // lays it out
      frames.push(performance.now() - began);
      await new Promise((resolve) => setTimeout(resolve, 30));
    }
    return frames.sort((a, b) => a - b);
  });
  console.log(`      script and layout of a step: ${times[20].toFixed(1)} ms, at the 95th percentile ${times[38].toFixed(1)} ms`);
  await page.getByLabel("Duration [s]").fill("3000");
  await says(live(page), /too long for a preview/);
});
