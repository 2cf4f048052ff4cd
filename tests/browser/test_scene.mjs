// The scene's page: what is typed is drawn, derived, checked, kept in the URL and run; what is not touched stays as it was.
import assert from "node:assert/strict";
import { inflateRawSync } from "node:zlib";
import { axe, leads, overflow, says, tabTo, test, until } from "./support.mjs";

const clearance = (page) => page.getByRole("textbox", { name: "Clearance" }).first();
const box = (page, name) => page.getByRole("textbox", { name, exact: false }).first();
const shows = (page, pattern) => until(`a drawing of ${pattern}`,
  async () => pattern.test(await page.getByRole("img", { name: /structure|storeys/i }).first().getAttribute("aria-label")));
const outcome = (page) => page.getByRole("region", { name: "Estimate" });
const run = (page) => page.getByRole("button", { name: "Run", exact: true });

// The scene as the page would send it.
async function scene(page) {
  await page.getByRole("heading", { name: "The scene as JSON" }).click();
  const text = await page.getByRole("textbox", { name: "The scene as JSON" }).inputValue();
  await page.getByRole("heading", { name: "The scene as JSON" }).click();
  return JSON.parse(text);
}

test("An edited clearance is drawn, derived from, kept in the URL and the same elsewhere", async ({ page, newPage, url }) => {
  await page.goto(url("#/scene"));
  await says(page.locator("main"), /1\.656 kN\/m[\s\S]*4\.046 N s\/m/);
  await shows(page, /15\smm/);
  await clearance(page).fill("0,01");
  await shows(page, /10\smm/);
  await leads(page, /#\/scene\?s=/);
  await clearance(page).fill("2e-2");
  await shows(page, /20\smm/);
  await box(page, "Mass").nth(0).fill("2.7");
  await says(outcome(page), /2\.85 Hz/);
  const typed = JSON.stringify(await scene(page));
  const kept = () => inflateRawSync(Buffer.from(new URLSearchParams(page.url().split("?")[1]).get("s"), "base64url")).toString();
  await until("the URL to have it all", () => kept() === typed);
  assert.match(typed, /"mass":2\.7,.*"clearance":0\.02,/);
  const other = await newPage();
  await other.goto(page.url());
  await clearance(other).waitFor();
  assert.equal(JSON.stringify(await scene(other)), typed);
  await page.reload();
  await until("the clearance to be there again", async () => (await clearance(page).inputValue()) === "0.02");
});

test("Faults stand at their fields and in a list that leads to them; mended, the scene runs", async ({ page, url, refused }) => {
  refused(422);
  await page.goto(url("#/scene"));
  await clearance(page).fill("-1");
  await box(page, "Duration").fill("ten");
  await says(page.locator("main"), /must be at least 0 m, is -1/);
  await says(page.locator("main"), /must be a number \[s\], is a string/);
  await run(page).click();
  const first = page.getByText("To be mended before it runs").locator("..");
  await says(first, /Damper 1, clearance/);
  await until("the list to have the focus", () => first.evaluate((node) => node === document.activeElement));
  await first.getByRole("button", { name: "Damper 1, clearance" }).press("Enter");
  await until("the field to have the focus",
    () => clearance(page).evaluate((node) => node === document.activeElement && node.getAttribute("aria-invalid") === "true"));
  await clearance(page).fill("0.015");
  await until("one fault less", async () => !(await first.innerText()).includes("clearance"));
  await box(page, "Duration").fill("10");
  await until("the list to be gone", async () => !(await page.getByText("To be mended").isVisible()));
  await page.keyboard.press("Control+Enter");
  await leads(page, /#\/results\/r-/);
});

test("A frame with two dampers, built by hand", async ({ page, url }) => {
  await page.goto(url("#/scene"));
  await page.getByLabel("Structure kind").selectOption("frame");
  await box(page, "Masses").fill("1200, 1200, 1200");
  await box(page, "Stiffnesses").fill("9e5 9e5 9e5");
  await page.getByRole("button", { name: "Add damper" }).click();
  await page.getByRole("textbox", { name: "Storey" }).first().fill("2");
  await box(page, "Mass [kg]").nth(0).fill("40");
  await page.getByLabel("Excitation kind").selectOption("random");
  await says(outcome(page), /Hz, /);
  const made = await scene(page);
  assert.deepEqual(made.structure,
    { kind: "frame", masses: [1200, 1200, 1200], stiffnesses: [900000, 900000, 900000], damping_ratio: 0.02 });
  assert.deepEqual(made.dampers.map(({ mass, storey }) => [mass, storey]), [[40, 2], [0.1107, undefined]]);
  await shows(page, /3 storeys|storey 2/i);
  await page.getByRole("button", { name: "Remove Damper 1" }).click();
  assert.equal((await scene(page)).dampers.length, 1);
  await run(page).click();
  await leads(page, /#\/(results|jobs)\//);
});

test("By keyboard alone from the top of the page to a result", async ({ page, url }) => {
  await page.goto(url("#/scene"));
  await clearance(page).waitFor();
  await tabTo(page, clearance(page));
  await page.keyboard.press("Control+A");
  await page.keyboard.type("0.012");
  await tabTo(page, page.getByLabel("Excitation kind"));
  await page.keyboard.press("ArrowDown");
  await tabTo(page, box(page, "RMS"));
  await page.keyboard.press("Control+A");
  await page.keyboard.type("2");
  await tabTo(page, run(page));
  await page.keyboard.press("Enter");
  await leads(page, /#\/(results|jobs)\//);
});

test("Every example goes through the form unchanged", async ({ page, daemon, url }) => {
  await page.goto(url("#/scene"));
  await clearance(page).waitFor();
  const changed = await page.evaluate(async () => {
    const from = (name) => import(new URL(`web/js/${name}.js`, document.baseURI).href);
    const [{ makeDraft }, { SceneForm }, { get, getSchema }, { html, render }] = await Promise.all(
      [from("form/draft"), from("scene/steps"), from("api"), from("ui/preact")]);
    const told = [], shown = [];
    for (const { name, scene } of (await get("v1/examples")).examples) {
      const host = document.body.appendChild(document.createElement("div"));
      const draft = makeDraft(structuredClone(scene));
      render(html`<${SceneForm} schema=${await getSchema("scene")} draft=${draft} widgets=${[]} />`, host);
      shown.push({ name, scene, host, draft });
    }
    for (const { name, scene, host, draft } of shown) {
      if (JSON.stringify(draft.scene) !== JSON.stringify(scene)) told.push(`${name} untouched`);
      const duration = host.querySelector('[data-pointer="/duration"] input');
      duration.value = "3.25";
      duration.dispatchEvent(new Event("input", { bubbles: true }));
      if (JSON.stringify(draft.scene) !== JSON.stringify({ ...scene, duration: 3.25 })) told.push(`${name} edited`);
      host.remove();
    }
    return told;
  });
  assert.deepEqual(changed, []);
  // And as the page shows them, with all of its controls.
  for (const name of ["all_keys", "sweep_clearance_buffer", "contact_table"]) {
    await page.goto(url(`#/scene?example=${name}`));
    const example = await daemon.example(name);
    await until(`${name} to be there`, async () => JSON.stringify(await scene(page)) === JSON.stringify(example));
  }
});

test("A result's scene is the same one when it is taken up, and a link to its result", async ({ page, daemon, url }) => {
  for (const name of ["frame_two_dampers", "sweep_clearance_buffer", "paper_random_sponge"]) {
    const job = await daemon.run(name, name === "sweep_clearance_buffer" ? {} : { duration: 2 });
    await page.goto(url(`#/scene?result=${job.result}`));
    await until("its result to be known",
      async () => (await outcome(page).getByRole("link", { name: "its result" })
      .getAttribute("href")) === `#/results/${job.result}`);
  }
  assert.equal((await scene(page)).dampers[0].buffer, "sponge@1");
});

test("JSON and form are one scene; a slip is told by its line", async ({ page, url }) => {
  await page.goto(url("#/scene"));
  await clearance(page).waitFor();
  await page.getByRole("heading", { name: "The scene as JSON" }).click();
  const text = page.getByRole("textbox", { name: "The scene as JSON" });
  const now = await text.inputValue();
  await text.fill(now.replace('"duration"', 'duration'));
  await says(page.locator("main"), /line \d+ column \d+/);
  await text.fill("5");
  await says(page.locator("main"), /a scene is an object/);
  await text.fill(now.replace("0.015", "0.025"));
  await page.getByRole("heading", { name: "The scene as JSON" }).click();
  assert.equal(await clearance(page).inputValue(), "0.025");
});

test("A sweep by the names of what varies, and other pages on the way lose nothing", async ({ page, url }) => {
  await page.goto(url("#/scene"));
  await clearance(page).fill("0.016");
  await page.getByLabel("Study kind").selectOption("sweep");
  await page.getByLabel("What varies").selectOption({ label: "damper 1, mass [kg]" });
  const before = await scene(page);
  assert.equal(before.study.kind, "sweep");
  assert.ok(before.study.axes[0].count >= 2);
  await page.getByRole("link", { name: "Runs" }).click();
  await leads(page, /#\/jobs/);
  await page.goBack();
  await clearance(page).waitFor();
  assert.deepEqual(await scene(page), before);
  await page.getByRole("button", { name: "Examples" }).click();
  await page.getByRole("link", { name: /Figure 6\(b\)/ }).click();
  await until("the sponge", async () => (await clearance(page).inputValue()) === "0.015");
  await page.goBack();
  await until("the sweep again", async () => (await scene(page)).study?.kind === "sweep");
});

test("The scene's page is fit for a narrow screen in the dark", async ({ newPage, url }) => {
  const page = await newPage({ viewport: { width: 360, height: 740 }, colorScheme: "dark" });
  await page.goto(url("#/scene?example=frame_two_dampers"));
  await says(outcome(page), /Hz, /);
  assert.deepEqual(await axe(page), []);
  assert.equal(await overflow(page), 0);
});
