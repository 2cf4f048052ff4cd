// What the guide's pages do beyond HTML: the theme, copying code, the heading in sight, and the search.
import { get } from "../web/js/api.js";
import { connectTheme } from "../web/js/theme.js";
import { CopyButton, Notice } from "../web/js/ui/controls.js";
import { html, render } from "../web/js/ui/preact.js";

const MAX_RESULTS = 12; // results
const EXCERPT = 130; // characters before and after a word
const at = (id) => document.getElementById(id);
connectTheme(at("guide-theme"));

// Code: of a console only what is typed, without its prompts.
function typed(code) {
  if (!code.classList.contains("language-console")) return code.textContent;
  const lines = code.textContent.split("\n").filter((line) => line.startsWith("$ "));
  return lines.map((line) => line.slice(2)).join("\n");
}
for (const block of document.querySelectorAll("main pre")) {
  const box = document.createElement("div");
  const code = block.querySelector("code");
  box.className = "code-box";
  block.replaceWith(box);
  const slot = document.createElement("span");
  render(html`<${CopyButton} text=${() => typed(code)} />`, slot);
  box.append(block, slot);
}

// The heading that is read is marked in the list of headings.
const entries = new Map(
  [...document.querySelectorAll("#guide-contents a")].map((link) => [
    decodeURIComponent(link.hash.slice(1)),
    link,
  ]),
);
const headings = [...entries.keys()].map(at).filter(Boolean);
function mark() {
  const read = headings.findLast((heading) => heading.getBoundingClientRect().top < 120);
  for (const [id, link] of entries) link.ariaCurrent = id === read?.id ? "true" : null;
}
addEventListener("scroll", () => requestAnimationFrame(mark), { passive: true });
mark();
for (const list of [at("guide-pages"), at("guide-contents")])
  list.addEventListener(
    "click",
    (event) => event.target.closest("a") && list.matches(":popover-open") && list.hidePopover(),
  );

// The page that is read is in sight in the list of pages, too.
const list = at("guide-pages");
const here = list.querySelector("[aria-current]");
if (here && here.offsetTop > list.clientHeight - 60)
  list.scrollTop = here.offsetTop - list.clientHeight / 2;

// At a wrong address the service sends the first page.
if (here.pathname !== location.pathname && !/\/index.html$/.test(location.pathname)) {
  const box = document.createElement("div");
  at("guide-main").prepend(box);
  const sentence =
    "The link is wrong or old. This is the first page; the search and the list of pages lead on.";
  render(
    html`<${Notice} kind="warn" title="The guide has no page at this address"
      ><p>${sentence}</p><//
    >`,
    box,
  );
}

// The search. The index is read when the field gets the focus: [[page, title, [[anchor, heading, text] ...]] ...].
const words = at("guide-words");
const found = at("guide-found");
let index = null;
let chosen = -1;
at("guide-search").hidden = false;

const plain = (text) => text.toLowerCase();
// What people ask for, and the word of the guide.
const SYNONYMS = [
  [/\blicens(e|ing)\b/g, "licence"],
  [/\b(log-?in|passwords?|api[ -]?keys?)\b/g, "token"],
  [/\breverse proxy\b/g, "proxy"],
  [/\bsse\b/g, "events"],
  [/\bcitations?\b/g, "cite"],
  [/\bhow long\b.*/g, "cost"],
  [/\b(directions?|orientation)\b/g, "sign"],
  [/\bfloors?\b/g, "storey"],
  [/\bnew (contact )?(model|law)\b/g, "add law"],
];
const FILLERS = new Set(
  "a an and are be can do does for from how i in is it my of on or the there to what when where which why with".split(
    " ",
  ),
);
// "authentication" finds "authenticate": long words are looked for without their ending.
const stem = (word) => word.replace(/^(.{4,}?)(ations?|ions?|ing|ed|es|s|e)$/, "$1");
// The words that count, without their endings; all of them where no other is there.
const asked = () => {
  const text = SYNONYMS.reduce((now, [from, to]) => now.replace(from, to), plain(words.value));
  const all = text
    .split(/\s+/)
    .map((word) => word.replace(/^[^\p{L}\p{N}_/-]+|[^\p{L}\p{N}_/]+$/gu, ""))
    .filter(Boolean);
  const counted = all.filter((word) => !FILLERS.has(word));
  return (counted.length > 0 ? counted : all).map(stem);
};
const hrefOf = (page, anchor) =>
  `${page === "index" ? "./" : `${page}.html`}${anchor && `#${anchor}`}`;
