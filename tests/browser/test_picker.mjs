// What stands at a damper's stops: a material and its revision, numbers of one's own, sides that differ.
import assert from "node:assert/strict";
import { axe, overflow, says, tabTo, test, until } from "./support.mjs";

const FELT = { slug: "felt", name: "Felt", restitution: 0.3, restitution_deviation: 0.03, contact_time: 0.02, contact_time_deviation: 0.001,
  least_speed: 0.2, most_speed: 0.8, source: "a test" };

// The scene as the page's JSON view has it.
async function sceneOf(page) {
  await page.getByRole("heading", { name: "The scene as JSON" }).click();
  const text = await page.locator("textarea:visible").inputValue();
  await page.getByRole("heading", { name: "The scene as JSON" }).click();
  return JSON.parse(text);
}

test("A material is chosen by keyboard and its page gives k_b and c_b with their ± for this pair of masses", async ({ page, daemon, url }) => {
  await daemon.ask("POST", "v1/materials", FELT);
  await page.goto(url("#/scene"));
  const list = page.getByRole("combobox", { name: "Material" });
  await until("the materials", async () => (await list.locator("option").count()) >= 6);
  await tabTo(page, list);
  await page.keyboard.type("Felt");
  const buffers = page.getByRole("group", { name: "Buffers" });
  await says(buffers, /k_?b 2\.895 ± 0\.3 kN\/m, c_?b 12\.32 ± 1\.2 N s\/m, ζ 0\.3579 ± 0\.026/);
  await says(buffers, /Measured from 0\.2 .*to 0\.8 m\/s/);
  await says(list.locator("option:checked"), /Felt: e 0\.3, contact time 20 ms, draft/);
  assert.equal((await sceneOf(page)).dampers[0].buffer, "felt");
  await page.getByRole("combobox", { name: "Revision" }).selectOption({ label: "@1, draft" });
  assert.equal((await sceneOf(page)).dampers[0].buffer, "felt@1");
  assert.deepEqual(await axe(page), []);
});

test("Own numbers begin with the material's, and what they come to follows", async ({ page, url }) => {
  await page.goto(url("#/scene"));
  const buffers = page.getByRole("group", { name: "Buffers" });
  await says(buffers, /k_?b 1\.656 kN\/m/);
  await buffers.getByRole("combobox", { name: "Material" }).selectOption({ label: "own e and contact time" });
  assert.equal(await buffers.getByLabel("Restitution").inputValue(), "0.61");
  await buffers.getByLabel("Restitution").fill("0.2");
  await says(buffers, /k_?b 2\.04 kN\/m/);
  await buffers.getByRole("combobox", { name: "Material" }).selectOption({ label: "own stiffness" });
  const { buffer } = (await sceneOf(page)).dampers[0];
  assert.ok(Math.abs(buffer.stiffness - 2039.9) < 1 && buffer.damping > 13, JSON.stringify(buffer));
});

test("Both sides get buffers of their own, and one again", async ({ newPage, url }) => {
  const page = await newPage({ viewport: { width: 360, height: 800 } });
  await page.goto(url("#/scene"));
  await page.getByLabel("The same on both sides").uncheck();
  await page.getByRole("group", { name: "Right buffer" }).getByRole("combobox", { name: "Material" })
    .selectOption({ label: "Aluminium: e 0.46, contact time 300 µs, approved" });
  await says(page.getByRole("group", { name: "Right buffer" }), /k_?b 1[\d.]+ MN\/m/);
  const [damper] = (await sceneOf(page)).dampers;
  assert.deepEqual([damper.left_buffer, damper.right_buffer, damper.buffer], ["sponge", "aluminium", undefined]);
  assert.equal(await overflow(page), 0);
  await page.getByLabel("The same on both sides").check();
  assert.equal((await sceneOf(page)).dampers[0].buffer, "sponge");
});
