// Materials as a lab member uses them: found, measured by a drop test, reviewed, reverted, written by two at once.
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
  await type(".1");
  await press("Tab");
  await type(".04");
  await press("Tab", "Tab", "Tab");
  await type(".009");
  await press("Shift+Tab", "Shift+Tab", "Shift+Tab", "Enter");
  for (const height of [".041", ".039", ".042", ".04"]) {
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
  await page.getByLabel("Drop height, drop 1").fill("0.1");
  await page.getByLabel("Rebound height, drop 1").fill("0,5");
  const cell = page.getByLabel("Rebound height, drop 1");
  await until("the fault", async () => (await cell.getAttribute("aria-invalid")) === "true");
  await page.getByRole("button", { name: "Drop 1, rebound height" }).click();
  await until("the focus to be there", () => cell.evaluate((node) => node === document.activeElement));
  await cell.evaluate((node) => {
    const clipboardData = new DataTransfer();
    clipboardData.setData("text", "height\n0.037\n0.038\n0,036\n0.09\n");
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
  await figure.getByText("As a table").click();
  await figure.getByRole("table").waitFor();
  const found = await figure.getByRole("table").evaluate((table, name) => {
    const at = [...table.querySelectorAll("thead th")].findIndex((head) => head.textContent.includes(name));
    return [...table.querySelectorAll("tbody tr")].map((row) => row.children[at]?.textContent);
  }, name);
  await figure.getByText("As a table").click();
  return found;
}

test("A force trace is read from a file; its contacts are drawn with the pulses that fit them", async ({ page, url, folder }) => {
  const rows = pulses(1e-3);
  await page.goto(url("#/materials/soft_rubber/measure"));
  await page.getByRole("button", { name: "Add trace" }).click();
  await choose(page, folder, "trace.csv", `time [s],force [N]\n${csv(rows)}`);
  await says(main(page), /Contacts detected: 2; \S+ N at (100|99\.9) ms, T_c 3[12]\.?\d* ms, e 0\.5/);
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
  await says(main(page), /Contacts detected: 2; 2\.5 N at .*, the trace differs from every pulse .*; \S+ N at 400 ms, T_c/);
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
  await says(page.getByRole("region", { name: "Trail" }), /Approved revision 2: agrees with the sheet .*Wrote revision 2: measured anew/s);
  await page.getByRole("link", { name: "Revision 1", exact: true }).click();
  await says(main(page), /felt@1 of 2/); // the page before has the same differences
  await says(page.getByRole("region", { name: "From revision 1 to revision 2" }), /Restitution\s+0\.3\s+0\.33/);
  refused(412);
  await daemon.ask("POST", "/v1/materials/felt/revisions", { ...felt, restitution: 0.35, comment: "a third sheet" }, { "If-Match": "*" });
  await page.getByRole("button", { name: "Revert to revision 1" }).click();
  await says(main(page), /Another client changed it meanwhile.*a third sheet.*0\.33\s+0\.35/s);
  await page.getByRole("button", { name: "Do mine all the same" }).click();
  await says(main(page), /felt@4 of 4/);
  assert.equal((await daemon.get("/v1/materials/felt@4")).restitution, 0.3);
});

test("Materials are found by filters that stand in the URL", async ({ page, url, newPage }) => {
  await page.goto(url("#/materials"));
  await page.getByLabel("Words").fill("rubber");
  await page.getByLabel("Restitution e").fill("0.5..");
  await page.keyboard.press("Enter");
  await says(page.getByRole("main").getByRole("status"), /^1 found$/);
  const other = await newPage();
  await other.goto(page.url());
  await says(other.getByRole("main").getByRole("status"), /^1 found$/);
  await says(other.getByRole("region", { name: "Materials" }), /Hard rubber/);
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
