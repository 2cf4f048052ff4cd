// Tables of results: one unit for a column, decimals aligned, sorted by a click on a heading, filtered by words, copied.
import { html, useMemo, useState } from "./preact.js";
import { settings } from "../settings.js";
import { CopyButton, tabbed, withSubscripts } from "./controls.js";
import { useStore } from "./hooks.js";
import { number, pretty, scale } from "../units.js";

const isNumber = (value) => typeof value === "number" && Number.isFinite(value);

// The size that a column's unit suits: the largest, or a small one where many are far below that: not one that is next to nothing.
function readableSize(sizes, largest) {
  const sorted = sizes.filter((size) => size > 1e-4 * largest).sort((a, b) => a - b);
  const small = sorted[(sorted.length - 1) >> 2];
  return small < largest / 100 ? small : largest;
}

// How a column of numbers is written: its factor and unit, and as many decimals as show `digits` digits of the largest.
export function columnFormat(values, unit, digits = 4) {
  const sizes = values.filter(isNumber).map(Math.abs);
  const largest = sizes.length > 0 ? Math.max(...sizes) : 0;
  const [factor, shown] = scale(readableSize(sizes, largest), unit);
  const size = largest / factor;
  const isWhole = values.every((value) => !isNumber(value) || Number.isInteger(value / factor));
  const isPlain = size === 0 || (size >= 1e-3 && size < 1e6);
  const decimals =
    isWhole || size === 0 ? 0 : Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  let places = Math.min(decimals, 9);
  const isRound = (value) => !isNumber(value) || (value / factor).toFixed(places).endsWith("0");
  while (places > 0 && values.every(isRound)) places--;
  // Values over many decades have digits of their own: none is shown as 0, or far off, for want of decimals.
  const isLost = (size) =>
    Math.abs((size / factor).toFixed(places) - size / factor) > 0.02 * (size / factor);
  const isWide = sizes.some(isLost);
  const write = (value) => {
    if (!isNumber(value)) return number(value, digits);
    return isPlain && !isWide
      ? (value / factor)
          .toFixed(places)
          .replace(/^-(?=[0.]*$)/, "")
          .replace("-", "−")
      : number(value / factor, digits);
  };
  return { factor, unit: shown === "1" ? "" : pretty(shown), write };
}

const isMissing = (value) => value === null || value === undefined;
function compare(a, b) {
  if (isMissing(a) || isMissing(b)) return Number(isMissing(a)) - Number(isMissing(b));
  if (typeof a === "string") return a.localeCompare(b, "en", { numeric: true });
  return a - b;
}

