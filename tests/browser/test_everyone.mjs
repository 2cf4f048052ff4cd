// What the dashboard owes to everyone: something to read before data is there, paper, an address that is the whole state.
// Names, contrast and width of every page are test_pages.mjs's.
import assert from "node:assert/strict";
import { settle } from "./pages.mjs";
import { overflow, says, test, until } from "./support.mjs";

const sponge = async (daemon) => ({ hash: `#/results/${(await daemon.run("paper_free_sponge")).result}`, wants: /impact/ });

test("The title, a heading and the way on are there before any answer of the service", async ({ page, url }) => {
  await page.route(/\/(v1|schemas|version)/, () => {}); // never answered
  await page.goto(url());
  await page.getByRole("heading", { level: 1 }).waitFor();
  await page.getByRole("navigation").getByRole("link", { name: "Materials" }).waitFor();
  await page.getByRole("img").first().waitFor(); // the paper's sponge, drawn
  await page.getByRole("button", { name: /^Run/ }).first().waitFor();
});

test("The report of a result has its numbers, charts, impacts and inputs; on paper nothing is cut off, no controls, dark on white", async ({ daemon, url, newPage }) => {
  const page = await newPage({ colorScheme: "dark", viewport: { width: 760, height: 900 } });
  const result = await sponge(daemon);
  await settle(page, url(result.hash), result);
  await settle(page, () => page.getByRole("link", { name: "Report", exact: true }).click(), { wants: /Inputs/ });
  await page.getByRole("button", { name: "Print or save as PDF" }).waitFor();
  for (const name of ["Motion", "Spectrum", "Impacts", "Energy", "How it was computed", "Inputs"])
    await page.getByRole("heading", { name, exact: true, level: 2 }).waitFor();
  assert.ok((await page.locator("main figure.chart").count()) >= 4);
  await says(page.getByRole("region", { name: "Inputs" }), /Damper 1, clearance\s*15 mm/);
  await page.emulateMedia({ media: "print" });
  assert.equal(await page.getByRole("button", { name: /Copy|PNG|SVG|Play|Theme|studies|Print/ }).count(), 0);
  assert.equal(await page.getByRole("navigation").count(), 0);
  await until("the page to fit", async () => (await overflow(page)) === 0, 2000);
  const light = await page.evaluate(() => getComputedStyle(document.body).color.match(/\d+/g).slice(0, 3).every((part) => Number(part) < 90));
  assert.ok(light, "text on paper is dark");
  const cut = await page.evaluate(() => [...document.querySelectorAll("main *")].filter((node) => node.checkVisibility() &&
    getComputedStyle(node).overflowY === "auto" && node.scrollHeight > node.clientHeight + 2).map((node) => node.ariaLabel ?? node.className));
  assert.deepEqual(cut, [], "nothing on paper can be scrolled to");
  assert.ok((await page.pdf()).length > 20000);
});

// All that is drawn: [name, SVG without the names that each page gives anew].
const charts = async (page) => {
  await until("all to be drawn", async () => !/loading …/i.test(await page.locator("main").innerText()));
  return page.evaluate(() => [...document.querySelectorAll("main svg")].filter((node) => node.checkVisibility())
    .map((node) => [node.closest("figure, section")?.ariaLabel, node.outerHTML.replace(/\b(\w+)-\d+/g, "$1")]));
};
// The sections whose pictures differ.
const differing = (some, others) => some.filter(([, picture], at) => picture !== others[at]?.[1]).map(([section]) => section);

test("A result's address with its window and impact is the same picture in a fresh profile, after a reload and after back", async ({ page, daemon, url, newPage }) => {
  const result = await sponge(daemon);
  const shared = { ...result, hash: `${result.hash}?from=1&to=1.8&impact=5` };
  await settle(page, url(result.hash), result);
  const whole = await charts(page);
  await settle(page, url(shared.hash), shared);
  const zoomed = await charts(page);
  assert.ok(whole.length >= 3 && zoomed.length === whole.length, `${whole.length} and ${zoomed.length} charts`);
  assert.ok(differing(whole, zoomed).length >= 2, "the window of time is seen in the charts");
  const other = await newPage();
  await settle(other, url(shared.hash), shared);
  assert.deepEqual(differing(zoomed, await charts(other)), [], "a fresh profile");
  await settle(page, () => page.reload(), shared);
  assert.deepEqual(differing(zoomed, await charts(page)), [], "a reload");
  await settle(page, () => page.goBack(), result);
  assert.deepEqual(differing(whole, await charts(page)), [], "back");
});