function sectionsOf([page, title, sections]) {
  return sections.map(([anchor, heading, text]) => ({
    weight: page === "api" ? 0.7 : 1,
    href: hrefOf(page, anchor),
    title,
    heading,
    text,
    anchor,
    low: { title: plain(title), heading: plain(heading), text: plain(text) },
  }));
}
async function read() {
  index ??= get("search.json").then((pages) => pages.flatMap(sectionsOf));
  index.catch(() => {
    index = null;
  });
  return index;
}

const escape = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
// Words are looked for at their beginning: "sign" does not find "design".
const begins = (...wanted) =>
  new RegExp(`(?<![\\p{L}\\p{N}])(${wanted.map(escape).join("|")})`, "iu");

// How well a section fits the words, 0 where more than half of them are missing: a heading counts more than a title, and that more
// than the text; the reference of the API counts less than other pages.
function score({ low, anchor, weight }, wanted) {
  let sum = 0;
  let missing = 0;
  for (const word of wanted) {
    const start = begins(word);
    let points = start.test(low.heading) ? 40 : 0;
    if (low.heading === word) points = 60;
    if (anchor && start.test(low.title)) points += 8;
    if (start.test(low.text)) points += 4;
    if (points === 0) missing++;
    sum += points;
  }
  if (2 * missing > wanted.length || sum === 0) return 0;
  const all = wanted.join(" ");
  if (low.heading.includes(all)) sum += 30;
  else if (low.text.includes(all)) sum += 6;
  if (!anchor) sum += 5;
  return weight * 0.2 ** missing * sum;
}

const marked = (text, wanted) =>
  text.split(begins(...wanted)).map((part, i) => (i % 2 ? html`<mark>${part}</mark>` : part));
function excerpt({ text, low }, wanted) {
  const place = Math.min(
    ...wanted.map((word) => low.text.search(begins(word))).filter((one) => one >= 0),
    text.length,
  );
  const from = Math.max(0, place === text.length ? 0 : place - EXCERPT / 2),
    part = text.slice(from, from + EXCERPT);
  return `${from > 0 ? "…" : ""}${part.trim()}${from + EXCERPT < text.length ? "…" : ""}`;
}

function choose(next) {
  const options = found.querySelectorAll("[role=option]");
  chosen = options.length ? (next + options.length) % options.length : -1;
  options.forEach((option, i) => {
    option.ariaSelected = String(i === chosen);
  });
  if (chosen >= 0) options[chosen].scrollIntoView({ block: "nearest" });
  words.setAttribute("aria-activedescendant", chosen >= 0 ? options[chosen].id : "");
}

function close() {
  found.hidden = true;
  words.ariaExpanded = "false";
  words.removeAttribute("aria-activedescendant");
}

const resultOf = (wanted) =>
  function Result({ section }, i) {
    return html`<a
      role="option"
      id=${`guide-found-${i}`}
      href=${section.href}
      tabindex="-1"
      onClick=${close}
    >
      <b
        >${section.anchor && html`<span class="quiet">${`${section.title} › `}</span>`}${marked(section.heading, wanted)}</b
      >
      ${marked(excerpt(section, wanted), wanted)}
    </a>`;
  };
const nothing = (sections) =>
  sections
    ? `Nothing has ${words.value.trim()}.`
    : "The index cannot be read; is the server running?";

async function search() {
  const wanted = asked();
  if (wanted.length === 0) return close();
  const sections = await read().catch(() => null);
  if (asked().join(" ") !== wanted.join(" ")) return; // typed meanwhile
  const best = (sections ?? [])
    .map((section) => ({ section, points: score(section, wanted) }))
    .filter(({ points }) => points > 0)
    .sort((a, b) => b.points - a.points)
    .slice(0, MAX_RESULTS);
  render(
    html`${best.map(resultOf(wanted))}${best.length === 0 && html`<p>${nothing(sections)}</p>`}`,
    found,
  );
  found.hidden = false;
  words.ariaExpanded = "true";
  choose(0);
}

words.addEventListener("input", search);
words.addEventListener("focus", () => read().then(search, () => {}));
words.addEventListener("keydown", (event) => {
  if (event.key === "ArrowDown" || event.key === "ArrowUp")
    choose(chosen + (event.key === "ArrowDown" ? 1 : -1));
  else if (event.key === "Enter") found.querySelector("[aria-selected=true]")?.click();
  else if (event.key === "Escape") close();
  else return;
  event.preventDefault();
});
addEventListener("keydown", (event) => {
  if (
    event.key !== "/" ||
    event.ctrlKey ||
    event.metaKey ||
    event.altKey ||
    event.target.matches("input, textarea, select")
  )
    return;
  event.preventDefault();
  words.focus();
  words.select();
});
addEventListener("click", (event) => !at("guide-search").contains(event.target) && close());