// A table of `rows`; its caption is seen where `isHeaded`. A column is {label, value(row), unit, digits, cell(row), isNumeric}: `value` is what is sorted and
// copied; numbers are written in the column's unit, or as `cell` shows them where it returns something. `filter` shows a field whose words rows must
// contain; `selection` is {chosen: Set of keys, toggle(row)}, with `keyOf(row)`; `chosenKey` marks a row. The table keeps its
// order, {column: index, direction: 1 or -1}, unless `order` and `onOrder` do. `tools` stand above it.
export function Table({
  caption,
  isHeaded,
  columns,
  rows,
  filter,
  selection,
  keyOf,
  chosenKey,
  onRow,
  order: givenOrder,
  onOrder,
  tools,
  empty = "Nothing here yet.",
}) {
  const [ownOrder, setOwnOrder] = useState({ column: -1, direction: 1 });
  const order = givenOrder ?? ownOrder;
  const setOrder = onOrder ?? setOwnOrder;
  const [words, setWords] = useState("");
  const units = useStore(settings);
  const formats = useMemo(
    () =>
      columns.map((column) =>
        column.unit !== undefined || column.isNumeric
          ? columnFormat(rows.map(column.value), column.unit, column.digits)
          : null,
      ),
    [columns, rows, units],
  );
  const textOf = (column, row, at) => {
    const value = column.value(row);
    if (formats[at] && isNumber(value)) return formats[at].write(value);
    return isMissing(value) ? "–" : String(value);
  };
  const wanted = words.toLowerCase().split(/\s+/).filter(Boolean);
  const matches = (row) => {
    const text = columns.map((column) => String(column.value(row) ?? "").toLowerCase()).join("\n");
    return wanted.every((word) => text.includes(word));
  };
  let shown = wanted.length > 0 ? rows.filter(matches) : rows;
  if (order.column >= 0) {
    const { value } = columns[order.column];
    shown = shown.toSorted((a, b) => order.direction * compare(value(a), value(b)));
  }
  const headOf = (column, at) =>
    `${column.label}${formats[at]?.unit ? ` [${formats[at].unit}]` : ""}`;
  // What stands before a value on a phone: a symbol after the word adds nothing there.
  const shortHeadOf = (column, at) => headOf(column, at).replace(/ [A-Za-z]_[a-z]\b/, "");
  const isLong = (column, at) =>
    !formats[at] && rows.some((row) => textOf(column, row, at).length > 18);
  const kinds = columns.map((column, at) => {
    if (formats[at]) return "number";
    return isLong(column, at) ? "long" : null;
  });
  const lines = () =>
    tabbed([
      columns.map((column) => `${column.label}${column.unit ? ` [${column.unit}]` : ""}`),
      ...shown.map((row) => columns.map((column) => column.value(row) ?? "")),
    ]);
  const sort = (at) =>
    setOrder({ column: at, direction: order.column === at ? -order.direction : 1 });
  const ariaSort = (at) => {
    if (order.column !== at) return "none";
    return order.direction > 0 ? "ascending" : "descending";
  };
  return html`${isHeaded && html`<h3>${caption}</h3>`}
    <div class="table">
      <div class="table-tools">
        ${tools}
        ${filter && html`<input type="search" placeholder=${filter} aria-label=${filter} value=${words} onInput=${(event) => setWords(event.currentTarget.value)} />`}
        ${rows.length > 0 && html`<${CopyButton} text=${lines} label="Copy" />`}
      </div>
      <div class="scroll" tabindex="0" role="region" aria-label=${caption}>
        <table>
          <caption class="visually-hidden">
            ${caption}
          </caption>
          <thead>
            <tr>
              ${selection && html`<th scope="col"><span class="visually-hidden">Choose</span></th>`}
              ${columns.map(
                (column, at) =>
                  html`<th scope="col" class=${kinds[at]} aria-sort=${ariaSort(at)}>
                    <button type="button" class="sort" onClick=${() => sort(at)}>
                      ${withSubscripts(headOf(column, at))}
                    </button>
                  </th>`,
              )}
            </tr>
          </thead>
          <tbody>
            ${shown.map(
              (row) =>
                html`<tr
                  key=${keyOf?.(row)}
                  class=${keyOf && chosenKey !== undefined && keyOf(row) === chosenKey ? "chosen" : null}
                  onClick=${onRow && (() => onRow(row))}
                >
                  ${
                    selection &&
                    html`<td>
                      <input
                        type="checkbox"
                        aria-label=${`Choose ${columns[0].value(row)}`}
                        checked=${selection.chosen.has(keyOf(row))}
                        onChange=${() => selection.toggle(row)}
                      />
                    </td>`
                  }
                  ${columns.map((column, at) => {
                    const content = column.cell?.(row) ?? textOf(column, row, at);
                    return at === 0
                      ? html`<th
                          scope="row"
                          class=${kinds[at]}
                          data-label=${shortHeadOf(column, at)}
                        >
                          ${content}
                        </th>`
                      : html`<td class=${kinds[at]} data-label=${shortHeadOf(column, at)}>
                          ${content}
                        </td>`;
                  })}
                </tr>`,
            )}
          </tbody>
        </table>
        ${shown.length === 0 && html`<p class="quiet empty">${rows.length > 0 ? "No row contains these words." : empty}</p>`}
      </div>
    </div>`;
}
