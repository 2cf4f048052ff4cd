// Runs the browser tests: Debian's chromium-headless-shell, one for all; a daemon for each file; two files at a time.
// Usage in support.mjs. The last line counts.
import { createHash } from "node:crypto";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { chromium } from "playwright-core";
import { Daemon } from "./daemon.mjs";
import { pace, reading, tests } from "./support.mjs";

const here = path.dirname(fileURLToPath(import.meta.url));
const { values, positionals: words } = parseArgs({
  allowPositionals: true,
  options: {
    build: { type: "string", default: path.join(here, "..", "..", "build") },
    at: { type: "string" }, // a service that runs already, in place of daemons of our own
    serial: { type: "boolean", default: false },
    slow: { type: "string", default: "1" }, // so many times as slow a computer before the reader, answers that wait
    seed: { type: "string", default: "1" }, // of how long each does
  },
});
const build = path.resolve(values.build);
const pictures = path.join(build, "browser");
pace.slow = Number(values.slow);
const TEST_MS = 300000 * pace.slow;
const LATE_MS = 300; // an answer's wait, at most

for (const name of fs.readdirSync(here).filter((one) => /^test_.*\.mjs$/.test(one)).sort()) {
  reading.file = name;
  await import(`./${name}`);
}
const chosen = tests.filter(({ file, sentence }) => words.length === 0 || words.some((word) => file.includes(word) || sentence.includes(word)));
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium-headless-shell", args: ["--no-sandbox"] });

// Slows a page down, and holds each of its requests back for a while of its own that follows from the seed: so answers come late
// and overtake each other.
async function slowDown(page) {
  page.setDefaultTimeout(30000 * pace.slow);
  const session = await page.context().newCDPSession(page); // open as long as the page is
  await session.send("Emulation.setCPUThrottlingRate", { rate: pace.slow });
  const asked = new Map();
  await page.context().route("**/*", async (route) => {
    const what = `${route.request().method()} ${new URL(route.request().url()).pathname}`, nth = (asked.get(what) ?? 0) + 1;
    asked.set(what, nth);
    const part = createHash("sha256").update(`${values.seed} ${what} ${nth}`).digest().readUInt32BE() / 2 ** 32;
    await new Promise((resolve) => setTimeout(resolve, part * LATE_MS));
    await route.continue().catch(() => {}); // the page may be closed
  });
}

// A page in a profile of its own whose every wrong lands in `wrongs`.
async function openPage(room, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, colorScheme: "light", ...options });
  room.contexts.push(context);
  const wrong = (text) => room.wrongs.push(text);
  context.on("request", (request) => {
    if (!/^(data|blob):/.test(request.url()) && !request.url().startsWith(`${room.daemon.url}/`)) wrong(`request to another host: ${request.url()}`);
  });
  context.on("response", (response) => {
    if (response.status() >= 400 && !room.announced.has(response.status()))
      wrong(`${response.request().method()} ${response.url()} was answered ${response.status()}`);
  });
  context.on("weberror", (error) => wrong(`uncaught: ${error.error().stack ?? error.error()}`));
  context.on("console", (message) => {
    if (message.type() !== "error") return;
    // A refused request is told by its status, above.
    if (/^Failed to load resource: the server responded with a status of \d+/.test(message.text())) return;
    if (room.announced.has(0) && /net::ERR_/.test(message.text())) return;
    wrong(`console: ${message.text()} (${message.location().url})`);
  });
  const page = await context.newPage();
  if (pace.slow > 1) await slowDown(page);
  return page;
}

async function run({ file, sentence, body }, daemon) {
  const room = { daemon, contexts: [], wrongs: [], announced: new Set() };
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "impactd-browser-test-"));
  const began = performance.now();
  let page, timer, error = null;
  try {
    page = await openPage(room);
    const late = new Promise((_, reject) => {
      timer = setTimeout(() => reject(new Error(`not done after ${TEST_MS / 1000} s`)), TEST_MS);
    });
    await Promise.race([late, body({
      page, daemon, folder,
      newPage: (options) => openPage(room, options),
      url: (hash = "") => `${daemon.url}/${hash}`,
      refused: (...statuses) => statuses.forEach((status) => room.announced.add(status)),
    })]);
  } catch (problem) {
    error = problem;
  }
  clearTimeout(timer);
  const isGood = error === null && room.wrongs.length === 0;
  const seconds = ((performance.now() - began) / 1000).toFixed(2);
  const lines = [`${isGood ? "ok   " : "FAIL "} ${sentence} [${seconds} s]`];
  if (!isGood) {
    if (error) lines.push(`      ${String(error.stack ?? error).replaceAll("\n", "\n      ")}`);
    for (const one of room.wrongs.slice(0, 10)) lines.push(`      ${one}`);
    fs.mkdirSync(pictures, { recursive: true });
    for (const [at, one] of room.contexts.flatMap((context) => context.pages()).entries()) {
      const target = path.join(pictures, `${path.basename(file, ".mjs")}-${tests.findIndex((two) => two.sentence === sentence)}-${at}.png`);
      const isTaken = await one.screenshot({ path: target, fullPage: true, timeout: 5000 }).then(() => true, () => false);
      lines.push(`      ${one.url()}${isTaken ? `, its picture: ${target}` : ""}`);
    }
  }
  console.log(lines.join("\n"));
  for (const context of room.contexts) await context.close().catch(() => {});
  fs.rmSync(folder, { recursive: true, force: true });
  return isGood;
}

// What takes longest first, so that the last one to end is a short one: all pages, then files by their number of tests.
const weight = (list) => (list[0].file === "test_pages.mjs" ? Infinity : list.length);
const files = [...new Set(chosen.map(({ file }) => file))]
  .map((file) => chosen.filter((one) => one.file === file)).sort((a, b) => weight(b) - weight(a));
let passed = 0, failed = 0;
// A promise that a test left behind must not end the others.
process.on("unhandledRejection", (error) => {
  failed++;
  console.log(`FAIL  left behind: ${error?.stack ?? error}`);
});
async function work() {
  for (let list; (list = files.shift()); ) {
    const daemon = new Daemon(build, values.at);
    try {
      await daemon.start();
      for (const one of list) if (await run(one, daemon)) passed++; else failed++;
    } catch (error) {
      failed++;
      console.log(`FAIL  ${list[0].file}: ${error.stack ?? error}`);
    }
    await daemon.end();
  }
}
await Promise.all(values.serial ? [work()] : [work(), work()]);
await browser.close();
console.log(`tests/browser: ${passed} passed, ${failed} failed`);
process.exit(failed > 0 || passed === 0 ? 1 : 0);