test("The theme is chosen by a button and stays; the link over the navigation leads into the content", async ({ page, url }) => {
  const back = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  await page.goto(url("#/shell"));
  await says(page.getByRole("main"), /curl/);
  const light = await back();
  await page.getByRole("button", { name: "Use dark colours" }).click();
  const dark = await back();
  assert.notEqual(light, dark);
  await page.reload();
  await page.getByRole("button", { name: "Use light colours" }).waitFor();
  assert.equal(await back(), dark);
  await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  assert.equal(await page.evaluate(() => document.activeElement.id), "main");
});

test("Where the browser keeps nothing, the page works, and a theme lasts as long as it does", async ({ page, url }) => {
  await page.addInitScript(() => {
    const refuse = () => { throw new DOMException("refused", "SecurityError"); };
    for (const name of ["localStorage", "sessionStorage"]) Object.defineProperty(window, name, { get: refuse });
  });
  await page.goto(url("#/scene"));
  await says(page.getByRole("region", { name: "Estimate" }), /Hz/);
  await page.getByRole("button", { name: "Use dark colours" }).click();
  await page.getByRole("button", { name: "Use light colours" }).waitFor();
  await page.getByRole("link", { name: "Runs" }).click();
  await says(page.getByRole("heading", { level: 1 }), /Runs/);
});

test("Units are chosen in the header: charts, numbers and tables follow at once, and stay; the address does not change", async ({ page, daemon, url }) => {
  const result = await sponge(daemon), main = page.getByRole("main");
  const { summary } = await daemon.get(`/v1${result.hash.slice(1)}`);
  await settle(page, url(`${result.hash}?channels=displacement,acceleration,contact_force`), result);
  const hash = await page.evaluate(() => location.hash);
  const heading = (name) => page.getByRole("heading", { name });
  await heading("Displacement [mm]").waitFor();
  await heading("Acceleration [m/s²]").waitFor();
  await page.getByRole("button", { name: "Units" }).click();
  const choose = (quantity, unit) => page.getByRole("group", { name: quantity }).getByRole("button", { name: unit, exact: true }).click();
  await choose("Lengths", "m");
  await choose("Accelerations", "g");
  await choose("Forces", "kN");
  await heading("Displacement [m]").waitFor();
  await heading("Acceleration [g]").waitFor();
  await heading("Contact force [kN]").waitFor();
  await says(page.getByRole("region", { name: "Impacts", exact: true }), /Peak force \[kN\]/);
  await says(main, new RegExp(`Acceleration, rms[^]*${(summary.rms_acceleration / 9.80665).toPrecision(3)}\\d* g`));
  assert.equal(await page.evaluate(() => location.hash), hash);
  await settle(page, () => page.reload(), result);
  await heading("Acceleration [g]").waitFor();
  const [first, second] = await page.getByRole("figure", { name: "Acceleration" }).locator("text").allTextContents();
  assert.ok(Number.isInteger(Number(first.replace("−", "-")) * 100) && first !== second, `ticks are round in g: ${first}, ${second}`);
  await page.goto(url("#/scene"));
  await says(page.getByRole("region", { name: "Live" }), /Clearance\s+0\.015 m/);
  await page.getByRole("button", { name: "Units" }).click();
  await choose("Lengths", "Automatic");
  await says(main, /= 15 mm/);
});

test("A hint on the first visit leads to the tutorial, and does not come again once it was closed or left", async ({ page, url, newPage }) => {
  const hint = (where) => where.getByRole("region", { name: "First visit" });
  await page.goto(url("#/scene"));
  await says(hint(page), /New here\?/);
  await hint(page).getByRole("link", { name: "Tutorial" }).waitFor();
  await hint(page).getByRole("button", { name: "Close the hint" }).click();
  await hint(page).waitFor({ state: "detached" });
  await page.reload();
  await page.getByRole("heading", { level: 1, name: "Scene" }).waitFor();
  assert.equal(await hint(page).count(), 0);
  const other = await newPage();
  await other.goto(url("#/jobs"));
  await other.getByRole("heading", { level: 1, name: "Runs" }).waitFor();
  await other.goto(url("#/scene"));
  await other.getByRole("heading", { level: 1, name: "Scene" }).waitFor();
  assert.equal(await hint(other).count(), 0);
});
