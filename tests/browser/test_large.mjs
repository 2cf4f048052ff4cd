// Results of 10,000,000 samples and of many channels: what a browser takes of them, and that no peak is lost.
import assert from "node:assert/strict";
import { leads, says, test, transferred } from "./support.mjs";

const MOST_BYTES = 200000;
const structure = { mass: 1.35, stiffness: 865, damping: 1.092 };
const motion = (page) => page.getByRole("region", { name: "Motion over time" });
const data = ({ requests }) => requests.filter((one) => one.url?.includes("/v1/"));
const sum = (requests) => requests.reduce((total, one) => total + one.bytes, 0);

// What the network brings until the charts are drawn and all is quiet.
async function measured(page, action) {
  const seen = await transferred(page, async () => {
    const answer = page.waitForResponse(/series\.(json|npy)/);
    await action();
    await (await answer).finished();
  });
  return data(seen);
}

async function drag(page, chart) {
  const box = await chart.boundingBox();
  await page.mouse.move(box.x + box.width * 0.42, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.62, box.y + box.height / 2, { steps: 4 });
  await page.mouse.up();
}

test("10,000,000 samples: the first plot and each of five zooms bring less than 200 kB", async ({ page, daemon, url }) => {
  const job = await daemon.run({ structure, excitation: { kind: "random", band: [0.5, 50], rms: 1, seed: 1 },
    duration: 10000, sample_rate: 1000, output: { channels: ["displacement", "acceleration"], psd: null } });
  await page.goto(url("#/shell")); // the page's own files are here before
  const first = await measured(page, () => page.evaluate((id) => { location.hash = `#/results/${id}`; }, job.result));
  assert.ok(sum(first) < MOST_BYTES, JSON.stringify(first));
  await says(motion(page), /least and the largest of 12\d+ samples/);
  const chart = page.getByRole("application", { name: "Displacement" });
  await chart.scrollIntoViewIfNeeded();
  for (let zoom = 1, span = 10000; zoom <= 5; zoom++) {
    const bytes = await measured(page, () => drag(page, chart));
    const hasAll = bytes.some((one) => one.url.includes("series.npy")); // at most 50,000 samples of three columns
    assert.ok(sum(bytes) < (hasAll ? 24 * 50000 + MOST_BYTES : MOST_BYTES), `zoom ${zoom}: ${JSON.stringify(bytes)}`);
    const [, from, to] = await leads(page, /from=([\d.]+)&to=([\d.]+)/);
    assert.ok(to - from < span * 0.5 && to > from, `zoom ${zoom}: from ${from} to ${to}`);
    span = to - from;
  }
  await says(motion(page), /./);
});

test("A peak of one sample in 10,000,000 is seen in the whole view", async ({ page, daemon, url }) => {
  const samples = Array(5000).fill(0);
  samples[4321] = 5;
  const job = await daemon.run({ structure, excitation: { kind: "record", samples, interval: 0.001 },
    duration: 10000, sample_rate: 1000, output: { channels: ["base_acceleration"], psd: null } });
  await page.goto(url(`#/results/${job.result}`));
  await says(page.getByRole("figure", { name: "Base acceleration" }), /and 5 m\/s²/);
  // The band reaches the upper half of the plot: only the peak is there.
  const d = await page.getByRole("figure", { name: "Base acceleration" }).locator("path.band").getAttribute("d");
  const heights = [...d.matchAll(/[ML]([\d.-]+) ([\d.-]+)/g)].map(([, , y]) => Number(y));
  const [top, bottom] = [Math.min(...heights), Math.max(...heights)];
  assert.ok(bottom - top > 100 && heights.filter((y) => y < (top + bottom) / 2).length >= 1, `from ${top} to ${bottom}`);
});

test("Twenty channels at once stay under 200 kB too", async ({ page, daemon, url }) => {
  const names = ["displacement", "velocity", "acceleration", "mean_acceleration"];
  const channels = names.flatMap((name) => [1, 2, 3, 4, 5].map((storey) => `${name}_${storey}`));
  const job = await daemon.run({ structure: { kind: "frame", masses: Array(5).fill(1), stiffnesses: Array(5).fill(5000), damping_ratio: 0.02 },
    excitation: { kind: "random", band: [0.5, 50], rms: 1, seed: 2 }, duration: 100, sample_rate: 1000, output: { channels, psd: null } });
  await page.goto(url("#/shell"));
  const all = await measured(page, () => page.evaluate((hash) => { location.hash = hash; }, `#/results/${job.result}?channels=${channels.join(",")}`));
  const bytes = all.filter((one) => /(series|impacts)\.json/.test(one.url)); // the plots' own; the animation takes pieces besides
  assert.ok(bytes.length > 1, JSON.stringify(all));
  assert.ok(sum(bytes) < MOST_BYTES, JSON.stringify(bytes));
});
