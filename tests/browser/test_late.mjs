// Answers that come late, as on a slow line: what is newer stays, a page that was left touches nothing, no click is lost or counts
// twice.
import assert from "node:assert/strict";
import { hold, leads, says, tabTo, test, until } from "./support.mjs";

const main = (page) => page.getByRole("main");
const button = (page, name) => page.getByRole("button", { name, exact: true });
const heading = (page, name) => page.getByRole("heading", { level: 1, name });
const menu = (page, name) => page.getByRole("navigation").getByRole("link", { name }).click();
const region = (page, name) => page.getByRole("region", { name, exact: true });

test("A run's page that is left before its answer came leads nowhere", async ({ page, daemon, url }) => {
  const { id } = await daemon.run("paper_free_sponge");
  const job = await hold(page, `**/v1/jobs/${id}`);
  await page.goto(url("#/jobs"));
  await heading(page, "Runs").waitFor();
  await page.goto(url(`#/jobs/${id}`));
  await job.asked();
  await menu(page, "Records");
  await heading(page, "Ground motions").waitFor();
  await job.letGo();
  assert.match(page.url(), /#\/records$/);
  assert.equal(await heading(page, "Ground motions").count(), 1);
});

test("A run is followed though the service was lost right after its first answer", async ({ page, daemon, url, refused }) => {
  refused(0);
  const long = { ...(await daemon.example("paper_sine_aluminium")), duration: 2000, sample_rate: 100,
    output: { channels: [], psd: null, reduction: false }, accuracy: { solver: "rk4", step: 1e-5 } };
  const { id } = await daemon.ask("POST", "/v1/jobs", long, { Prefer: "respond-async" });
  let asked = 0;
  await page.route(new RegExp(`/v1/jobs/${id}(\\?|$)`), (route) => (++asked === 2 ? route.abort() : route.fallback()));
  await page.goto(url(`#/jobs/${id}`));
  await until("it to be asked for again", () => asked >= 3);
  await daemon.ask("DELETE", `/v1/jobs/${id}`);
  await says(main(page), /Cancelled/);
});

test("A page of comparisons that is being left does not come back when its list comes", async ({ page, daemon, url }) => {
  for (const duration of [1, 2]) await daemon.run({ ...(await daemon.example("paper_free_sponge")), duration });
  const list = await hold(page, /\/v1\/jobs\?.*details=1/);
  await page.goto(url("#/compare"));
  await list.asked();
  // As the way back does, a moment before the page hears of it.
  await page.evaluate(() => history.replaceState(null, "", "#/records"));
  await list.letGo();
  assert.match(page.url(), /#\/records$/);
});

test("A search that another page overtook does not come back", async ({ page, url }) => {
  await page.goto(url("#/records"));
  await heading(page, "Ground motions").waitFor();
  const list = await hold(page, /\/v1\/materials\?/);
  await menu(page, "Materials");
  await list.asked();
  await page.getByRole("searchbox").fill("sponge");
  await page.getByRole("searchbox").press("Enter");
  await leads(page, /q=sponge/);
  await menu(page, "Records");
  await heading(page, "Ground motions").waitFor();
  await list.letGo();
  assert.equal(await heading(page, "Ground motions").count(), 1);
  assert.match(page.url(), /#\/records$/);
});

test("The menu of comparisons keeps the focus when its materials come", async ({ page, daemon, url }) => {
  const ran = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${ran.result}`));
  await says(heading(page), /sponge/);
  const list = await hold(page, /\/v1\/materials\?/);
  await tabTo(page, page.getByRole("button", { name: /^Compare with/ }));
  await page.keyboard.press("Enter");
  await list.asked();
  const earlier = page.getByRole("link", { name: "An earlier run …" });
  await tabTo(page, earlier);
  await list.letGo();
  await button(page, "Aluminium").waitFor();
  assert.ok(await earlier.evaluate((link) => link === document.activeElement));
});

test("The example that was asked for last is the one that stays", async ({ page, url }) => {
  await page.goto(url("#/scene"));
  const title = page.getByLabel("Title", { exact: true });
  await title.waitFor();
  const frame = await hold(page, "**/v1/examples/frame_two_dampers");
  await page.goto(url("#/scene?example=frame_two_dampers"));
  await frame.asked();
  await page.goto(url("#/scene?example=paper_free_aluminium"));
  await until("aluminium", async () => /aluminium/i.test(await title.inputValue()));
  await frame.letGo();
  assert.match(await title.inputValue(), /aluminium/i);
});

test("Run waits for the scene that the link names", async ({ page, url }) => {
  const example = await hold(page, "**/v1/examples/paper_free_aluminium");
  await page.goto(url("#/scene?example=paper_free_aluminium"));
  await example.asked();
  await button(page, "Run").click();
  await example.letGo();
  await leads(page, /#\/results\/r-/);
  await says(main(page), /Largest force[^]*401/);
});

test("A double click runs a point once", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("sweep_frequency");
  await page.goto(url(`#/results/${result}?point=3`));
  let sent = 0;
  page.on("request", (request) => request.method() === "POST" && /v1\/jobs/.test(request.url()) && sent++);
  const scene = await hold(page, /v1\/.*\/scene/);
  await button(page, "Run this point").dblclick();
  await scene.asked();
  await scene.letGo();
  await leads(page, /#\/(jobs|results)\/(?!.*point=)/);
  await main(page).getByRole("heading", { level: 1 }).waitFor();
  assert.equal(sent, 1);
});

test("The player goes on that was started before its impact was known", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  const { impacts } = await daemon.get(`/v1/results/${result}/impacts.json`);
  const row = await hold(page, /impacts\.json\?first=5/);
  await page.goto(url(`#/results/${result}?impact=5`));
  await row.asked();
  await button(page, "Play").click();
  await button(page, "Pause").waitFor();
  await row.letGo();
  await until("its instant", async () => Number(await page.getByRole("slider", { name: "Instant" }).inputValue()) >= impacts[4].start - 0.01);
  assert.equal(await button(page, "Pause").count(), 1);
});

test("The next impact is the one that is seen in the series, though its force is yet to come", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  const { impacts } = await daemon.get(`/v1/results/${result}/impacts.json`);
  await page.goto(url(`#/results/${result}`));
  const panel = region(page, "Selected impact");
  await says(panel, /Impact 2 of 22/);
  const force = await hold(page, "**/impacts/3/force.json");
  await panel.getByRole("button", { name: "Next impact" }).click();
  await force.asked();
  await leads(page, /impact=3/);
  await panel.getByRole("button", { name: "Next impact" }).click();
  await leads(page, /impact=4/);
  await says(panel, /Impact 4 of 22/);
  await force.letGo();
  await says(panel, /Impact 4 of 22/);
  await panel.getByRole("button", { name: "Zoom to this impact" }).click();
  const [, from, to] = await leads(page, /[?&]impact=4&from=([\d.]+)&to=([\d.]+)/);
  assert.ok(from < impacts[3].start && impacts[3].start < to, `${impacts[3].start} is not within ${from} to ${to}`);
});

// A result of so many samples that each zoom asks for others.
async function long(page, daemon, url) {
  const { result } = await daemon.run("paper_free_sponge", { duration: 120 });
  await page.goto(url(`#/results/${result}`));
  const chart = page.getByRole("application", { name: "Displacement", exact: true });
  await chart.locator("path").first().waitFor();
  await chart.focus();
  return chart;
}

test("One zoom after another goes on from the last one, not from where its data are", async ({ page, daemon, url }) => {
  await long(page, daemon, url);
  const series = await hold(page, /series\.(json|npy)/, 1);
  await page.keyboard.press("+");
  await leads(page, /from=30&to=90/);
  await series.asked();
  await page.keyboard.press("+");
  await leads(page, /from=45&to=75/);
  let isHere = false;
  const come = series.letGo().then(() => (isHere = true));
  while (!isHere) for (const arrow of ["Right", "Left"]) await page.keyboard.press(`Shift+Arrow${arrow}`); // to and fro, at rest never
  await come;
  await leads(page, /from=45&to=75/);
});

test("A drag goes on while finer data come", async ({ page, daemon, url }) => {
  const chart = await long(page, daemon, url);
  const series = await hold(page, /series\.(json|npy)/, 1);
  await page.keyboard.press("+");
  await leads(page, /from=30&to=90/);
  await series.asked();
  await chart.scrollIntoViewIfNeeded();
  const { x, y, width, height } = await chart.boundingBox();
  await page.mouse.move(x + width * 0.3, y + height / 2);
  await page.mouse.down();
  await page.mouse.move(x + width * 0.5, y + height / 2, { steps: 3 });
  await series.letGo();
  await page.mouse.move(x + width * 0.6, y + height / 2, { steps: 3 });
  await page.mouse.up();
  const [, from, to] = await leads(page, /from=(?!30&)([\d.]+)&to=([\d.]+)/);
  assert.ok(from > 40 && to < 75, `${from} to ${to}`);
});

test("What was typed last is there again, though a link was followed at once", async ({ page, url }) => {
  await page.goto(url("#/scene"));
  const mass = page.getByRole("group", { name: "Damper 1" }).getByLabel(/^Mass/);
  await mass.fill("0.2");
  await menu(page, "Records");
  await heading(page, "Ground motions").waitFor();
  await page.goBack();
  await until("the mass", async () => (await mass.inputValue()) === "0.2");
  await leads(page, /#\/scene\?s=/);
});

test("What was typed last is there again, though a link was followed while it was on its way into the URL", async ({ page, url }) => {
  await page.addInitScript(() => {
    const pack = Response.prototype.arrayBuffer;
    Response.prototype.arrayBuffer = async function () {
      globalThis.isPacking = true;
      await new Promise((resolve) => setTimeout(resolve, 3000));
      return pack.call(this);
    };
  });
  await page.goto(url("#/scene"));
  const mass = page.getByRole("group", { name: "Damper 1" }).getByLabel(/^Mass/);
  await mass.fill("0.2");
  await until("the scene on its way", () => page.evaluate(() => globalThis.isPacking));
  await menu(page, "Records");
  await heading(page, "Ground motions").waitFor();
  await page.goBack();
  await until("the mass", async () => (await mass.inputValue()) === "0.2");
});

test("The revisions of another material are not offered", async ({ page, url }) => {
  await page.goto(url("#/scene"));
  const revision = page.getByRole("combobox", { name: "Revision" }).first(), count = () => revision.locator("option").count();
  await until("the sponge's revisions", async () => (await count()) > 1);
  const revisions = await hold(page, "**/v1/materials/aluminium/revisions*");
  await page.getByRole("combobox", { name: "Material" }).first().selectOption(JSON.stringify("aluminium"));
  await revisions.asked();
  assert.equal(await count(), 1);
  await revisions.letGo();
  await until("the aluminium's", async () => (await count()) > 1);
});

test("A refusal of what was typed before says nothing of what is typed now", async ({ page, url, refused }) => {
  refused(422);
  await page.goto(url("#/materials/sponge/measure"));
  const rebound = page.getByLabel("Rebound height, drop 1");
  const judged = await hold(page, /measurements\?dry_run/, 1);
  await page.getByLabel("Drop height, drop 1").fill("0.1");
  await rebound.fill("0.5");
  await judged.asked();
  await rebound.fill("0.04");
  await says(main(page), /0\.63\d+/);
  await judged.letGo();
  assert.notEqual(await rebound.getAttribute("aria-invalid"), "true");
  assert.equal(await page.getByRole("alert").count(), 0);
});
