// Results beside each other: the page says from their numbers why one buffer beats another.
import assert from "node:assert/strict";
import { axe, leads, says, test, transferred } from "./support.mjs";

const pair = async (daemon) => [await daemon.run("paper_free_sponge"), await daemon.run("paper_free_aluminium")].map((job) => job.result);

test("The last two runs, sponge and aluminium, are compared: force, time and what differs are told", async ({ page, daemon, url }) => {
  const ids = await pair(daemon);
  await page.goto(url("#/compare"));
  await leads(page, /compare\?a=r-\w+&b=r-\w+/);
  await page.goto(url(`#/compare?a=${ids[0]}&b=${ids[1]}`));
  const page1 = page.getByRole("main");
  await says(page1, /B aluminium@1 pushes 70 times as hard as A sponge@1 \(401 N against 5\.72 N\)/);
  await says(page1, /83 times as long over a contact \(25 ms against 300 µs\)/);
  await says(page.getByRole("table", { name: "Inputs that differ" }), /Damper 1, buffer, contact time\s+25 ms\s+300 µs/);
  assert.doesNotMatch(await page.getByRole("table", { name: "Inputs that differ" }).innerText(), /clearance|stiffness/);
  await page.getByRole("application", { name: "Spectrum of the mean acceleration" }).waitFor();
  await says(page1, /Apart from A sponge@1 by 1 % of the largest displacement: B aluminium@1 from 47 ms on\./);
  // By how much the densities about 500 Hz differ, from the service's own numbers.
  const [a, b] = await Promise.all(ids.map((id) => daemon.get(`/v1/results/${id}/psd.json`)));
  const power = ({ frequency, channels }) => frequency.values.reduce((sum, at, k) =>
    sum + (at > 447 && at < 562 ? channels.mean_acceleration.values[k] : 0), 0);
  await says(page1, new RegExp(`Apart from A sponge@1: B aluminium@1 by 14 dB, most around 500 Hz: ${
    Math.round(10 * Math.log10(power(b) / power(a)))} dB more`));
  assert.deepEqual(await axe(page), []);
});

test("The window of time is in the URL, finer data is little, and back shows the whole again", async ({ page, daemon, url }) => {
  const [a, b] = await pair(daemon);
  await page.goto(url(`#/compare?a=${a}&b=${b}`));
  const chart = page.getByRole("application", { name: "Over time" });
  await chart.waitFor();
  await chart.focus();
  const { bytes } = await transferred(page, async () => {
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("+");
    await leads(page, /from=0&to=5/);
  });
  assert.ok(bytes > 0 && bytes < 200000, `${bytes} bytes`);
  await says(page.getByRole("main"), /From 0 s to 5 s/);
  await page.goBack();
  await says(page.getByRole("main"), /From 0 s to 10 s/);
});

test("By keyboard a result is added and taken out", async ({ page, daemon, url }) => {
  const [a, b] = await pair(daemon);
  await page.goto(url(`#/compare?a=${a}`));
  const second = page.getByRole("combobox", { name: "B", exact: true });
  await second.selectOption(b);
  await page.getByRole("button", { name: "Compare" }).press("Enter");
  await leads(page, new RegExp(`b=${b}`));
  await says(page.getByRole("main"), /70 times as hard/);
  await second.selectOption("none");
  await page.getByRole("button", { name: "Compare" }).press("Enter");
  await leads(page, /compare\?a=r-\w+$/);
});

test("What has no force of an impact is compared too: the impulse model, and a scene at rest", async ({ page, daemon, url }) => {
  const [sponge] = await pair(daemon);
  const impulse = await daemon.run("paper_free_sponge", { contact: { model: "impulse" } });
  const rest = await daemon.run("paper_free_sponge", { excitation: { kind: "free" } });
  await page.goto(url(`#/compare?a=${sponge}&b=${impulse.result}&c=${rest.result}`));
  await says(page.getByRole("main"), /B impulse from 46 ms on/);
  await says(page.getByRole("table", { name: "Numbers that differ" }), /Impacts\s+22\s+30[^]*0 ×/);
  await says(page.getByRole("figure", { name: "Over time" }), /A \S+ between −12\.89 mm and 15 mm/);
});

test("Contact models of a scene: what the impulse model makes of its spectrum", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("compare_sponge");
  await page.goto(url(`#/results/${result}`));
  await says(page.getByRole("main"), /The impulse model's spectrum is off by 16 dB: its contacts take no time, these 26 ms on average/);
  await says(page.getByRole("figure", { name: "Displacement over time" }), /Apart from spring damper, zero penetration by 1 %[^:]*: impulse from 46 ms on, /);
  // A model is a row.
  await says(page.getByRole("row", { name: /^impulse/ }), /2\.692 mm\s+\+4\.2 %[^]*16\.17 dB\s+46 ms/);
});

test("A result that is not there is told, and the page goes on", async ({ page, daemon, url, refused }) => {
  refused(404);
  const [a, b] = await pair(daemon);
  await page.goto(url(`#/compare?a=${a}&b=r-none`));
  await page.getByRole("alert").waitFor();
  await page.getByRole("combobox", { name: "B", exact: true }).selectOption(b);
  await page.getByRole("button", { name: "Compare" }).press("Enter");
  await says(page.getByRole("main"), /70 times as hard/);
});
