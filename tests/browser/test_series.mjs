// Motion over time: zoom by mouse, keys and buttons, the address that follows, marks of impacts, the trust horizon.
import assert from "node:assert/strict";
import { leads, says, test, until } from "./support.mjs";

const chartOf = (page, name) => page.getByRole("application", { name, exact: true });
const figure = (page, name) => page.getByRole("figure", { name, exact: true });

test("Zoom by keys moves every chart and the address; back undoes it; another reader sees the same", async ({ page, newPage, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}`));
  await says(figure(page, "Contact force"), /From 0 s to 10 s: contact force between −5\.716 N/);
  await chartOf(page, "Displacement").focus();
  await page.keyboard.press("+");
  await says(figure(page, "Contact force"), /From 2\.5 s to 7\.5 s/);
  const [, from, to] = await leads(page, /from=([\d.]+)&to=([\d.]+)/);
  assert.ok(Math.abs(from - 2.5) < 0.02 && Math.abs(to - 7.5) < 0.02, `${from} to ${to}`);
  await page.keyboard.press("Shift+ArrowLeft");
  await says(figure(page, "Acceleration"), /From 1\.25 s to 6\.25 s/);
  await leads(page, /from=1\.25&to=6\.25/);
  await page.goBack();
  await says(figure(page, "Acceleration"), /From 2\.5 s to 7\.5 s/);
  const other = await newPage();
  await other.goto(page.url());
  await says(figure(other, "Displacement"), /From 2\.5 s to 7\.5 s/);
  await page.getByRole("button", { name: "Show the whole" }).first().click();
  await says(figure(page, "Displacement"), /From 0 s to 10 s/);
});

test("The cursor of one chart tells the values of all; Page Down and Enter choose an impact", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}`));
  await says(page.getByRole("region", { name: "Motion over time" }), /largest of 13 samples[^]*22 contacts in this window/);
  await chartOf(page, "Displacement").focus();
  await page.keyboard.press("PageDown");
  await page.keyboard.press("PageDown");
  await says(figure(page, "Acceleration"), /at 11\d\.?\d* ms · impact 2/);
  await says(page.getByRole("status").filter({ hasText: "impact 2" }), /displacement −.*impact 2, .*stop/);
  await page.keyboard.press("Enter");
  await leads(page, /impact=2/);
});

test("What cannot be trusted is shaded and said; channels are chosen by name and kept in the address", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_random_sponge");
  await page.goto(url(`#/results/${result}`));
  await says(page.getByRole("region", { name: "Summary" }), /To 9\.217 s, the trust horizon/);
  await page.getByLabel("velocity", { exact: true }).check();
  await says(figure(page, "Velocity"), /between −/);
  await page.getByLabel("acceleration", { exact: true }).uncheck();
  await until("the chart to go", async () => (await figure(page, "Acceleration").count()) === 0);
  await leads(page, /channels=displacement,velocity,contact_force/);
});

test("A series that is not stored any more says so and runs again by a button", async ({ page, daemon, url, refused }) => {
  refused(410);
  const { result } = await daemon.run("paper_free_sponge");
  await page.route(/series\.json/, (route) => route.fulfill({ status: 410, contentType: "application/problem+json",
    body: JSON.stringify({ type: "/problems/gone", title: "Gone", status: 410, detail: "another engine" }) }));
  await page.goto(url(`#/results/${result}`));
  await says(page.getByRole("region", { name: "Motion over time" }), /not stored any more/);
  await page.getByRole("button", { name: "Run the scene again" }).click();
  await leads(page, /#\/(jobs\/j-|results\/r-)/);
});

test("A drag chooses a window of single samples, drawn one by one, with a table behind", async ({ page, daemon, url }) => {
  const { result } = await daemon.run("paper_free_sponge");
  await page.goto(url(`#/results/${result}?from=0.1&to=0.2`));
  await says(page.getByRole("region", { name: "Motion over time" }), /Every sample is drawn/);
  await chartOf(page, "Displacement").scrollIntoViewIfNeeded();
  const box = await chartOf(page, "Displacement").boundingBox();
  await page.mouse.move(box.x + box.width * 0.4, box.y + 90);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.6, box.y + 90, { steps: 4 });
  await page.mouse.up();
  const [, from, to] = await leads(page, /from=(0\.13\d*)&to=(0\.15\d*)/);
  await says(figure(page, "Displacement"), /From 13\d[.\d]* ms to 15\d[.\d]* ms/);
  await figure(page, "Displacement").getByText("As a table").click();
  await until("the rows of the window alone", async () => {
    const rows = await figure(page, "Displacement").getByRole("row").count();
    return rows > (to - from) * 1000 && rows < (to - from) * 1000 + 8;
  });
});
