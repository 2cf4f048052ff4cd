// The grid in which drops are typed or pasted, a row each: heights in mm, times in ms. An empty height or approach speed is as
// above it; a row without a reading is not sent.
import { settings } from "../settings.js";
import { useId, useStore } from "../ui/hooks.js";
import { html, useLayoutEffect, useRef, useState } from "../ui/preact.js";
import { number, pretty, title } from "../units.js";

const MAX_ROWS = 1000;
const COUNT = 6; // columns
const GIVEN = [0, 2]; // columns of the drop, repeated from above
const READ = [1, 3, 4]; // columns of readings
const FACTORS = { m: 1, cm: 0.01, mm: 0.001, s: 1, ms: 0.001, µs: 1e-6, us: 1e-6 };

// {name, label, type, unit, per}: so many `per` of its unit are one of the service's.
function columnsOf(schema, lengthUnit) {
  const units = { m: lengthUnit === "m" ? ["m", 1] : ["mm", 1000], s: ["ms", 1000] };
  return Object.entries(schema.items.properties)
    .slice(0, COUNT)
    .map(([name, { type, "x-unit": si }]) => {
      const [unit, per] = units[si] ?? [si, 1];
      return { name, type, unit, per, label: title(name) };
    });
}

const toNumber = (text) => Number(text.trim().replace(",", "."));
const isNumeric = (text) => text.trim() !== "" && !Number.isNaN(toNumber(text));
const rescaled = (text, factor) =>
  isNumeric(text) && factor !== 1
    ? String(Number((toNumber(text) * factor).toPrecision(12)))
    : text;

// What is no number is sent as it stands: the service refuses it.
function valueOf(text, { type, per }) {
  if (text === "") return undefined;
  return type === "string" || !isNumeric(text) ? text : toNumber(text) / per;
}

// The rows with empty cells of given columns filled from above.
function filled(rows) {
  const above = [];
  return rows.map((cells) =>
    cells.map((text, column) => {
      if (!GIVEN.includes(column)) return text;
      above[column] = text || above[column] || "";
      return above[column];
    }),
  );
}

const hasReading = (cells) => READ.some((column) => cells[column] !== "");
const emptyRow = () => Array(COUNT).fill("");

// Pasted rows of texts; a heading may state units ("height [m]", "time, s"), which are converted.
function pastedRows(text, columns, first) {
  const rows = text
    .trimEnd()
    .split(/\s*\n/)
    .map((line) => line.split(/ *[\t;] */));
  if (rows[0].some((cell) => isNumeric(cell))) return rows;
  const factors = rows[0].map((head, at) => {
    const unit = /(?:^|[\s,[(])(mm|cm|m|ms|s|µs|us)[\])]?\s*$/.exec(head)?.[1];
    const { unit: own } = columns[first + at] ?? {};
    return unit && FACTORS[own] ? FACTORS[unit] / FACTORS[own] : 1;
  });
  return rows.slice(1).map((cells) => cells.map((cell, at) => rescaled(cell, factors[at] ?? 1)));
}

export function DropGrid({ pointer, schema, draft }) {
  const { length } = useStore(settings);
  const columns = columnsOf(schema, length);
  const [rows, setRows] = useState([emptyRow()]);
  const id = useId("drop");
  const body = useRef(null);

  // Texts follow the unit of their column.
  const last = useRef(columns);
  useLayoutEffect(() => {
    const factors = columns.map(({ per }, at) => per / last.current[at].per);
    last.current = columns;
    if (factors.some((factor) => factor !== 1))
      setRows((now) => now.map((cells) => cells.map((text, at) => rescaled(text, factors[at]))));
  }, [length]);

  const sent = rows.map((cells, at) => (hasReading(cells) ? at : -1)).filter((at) => at >= 0);
  const focus = (row, column) => body.current.rows[row]?.cells[column + 1].firstChild.focus();

  // Writes texts from a cell on to the right and down.
  function put(row, column, texts) {
    const next = rows.map((cells) => [...cells]);
    texts.slice(0, MAX_ROWS - row).forEach((line, down) => {
      next[row + down] ??= emptyRow();
      line.slice(0, COUNT - column).forEach((text, right) => {
        next[row + down][column + right] = text;
      });
    });
    if (next.length < MAX_ROWS && next.at(-1).some(Boolean)) next.push(emptyRow());
    setRows(next);
    const drops = filled(next)
      .filter((_, at) => hasReading(next[at]))
      .map((cells) =>
        Object.fromEntries(columns.map((one, at) => [one.name, valueOf(cells[at], one)])),
      );
    draft.set(pointer, drops);
  }

  function paste(event, row, column) {
    const texts = pastedRows(event.clipboardData.getData("text"), columns, column);
    if (texts.flat().length <= 1) return;
    event.preventDefault();
    put(row, column, texts);
    requestAnimationFrame(() => focus(Math.min(row + texts.length, MAX_ROWS) - 1, column));
  }

  function move(event, row, column) {
    const step = { Enter: 1, ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step || event.ctrlKey) return;
    event.preventDefault();
    focus(row + step, column);
  }

  const shown = filled(rows);
  const evaluated = draft.check?.evaluation?.rows ?? [];
  const drawRow = (cells, row) => {
    const at = sent.indexOf(row);
    const result = evaluated.find(({ from }) => from === `drop ${at + 1}`);
    return html`<tr key=${row}>
      <th scope="row">${row + 1}</th>
      ${columns.map(({ name, label, unit }, column) => {
        const place = `${pointer}/${at}/${name}`;
        return html`<td
          data-pointer=${place}
          data-label=${unit ? `${label} [${pretty(unit)}]` : label}
        >
          <input
            aria-label=${`${label}, drop ${row + 1}`}
            aria-describedby=${`${id}-${row}`}
            aria-invalid=${at >= 0 && draft.faultsAt(place).length > 0}
            class=${columns[column].type === "string" ? "long" : null}
            value=${cells[column]}
            placeholder=${shown[row][column]}
            onInput=${(event) => put(row, column, [[event.currentTarget.value]])}
            onPaste=${(event) => paste(event, row, column)}
            onKeyDown=${(event) => move(event, row, column)}
          />
        </td>`;
      })}
      <td class="number" data-label="e">
        <output id=${`${id}-${row}`}>${result && number(result.restitution, 3)}</output>
      </td>
    </tr>`;
  };
  return html`<div class="table">
      <div class="scroll">
        <table class="drops" aria-label="Drops">
          <thead>
            <tr>
              <th scope="col">#</th>
              ${columns.map(
                ({ label, unit }) =>
                  html`<th scope="col">
                    ${label}${unit && html` <span class="unit">[${pretty(unit)}]</span>`}
                  </th>`,
              )}
              <th scope="col" class="number">e</th>
            </tr>
          </thead>
          <tbody ref=${body}>
            ${rows.map(drawRow)}
          </tbody>
        </table>
      </div>
    </div>
    <p class="hint">
      Enter goes down, Tab right; columns can be pasted, also with a heading that states the unit.
    </p>`;
}
