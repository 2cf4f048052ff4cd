// Runs: the list, one run while it goes on, cancelling, failing, a daemon that starts anew.
import assert from "node:assert/strict";
import { leads, says, tabTo, test, until } from "./support.mjs";

// A scene of some ten seconds in fixed small steps, and a sweep of it over 400 points.
const slow = async (daemon, changes = {}) => ({ ...(await daemon.example("paper_sine_aluminium")), title: "A slow one", duration: 400,
  sample_rate: 100, output: { channels: [], psd: null, reduction: false }, accuracy: { solver: "rk4", step: 1e-5 }, ...changes });
const sweep = { kind: "sweep", axes: [{ pointer: "/dampers/0/clearance", from: 0.01, to: 0.02, count: 400 }] };
const submit = (daemon, scene) => daemon.ask("POST", "/v1/jobs", scene, { Prefer: "respond-async" });
const state = async (daemon, id) => (await daemon.get(`/v1/jobs/${id}`)).status;

test("A long sweep shows how far it is and its rows, and a click cancels it", async ({ page, daemon, url }) => {
  const { id } = await submit(daemon, await slow(daemon, { title: "A long sweep", duration: 20, study: sweep }));
  await page.goto(url(`#/jobs/${id}`));
  await says(page.getByRole("heading", { level: 1 }), /A long sweep/);
  await says(page.getByText(/% after/), /\d %? ?after .* left/);
  assert.ok((await page.getByRole("progressbar").evaluate((bar) => bar.position)) > 0);
  await page.getByText("As a table").first().waitFor();
  await page.getByRole("button", { name: "Cancel" }).click();
  await says(page.getByRole("main"), /Cancelled[\s\S]*Ended after/);
  assert.equal(await state(daemon, id), "dismissed");
  assert.equal(await page.getByRole("button", { name: "Cancel" }).count(), 0);
  const change = page.getByRole("link", { name: "Change the scene" });
  await until("the focus to go on to the link", () => change.evaluate((node) => node === document.activeElement));
  await page.keyboard.press("Enter");
  await leads(page, /#\/scene\?job=j-/);
  await says(page.getByRole("heading", { level: 1 }), /./);
});

test("Runs are found by words, state and study, by a URL too, and one is cancelled by keyboard", async ({ page, daemon, url, newPage }) => {
  await daemon.run("paper_free_sponge");
  await daemon.run("compare_sponge");
  const { id } = await submit(daemon, await slow(daemon));
  await page.goto(url("#/jobs"));
  await page.getByRole("link", { name: /sponge/ }).first().waitFor();
  await page.getByRole("combobox", { name: "Study" }).selectOption("compare");
  await until("the comparison alone", async () => (await page.getByRole("row").count()) === 2);
  await page.getByRole("combobox", { name: "Study" }).selectOption("");
  await page.getByLabel("Search").fill("slow");
  await leads(page, /q=slow/);
  await until("the slow one alone", async () => (await page.getByRole("row").count()) === 2);
  const other = await newPage();
  await other.goto(page.url());
  await other.getByRole("link", { name: "A slow one" }).waitFor();
  assert.equal(await other.getByRole("row").count(), 2);
  await says(page.getByRole("row", { name: /A slow one/ }), /Running[^]*%/);
  await tabTo(page, page.getByRole("button", { name: "Cancel A slow one" }));
  await page.keyboard.press("Enter");
  await page.getByRole("cell", { name: /Cancelled/ }).waitFor();
  assert.equal(await state(daemon, id), "dismissed");
  assert.equal(await page.evaluate(() => document.activeElement.textContent), "A slow one");
});

const cells = (page, at) => page.getByRole("row").evaluateAll((rows, column) =>
  rows.slice(1).map((row) => row.cells[column].innerText.trim().replaceAll("\u00a0", " ").split(/\n+/).join(": ")), at);

test("Runs without a title, or with the same one, are named by what differs; inputs and metrics are columns that sort", async ({ page, daemon, url }) => {
  const { title, ...scene } = await daemon.example("paper_free_sponge");
  for (const clearance of [0.0101, 0.0303, 0.0202])
    await daemon.run({ ...scene, dampers: [{ ...scene.dampers[0], clearance }] }, clearance < 0.03 ? { title: "Tuned" } : {});
  await daemon.run({ ...scene, dampers: [{ ...scene.dampers[0], clearance: 0.0404 }] });
  await page.goto(url("#/jobs?q=clearance"));
  await until("four runs with names", async () => (await cells(page, 1)).join() === "Sponge, clearance 40.4 mm,Tuned: Clearance 20.2 mm,Sponge, clearance 30.3 mm,Tuned: Clearance 10.1 mm");
  const heads = await page.getByRole("columnheader").allInnerTexts();
  for (const name of [/Clearance \[mm\]/, /Motion, rms \[mm\]/, /Motion, peak \[mm\]/, /Impacts/, /Largest force \[N\]/])
    assert.ok(heads.some((head) => name.test(head)), `${name} among ${heads}`);
  const rms = heads.findIndex((head) => head.startsWith("Motion, rms"));
  await page.getByRole("button", { name: "Motion, rms [mm]" }).click();
  await leads(page, /sort=rms_displacement/);
  const rising = (await cells(page, rms)).map(Number);
  assert.deepEqual(rising, [...rising].sort((a, b) => a - b));
  await page.getByRole("button", { name: "Motion, rms [mm]" }).click();
  await leads(page, /sort=-rms_displacement/);
  await page.reload();
  await until("the same order by the address", async () => (await cells(page, rms)).map(Number).join() === [...rising].reverse().join());
});

test("Chosen runs are compared, renamed and deleted", async ({ page, daemon, url }) => {
  const scene = await daemon.example("paper_free_sponge");
  const [first, second] = [await daemon.run(scene, { title: "Mine 1", duration: 3 }), await daemon.run(scene, { title: "Mine 2", duration: 4 })];
  await page.goto(url("#/jobs?q=mine"));
  await page.getByRole("checkbox", { name: "Choose Mine 1" }).check();
  assert.ok(await page.getByRole("button", { name: "Compare" }).isDisabled());
  await page.getByRole("button", { name: "Rename" }).click();
  await page.getByLabel("Title").fill("Mine, renamed");
  await page.keyboard.press("Enter");
  await page.getByRole("link", { name: "Mine, renamed" }).waitFor();
  assert.equal((await daemon.get(`/v1/jobs/${first.id}`)).title, "Mine, renamed");
  await page.getByRole("button", { name: "Choose all" }).click();
  await page.getByRole("link", { name: "Compare" }).nth(1).click();
  await leads(page, new RegExp(`compare\\?a=${first.result}&b=${second.result}`));
  await page.getByRole("heading", { name: "Compare", level: 1 }).waitFor();
  await page.goBack();
  await page.getByRole("button", { name: "Choose all" }).click();
  await page.getByLabel("Search").fill("mine 2");
  await says(page.getByRole("group", { name: "Chosen runs" }), /1 chosen, 1 more hidden by the filter/);
  await page.getByRole("button", { name: "Delete", exact: true }).click();
  await page.getByRole("button", { name: "Delete for good" }).click();
  await until("it to go", async () => (await page.getByRole("row").count()) === 1);
  const left = (await daemon.get("/v1/jobs?q=mine")).jobs.map(({ id }) => id);
  assert.deepEqual(left, [first.id]);
});

test("A run that cannot be deleted is left with the reason; the others that were chosen go", async ({ page, daemon, url, refused }) => {
  refused(409);
  const scene = await daemon.example("paper_free_sponge");
  const ids = [];
  for (const duration of [1, 2, 3]) ids.push((await daemon.run(scene, { title: `Spare ${duration}`, duration })).id);
  const answer = { title: "Conflict", detail: "its result is needed" };
  await page.route(`**/v1/jobs/${ids[1]}?purge=1`, (route) => route.fulfill({ status: 409, contentType: "application/problem+json", json: answer }));
  await page.goto(url("#/jobs?q=spare"));
  await page.getByRole("link", { name: "Spare 3" }).waitFor();
  await page.getByRole("button", { name: "Choose all" }).click();
  await page.getByRole("button", { name: "Delete", exact: true }).click();
  await page.getByRole("button", { name: "Delete for good" }).click();
  await says(page.getByRole("alert"), /Its result is needed/);
  await until("the others to go", async () => (await page.getByRole("row").count()) === 2);
  assert.deepEqual((await daemon.get("/v1/jobs?q=spare")).jobs.map(({ id }) => id), [ids[1]]);
});

test("A list shows a run that begins; a list of those that run drops one that has ended", async ({ page, newPage, daemon, url }) => {
  const link = (where, name) => where.getByRole("link", { name, exact: true });
  const first = await submit(daemon, await slow(daemon, { title: "The first of two", duration: 2000 }));
  await page.goto(url("#/jobs"));
  await link(page, "The first of two").waitFor();
  const second = await submit(daemon, await slow(daemon, { title: "The second of two", duration: 2001 }));
  await link(page, "The second of two").waitFor();
  const running = await newPage();
  await running.goto(url("#/jobs?status=running"));
  await link(running, "The first of two").waitFor();
  for (const { id } of [second, first]) await daemon.ask("DELETE", `/v1/jobs/${id}`);
  await link(running, "The first of two").waitFor({ state: "detached" });
});

test("A page of many runs leads to the older ones and back, and words find older ones by their titles", async ({ page, daemon, url }) => {
  const scene = await daemon.example("paper_free_sponge");
  await daemon.run(scene, { title: "The oldest of many" });
  for (let number = 0; number < 100; number++) await daemon.run(scene, { title: `Run ${number}.`, duration: 1 });
  await page.goto(url("#/jobs"));
  await page.getByRole("link", { name: "Run 99." }).waitFor();
  await page.getByRole("link", { name: "Older runs" }).click();
  await page.getByRole("link", { name: "The oldest of many" }).waitFor();
  await page.goBack();
  await page.getByRole("link", { name: "Run 99." }).waitFor();
  await page.getByLabel("Search").fill("oldest");
  await page.getByRole("link", { name: "The oldest of many" }).waitFor();
});

test("A run that fails says why", async ({ page, daemon, url }) => {
  const scene = await daemon.example("paper_free_sponge");
  const axes = [{ pointer: "/dampers/0/clearance", values: [0.02, 0.01, 0.02] },
    { pointer: "/dampers/0/position", from: 0, to: 0.006, count: 3000 }];
  const { id } = await submit(daemon, { ...scene, study: { kind: "sweep", axes } });
  await page.goto(url(`#/jobs/${id}`));
  await says(page.getByRole("alert"), /must be between the stops/);
  await page.getByRole("link", { name: "Change the scene" }).waitFor();
});

test("A run's page outlasts a daemon that starts anew, and ends at the result", async ({ page, daemon, url, refused }) => {
  refused(0, 503);
  const { id } = await submit(daemon, await slow(daemon, { duration: 60 }));
  await page.goto(url(`#/jobs/${id}`));
  await says(page.getByRole("main"), /% after/);
  await daemon.stop();
  await says(page.getByRole("main"), /does not answer/);
  await daemon.start();
  await until("the result", () => /#\/results\/r-/.test(page.url()), 60000);
  await page.getByRole("heading", { level: 1 }).waitFor();
});
