// Ground motions: one uploaded, looked at, used in a scene, deleted.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { axe, leads, overflow, says, test, transferred, until } from "./support.mjs";

const course = (count) => Array.from({ length: count }, (_, k) => `${(Math.sin(0.3 * k) * Math.sin((Math.PI * k) / count)).toFixed(6)}\n`).join("");

test("A file is uploaded, a fault told, shakes a scene, and goes again", async ({ page, daemon, url, folder, refused }) => {
  const file = path.join(folder, "Valley 7.txt");
  fs.writeFileSync(file, course(2000));
  refused(400, 422);
  await page.goto(url("#/records"));
  await says(page.locator("main"), /There are none yet/);
  await page.getByLabel("File").setInputFiles(file);
  assert.equal(await page.getByLabel("Name").inputValue(), "Valley_7");
  await page.getByLabel("Unit").selectOption("m/s²");
  await page.getByRole("button", { name: "Upload", exact: true }).click();
  await says(page.getByRole("alert"), /must state the interval/);
  await page.getByLabel("Name").fill("Valley 7");
  await page.getByLabel("Interval").fill("0,01");
  await page.getByRole("button", { name: "Upload", exact: true }).click();
  await until("the focus to be at what is wrong", () => page.getByLabel("Name").evaluate((node) => node === document.activeElement));
  await says(page.locator("main"), /must be 1 to 64 letters/);
  await page.getByLabel("Name").fill("Valley_7");
  await page.getByText("More: source").click();
  await page.getByLabel("Source").fill("made up");
  await page.getByRole("button", { name: "Upload", exact: true }).click();
  await says(page.locator("main"), /2000 samples over 19\.99 s/);
  await says(page.locator("main"), /made up/);
  assert.deepEqual(await axe(page), []);
  await page.getByRole("link", { name: "Use in a scene" }).click();
  await says(page.getByRole("combobox", { name: "Name" }).locator("option:checked"), /Valley_7: 19\.99 s, peak .* m\/s²/);
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await leads(page, /#\/results\//);
  const { jobs } = await daemon.get("v1/jobs");
  assert.equal((await daemon.get(`v1/results/${jobs[0].result}`)).scene.excitation.name, "Valley_7");
});

test("A record that a result needs stays; another one is deleted", async ({ page, daemon, url, refused }) => {
  refused(409);
  await daemon.ask("POST", "v1/records", { name: "spare", interval: 0.01, samples: [0, 1, 0, -1, 0] });
  page.on("dialog", (dialog) => dialog.accept());
  await page.goto(url("#/records"));
  await page.getByRole("link", { name: "Valley_7", exact: true }).click();
  await page.getByRole("button", { name: "Delete" }).click();
  await says(page.getByRole("alert"), /used by 1 result/);
  await page.goto(url("#/records/spare"));
  await page.getByRole("button", { name: "Delete" }).click();
  await leads(page, /#\/records$/);
  assert.deepEqual((await daemon.get("v1/records")).records.map((record) => record.name), ["Valley_7"]);
});

test("A record of 500,000 samples is seen and zoomed into with less than 200 kB a view, at 360 px", async ({ newPage, daemon, url }) => {
  await daemon.ask("POST", "v1/records", { name: "long", interval: 0.001, samples: Array.from({ length: 500000 }, (_, k) => (k === 123456 ? 9 : Math.sin(0.01 * k))) });
  const page = await newPage({ viewport: { width: 360, height: 800 }, colorScheme: "dark" });
  await page.goto(url("#/records"));
  const first = await transferred(page, async () => {
    await page.getByRole("link", { name: "long", exact: true }).click();
    await says(page.locator("main"), /the largest is 9 m\/s², at 123\.5 s/);
  });
  const next = await transferred(page, async () => {
    await page.getByRole("application", { name: /^Base acceleration/ }).focus();
    await page.keyboard.press("+");
  });
  assert.ok(first.bytes < 200000 && next.bytes > 1000 && next.bytes < 200000, `${first.bytes}, ${next.bytes}`);
  await leads(page, /from=/);
  assert.equal(await overflow(page), 0);
});

test("A record shows the response spectrum of oscillators; damping and quantity stand in the address", async ({ page, daemon, url }) => {
  const samples = Array.from({ length: 1000 }, (_, k) => Math.sin((2 * Math.PI * k) / 50));
  await daemon.ask("POST", "v1/records", { name: "hum", interval: 0.01, samples });
  await page.goto(url("#/records/hum"));
  await says(page.getByRole("definition").filter({ hasText: "made with it" }), /^0/);
  const panel = page.getByRole("region", { name: "Response spectrum" });
  await panel.getByRole("figure", { name: "Pseudo-acceleration of oscillators" }).waitFor();
  await panel.getByRole("button", { name: "Displacement" }).click();
  await panel.getByRole("group", { name: "Damping ratio" }).getByRole("button", { name: "2 %" }).click();
  await leads(page, /spectrum=displacement&damping=0\.02/);
  await page.reload();
  await panel.getByRole("figure", { name: "Displacement of oscillators" }).waitFor();
  assert.equal(await panel.getByRole("button", { name: "2 %" }).getAttribute("aria-pressed"), "true");
  await page.getByRole("button", { name: "Download" }).click();
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Samples as csv" }).click()]);
  assert.equal(download.suggestedFilename(), "hum.csv");
});
