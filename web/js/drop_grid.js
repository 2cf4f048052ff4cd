// The grid that drops are typed or pasted into, a row each: a widget of a measurement's form. An empty height or approach speed
// is as above it; a row without a reading is not sent.
import { fresh, h, hint } from "./dom.js";
import { number, title } from "./units.js";

const MOST = 1000, GIVEN = [0, 2], READ = [1, 3, 4]; // drops, and columns

// What is no number is refused as it stands.
function read({ value, placeholder }, type) {
  const text = value || placeholder, number = Number(text.replace(",", "."));
  return text === "" ? undefined : type === "string" || Number.isNaN(number) ? text : number;
}

export function dropGrid({ pointer, schema, draft }) {
  const columns = Object.entries(schema.items.properties).slice(0, 6), lines = [], body = h("tbody");
  let sent = []; // lines with a reading

  function add() {
    const at = lines.length, outcome = h("output", { id: fresh("drop") });
    const cells = columns.map(([name], k) => h("input", {
      "aria-label": `${title(name)}, drop ${at + 1}`, "aria-describedby": outcome.id,
      oninput: () => put(at, k, [[cells[k].value]]),
      onpaste(event) {
        const rows = event.clipboardData.getData("text").trimEnd().split(/\s*\n/).map((line) => line.split(/ *[\t;] */));
        if (rows.flat().length === 1) return;
        event.preventDefault();
        put(at, k, /\d/.test(rows[0]) ? rows : rows.slice(1)); // without a heading
        lines.at(-1).cells[k].focus();
      },
      onkeydown(event) {
        const step = { Enter: 1, ArrowDown: 1, ArrowUp: -1 }[event.key];
        if (!step || event.ctrlKey) return;
        event.preventDefault();
        lines[at + step]?.cells[k].focus();
      },
    }));
    lines.push({ cells, outcome });
    body.append(h("tr", null, h("th", { scope: "row" }, at + 1), [...cells, outcome].map((cell) => h("td", null, cell))));
  }
  // Rows of texts, from a cell on to the right and down.
  function put(at, k, rows) {
    rows.slice(0, MOST - at).forEach((row, down) => {
      if (!lines[at + down]) add();
      row.slice(0, columns.length - k).forEach((text, right) => (lines[at + down].cells[k + right].value = text));
    });
    if (lines.length < MOST && lines.at(-1).cells.some((cell) => cell.value)) add();
    for (const given of GIVEN) lines.reduce((above, { cells }) => cells[given].value || (cells[given].placeholder = above), "");
    sent = lines.filter(({ cells }) => READ.some((column) => cells[column].value));
    draft.set(pointer, sent.map(({ cells }) =>
      Object.fromEntries(columns.map(([name, { type }], column) => [name, read(cells[column], type)]))));
  }
  add();
  const heads = ["#", ...columns.map(([name, { "x-unit": unit }]) => title(name) + (unit ? `, ${unit}` : "")), "e"];
  const element = h("div", null, h("div.scroll", null, h("table.drops", { "aria-label": "Drops" },
    h("thead", null, h("tr", null, heads.map((head) => h("th", { scope: "col" }, head)))), body)),
  hint("Enter goes down, Tab right; columns can be pasted."));
  return { element, refresh() {
    for (const line of lines) {
      const { cells, outcome } = line, at = sent.indexOf(line), faults = draft.faultsAt(`${pointer}/${at}`);
      const row = draft.check?.evaluation?.rows.find(({ from }) => from === `drop ${at + 1}`);
      outcome.className = outcome.value = faults.length > 0 ? "fault" : "";
      if (row) outcome.value = number(row.restitution, 3);
      cells.forEach((cell, k) => {
        cell.parentElement.dataset.pointer = `${pointer}/${at}/${columns[k][0]}`;
        cell.setAttribute("aria-invalid", draft.faultsAt(cell.parentElement.dataset.pointer).length > 0);
      });
    }
  } };
}
