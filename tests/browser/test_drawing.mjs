// The drawing of a scene: its numbers in words, its lengths against one scale, the shape of its columns.
import assert from "node:assert/strict";
import { test, until } from "./support.mjs";

const drawing = (page) => page.getByRole("img", { name: /A (structure|frame)/ }).first();

// Lengths in the picture: pixels per metre by its bar, and the dimensions of the clearances from the top (px).
const measured = (page) => drawing(page).evaluate((svg) => {
  const width = (node) => node.getBBox().width;
  const [, number, prefix] = /([\d.]+)\s([µm]?)m$/.exec(svg.querySelector(".bar-text").textContent);
  const release = svg.querySelector(".release .line");
  return {
    scale: width(svg.querySelector(".bar")) / (Number(number) * { "": 1, m: 1e-3, "µ": 1e-6 }[prefix]),
    clearances: [...svg.querySelectorAll(".clearance .ends")].map(width),
    start: release && width(release),
  };
});

for (const [name, words] of [["paper_free_sponge", /1.35\skg.*0.1107\skg · sponge, clearance 15\smm/],
  ["matrices", /25\skg.*clearance 20\smm/],
  ["frame_two_dampers", /3 storeys.*storey 3 .*60\skg · sponge, clearance 40|storey 2 .*40\skg · soft rubber, clearance 30\smm/]])
  test(`The drawing of ${name} is to scale and named in words`, async ({ page, daemon, url }) => {
    const { dampers, excitation } = await daemon.example(name);
    await page.goto(url(`#/scene?example=${name}`));
    await until("its words", async () => words.test(await drawing(page).getAttribute("aria-label")));
    const { scale, clearances, start } = await measured(page);
    const wanted = dampers.map(({ clearance }) => clearance * scale).reverse();
    assert.equal(clearances.length, wanted.length);
    wanted.forEach((width, k) => assert.ok(Math.abs(clearances[k] - width) < 0.5, `${clearances[k]} px, not ${width}`));
    const first = [excitation?.displacement ?? 0].flat().at(-1);
    if (first !== 0) assert.ok(Math.abs(start - Math.abs(first) * scale) < 1, `it starts ${start} px aside, not ${first * scale}`);
    else assert.equal(start, null);
  });

test("A clearance is seen as it is typed; what cannot be read is left out", async ({ page, url, refused }) => {
  refused(422); // the scene without it, where that was asked about
  await page.goto(url("#/scene"));
  const field = page.getByRole("textbox", { name: "Clearance" }).first();
  await field.fill("0.018");
  await until("18 mm", async () => /clearance 18\smm/.test(await drawing(page).getAttribute("aria-label")));
  const { scale, clearances } = await measured(page);
  assert.ok(Math.abs(clearances[0] - 0.018 * scale) < 0.5);
  await field.fill("");
  await until("no clearance", async () => /no clearance/.test(await drawing(page).getAttribute("aria-label")));
});

test("Columns are upright at both ends and bend as beams that are held there", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("frame_two_dampers", { duration: 4 });
  await page.goto(url(`#/results/${result}?t=2`));
  const columns = page.getByRole("img", { name: /3 storeys/ });
  await until("a state that is bent", () => columns.evaluate((svg) => [...svg.querySelectorAll(".column")].some((column) => {
    const [a, , , b] = column.getAttribute("d").match(/-?[\d.]+ -?[\d.]+/g).slice(0, 4).map((pair) => Number(pair.split(" ")[0]));
    return Math.abs(b - a) > 2;
  })));
  const errors = await columns.evaluate((svg) => [...svg.querySelectorAll(".column")].map((column) => {
    const points = column.getAttribute("d").match(/-?[\d.]+ -?[\d.]+/g).slice(0, 4).map((pair) => pair.split(" ").map(Number));
    const [[x0, y0], , , [x1, y1]] = points;
    const curve = document.createElementNS("http://www.w3.org/2000/svg", "path");
    curve.setAttribute("d", `M${points[0].join(" ")}C${points.slice(1).map((one) => one.join(" ")).join(" ")}`);
    const length = curve.getTotalLength();
    let worst = 0;
    for (let at = 0; at <= 20; at++) {
      const { x, y } = curve.getPointAtLength((at / 20) * length);
      const s = (y - y0) / (y1 - y0);
      worst = Math.max(worst, Math.abs(x - (x0 + (x1 - x0) * (3 * s * s - 2 * s ** 3))));
    }
    return worst;
  }));
  assert.equal(errors.length, 3);
  for (const error of errors) assert.ok(error < 0.1, `${error} px`);
});
