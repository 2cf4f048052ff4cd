// What the browser tests share. Not a test framework: a test is a call of test() with the sentence it proves.
//
//   import assert from "node:assert/strict";
//   import { says, test } from "./support.mjs";
//
//   test("A click on Run leads to the result", async ({ page, daemon, url }) => {
//     await page.goto(url("#/scene"));
//     await page.getByRole("button", { name: "Run" }).click();
//     await says(page.getByRole("heading", { level: 1 }), /sponge/);
//   });
//
//   (cd tests/browser && npm ci)       once
//   node tests/browser/run.mjs [--build DIR | --at URL] [--serial] [--slow N [--seed N]] [WORD...]
//       only tests whose file or sentence holds a WORD; at a service that runs already in place of daemons of their own;
//       with pages N times slower, each of whose requests waits up to 300 ms, by the seed: what passes only when quick fails
//
// A test does what a person does: it finds things by role, label and text, never by class; it waits for what it wants to
// see (playwright's clicks wait by themselves; until(), says() below), never for a time. Each file has a daemon of its own,
// whose data its tests share in their order; files run two at a time. A test gets
//   page               a page in a fresh profile, 1280 x 900, light
//   newPage(options)   one more, in a profile of its own: options as of playwright's newContext ({viewport, colorScheme …})
//   url(hash)          the dashboard's address there, url("#/jobs")
//   daemon             {url, get(path), ask(method, path, json), run(scene or an example's name, changes) -> the finished
//                      job, example(name), start(), stop()}
//   refused(status…)   says that answers of this status belong to this test (0: no answer at all)
//   folder             a folder for files of this test, gone afterwards
// and fails, whatever else it proves, on any console error (policy violations are such), uncaught exception, request to
// another host, and on answers of 4xx and 5xx that were not announced by refused(). After a failure the page's picture is
// in BUILD/browser/.
import assert from "node:assert/strict";
import fs from "node:fs";
import { createRequire } from "node:module";

export const tests = []; // {file, sentence, body}; run.mjs sets `reading.file` while it imports a file
export const reading = { file: null };

export function test(sentence, body) {
  tests.push({ file: reading.file, sentence, body });
}

export const pace = { slow: 1 }; // how many times slower pages are than they would be: run.mjs sets it
const WAIT_MS = 20000;

// Asks again and again until `probe` answers something true and does not throw; returns that.
export async function until(what, probe, wait = WAIT_MS) {
  const end = Date.now() + wait * pace.slow;
  for (;;) {
    let seen, error;
    try {
      seen = await probe();
      if (seen) return seen;
    } catch (problem) {
      error = problem;
    }
    if (Date.now() > end) throw new Error(`waited ${(wait * pace.slow) / 1000} s for ${what}; ${error ? error.message : `at last: ${JSON.stringify(seen)}`}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

// Waits until the text of what `locator` finds matches; returns that text.
export async function says(locator, pattern, wait = WAIT_MS) {
  let text = "";
  await until(`${locator} to say ${pattern}`, async () => {
    text = (await locator.first().innerText()).replaceAll("\u00a0", " "); // between a number and its unit
    if (!pattern.test(text)) throw new Error(`it says ${JSON.stringify(text.slice(0, 400))}`);
    return true;
  }, wait);
  return text;
}

// Waits until the page's address matches; returns the match.
export const leads = (page, pattern) => until(`an address like ${pattern}`, () => {
  const found = pattern.exec(page.url());
  if (!found) throw new Error(`it is ${page.url()}`);
  return found;
});

// Keeps the page waiting for the answers of the first `most` requests whose address matches: asked(count) waits until so many are
// asked for; letGo() lets them come, and what the page does about them.
export async function hold(page, pattern, most = Infinity) {
  const held = [];
  let isHeld = true;
  await page.route(pattern, (route) => (isHeld && held.length < most ? void held.push(route) : route.fallback()));
  return {
    asked: (count = 1) => until(`${count} of ${pattern} to be asked for`, () => held.length >= count),
    async letGo() {
      isHeld = false;
      for (const route of held) {
        await route.fallback().catch(() => {}); // the page may not wait for it any more
        await (await route.request().response())?.finished();
      }
      await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
    },
  };
}

// Bytes that the network brought while `action` ran and until the page fell quiet: bodies as sent, with their heads.
export async function transferred(page, action) {
  const session = await page.context().newCDPSession(page);
  await session.send("Network.enable");
  const open = new Set();
  const done = [];
  const names = new Map();
  session.on("Network.requestWillBeSent", (event) => open.add(event.requestId) && names.set(event.requestId, event.request.url));
  session.on("Network.loadingFinished", (event) => {
    open.delete(event.requestId);
    done.push({ url: names.get(event.requestId), bytes: event.encodedDataLength });
  });
  session.on("Network.loadingFailed", (event) => open.delete(event.requestId));
  await action();
  let quiet = 0;
  await until("the network to fall quiet", async () => (quiet = open.size === 0 ? quiet + 1 : 0) >= 6);
  await session.detach();
  return { bytes: done.reduce((sum, one) => sum + one.bytes, 0), requests: done };
}

// What axe-core finds on the page as it stands, from a world of its own so that the page's policy is left as it is: serious
// and critical findings, a line each; of the rules named alone, if any are.
const source = fs.readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
export async function axe(page, rules = null) {
  const session = await page.context().newCDPSession(page);
  const { frameTree } = await session.send("Page.getFrameTree");
  const { executionContextId: contextId } = await session.send("Page.createIsolatedWorld", { frameId: frameTree.frame.id });
  const ask = async (expression) => {
    const { result, exceptionDetails } = await session.send("Runtime.evaluate", { expression, contextId, awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  };
  await ask(`${source}; 0`);
  const violations = await ask(`axe.run(${JSON.stringify(rules ? { runOnly: rules } : {})})` + ".then((found) => found.violations.map(({id, impact, help, nodes}) => " +
    "({id, impact, help, nodes: nodes.slice(0, 3).map((node) => node.target.join(' ') + ': ' + node.failureSummary.split('\\n')[1])})))");
  await session.detach();
  return violations.filter((one) => ["serious", "critical"].includes(one.impact))
    .map((one) => `${one.impact} ${one.id}: ${one.help}\n      ${one.nodes.join("\n      ")}`);
}

// How far the page is wider than its window, 0 if it is not.
export const overflow = (page) => page.evaluate(() => Math.max(0, document.documentElement.scrollWidth - document.documentElement.clientWidth));

// Goes on by Tab until what `locator` finds has the focus, which must be seen there.
export async function tabTo(page, locator, most = 150) {
  await locator.first().waitFor();
  for (let presses = 0; presses < most; presses++) {
    const isSeen = await locator.first().evaluate((node) => (node !== document.activeElement ? null
      : node.matches(":focus-visible") && getComputedStyle(node).outlineStyle !== "none"));
    assert.notEqual(isSeen, false, `the focus on ${locator} is not seen`);
    if (isSeen) return;
    await page.keyboard.press("Tab");
  }
  throw new Error(`${most} presses of Tab do not lead to ${locator}`);
}
