// A result in slow motion: by time, by impact, by keyboard.
import assert from "node:assert/strict";
import fs from "node:fs";
import { leads, says, tabTo, test, until } from "./support.mjs";

const player = (page) => page.getByRole("group", { name: "Player" });
const instant = (page) => player(page).getByRole("slider", { name: "Instant" });
const click = (page, name) => page.getByRole("region", { name: "Selected impact" }).getByRole("button", { name }).click();
const at = (page) => Number(new URL(page.url().replace("#/", "")).searchParams.get("t"));

test("The player follows from impact to impact and shows what the series holds", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  const { impacts } = await daemon.get(`v1/results/${result}/impacts.json`);
  await page.goto(url(`#/results/${result}?t=0.052&impact=1`));
  const { channels } = await daemon.get(`v1/results/${result}/series.json?from=0.052&to=0.052`);
  const read = (await says(player(page), /Contact force/)).replaceAll("−", "-");
  for (const name of ["displacement", "contact_force"]) {
    const [value] = channels[name].values, shown = (name === "displacement" ? value * 1e3 : value).toPrecision(3);
    assert.ok(read.includes(shown.replace(/\.?0+$/, "")), `${shown} is not in ${read}`);
  }
  await click(page, "Next impact");
  await leads(page, /impact=2\b/);
  await until("its instant", async () => Math.abs(at(page) - impacts[1].start) < 1e-9);
  await says(player(page), /−7.5 mm/); // at the left stop of a clearance of 15 mm
  await click(page, "Previous impact");
  await leads(page, /impact=1\b/);
  await says(player(page), new RegExp(impacts[0].start.toFixed(5)));
  await page.goBack();
  await leads(page, /impact=2\b/);
  await says(player(page), /0\.11591 s/);
});

test("The player by keyboard: scrub, play, pause", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}`));
  await until("the part that the charts show", async () => Number(await instant(page).getAttribute("max")) < 5);
  await tabTo(page, instant(page));
  await page.keyboard.press("ArrowRight");
  await leads(page, /t=0\.00\d+\b/); // a thousandth of what the charts show
  await page.keyboard.press("Home");
  await leads(page, /t=0\b/);
  await page.keyboard.press("Space");
  await until("it to move", async () => at(page) > 0.004);
  await page.keyboard.press("Space");
  await player(page).getByRole("button", { name: "Play" }).waitFor();
  const stood = at(page);
  const [, told] = /Time\s+([\d.]+) s/.exec(await player(page).innerText());
  assert.ok(Math.abs(Number(told) - stood) < 1.1e-5, `it stands at ${told} s, its address says ${stood}`);
});

test("From impact to impact by buttons and by keys; at the end of a loop it begins again", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  const { impacts } = await daemon.get(`v1/results/${result}/impacts.json`);
  await page.goto(url(`#/results/${result}?t=0.2`));
  await says(player(page), /Contact force/);
  const reaches = (number) => until(`impact ${number}`, () => Math.abs(at(page) - impacts[number - 1].start) < 1e-9);
  const after = impacts.findIndex(({ start }) => start > 0.2) + 1;
  await player(page).getByRole("button", { name: "Impact after" }).click();
  await reaches(after);
  await leads(page, new RegExp(`impact=${after}\\b`));
  await instant(page).focus();
  await page.keyboard.press("n");
  await reaches(after + 1);
  await page.keyboard.press("p");
  await reaches(after);
  await player(page).getByRole("button", { name: "Impact before" }).click();
  await reaches(after - 1);
  await page.goto(url(`#/results/${result}?from=0.1&to=0.14&t=0.139`));
  await player(page).getByRole("button", { name: "Loop" }).click();
  await player(page).getByRole("button", { name: "Play", exact: true }).click();
  await until("it to begin again", () => at(page) < 0.135);
  await player(page).getByRole("button", { name: "Pause" }).click();
});

