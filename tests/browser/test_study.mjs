// What studies found: each kind's sentence, pictures with their tables, and the way from a point to its run.
import assert from "node:assert/strict";
import { axe, leads, overflow, says, tabTo, test, until } from "./support.mjs";

const open = async (page, daemon, url, name, query = "") => {
  const { result } = await daemon.run(name);
  await page.goto(url(`#/results/${result}${query}`));
  return page.getByRole("main");
};

test("A sweep over a buffer and a clearance: a line for each buffer, the best point in words; a point opens, moves and runs", async ({ page, daemon, url }) => {
  const main = await open(page, daemon, url, "sweep_clearance_buffer", "?metric=rms_displacement");
  await says(main, /Least RMS displacement: 1\.\d+ mm at buffer soft rubber, clearance 28 mm, [\d.]+ % below the given scene and [\d.]+ % below the structure without its damper\./);
  await says(main, /edge of the range of the clearance/);
  const chart = page.getByRole("figure", { name: "RMS displacement" });
  for (const name of ["sponge", "soft rubber", "hard rubber", "hard acrylic", "aluminium"]) await says(chart, new RegExp(name));
  for (const name of ["RMS acceleration", "Impacts", "Peak contact force"]) await page.getByRole("figure", { name }).waitFor();
  const { width, height } = await page.getByRole("application", { name: "RMS displacement" }).boundingBox();
  await page.getByRole("application", { name: "RMS displacement" }).click({ position: { x: width - 20, y: height * 0.7 } });
  const point = page.getByRole("group", { name: "Point" });
  await says(point, /Clearance\s+28 mm/);
  await leads(page, /point=\d+/);
  await point.getByRole("slider", { name: "Buffer" }).fill("0");
  await leads(page, /point=26\b/);
  await says(point, /Point 26[^]*Buffer\s+sponge/);
  await point.getByRole("button", { name: "Run this point" }).click();
  await leads(page, /#\/results\/r-\w+$/);
  await page.goBack();
  await page.getByRole("link", { name: "Change its scene" }).click();
  await leads(page, /#\/scene\?s=/);
  await until("the point's clearance", async () => (await page.getByRole("textbox", { name: "Clearance" }).inputValue()) === "0.028");
});

test("A sweep over two numbers is contours: colours with numbers, the value under the pointer, a click opens a point", async ({ page, daemon, url }) => {
  const axes = [{ pointer: "/dampers/0/mass", from: 0.05, to: 0.2, count: 7 }, { pointer: "/dampers/0/clearance", from: 0.005, to: 0.03, count: 11 }];
  const job = await daemon.run("paper_free_sponge", { study: { kind: "sweep", axes, metrics: ["rms_displacement"] } });
  const { columns } = await daemon.get(`/v1/results/${job.result}/table.json`);
  const main = page.getByRole("main");
  await page.goto(url(`#/results/${job.result}`));
  await says(main, /RMS displacement \[mm\]/);
  await says(main, /Least RMS displacement: [\d.]+ mm at damper mass [\d.]+ kg, clearance [\d.]+ mm/);
  const picture = page.getByRole("application", { name: "RMS displacement", exact: true });
  const { width, height } = await picture.boundingBox();
  await picture.hover({ position: { x: width - 18, y: 14 } });
  const last = (columns.rms_displacement.values.at(-1) * 1e3).toPrecision(4);
  await says(main, new RegExp(`mass 0\\.2 kg, clearance 30 mm: ${Number(last)} mm`));
  await picture.press("ArrowDown");
  await says(main, /mass 0\.175 kg, clearance 30 mm: /);
  await picture.click({ position: { x: 66, y: height - 40 } });
  await says(page.getByRole("group", { name: "Point" }), /Point 0/);
  const [first] = columns.rms_displacement.values;
  await says(page.getByRole("group", { name: "Point" }), new RegExp(`${Number((first * 1e3).toPrecision(4))} mm`));
  assert.deepEqual(await axe(page), []);
});

test("A sweep by keyboard: the best point of contours opens, a small chart becomes the large one", async ({ page, daemon, url }) => {
  const axes = [{ pointer: "/dampers/0/mass", from: 0.05, to: 0.2, count: 4 }, { pointer: "/dampers/0/clearance", from: 0.005, to: 0.03, count: 5 }];
  const job = await daemon.run("paper_free_sponge", { study: { kind: "sweep", axes, metrics: ["rms_displacement", "peak_contact_force"] } });
  await page.goto(url(`#/results/${job.result}?metric=rms_displacement`));
  const { columns } = await daemon.get(`/v1/results/${job.result}/table.json`);
  const values = columns.rms_displacement.values;
  const best = columns.index.values[values.indexOf(Math.min(...values))];
  await page.getByRole("button", { name: "Open the best one" }).press("Enter");
  await leads(page, new RegExp(`point=${best}\\b`));
  await page.getByRole("button", { name: "Enlarge: Peak contact force" }).press("Enter");
  await leads(page, /metric=peak_contact_force/);
  await says(page.getByRole("main"), /Least peak contact force: [\d.]+ N at damper mass/);
  await page.getByRole("button", { name: "Enlarge: RMS displacement" }).waitFor();
  assert.deepEqual(await axe(page), []);
  await page.goBack();
  await page.getByRole("button", { name: "Enlarge: Peak contact force" }).waitFor();
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

test("Contact models side by side: how far each is off, by a choice of measures, spectra and motions, those that were refused", async ({ page, daemon, url }) => {
  const main = await open(page, daemon, url, "compare_sponge");
  await says(main, /The impulse model's spectrum is off by 16 dB: its contacts take no time, those of spring damper, zero penetration 26 ms on average\./);
  await says(main, /impulse from 46 ms on/);
  const bars = page.getByRole("figure", { name: "Difference from spring damper, zero penetration" });
  await until("levels", async () => /\+16\.2 dB/.test(await bars.locator("svg").textContent()));
  await page.getByRole("button", { name: "RMS displacement", exact: true }).click();
  await leads(page, /by=rms_displacement/);
  await until("changes", async () => /\+4\.18 %/.test(await bars.locator("svg").textContent()));
  for (const name of ["Spectra of the mean acceleration", "Displacement over time"]) await says(page.getByRole("figure", { name }), /impulse/);
  await says(page.getByRole("table", { name: "Numbers that differ" }), /Lankarani-Nikravesh/);
  await says(main, /Not run: Hertz\. Restitution must be 1 [^/]*; it is 0\.61\./);
  assert.deepEqual(await axe(page), []);
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

test("A sweep's points by keyboard, and its URL gives the same point again", async ({ page, daemon, url, newPage }) => {
  const main = await open(page, daemon, url, "sweep_clearance_buffer", "?point=0");
  const point = page.getByRole("group", { name: "Point" });
  await tabTo(page, point.getByRole("slider", { name: "Buffer" }));
  await page.keyboard.press("ArrowRight");
  await leads(page, /point=27\b/);
  await page.keyboard.press("Tab");
  await page.keyboard.press("ArrowRight");
  await says(main, /Point 28/);
  assert.deepEqual(await axe(page), []);
  const other = await newPage({ viewport: { width: 360, height: 800 }, colorScheme: "dark" });
  await other.goto(page.url());
  await says(other.getByRole("group", { name: "Point" }), /Point 28[^]*Buffer\s+soft rubber/);
  assert.equal(await overflow(other), 0);
});

test("A sweep over a load names the worst point; its points open from the table", async ({ page, daemon, url }) => {
  const main = await open(page, daemon, url, "sweep_frequency");
  await says(main, /Largest RMS displacement: 12\.09 mm at frequency 3\.819 Hz\./);
  await page.getByText("All points as a table").click();
  await page.getByRole("table", { name: "61 points" }).getByRole("button", { name: "28", exact: true }).click();
  await says(main, /Point 28[^]*Frequency\s+3\.819 Hz/);
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
  await says(main, /Take exact[:,]/);
  await says(main, /The cheapest other/);
  await says(main, /displacement wrong by [^]* of CPU time a run/);
  assert.match(await until("a link with the way", () => page.getByRole("link", { name: "rk4, step 100 µs" }).getAttribute("href").then((href) => /s=/.test(href) && href)), /#\/scene\?s=/);
  const rows = page.getByRole("table", { name: /^Ways to run/ }).getByRole("row");
  await says(rows.nth(1), /recommended/);
  await page.goto(url(`#/results/${job.result}?way=exact`));
  await says(main, /exact: error/);
  assert.match(await until("a link with the scene", () => page.getByRole("link", { name: "Use it in the scene" }).getAttribute("href").then((href) => /s=/.test(href) && href)), /#\/scene\?s=/);
});

test("Many seeds: the mean with its interval, a histogram or its sum, bands of spectra, the seed of the largest is in the scene", async ({ page, daemon, url }) => {
  const main = await open(page, daemon, url, "ensemble_random_sponge");
  await says(main, /Mean RMS displacement 3\.819 mm \(95 %: 3\.67 mm to 3\.97 mm\); 90 of 100 runs have 3\.16 mm to 4\.56 mm\. 44 runs\./);
  await says(main, /44 of 200 runs keep the mean of RMS displacement within 0\.05/);
  await says(page.getByRole("figure", { name: "Spectrum of the mean acceleration" }), /one run, by a standard deviation[^]*mean, 95 %/);
  await says(page.getByRole("figure", { name: "Distribution of the RMS displacement" }), /Number of runs/);
  await page.getByRole("button", { name: "Cumulative" }).click();
  await says(page.getByRole("figure", { name: "Distribution of the RMS displacement" }), /Part of the runs at or below/);
  await page.getByRole("group", { name: "Metric" }).getByRole("button", { name: "Peak contact force" }).click();
  await leads(page, /metric=peak_contact_force/);
  await says(main, /Mean peak contact force 5\.631 N/);
  assert.deepEqual(await axe(page), []);
  await page.getByRole("link", { name: "seed 44" }).first().press("Enter");
  await leads(page, /#\/scene/);
});

test("Errors of the buffers: the steepest slope in words and first in a tornado, those that are none, k_b and c_b", async ({ page, daemon, url }) => {
  const main = await open(page, daemon, url, "sensitivity_sponge");
  await says(main, /The peak contact force depends most on the free mass: 0\.86 % for 1 % more of it/);
  await says(main, /peak contact force from 5\.04 N to 6\.73 N \(stated 5\.72 N\)/);
  const tornado = page.getByRole("figure", { name: "Slopes of the peak contact force" });
  assert.match(await tornado.locator("svg").textContent(), /free mass.*contact time.*clearance.*restitution.*\+0\.86 %.*−0\.69 %.*\+0\.66 %.*\+0\.24 %/s);
  await page.getByRole("button", { name: "RMS acceleration", exact: true }).click();
  await until("slopes that do not settle", async () => /not settled/.test(await page.getByRole("figure", { name: "Slopes of the RMS acceleration" }).locator("svg").textContent()));
  await says(page.getByRole("table", { name: /stiffness and damping/ }), /1\.656 kN\/m ± 20\.1 %/);
  assert.deepEqual(await axe(page), []);
});

test("Optimize: the best values with their gain in words, the front of two objectives, the way to the scene that has them", async ({ page, daemon, url }) => {
  const study = { kind: "optimize", max_candidates: 10, objectives: [{ metric: "rms_displacement" }, { metric: "peak_contact_force" }],
    variables: [{ pointer: "/dampers/0/clearance", from: 0.005, to: 0.03 }, { pointer: "/dampers/0/buffer", values: ["sponge", "aluminium"] }] };
  const job = await daemon.run("paper_free_sponge", { duration: 2, study }), main = page.getByRole("main");
  await page.goto(url(`#/results/${job.result}`));
  await says(main, /A good compromise: clearance [\d.]+ mm, buffer (sponge|aluminium)\. RMS displacement [\d.]+ mm, [\d.]+ % (below|above) the given scene/);
  await says(main, /10 candidates, 12 runs\./);
  await says(page.getByRole("table", { name: "Against the structure without dampers" }), /RMS displacement\s+[\d.]+ mm\s+[\d.]+ mm\s+[\d.]+ mm/);
  await says(page.getByRole("table", { name: "Best compromises" }), /clearance [\d.]+ mm, buffer \w+\s+[\d.]+\s+[\d.]+/);
  await page.getByRole("figure", { name: "Best compromises" }).waitFor();
  assert.deepEqual(await axe(page), []);
  await page.getByRole("link", { name: "Run the scene with these values" }).click();
  await leads(page, /#\/scene\?s=/);
});

test("Optimize over two numbers: every candidate on a map of both, coloured by the objective", async ({ page, daemon, url }) => {
  const study = { kind: "optimize", max_candidates: 10, objectives: [{ metric: "rms_displacement" }],
    variables: [{ pointer: "/dampers/0/clearance", from: 0.005, to: 0.03 }, { pointer: "/dampers/0/mass", from: 0.05, to: 0.2 }] };
  const job = await daemon.run("paper_free_sponge", { duration: 2, study });
  await page.goto(url(`#/results/${job.result}`));
  const map = page.getByRole("figure", { name: "The search" });
  await says(map, /RMS displacement of every candidate[^]*from [\d.]+ mm/);
  await until("both axes", async () => /Damper mass \[kg\]/.test(await map.locator("svg").first().textContent()));
  const plot = page.getByRole("application", { name: "The search" });
  await plot.hover({ position: { x: 300, y: 100 } });
  await says(map, /from [\d.]+ mm 0\.\d+ kg, [\d.]+ mm/);
  assert.deepEqual(await axe(page), []);
});

test("Calibrate: what was found and how well it is known, measured beside fitted, what is left", async ({ page, daemon, url }) => {
  const main = await open(page, daemon, url, "calibrate_free_sponge");
  await says(main, /Explained: restitution 0\.6098 ± [^,]+, contact time 24\.99 ms ± 29 µs\./);
  await says(page.getByRole("figure", { name: "Displacement", exact: true }), /measured[^]*fitted/);
  await page.getByRole("figure", { name: "Displacement, measured less fitted" }).waitFor();
  await says(page.getByRole("table", { name: "Parameters" }), /Contact time\s+24\.99 ms\s+[\d.]+ µs\s+24\.9 ms to 25\.1 ms\s+yes/);
  await says(page.getByRole("table", { name: "Residuals" }), /Displacement\s+101 µm/);
  assert.deepEqual(await axe(page), []);
  await page.getByRole("link", { name: "Propose a revision of sponge" }).click();
  await page.getByRole("button", { name: "Make it revision 2" }).waitFor();
  await says(page.getByRole("main"), /Calibration of Sponge/);
  assert.match(await page.getByRole("textbox", { name: /^Restitution$/ }).inputValue(), /^0\.6098/);
});

test("Response: the largest motion against that without dampers; stable, unstable and irregular motions", async ({ page, daemon, url }) => {
  const main = await open(page, daemon, url, "response_sponge");
  await says(main, /The largest displacement is [\d.]+ mm at frequency [\d.]+ Hz, [\d.]+ % below the largest without dampers/);
  await says(page.getByRole("figure", { name: "Response curve" }), /without dampers[^]*stable[^]*unstable/);
  const curve = page.getByRole("application", { name: "Response curve" });
  const { width, height } = await curve.boundingBox();
  await curve.hover({ position: { x: width / 2, y: height / 2 } });
  await says(page.getByRole("figure", { name: "Response curve" }), /stable [\d.]+ mm, period \d+ cycles?, \d+ impacts?/);
  await page.getByText("All points as a table").click();
  await says(page.getByRole("table", { name: "Points" }), /3\.0*\s+up\s+1\s+2\s+yes\s+4\.95\d*\s+3\.50\d*/);
  await open(page, daemon, url, "ensemble_inputs");
  const shares = page.getByRole("figure", { name: /variance of the RMS displacement/ });
  await until("shares", async () => /buffer.*clearance.*66\.7 %/s.test(await shares.locator("svg").textContent()));
  await page.getByRole("figure", { name: "Fan of the displacement" }).waitFor();
  assert.deepEqual(await axe(page), []);
});

test("Fragility: the intensity at which half of the motions exceed a limit, with the records beside the curve", async ({ page, daemon, url }) => {
  const samples = (seed) => Array.from({ length: 800 }, (_, at) => Math.sin(at * (0.13 + 0.04 * seed)) * Math.exp(-(((at - 400) / 150) ** 2)) + 0.3 * Math.sin(at * 0.71 + seed));
  for (let seed = 1; seed <= 4; seed++) await daemon.ask("POST", "/v1/records", { name: `quake_${seed}`, interval: 0.01, samples: samples(seed) });
  const study = { kind: "fragility", records: [1, 2, 3, 4].map((seed) => `quake_${seed}`), levels: { values: [0.5, 1, 2, 3, 4, 6] },
    limits: [{ metric: "peak_displacement", value: 0.01 }, { metric: "peak_acceleration", value: 4 }] };
  const job = await daemon.run("paper_free_sponge", { excitation: { kind: "record", name: "quake_1" }, duration: 8, study });
  const main = page.getByRole("main");
  await page.goto(url(`#/results/${job.result}`));
  await says(main, /bring the peak displacement above 10 mm at a peak ground acceleration of [\d.]+ m\/s²|no curve can be fitted/);
  await page.getByRole("figure", { name: "Fragility" }).waitFor();
  await page.getByRole("button", { name: "Peak acceleration 4 m/s²" }).click();
  await leads(page, /limit=1/);
  await says(page.getByRole("figure", { name: "Peak acceleration of each record" }), /records[^]*16 to 84 %[^]*median/);
  assert.deepEqual(await axe(page), []);
});
