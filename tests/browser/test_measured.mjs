// Measured data over a result: chosen in two clicks or dropped, shifted, compared over time and in the spectrum; files that are not right.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { axe, leads, says, test, until } from "./support.mjs";

// The simulated displacement, later by `shift` s and `factor` times as large, every second sample: [[time in s, value in m]].
async function motion(daemon, result, { shift = 0.137, factor = 1.05 } = {}) {
  const { channels } = await daemon.get(`/v1/results/${result}/series.json?channels=displacement`);
  return channels.displacement.values.flatMap((value, at) => (at % 2 === 0 && at < 6000 ? [[at / 1000 + shift, factor * value]] : []));
}

function file(folder, text, name = "measured.csv") {
  const where = path.join(folder, name);
  fs.writeFileSync(where, text);
  return where;
}

async function choose(page, where) {
  const chooser = page.waitForEvent("filechooser");
  await page.getByRole("button", { name: "Measured data …" }).click();
  await (await chooser).setFiles(where);
}

const panel = (page) => page.getByRole("region", { name: "Measured data", exact: true });

test("Two clicks lay a measured file over a result: the shift is found, the difference stated, levels by third octaves", async ({ page, daemon, url, folder }) => {
  const { result } = await daemon.run("paper_free_sponge");
  const rows = await motion(daemon, result);
  await page.goto(url(`#/results/${result}`));
  const decimal = (value) => value.toPrecision(8).replace(".", ",");
  const text = ["Zeit [s];displacement [mm]", ...rows.map(([time, value]) => `${decimal(time)};${decimal(1000 * value)}`)].join("\r\n");
  await choose(page, file(folder, text));
  const said = await says(panel(page).getByRole("status"), /Moved by −137 ms, the measurement differs by .*µm rms, 5 % of the simulated rms; correlation 1\./);
  const rms = Math.sqrt(rows.reduce((sum, [, value]) => sum + (value * (0.05 / 1.05)) ** 2, 0) / rows.length);
  assert.ok(Math.abs(Number(/by ([\d.]+) µm rms/.exec(said)[1]) * 1e-6 - rms) < 0.02 * rms, `${said} is ${rms}`);
  for (const name of ["Measured and simulated displacement", "Measured less simulated", "Spectra of the measured and simulated displacement"])
    await panel(page).getByRole("application", { name, exact: true }).waitFor();
  // A motion 5 % larger is 0.42 dB louder.
  await panel(page).getByRole("button", { name: "Numbers: Measured over simulated by third octaves" }).click();
  const level = await panel(page).getByRole("region", { name: /Numbers of Measured over/ }).getByRole("row", { name: /^4\.0/ }).innerText();
  assert.ok(Math.abs(Number(level.split(/\s+/)[1]) - 0.424) < 0.05, level);
  assert.deepEqual(await axe(page), []);
  // It is there after a reload; then it is closed.
  await page.reload();
  await says(panel(page).getByRole("status"), /Moved by −137 ms/);
  await panel(page).getByRole("button", { name: "Close the measured data" }).click();
  await until("it to be closed", async () => (await panel(page).count()) === 0);
});

test("The shift is adjusted in the address; one column needs an interval, and its unit is chosen", async ({ page, daemon, url, folder }) => {
  const { result } = await daemon.run("paper_free_sponge");
  const rows = await motion(daemon, result, { shift: 0, factor: 1 });
  await page.goto(url(`#/results/${result}`));
  await choose(page, file(folder, rows.map(([, value]) => 1000 * value).join("\n"), "one.txt"));
  await panel(page).getByRole("button", { name: "mm", exact: true }).click();
  await panel(page).getByLabel("Interval [ms]").fill("2");
  await panel(page).getByLabel("Interval [ms]").press("Enter");
  await says(panel(page).getByRole("status"), /Moved by 0 s, the measurement is the simulated motion but for rounding; correlation 1/);
  await panel(page).getByLabel("Shift [ms]").fill("20");
  await panel(page).getByLabel("Shift [ms]").press("Enter");
  await leads(page, /shift=0\.02/);
  await says(panel(page).getByRole("status"), /Moved by 20 ms/);
  await panel(page).getByRole("button", { name: "Find the shift" }).click();
  await says(panel(page).getByRole("status"), /Moved by 0 s/);
});

test("A file is dropped on the page; one that is not right is refused with its line and what would be right", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}`));
  await page.getByRole("button", { name: "Measured data …" }).waitFor();
  const drop = (text) => page.evaluate((content) => {
    const data = new DataTransfer();
    data.items.add(new File([content], "dropped.csv", { type: "text/csv" }));
    for (const name of ["dragover", "drop"])
      document.querySelector("main").dispatchEvent(new DragEvent(name, { dataTransfer: data, bubbles: true, cancelable: true }));
  }, text);
  const rows = (await motion(daemon, result)).map(([time, value]) => `${time.toFixed(3)},${value}`);
  const wrong = (at, line) => [...rows.slice(0, at), line, ...rows.slice(at + 1)].join("\n");
  for (const [text, fault] of [[wrong(20, "0.177,abc"), /Line 21: "abc" is not a number; a time and a value would be right: 0\.005; 0\.0132/],
    [wrong(30, "5"), /Line 31 has 1 column, the lines before have 2/],
    [wrong(40, "9.9,0"), /Line 41: times rise by even steps, so 0\.217 would be right, not 9\.9/],
    [wrong(50, ""), /Line 51 is empty/],
    [wrong(60, "0.257,1e300"), /Line 61: 1e300 is too large for a measured value/],
    ["time,value\n1,2\n", /dropped\.csv has 1 lines? of numbers; at least 16/],
    ["<html>", /dropped\.csv has 0 lines of numbers/]]) {
    await drop(text);
    await says(panel(page).getByRole("alert"), fault);
  }
  await drop(["time,value,", ...rows].join(",\r")); // separators at the ends, lines of an old system
  await says(panel(page).getByRole("status"), /Moved by −137 ms/);
  assert.equal(await panel(page).getByRole("alert").count(), 0);
});
