// Motion over time: zoom by mouse, keys and buttons, the address that follows, marks of impacts, the trust horizon.
import assert from "node:assert/strict";
import { leads, says, test, until } from "./support.mjs";

const chartOf = (page, name) => page.getByRole("application", { name, exact: true });
const figure = (page, name) => page.getByRole("figure", { name, exact: true });
const motion = (page) => page.getByRole("region", { name: "Motion over time" });

test("Zoom by keys moves every chart and the address; back undoes it; another reader sees the same", async ({ page, newPage, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}?from=0&to=10`));
  await says(figure(page, "Contact force"), /Time from 0 s to 10 s; contact force between −5\.716 N/);
  await chartOf(page, "Displacement").focus();
  await page.keyboard.press("+");
  await says(figure(page, "Contact force"), /from 2\.5 s to 7\.5 s/);
  const [, from, to] = await leads(page, /from=([\d.]+)&to=([\d.]+)/);
  assert.ok(Math.abs(from - 2.5) < 0.02 && Math.abs(to - 7.5) < 0.02, `${from} to ${to}`);
  await page.keyboard.press("Shift+ArrowLeft");
  await says(figure(page, "Free mass between its stops"), /from 1\.25 s to 6\.25 s/);
  await leads(page, /from=1\.25&to=6\.25/);
  await page.goBack();
  await says(figure(page, "Contact force"), /from 2\.5 s to 7\.5 s/);
  const other = await newPage();
  await other.goto(page.url());
  await says(figure(other, "Displacement"), /from 2\.5 s to 7\.5 s/);
  await page.getByRole("button", { name: "Show the whole" }).first().click();
  await says(figure(page, "Displacement"), /from 0 s to 10 s/);
});

test("A decaying motion is shown as long as there is one, beside that of the bare structure; the whole is a click away", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}`));
  await says(motion(page), /The first 3\.6 s of 10 s hold almost all of the motion/);
  await says(figure(page, "Displacement"), /without damper between −14\.\d+ mm and 15 mm; with the damper between −12\.\d+ mm and 15 mm/);
  await page.getByRole("button", { name: "Show the whole" }).first().click();
  await says(figure(page, "Displacement"), /from 0 s to 10 s/);
});

test("The cursor of one chart tells the values of all; Page Down and Enter choose an impact", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}`));
  await chartOf(page, "Displacement").focus();
  await until("the marks", async () => (await figure(page, "Displacement").locator(".marker").count()) > 15);
  await page.keyboard.press("PageDown");
  await page.keyboard.press("PageDown");
  await says(page.getByRole("status").filter({ hasText: "impact 2" }), /with the damper −.*impact 2, .*stop/);
  await page.keyboard.press("Enter");
  await leads(page, /impact=2/);
});

test("What cannot be trusted is shaded and said; charts are chosen by name and kept in the address", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_random_sponge");
  await page.goto(url(`#/results/${result}?tab=accuracy`));
  await says(page.getByRole("tabpanel"), /To 9\.217 s, the trust horizon/);
  await says(page.getByRole("main"), /Accuracy[^]*to 9\.22 s/);
  await page.getByRole("button", { name: "Velocity", exact: true }).click();
  await says(figure(page, "Velocity"), /between −/);
  await page.getByRole("button", { name: "Contact force", exact: true }).click();
  await until("the chart to go", async () => (await figure(page, "Contact force").count()) === 0);
  await leads(page, /channels=displacement,relative_1,velocity/);
});

test("A series that is not stored any more says so and runs again by a button", async ({ page, daemon, url, refused }) => {
  refused(410);
  const { result } = await daemon.run("paper_free_sponge");
  await page.route(/series\.(npy|json)/, (route) => route.fulfill({ status: 410, contentType: "application/problem+json",
    body: JSON.stringify({ type: "/problems/gone", title: "Gone", status: 410, detail: "another engine" }) }));
  await page.goto(url(`#/results/${result}`));
  await says(motion(page), /not stored any more/);
  await page.getByRole("button", { name: "Run the scene again" }).click();
  await leads(page, /#\/(jobs\/j-|results\/r-)/);
});

test("A drag chooses a window; its samples stand in a table", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}?from=0.1&to=0.2`));
  await says(figure(page, "Displacement"), /from 100 ms to 200 ms/);
  await chartOf(page, "Displacement").scrollIntoViewIfNeeded();
  const box = await chartOf(page, "Displacement").boundingBox();
  await page.mouse.move(box.x + box.width * 0.4, box.y + 90);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.6, box.y + 90, { steps: 4 });
  await page.mouse.up();
  const [, from, to] = await leads(page, /from=(0\.13\d*)&to=(0\.15\d*)/);
  assert.ok(to > from);
  await says(figure(page, "Displacement"), /from 13\d[.\d]* ms to 15\d[.\d]* ms/);
  await page.getByRole("button", { name: "Numbers: Displacement" }).click();
  await says(figure(page, "Displacement"), /The first 1000 of 10001 rows/);
  assert.equal(await figure(page, "Displacement").getByRole("row").count(), 1001);
});

test("A 4 Hz sine is a single line at 10, 30 and 60 s; a chart's picture is a click away", async ({ page, daemon, url }) => {
  for (const duration of [10, 30, 60]) {
    const { result } = await daemon.run({ structure: { mass: 1, stiffness: 1e6, damping: 200 }, excitation: { kind: "sine", amplitude: 1, frequency: 4 },
      duration, sample_rate: 500, output: { channels: ["displacement"], psd: null } });
    await page.goto(url(`#/results/${result}`));
    await says(figure(page, "Displacement"), new RegExp(`from 0 s to ${duration} s`));
      // Each turn of the line is at an extreme: it goes up and down between them and is no band.
    const d = await figure(page, "Displacement").locator("path.line").getAttribute("d");
    const points = [...d.matchAll(/[ML]([\d.-]+) ([\d.-]+)/g)].map(([, x, y]) => [Number(x), Number(y)]);
    const least = Math.min(...points.map(([, y]) => y)), most = Math.max(...points.map(([, y]) => y));
    const turns = points.filter(([, y], at) => at > 0 && at < points.length - 1 && (y - points[at - 1][1]) * (points[at + 1][1] - y) < 0);
    assert.ok(Math.abs(turns.length - 8 * duration) < 8, `${turns.length} turns in ${duration} s`);
    for (const [, y] of turns.slice(4)) assert.ok(Math.min(y - least, most - y) < 0.06 * (most - least), `a turn at ${y} of ${least} to ${most}`);
  }
  const [picture] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save as PNG: Displacement" }).click()]);
  assert.equal(picture.suggestedFilename(), "displacement.png");
  const [drawing] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save as SVG: Displacement" }).click()]);
  assert.equal(drawing.suggestedFilename(), "displacement.svg");
});
