// Materials as a lab member uses them: found, computed for a pair of masses, measured by a drop test, reviewed, reverted, written
// by two at once.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { leads, says, tabTo, test, until } from "./support.mjs";

const main = (page) => page.getByRole("main");

test("A drop test of a new material is entered by keyboard alone, and simulated with", async ({ page, url, daemon, refused }) => {
  refused(422); // of what is half typed, where keys come slowly
  let presses = 0;
  const press = async (...keys) => {
    for (const key of keys) await page.keyboard.press(key);
    presses += keys.length;
  };
  const type = async (text) => {
    await page.keyboard.type(text);
    presses += text.length;
  };
  const pressTo = async (control) => {
    await control.waitFor();
    while (!(await control.evaluate((node) => node === document.activeElement)) && presses < 90) await press("Tab");
    await press("Enter");
  };
  await page.goto(url("#/materials"));
  await tabTo(page, page.getByText("Add a material"));
  await press("Enter");
  await page.getByLabel("Slug").waitFor();
  await press("Tab");
  await type("cork_3_mm");
  await press("Tab");
  await type("Cork, 3 mm");
  await press("Tab");
  await type(".6");
  await press("Tab", "Tab");
  await type("guess");
  await press("Tab", "Tab", "Tab", "Enter");
  await leads(page, /#\/materials\/cork_3_mm$/);
  await pressTo(page.getByRole("link", { name: "Enter a drop test" }));
  await leads(page, /#\/materials\/cork_3_mm\/measure/);
  const first = page.getByLabel("Drop height, drop 1");
  await until("the first cell to have the focus", () => first.evaluate((node) => node === document.activeElement));
  await type("100");
  await press("Tab");
  await type("40");
  await press("Tab", "Tab", "Tab");
  await type("9");
  await press("Shift+Tab", "Shift+Tab", "Shift+Tab", "Enter");
  for (const height of ["41", "39", "42", "40"]) {
    await type(height);
    await press("Enter");
  }
  await says(page.getByRole("definition"), /0\.6356.*95 %.*readings: 5/s);
  await press("Control+Enter");
  await says(main(page), /What comes of test 1/);
  await press("Enter");
  await leads(page, /#\/materials\/cork_3_mm\?revision=2/);
  await pressTo(page.getByRole("link", { name: "Simulate with it" }));
  await leads(page, /#\/scene\?/);
  const made = await daemon.get("/v1/materials/cork_3_mm@2");
  assert.ok(Math.abs(made.restitution - 0.6356) < 0.0001 && made.contact_time === 0.009 && made.measurements[0] === 1);
  await says(main(page), /cork_3_mm@2 is a draft/);
  await press("Control+Enter");
  const [, id] = await leads(page, /#\/results\/([^?]+)/);
  assert.equal((await daemon.get(`/v1/results/${id}`)).plan.derived[0].material, "cork_3_mm@2");
  assert.ok(presses < 90, `it takes ${presses} presses of keys`);
});

test("Faults of a drop test stand in their rows, and a column is pasted", async ({ page, url, refused }) => {
  refused(422);
  await page.goto(url("#/materials/sponge/measure"));
  await page.getByLabel("Drop height, drop 1").fill("100");
  await page.getByLabel("Rebound height, drop 1").fill("0,5 x");
  const cell = page.getByLabel("Rebound height, drop 1");
  await until("the fault", async () => (await cell.getAttribute("aria-invalid")) === "true");
  await page.getByRole("button", { name: "Drop 1, rebound height" }).click();
  await until("the focus to be there", () => cell.evaluate((node) => node === document.activeElement));
  await cell.evaluate((node) => {
    const clipboardData = new DataTransfer();
    clipboardData.setData("text", "height [cm]\n3.7\n3.8\n3,6\n9\n");
    node.dispatchEvent(new ClipboardEvent("paste", { clipboardData, bubbles: true, cancelable: true }));
  });
  await says(page.getByRole("definition"), /readings: 4/);
  await page.getByLabel("Excluded, drop 4").fill("slipped");
  await says(page.getByRole("definition"), /0\.608.*readings: 3/s);
});

// The force on a buffer that a mass strikes with 0.5 m/s at 0.1 s, and slower at 0.4 s: a spring of 1 kN/m and a damper of 4 N s/m.
function pulses(interval) {
  const mass = 0.1, k_b = 1000, c_b = 4, decay = c_b / 2 / mass, omega = Math.sqrt(k_b / mass - decay ** 2), long = Math.PI / omega;
  return Array.from({ length: Math.round(0.6 / interval) }, (_, k) => {
    const time = k * interval, noise = 0.01 * Math.sin(k * 12.9898) * Math.sin(k * 78.233);
    const start = time < 0.4 ? 0.1 : 0.4, since = time - start;
    return [time, noise + (since > 0 && since < long ? (start > 0.3 ? 0.3 : 0.5) * Math.exp(-decay * since) *
      ((k_b - c_b * decay) / omega * Math.sin(omega * since) + c_b * Math.cos(omega * since)) : 0)];
  });
}
const csv = (rows, separator = ",") => rows.map(([time, force]) => `${time.toFixed(7)}${separator}${force.toFixed(5)}`).join("\n");

// Chooses a file of this text for the first trace of a drop test.
async function choose(page, folder, name, text) {
  const file = path.join(folder, name);
  fs.writeFileSync(file, text);
  await page.getByRole("button", { name: "Force [N]" }).setInputFiles(file);
}
// The values of a column of a chart's table.
async function column(page, chart, name) {
  const figure = page.getByRole("figure", { name: chart });
  const numbers = figure.getByRole("button", { name: /^Numbers/ });
  await numbers.click();
  await figure.getByRole("table").waitFor();
  const found = await figure.getByRole("table").evaluate((table, name) => {
    const at = [...table.querySelectorAll("thead th")].findIndex((head) => head.textContent.includes(name));
    return [...table.querySelectorAll("tbody tr")].map((row) => row.children[at]?.textContent);
  }, name);
  await numbers.click();
  return found;
}

test("A force trace is read from a file; its contacts are drawn with the pulses that fit them", async ({ page, url, folder }) => {
  const rows = pulses(1e-3);
  await page.goto(url("#/materials/soft_rubber/measure"));
  await page.getByRole("button", { name: "Add trace" }).click();
  await choose(page, folder, "trace.csv", `time [s],force [N]\n${csv(rows)}`);
  await says(main(page), /Contacts detected: 2; \S+ N at (100|99\.9) ms, contact time 3[12]\.?\d* ms, e 0\.5/);
  const drawn = (await column(page, "Force of trace 1", "fitted by zero penetration")).filter((text) => text !== "–");
  assert.equal(drawn.length, 66, "33 points for each of two contacts");
  await page.getByLabel("Excluded", { exact: true }).fill("cable moved");
  await says(main(page), /Nothing counts yet/);
});

test("A trace with semicolons and decimal commas is read; a file that is none is refused where it was chosen", async ({ page, url, folder }) => {
  await page.goto(url("#/materials/soft_rubber/measure"));
  await page.getByRole("button", { name: "Add trace" }).click();
  await choose(page, folder, "german.csv", `Zeit;Kraft\n${csv(pulses(1e-3), ";").replaceAll(".", ",")}`);
  await says(main(page), /Contacts detected: 2/);
  const field = page.getByRole("group", { name: "Trace 1" });
  for (const [text, fault] of [["time [s],force [N]\n0,1\n1,2\n3,2\n", /Line 3: a time in s, at even steps/],
    ["0,1\n1,2\n2,2\n3\n4,1\n", /Line 4: a time in s/], ["a|b\n0|1\n", /No line has two numbers/]]) {
    await choose(page, folder, "bad.csv", text);
    await says(field, fault);
    await says(field, /Contacts detected: 2/); // what was read before still counts
  }
});

test("Where no pulse fits a contact, or nothing is one, the page says why", async ({ page, url, folder }) => {
  await page.goto(url("#/materials/soft_rubber/measure"));
  await page.getByRole("button", { name: "Add trace" }).click();
  await choose(page, folder, "saturated.csv", csv(pulses(1e-3).map(([time, force]) => [time, Math.min(force, 2.5)])));
  await says(main(page), /Contacts detected: 2; 2\.5 N at .*, the trace differs from every pulse .*; \S+ N at 400 ms, contact time/);
  await choose(page, folder, "still.csv", csv(pulses(1e-3).slice(150, 390).map(([time, force]) => [time - 0.15, force])));
  await says(main(page), /Contacts detected: 0; no force exceeds the threshold/);
});

test("A revision is reviewed, compared and reverted; who writes second is told what happened and does it again", async ({ page, url, daemon, refused }) => {
  const felt = { name: "Felt", restitution: 0.3, contact_time: 0.02, source: "notebook 7" };
  await daemon.ask("POST", "/v1/materials", { slug: "felt", ...felt });
  await daemon.ask("POST", "/v1/materials/felt/revisions", { ...felt, restitution: 0.33, comment: "measured anew" }, { "If-Match": "*" });
  await page.goto(url("#/materials/felt?revision=2"));
  await page.getByLabel("Reason").fill("agrees with the sheet");
  await page.getByRole("button", { name: "Review it" }).click();
  await says(main(page), /Felt approved/);
  await says(page.getByRole("region", { name: "History" }), /Approved revision 2: agrees with the sheet\s.*Wrote revision 2: measured anew/s);
  await page.getByRole("link", { name: "Revision 1", exact: true }).click();
  await says(main(page), /felt@1 of 2/); // the page before has the same differences
  await says(page.getByRole("region", { name: "From revision 1 to revision 2" }), /Restitution\s+0\.3\s+0\.33/);
  refused(412);
  await daemon.ask("POST", "/v1/materials/felt/revisions", { ...felt, restitution: 0.35, comment: "a third sheet" }, { "If-Match": "*" });
  await page.getByRole("button", { name: "Revert to revision 1" }).click();
  await says(main(page), /Another client changed it meanwhile.*a third sheet.*0\.33\s+0\.35/s);
  await page.getByRole("button", { name: "Make my change all the same" }).click();
  await says(main(page), /felt@4 of 4/);
  assert.equal((await daemon.get("/v1/materials/felt@4")).restitution, 0.3);
});

test("Materials are found by filters that stand in the URL", async ({ page, url, newPage }) => {
  await page.goto(url("#/materials"));
  await page.getByRole("searchbox", { name: "Search" }).fill("rubber");
  await page.getByLabel("Kind").selectOption("rubber");
  await page.getByLabel("Restitution e, at least").fill("0,5");
  await page.getByLabel("Contact time [ms], at most").fill("19");
  await page.keyboard.press("Enter");
  await says(page.getByRole("main").getByRole("status"), /^1 found$/);
  const other = await newPage();
  await other.goto(page.url());
  await says(other.getByRole("main").getByRole("status"), /^1 found$/);
  await says(other.getByRole("region", { name: "Materials" }), /Hard rubber/);
  assert.match(page.url(), /e=0\.5\.\.&T_c=\.\.0\.019/);
  assert.equal(await other.getByLabel("Contact time [ms], at most").inputValue(), "19");
});

test("A table of materials has its faults told by row and column, and comes in when they are mended", async ({ page, url, folder, refused }) => {
  const file = path.join(folder, "lab.csv");
  refused(422);
  await page.goto(url("#/materials"));
  await page.getByText("Import", { exact: true }).click();
  fs.writeFileSync(file, "slug,name,restitution,source\nlab_one,One,1.3,own\n");
  await page.getByLabel(/^A table/).setInputFiles(file);
  await says(page.getByRole("alert"), /row 2, restitution must be within/);
  const mended = path.join(folder, "mended.csv");
  fs.writeFileSync(mended, "slug,name,restitution,source\nlab_one,One,0.3,own\n");
  await page.getByLabel(/^A table/).setInputFiles(mended);
  await says(page.getByRole("region", { name: "Materials" }), /One/);
});

test("A material's page computes k_b and c_b for a pair of masses, with uncertainty, and says where they hold", async ({ page, url, daemon, newPage }) => {
  const cork = { name: "Cork", restitution: 0.5, restitution_deviation: 0.02, contact_time: 0.01, contact_time_deviation: 0.0005, source: "notebook 8",
    impactor_mass: 0.11, base: "fixed", least_speed: 0.2, most_speed: 1.4 };
  await daemon.ask("POST", "/v1/materials", { slug: "cork", ...cork });
  await page.goto(url("#/materials/cork"));
  const pair = page.getByRole("region", { name: "For a pair of masses" }), table = pair.getByRole("region", { name: /^Contact parameters/ });
  assert.equal(await pair.getByLabel("Free mass").inputValue(), "0.11");
  await says(pair, /Effective mass 0\.11 kg; that of the test 0\.11 kg; measured from 0\.2 to 1\.4 m\/s/);
  await pair.getByLabel("Free mass").fill("0,5");
  await pair.getByLabel("Mass that it meets").fill("20");
  await says(pair, /Effective mass 0\.4878 kg/);
  const { contacts: [{ stiffness, damping }] } = await daemon.get("/v1/materials/cork/derived?damper_mass=0.5&structure_mass=20");
  const row = await table.getByRole("row", { name: /^zero penetration/ }).innerText();
  assert.ok(row.includes((stiffness.value / 1000).toFixed(2)) && row.includes(damping.value.toFixed(2)), row);
  await says(table, /k\s*b \[kN\/m\].*±.*95 %/s);
  await pair.getByRole("figure", { name: /^Force of an impact at 0\.53 m\/s/ }).waitFor();
  const other = await newPage({ viewport: { width: 390, height: 844 } });
  await other.goto(page.url());
  await says(other.getByRole("region", { name: "For a pair of masses" }), /Effective mass 0\.4878 kg/);
  await pair.getByRole("button", { name: "kb and cb" }).click();
  await leads(page, /for=rig/);
  await pair.getByLabel("Mass that it meets").fill("-1");
  await says(pair, /A mass is a number above 0 kg/);
});

test("Readings of drop tests are charts over the approach speed: what counts, what is far off, what is excluded", async ({ page, url, daemon }) => {
  const drops = [[0.1, 0.0082], [0.1, 0.0088], [0.2, 0.017], [0.2, 0.0185], [0.3, 0.026], [0.3, 0.06]]
    .map(([drop_height, rebound_height], at) => ({ drop_height, rebound_height, contact_time: 0.02 - at * 1e-4 }));
  await daemon.ask("POST", "/v1/materials", { slug: "wool", name: "Wool", restitution: 0.3, source: "a guess" });
  await daemon.ask("POST", "/v1/materials/wool/measurements", { drops: [...drops, { drop_height: 0.4, rebound_height: 0.033, excluded: "slipped" }], height_uncertainty: 0.001 });
  await page.goto(url("#/materials/wool"));
  const panel = page.getByRole("region", { name: "Drop tests", exact: true });
  await says(panel, /Restitution e\s+(?:\?\s+)?0\.\d+.*95 %.*readings: 6, far off: 1/s);
  const filled = (texts) => texts.filter((text) => text !== "–").length;
  assert.equal(filled(await column(page, "Restitution e", "readings")), 3, "speeds of readings that count");
  assert.equal(filled(await column(page, "Restitution e", "far off")), 1);
  assert.equal(filled(await column(page, "Restitution e", "excluded")), 1);
  await panel.getByRole("figure", { name: "Contact time T_c" }).getByRole("heading", { name: "[ms] over approach speed [m/s]" }).waitFor();
});

test("Heights are typed in mm and times in ms; with lengths in m what was typed is converted", async ({ page, url, refused }) => {
  refused(422); // who types slowly is asked for the rest
  await page.goto(url("#/materials/sponge/measure"));
  const grid = page.getByRole("table", { name: "Drops" });
  await says(grid, /Drop height\s+\[mm\].*Rebound height\s+\[mm\].*Contact time\s+\[ms\]/s);
  await page.getByLabel("Drop height, drop 1").fill("150");
  await page.getByLabel("Rebound height, drop 1").fill("54");
  await page.getByLabel("Contact time, drop 1").fill("25");
  const result = page.getByRole("region", { name: "Result" });
  await says(result, /0\.6\s+[^]*25 ms/);
  await page.getByRole("button", { name: "Units" }).click();
  await page.getByRole("group", { name: "Lengths" }).getByRole("button", { name: "m", exact: true }).click();
  await says(grid, /Drop height\s+\[m\]/);
  assert.equal(await page.getByLabel("Drop height, drop 1").inputValue(), "0.15");
  await page.keyboard.press("Escape");
  await page.getByLabel("Rebound height, drop 2").fill("0.054");
  await says(result, /0\.6\s+[^]*readings: 2/);
});

test("All materials are points of e over contact time; a click opens one", async ({ page, url }) => {
  await page.goto(url("#/materials"));
  const chart = page.getByRole("figure", { name: "Restitution e over contact time" });
  await says(page.getByRole("region", { name: "Materials" }), /Aluminium\s+metal\s+0\.46\d*\s[^]*?\s0\.3\s[^]*Sponge\s+foam\s+0\.61\d*\s[^]*?\s25\.0\s/); // one unit for a column, decimals aligned
  const place = await chart.locator("text", { hasText: /^Aluminium$/ }).boundingBox();
  await page.mouse.click(place.x - 8, place.y + place.height / 2);
  await leads(page, /#\/materials\/aluminium$/);
});
