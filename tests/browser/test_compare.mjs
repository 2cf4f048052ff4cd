// Results beside each other: the page says from their numbers why one buffer beats another.
import assert from "node:assert/strict";
import { axe, leads, says, test, transferred } from "./support.mjs";

const pair = async (daemon) => [await daemon.run("paper_free_sponge"), await daemon.run("paper_free_aluminium")].map((job) => job.result);

test("The last two runs, sponge and aluminium, are compared: force, time and what differs are stated", async ({ page, daemon, url }) => {
  const ids = await pair(daemon);
  await page.goto(url("#/compare"));
  await leads(page, /compare\?a=r-\w+&b=r-\w+/);
  await page.goto(url(`#/compare?a=${ids[0]}&b=${ids[1]}`));
  const page1 = page.getByRole("main");
  await says(page1, /B aluminium moves 3\.8 % less than A sponge \(rms 2\.48 mm against 2\.58 mm\)/);
  await says(page1, /B aluminium pushes 70 times as hard as A sponge \(401 N against 5\.72 N\)/);
  await says(page1, /A sponge pushes 83 times as long over a contact \(25 ms against 300 µs\)/);
  await says(page.getByRole("table", { name: "Inputs that differ" }), /Damper 1, buffer, contact time \[ms\]\s+25(\.0)?\s+0\.3/);
  assert.doesNotMatch(await page.getByRole("table", { name: "Inputs that differ" }).innerText(), /clearance|stiffness/);
  await says(page.getByRole("table", { name: "First impacts" }), /Peak force \[N\]\s+3\.8\s+291\.0/);
  await page.getByRole("application", { name: "Spectrum of the mean acceleration" }).waitFor();
  await says(page1, /More than 1 % of the largest displacement apart from A sponge: B aluminium from 47 ms on\./);
  // By how much the densities about 500 Hz differ, from the service's own numbers.
  const [a, b] = await Promise.all(ids.map((id) => daemon.get(`/v1/results/${id}/psd.json`)));
  const power = ({ frequency, channels }) => frequency.values.reduce((sum, at, k) =>
    sum + (at > 447 && at < 562 ? channels.mean_acceleration.values[k] : 0), 0);
  const level = Math.round(10 * Math.log10(power(b) / power(a)));
  await says(page1, new RegExp(`Apart from A sponge: B aluminium by 14 dB, most around 500 Hz: ${level} dB more`));
  await page.getByRole("button", { name: "Numbers: Level difference by third octaves" }).click();
  await says(page.getByRole("region", { name: "Numbers of Level difference by third octaves" }), new RegExp(`50\\d\\.\\d+\\s+${level - 1}?\\d*`));
  assert.deepEqual(await axe(page), []);
});

test("From a fresh dashboard sponge against aluminium takes 3 clicks from the scene, 2 from the page of comparisons", async ({ page, daemon, url }) => {
  for (const job of (await daemon.get("/v1/jobs?limit=100")).jobs) await fetch(`${daemon.url}/v1/jobs/${job.id}?purge=1`, { method: "DELETE" });
  await page.goto(url("#/scene"));
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.getByRole("button", { name: "Compare with …" }).click();
  await page.getByRole("button", { name: "Aluminium", exact: true }).click();
  await leads(page, /compare\?a=r-\w+&b=r-\w+/);
  await says(page.getByRole("main"), /B aluminium pushes 70 times as hard as A sponge/);
  for (const job of (await daemon.get("/v1/jobs?limit=100")).jobs) await fetch(`${daemon.url}/v1/jobs/${job.id}?purge=1`, { method: "DELETE" });
  await page.goto(url("#/records"));
  await page.getByRole("navigation").getByRole("link", { name: "Compare" }).click();
  await page.getByRole("button", { name: "Sponge against aluminium" }).click();
  await says(page.getByRole("main"), /B aluminium pushes 70 times as hard as A sponge/);
});

