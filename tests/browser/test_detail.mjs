// The sections of a result's page: summary, one impact, the ledger, spectrum, energies, plan, and what is taken along.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { leads, says, test, until } from "./support.mjs";

const impactPanel = (page) => page.getByRole("region", { name: "Selected impact", exact: true });
const tab = (page, name) => page.getByRole("tab", { name, exact: true }).click();

test("A result says how exact it is, what it cost, and where the energy went", async ({ page, daemon, url }) => {
  const job = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${job.result}`));
  await says(page.getByRole("heading", { level: 1 }), /sponge/);
  await says(page.getByRole("main"), /Motion, rms[^]*−30\.8 %[^]*Impacts[^]*22[^]*Largest force[^]*5\.718 N[^]*Accuracy/);
  const panel = page.getByRole("tabpanel");
  await tab(page, "Energy");
  await says(panel.getByRole("row", { name: /^Contact/ }), /−55\.68\s+−57\.2 %/);
  await tab(page, "How it was computed");
  await says(panel, /right to about \d(\.\d)? × 10⁻¹. of its largest value, from beginning to end/);
  await says(panel, /10 s of motion, 22 contacts and 10001 samples, computed in [\d.]+ .?s/);
  await says(panel, /spring damper: a contact time is given \(25 ms\)/);
  await says(panel.getByRole("row", { name: /^1, right sponge@1/ }), /1\.656\s+4\.046/);
});

test("One impact shows how long and how hard it pulls; others are a key away, and back again", async ({ page, daemon, url }) => {
  const job = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${job.result}`));
  const impact = impactPanel(page);
  await says(impact, /Impact 2 of 22[^]*Peak force\s+5\.718 N/);
  await says(impact, /The contact pulls with up to 17\.3 % of the push/);
  await impact.getByRole("button", { name: "Next impact" }).focus();
  await page.keyboard.press("Enter");
  await says(impact, /Impact 3 of 22/);
  assert.match(page.url(), /impact=3/);
  await page.goBack();
  await says(impact, /Impact 2 of 22/);
  await page.goto(url(`#/results/${job.result}?impact=22`));
  await says(impact, /Impact 22 of 22/);
  await impact.getByRole("button", { name: "Zoom to this impact" }).click();
  await leads(page, /from=6\.\d+&to=6\.\d/);
  await says(page.getByRole("tabpanel"), /^1 in this window/);
});

test("An impulse has no force; what was not asked for is told without asking", async ({ page, daemon, url }) => {
  const impulse = await daemon.run("paper_free_impulse_sponge");
  await page.goto(url(`#/results/${impulse.result}`));
  await says(impactPanel(page), /An impulse takes no time and has no force/);
  const bare = await daemon.run("paper_free_sponge", { output: { channels: ["displacement"], psd: null, impacts: false } });
  await page.goto(url(`#/results/${bare.result}?tab=spectrum`));
  await says(page.getByRole("tabpanel"), /asked for no spectrum/);
  await tab(page, "Impacts");
  await says(page.getByRole("tabpanel"), /No impact is listed; there were 22/);
});

test("The ledger lists impacts, sorts them and opens one", async ({ page, daemon, url }) => {
  const job = await daemon.run("frame_two_dampers");
  await page.goto(url(`#/results/${job.result}`));
  for (const name of ["storey 1", "storey 3", "storey 3 without dampers", "damper 2"])
    await page.getByRole("region", { name: "Motion over time" }).getByRole("button", { name, exact: true }).waitFor();
  const ledger = page.getByRole("tabpanel");
  await ledger.getByRole("columnheader", { name: "Peak force" }).getByRole("button").click();
  await until("the order", async () => (await ledger.getByRole("columnheader", { name: "Peak force" }).getAttribute("aria-sort")) === "ascending");
  await ledger.getByRole("button", { name: "Show impact 60", exact: true }).press("Enter");
  await says(impactPanel(page), /Impact 60 of 225/);
  assert.match(page.url(), /impact=60/);
});

test("The largest peak of a spectrum is named, others are laid over it, and the URL keeps all of it", async ({ page, newPage, daemon, url }) => {
  const sponge = await daemon.run("paper_random_sponge"), aluminium = await daemon.run("paper_random_aluminium");
  const { frequency, channels } = await daemon.get(`/v1/results/${sponge.result}/psd.json`);
  const values = channels.mean_acceleration.values, at = frequency.values[values.indexOf(Math.max(...values))];
  await page.goto(url(`#/results/${sponge.result}?tab=spectrum`));
  const spectrum = page.getByRole("tabpanel");
  assert.match(await says(spectrum, /Largest .* Hz\./), new RegExp(`at ${Number(at.toPrecision(4))} Hz`.replace(".", "\\.")));
  await spectrum.getByText("Overlay other results").click();
  const other = spectrum.getByRole("checkbox", { name: /aluminium/ });
  await other.check();
  await until("the URL", () => page.url().includes(aluminium.result));
  await says(spectrum.getByRole("figure"), /this result[\s\S]*aluminium/);
  await spectrum.getByRole("application").focus();
  await page.keyboard.press("+");
  await until("the zoom in the URL", () => /psd_from=/.test(page.url()));
  const said = await says(spectrum, /Largest .* in view/);
  const again = await newPage();
  await again.goto(page.url());
  assert.equal((await says(again.getByRole("tabpanel"), /Largest .* in view/)).match(/Largest[^.]*/)[0], said.match(/Largest[^.]*/)[0]);
  await other.uncheck();
  await until("the overlay gone", () => !/overlay/.test(page.url()));
});

test("Files are saved, and the lines to copy run as they stand", async ({ page, daemon, url, folder }) => {
  const scene = { ...(await daemon.example("paper_free_sponge")), title: "it's \"true\" $(id) \\ ''' null", duration: 2 };
  const job = await daemon.run(scene);
  await page.goto(url(`#/results/${job.result}`));
  await tab(page, "Files and code");
  const take = page.getByRole("tabpanel");
  const [download] = await Promise.all([page.waitForEvent("download"), take.getByRole("link", { name: "series.csv" }).click()]);
  const rows = fs.readFileSync(await download.path(), "utf8").trim().split("\n");
  assert.match(rows[0], /^time \[s\],displacement \[m\]/);
  assert.equal(rows.length, 2002);
  const lines = async (language) => {
    await take.getByText(`Run this scene from ${language}`).click();
    return take.getByRole("group").filter({ hasText: language }).locator("pre").textContent();
  };
  execFileSync("sh", ["-e"], { input: await lines("curl"), cwd: folder });
  assert.equal(JSON.parse(fs.readFileSync(path.join(folder, "job.json"))).result, job.result);
  assert.equal(fs.readFileSync(path.join(folder, "series.csv"), "utf8").trim().split("\n").length, 2002);
  assert.match(execFileSync("/usr/bin/python3", ["-"], { input: await lines("Python"), cwd: folder }).toString(), /'impacts': \d+.*'displacement'/);
});
