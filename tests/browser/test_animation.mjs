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
  await tabTo(page, instant(page));
  await page.keyboard.press("ArrowRight");
  await leads(page, /t=0\.01\b/);
  await page.keyboard.press("Home");
  await leads(page, /t=0\b/);
  await page.keyboard.press("Space");
  await until("it to move", async () => at(page) > 0.01);
  await page.keyboard.press("Space");
  await player(page).getByRole("button", { name: "Play" }).waitFor();
  const stood = at(page);
  const [, told] = /Time\s+([\d.]+) s/.exec(await player(page).innerText());
  assert.ok(Math.abs(Number(told) - stood) < 1.1e-5, `it stands at ${told} s, its address says ${stood}`);
});

test("A result without the channels says which", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge", { output: { channels: ["displacement"] } });
  await page.goto(url(`#/results/${result}`));
  await says(page.getByRole("region", { name: "In slow motion" }), /does not contain damper_displacement/);
});

test("The motion is played in a loop, goes from impact to impact, and is saved as a video", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  const { impacts } = await daemon.get(`v1/results/${result}/impacts.json`);
  await page.goto(url(`#/results/${result}?from=0.1&to=0.2`));
  await says(player(page), /Contact force/);
  await player(page).getByRole("button", { name: "To the impact after" }).click();
  await leads(page, /impact=2\b/);
  await says(player(page), new RegExp(`${impacts[1].start.toFixed(5)} s`));
  await player(page).getByRole("button", { name: "Loop" }).click();
  await player(page).getByLabel("Speed").selectOption("2");
  await player(page).getByRole("button", { name: "Play" }).click();
  let last = 0;
  await until("it to begin again", async () => {
    const now = Number(await instant(page).inputValue());
    const isBack = now < last - 0.01;
    last = now;
    return isBack;
  });
  await player(page).getByRole("button", { name: "Pause" }).click();
  await player(page).getByLabel("Speed").selectOption("10");
  const saving = page.waitForEvent("download");
  await player(page).getByRole("button", { name: "WebM" }).click();
  await player(page).getByRole("progressbar", { name: "Recording" }).waitFor();
  const video = fs.readFileSync(await (await saving).path());
  assert.equal(video.readUInt32BE(0), 0x1a45dfa3, "it is a WebM");
  assert.ok(video.length > 10000, `it has ${video.length} bytes`);
});

test("While a buffer pushes, its pad is thinner and the force has an arrow", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  const width = async () => (await page.locator("[data-part=pad-0]").boundingBox()).width;
  await page.goto(url(`#/results/${result}?t=0.1`));
  await says(player(page), /0\.10000 s/);
  const [free, arrow] = [await width(), page.locator("[data-part=force]")];
  assert.equal(await arrow.getAttribute("visibility"), "hidden");
  await page.goto(url(`#/results/${result}?t=0.125`));
  await until("the force", async () => (await arrow.getAttribute("visibility")) === "visible");
  assert.ok((await width()) < 0.97 * free, `${await width()} px, free ${free}`);
});