test("A contact's force is drawn as arrows on both bodies, as long as it is large", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  const { impacts } = await daemon.get(`v1/results/${result}/impacts.json`);
  const { peak_contact_force: peak } = (await daemon.get(`v1/results/${result}`)).summary;
  await page.goto(url(`#/results/${result}?t=${impacts[0].start + 0.01}`));
  await says(player(page), /Contact force/);
  const [, force] = /Contact force\s+([\d.]+) N/.exec(await says(player(page), /Contact force\s+[\d.]+ N/));
  const lengths = await player(page).getByRole("img").evaluate((svg) => [...svg.querySelectorAll(".force")].map((arrow) => arrow.getBBox().width));
  assert.equal(lengths.length, 2);
  const [free, pressed] = await player(page).getByRole("img").evaluate((svg) => [":not(.hit)", ".hit"].map((name) => svg.querySelector(`.pad${name}`).getBBox().width));
  assert.ok(pressed < 0.97 * free, `the pad is ${pressed} px thick, the free one ${free} px`);
  for (const length of lengths) assert.ok(Math.abs(length - (44 * Number(force)) / peak) < 1.5, `${length} px for ${force} of ${peak} N`);
});

test("The charts' cursor goes along while it plays; readers who prefer calm see no trail", async ({ page, newPage, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}`));
  const chart = page.getByRole("application", { name: "Displacement" }).first();
  await player(page).getByRole("button", { name: "Play", exact: true }).click();
  await until("the cursor", () => chart.evaluate((plot) => plot.querySelector(".cursor line") !== null));
  await until("a trail", () => player(page).evaluate((node) => node.querySelectorAll(".trail path").length > 4));
  await player(page).getByRole("button", { name: "Pause" }).click();
  const calm = await newPage({ reducedMotion: "reduce" });
  await calm.goto(url(`#/results/${result}?t=0.5`));
  await says(player(calm), /Contact force/);
  assert.equal(await player(calm).evaluate((node) => node.querySelectorAll(".trail path").length), 0);
});

test("A frame is saved as PNG, a window as WebM, which shows its progress and can be cancelled", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}?from=0&to=0.2&t=0.05`));
  await says(player(page), /Contact force/);
  const [picture] = await Promise.all([page.waitForEvent("download"), player(page).getByRole("button", { name: /frame as PNG/ }).click()]);
  assert.equal(picture.suggestedFilename(), "motion.png");
  const bytes = fs.readFileSync(await picture.path());
  assert.equal(bytes.readUInt32BE(16), 1280);
  const film = page.waitForEvent("download", { timeout: 60000 });
  await player(page).getByRole("button", { name: /Save as WebM: a film of [\d.]+ s/ }).click();
  await player(page).getByRole("progressbar", { name: "Film" }).waitFor();
  const saved = await film;
  assert.equal(saved.suggestedFilename(), "motion.webm");
  const video = fs.readFileSync(await saved.path());
  assert.equal(video.readUInt32BE(0), 0x1a45dfa3); // EBML
  assert.ok(video.length > 5000, `${video.length} bytes`);
  await player(page).getByRole("combobox", { name: "Speed" }).selectOption("1/20 ×"); // long enough to be cancelled
  const cancel = player(page).getByRole("button", { name: "Cancel the film" });
  const button = player(page).getByRole("button", { name: /Save as WebM/ });
  await button.focus();
  await button.evaluate(async (node) => { // a double click, in the page's own time
    node.click();
    await new Promise((resolve) => setTimeout(resolve, 50));
    node.click();
  });
  const hasFocus = await cancel.evaluate(async (node) => { // likewise: a slow page may be told too late
    const isActive = node === document.activeElement;
    await new Promise((resolve) => setTimeout(resolve, 500));
    node.click();
    return isActive;
  });
  assert.ok(hasFocus, "the button keeps the focus");
  await player(page).getByRole("button", { name: /Save as WebM/ }).waitFor();
});

test("A result without the channels says which", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge", { output: { channels: ["displacement"] } });
  await page.goto(url(`#/results/${result}`));
  await says(page.getByRole("region", { name: "In slow motion" }), /does not contain damper_displacement/);
});
