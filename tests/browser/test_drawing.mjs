// The drawing of a scene: its numbers in words, and its lengths against one scale.
import assert from "node:assert/strict";
import { test, until } from "./support.mjs";

const drawing = (page) => page.getByRole("img", { name: /A (structure|frame)/ });

// Lengths in the picture: pixels per metre by its bar, and the dimensions of the clearances from the top (px).
const measured = (page) => drawing(page).evaluate((svg) => {
  const bar = svg.querySelector(".bar"), [, number, prefix] = /([\d.]+) ([µm]?)m$/.exec(bar.nextSibling.textContent);
  const width = (node) => node.getBBox().width;
  return {
    scale: width(bar) / (Number(number) * { "": 1, m: 1e-3, "µ": 1e-6 }[prefix]),
    clearances: [...svg.querySelectorAll(".clearance")].map(width),
    start: (() => {
      const [ghost, mass] = ["rect.ghost", "rect.mass"].map((name) => svg.querySelector(name)?.getBoundingClientRect().x);
      return ghost === undefined ? null : ghost - mass;
    })(),
  };
});

for (const [name, words] of [["paper_free_sponge", /1.35 kg.*0.1107 kg · sponge, clearance 15 mm/],
  ["matrices", /25 kg.*clearance 20 mm/],
  ["frame_two_dampers", /3 storeys.*storey 2 .*40 kg · soft rubber, clearance 30 mm.*storey 3 .*60 kg · sponge, clearance 40/]])
  test(`The drawing of ${name} is to scale and named in words`, async ({ page, daemon, url }) => {
    const { dampers, excitation } = await daemon.example(name);
    await page.goto(url(`#/scene?example=${name}`));
    await until("its words", async () => words.test(await drawing(page).getAttribute("aria-label")));
    const { scale, clearances, start } = await measured(page);
    const wanted = dampers.map(({ clearance }) => clearance * scale).reverse();
    assert.equal(clearances.length, wanted.length);
    wanted.forEach((width, k) => assert.ok(Math.abs(clearances[k] - width) < 0.5, `${clearances[k]} px, not ${width}`));
    const first = [excitation?.displacement ?? 0].flat().at(-1);
    if (first !== 0) assert.ok(Math.abs(start - first * scale) < 1, `it starts ${start} px aside, not ${first * scale}`);
    else assert.equal(start, null);
  });

test("A clearance is seen as it is typed; what cannot be read is left out", async ({ page, url, refused }) => {
  refused(422); // the scene without it, where that was asked about
  await page.goto(url("#/scene"));
  const field = page.getByLabel(/^Clearance/).first();
  await field.fill("0.018");
  await until("18 mm", async () => /clearance 18 mm/.test(await drawing(page).getAttribute("aria-label")));
  const { scale, clearances } = await measured(page);
  assert.ok(Math.abs(clearances[0] - 0.018 * scale) < 0.5);
  await field.fill("");
  await until("no clearance", async () => /no clearance/.test(await drawing(page).getAttribute("aria-label")));
});
