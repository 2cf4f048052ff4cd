// What studies found: each kind's sentence, pictures with their tables, and the way from a point to its run.
import assert from "node:assert/strict";
import { axe, leads, overflow, says, tabTo, test, until } from "./support.mjs";

const open = async (page, daemon, url, name, query = "") => {
  const { result } = await daemon.run(name);
  await page.goto(url(`#/results/${result}${query}`));
  return page.getByRole("main");
};

test("A sweep's map: a cell tells its number, a click opens its point, the point runs", async ({ page, daemon, url }) => {
  const main = await open(page, daemon, url, "sweep_clearance_buffer", "?metric=peak_contact_force");
  await says(main, /2\.277 N at buffer sponge@1, clearance 2 mm to 566\.1 N at buffer aluminium@1, clearance 28 mm/);
  const cells = page.getByRole("grid", { name: "Peak contact force: buffer up, clearance across" }).getByRole("row", { name: /sponge/ }).getByRole("gridcell");
  await cells.nth(25).hover();
  await says(main, /buffer sponge@1, clearance 27 mm: \d/);
  await cells.last().click();
  await says(main, /Point 26\s+Buffer\s+sponge@1\s+Clearance\s+28 mm/);
  await leads(page, /point=26/);
  await page.getByRole("button", { name: "Run this point" }).click();
  await leads(page, /#\/results\/r-\w+$/);
  await page.goBack();
  await page.getByRole("link", { name: "Change its scene" }).click();
  await leads(page, /#\/scene\?s=/);
  await until("the point's clearance", async () => (await page.getByRole("textbox", { name: "Clearance" }).inputValue()) === "0.028");
});

test("A study's chart opened by itself has its colours, light and dark", async ({ daemon, newPage }) => {
  const { result } = await daemon.run("compare_sponge");
  const fills = await Promise.all(["light", "dark"].map(async (colorScheme) => {
    const page = await newPage({ colorScheme });
    await page.goto(`${daemon.url}/v1/results/${result}/compare.svg`);
    return page.evaluate(() => getComputedStyle(document.querySelector(".page")).fill);
  }));
  assert.deepEqual(fills, ["rgb(255, 255, 255)", "rgb(22, 24, 28)"]);
});

test("Below a study stands the scene's own run", async ({ page, daemon, url }) => {
  await open(page, daemon, url, "compare_sponge");
  assert.equal(await page.getByRole("region", { name: "Motion over time" }).count(), 0);
  await page.getByText("The run of the unchanged scene").click();
  await says(page.getByRole("main"), /Impacts[^]*22[^]*Largest force/);
  await says(page.getByRole("region", { name: "Motion over time" }), /almost all of the motion/);
  await page.getByRole("tab", { name: "How it was computed" }).click();
  await says(page.getByRole("tabpanel"), /10 s of motion, 22 contacts and 10001 samples\./);
});

test("A sweep's map by keyboard, and its URL gives the same point again", async ({ page, daemon, url, newPage }) => {
  const main = await open(page, daemon, url, "sweep_clearance_buffer");
  const grid = page.getByRole("grid", { name: /RMS displacement:/ });
  await tabTo(page, grid.locator("[tabindex='0']"));
  for (const key of ["ArrowRight", "ArrowUp"]) await page.keyboard.press(key);
  await says(main, /buffer soft_rubber@1, clearance 3 mm: /);
  await page.keyboard.press("Enter");
  await says(main, /Point 28/);
  assert.deepEqual(await axe(page), []);
  const other = await newPage({ viewport: { width: 360, height: 800 }, colorScheme: "dark" });
  await other.goto(page.url());
  await says(other.getByRole("main"), /Point 28\s+Buffer\s+soft_rubber@1/);
  assert.equal(await overflow(other), 0);
});

test("A sweep over one number is lines, whose points open", async ({ page, daemon, url }) => {
  const main = await open(page, daemon, url, "sweep_frequency");
  await says(main, /12\.09 mm at excitation frequency 3\.819 Hz/);
  await page.getByText("All points as a table").click();
  await page.getByRole("table", { name: "61 points" }).getByRole("button", { name: "28", exact: true }).click();
  await says(main, /Point 28\s+Excitation frequency\s+3\.819 Hz/);
});

test("Points that fail are told with their reason, and can be made again", async ({ page, daemon, url }) => {
  const job = await daemon.run("paper_free_sponge", { accuracy: { solver: "rk4", step: 0.001 },
    study: { kind: "sweep", axes: [{ pointer: "/dampers/0/buffer", values: ["sponge", "aluminium"] }], metrics: ["rms_displacement"] } });
  await page.goto(url(`#/results/${job.result}`));
  await says(page.getByRole("main"), /1 failed[^]*1 from point 1 on: rk4 is unstable/);
  await page.getByRole("button", { name: "Make the failed ones again" }).click();
  await leads(page, /#\/(jobs|results)\//);
});

test("The trade of error against cost names what to take, and a way leads into the scene", async ({ page, daemon, url }) => {
  const main = page.getByRole("main");
  const job = await daemon.run("paper_free_sponge", { study: { kind: "tradeoff", repeats: 1, solvers: ["exact", "rk4"] } });
  await page.goto(url(`#/results/${job.result}`));
  // Which of its sample rates is cheapest is measured, and so is whether a closer one takes hardly longer.
  await says(main, /Take exact[.,]/);
  await says(main, /keeps? displacement within 0\.001/);
  assert.match(await until("a link with the way", () => page.getByRole("link", { name: "rk4, step 0.0001 s" }).getAttribute("href").then((href) => /s=/.test(href) && href)), /#\/scene\?s=/);
  assert.match(await until("a link with the scene", () => page.getByRole("link", { name: "Use it in the scene" }).getAttribute("href").then((href) => /s=/.test(href) && href)), /#\/scene\?s=/);
});

test("Many seeds: how many were enough, bands of mean and runs, the seed of the largest is in the scene", async ({ page, daemon, url }) => {
  const main = await open(page, daemon, url, "ensemble_random_sponge");
  await says(main, /44 of 200 runs keep the mean of RMS displacement within 0\.05/);
  await says(page.getByRole("figure", { name: "Spectrum of the mean acceleration" }), /one run, by a standard deviation[^]*mean, 95 %/);
  assert.deepEqual(await axe(page), []);
  await page.getByRole("link", { name: "seed 44" }).first().press("Enter");
  await leads(page, /#\/scene/);
});

test("Errors of the buffers: bands, settled slopes and those that are none, k_b and c_b", async ({ page, daemon, url }) => {
  const main = await open(page, daemon, url, "sensitivity_sponge");
  await says(main, /peak contact force from 5\.04 N to 6\.73 N \(stated 5\.72 N\)/);
  await says(page.getByRole("table", { name: /Slopes/ }), /not settled/);
  await says(page.getByRole("table", { name: /stiffness and damping/ }), /1\.656 kN\/m ± 20\.1 %/);
  assert.deepEqual(await axe(page), []);
});

test("Studies that design: the chart, the values found with units, and the way to the scene that has them", async ({ page, daemon, url }) => {
  const study = { kind: "optimize", max_candidates: 10, objectives: [{ metric: "rms_displacement" }, { metric: "peak_contact_force" }],
    variables: [{ pointer: "/dampers/0/clearance", from: 0.005, to: 0.03 }, { pointer: "/dampers/0/buffer", values: ["sponge", "aluminium"] }] };
  const job = await daemon.run("paper_free_sponge", { duration: 2, study }), main = page.getByRole("main");
  await page.goto(url(`#/results/${job.result}`));
  await says(main, /Best: clearance 0\.0\d+, buffer (sponge|aluminium)@1\.\s+10 candidates, 12 runs\./);
  await says(page.getByRole("table", { name: "Gain" }), /RMS displacement\s+[\d.]+ mm\s+[\d.]+ mm\s+[\d.]+ mm/);
  await says(page.getByRole("table", { name: "Best compromises" }), /clearance 0\.0\d+, buffer \w+@1\s+[\d.]+ mm\s+[\d.]+ N/);
  await until("the chart", () => page.getByRole("img", { name: /^Chart/ }).evaluate((image) => image.naturalWidth > 0));
  assert.deepEqual(await axe(page), []);
  await page.getByRole("link", { name: "Run the scene with these values" }).click();
  await leads(page, /#\/scene\?s=/);
  await open(page, daemon, url, "calibrate_free_sponge");
  await says(page.getByRole("table", { name: "Parameters" }), /Buffer contact time\s+24\.99 ms\s+[\d.]+ µs\s+24\.9 ms to 25\.1 ms\s+yes/);
  await open(page, daemon, url, "response_sponge");
  await says(page.getByRole("table", { name: "Points" }), /3 Hz\s+up\s+1\s+2\s+yes\s+4\.954 mm\s+3\.498 mm/);
  await open(page, daemon, url, "ensemble_inputs");
  await says(page.getByRole("table", { name: /Shares of the inputs/ }), /Peak contact force\s+buffer\s+0\.\d+\s+0\.\d+ to 0\.\d+/);
  assert.deepEqual(await axe(page), []);
});