test("The difference over time is that of the samples, and a legend hides and isolates", async ({ page, daemon, url }) => {
  const ids = await pair(daemon);
  await page.goto(url(`#/compare?a=${ids[0]}&b=${ids[1]}&from=0&to=1`));
  const chart = page.getByRole("figure", { name: "Difference over time" });
  await chart.getByRole("button", { name: "Numbers: Difference over time" }).click();
  const [a, b] = await Promise.all(ids.map((id) => daemon.get(`/v1/results/${id}/series.json?channels=displacement&from=0.4&to=0.4`)));
  const difference = b.channels.displacement.values[0] - a.channels.displacement.values[0];
  const row = page.getByRole("region", { name: "Numbers of Difference over time" }).getByRole("row", { name: /^0\.4\s/ });
  const text = await row.innerText();
  const power = { "⁻⁴": 1e-4, "⁻⁵": 1e-5 };
  const [, digits, exponent] = /\s(−?[\d.]+)(?: × 10(⁻.))?$/.exec(text);
  assert.ok(Math.abs(Number(digits.replace("−", "-")) * (power[exponent] ?? 1) - difference) < 1e-8, `${text} is ${difference}`);
  const motion = page.getByRole("figure", { name: "Over time", exact: true });
  await motion.getByRole("button", { name: "B aluminium" }).click({ modifiers: ["Shift"] });
  assert.equal(await motion.getByRole("button", { name: "A sponge" }).getAttribute("aria-pressed"), "false");
  await motion.getByRole("button", { name: "A sponge" }).click();
  assert.equal(await motion.getByRole("button", { name: "A sponge" }).getAttribute("aria-pressed"), "true");
});

test("The window of time is in the URL, finer data is little, and back shows the whole again", async ({ page, daemon, url }) => {
  const [a, b] = await pair(daemon);
  await page.goto(url(`#/compare?a=${a}&b=${b}`));
  const chart = page.getByRole("application", { name: "Over time", exact: true });
  await chart.waitFor();
  await chart.focus();
  const { bytes } = await transferred(page, async () => {
    await page.keyboard.press("+");
    await leads(page, /from=[\d.]+&to=[\d.]+/);
  });
  assert.ok(bytes < 200000, `${bytes} bytes`);
  await says(page.getByRole("main"), /Whole/);
  await page.goBack();
  await leads(page, /compare\?a=r-\w+&b=r-\w+$/);
});

test("A result is added and taken out", async ({ page, daemon, url }) => {
  const [a, b] = await pair(daemon);
  await page.goto(url(`#/compare?a=${a}`));
  await page.getByRole("combobox", { name: "Add a result" }).selectOption(b);
  await page.getByRole("button", { name: "Add it" }).click();
  await leads(page, new RegExp(`b=${b}`));
  await says(page.getByRole("main"), /70 times as hard/);
  await page.getByRole("button", { name: "Take B aluminium out" }).press("Enter");
  await leads(page, /compare\?a=r-\w+$/);
});

test("What has no force of an impact is compared too: the impulse model, and a scene at rest", async ({ page, daemon, url }) => {
  const [sponge] = await pair(daemon);
  const impulse = await daemon.run("paper_free_sponge", { contact: { model: "impulse" } });
  const rest = await daemon.run("paper_free_sponge", { excitation: { kind: "free" } });
  await page.goto(url(`#/compare?a=${sponge}&b=${impulse.result}&c=${rest.result}`));
  await says(page.getByRole("main"), /B impulse[^.]* from 46 ms on/);
  await says(page.getByRole("table", { name: "Numbers that differ" }), /Impacts\s+22\s+30[^]*0 ×/);
  await says(page.getByRole("figure", { name: "Over time", exact: true }), /A [^;]* between −12\.89 mm and 15 mm/);
});

test("Results that are the same are called so, and a frame's top storey is compared with a single mass", async ({ page, daemon, url }) => {
  const [sponge] = await pair(daemon);
  const frame = await daemon.run("frame_two_dampers", { duration: 5 });
  await page.goto(url(`#/compare?a=${sponge}&b=${sponge}`));
  await says(page.getByRole("main"), /The results are the same\.[^]*The motions differ by rounding at most\.[^]*The spectra do not differ\./);
  await page.goto(url(`#/compare?a=${sponge}&b=${frame.result}`));
  await says(page.getByRole("main"), /Of a frame the top storey is shown/);
  const top = await daemon.get(`/v1/results/${frame.result}/series.json?channels=displacement_3`);
  const largest = Math.max(...top.channels.displacement_3.values) * 1000;
  await says(page.getByRole("figure", { name: "Over time", exact: true }), new RegExp(`and ${Math.floor(largest)}\\.`));
});

test("A result that is not there is named, and the page goes on", async ({ page, daemon, url, refused }) => {
  refused(404);
  const [a, b] = await pair(daemon);
  await page.goto(url(`#/compare?a=${a}&b=r-none`));
  await page.getByRole("alert").waitFor();
  await page.getByRole("button", { name: "Take B r-none out" }).click();
  await page.getByRole("combobox", { name: "Add a result" }).selectOption(b);
  await page.getByRole("button", { name: "Add it" }).click();
  await says(page.getByRole("main"), /70 times as hard/);
});
