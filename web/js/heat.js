// A map of numbers over two axes: a table of coloured cells that arrow keys move in.
import { h } from "./dom.js";
import { extent } from "./study_bits.js";

// Even steps of lightness from dark blue to light yellow, alike on light and dark and to the colour-blind.
const shade = (part) => `oklch(${0.3 + 0.6 * part} 0.13 ${285 - 180 * part})`;

// x and y are the texts of the columns and of the rows, which go up; cell(column, row) is {value, text, pick, isChosen}.
export function heat({ title, x, y, ends, isLog, cell }) {
  const points = y.flatMap((_, row) => x.map((_, column) => cell(column, row))), level = isLog ? Math.log : Number;
  const [low, high] = extent(points.map(({ value }) => value)).map(level);
  const part = (value) => (high > low ? (level(value) - low) / (high - low) : 0.5);
  const first = Math.max(0, points.findIndex(({ isChosen }) => isChosen));
  const cells = points.map(({ value, text, pick, isChosen }, at) => h("td", { tabindex: at === first ? 0 : -1, "aria-label": text,
    "aria-selected": isChosen && "true", onclick: pick, style: value !== null && { background: shade(part(value)) } }));
  const told = h("p.hint", { "aria-live": "polite" }, "Arrow keys go to other cells.");
  const look = ({ target }) => cells.includes(target) && (told.textContent = target.ariaLabel);
  function key(event) {
    const step = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: x.length, ArrowDown: -x.length }[event.key];
    const next = cells[cells.indexOf(event.target) + step];
    if (event.key === "Enter") event.target.click();
    if (!next) return;
    event.preventDefault();
    [event.target.tabIndex, next.tabIndex] = [-1, 0];
    next.focus();
  }
  // Cells are as tall as the picture lets them be, and labels as many as have room.
  const tall = Math.min(26, 420 / y.length), label = (every) => (text, at) => h("th", null, at % every === 0 && text);
  const rows = y.map(label(Math.ceil(18 / tall))).map((head, at) =>
    h("tr", { style: { height: `${tall}px` } }, head, cells.slice(at * x.length, (at + 1) * x.length)));
  const scale = h("span.shades", { style: { background: `linear-gradient(to right, ${[0, 0.5, 1].map(shade)})` } });
  return h("div", null, h("table.heat", { role: "grid", onkeydown: key, onfocusin: look, onmouseover: look },
    h("caption", null, title), h("tbody", null, rows.reverse()),
    h("tfoot", null, h("tr", null, h("td"), x.map(label(Math.ceil(x.length / 4)))))),
  h("p", null, ends[0], " ", scale, " ", ends[1], isLog && ", in equal ratios"), told);
}
