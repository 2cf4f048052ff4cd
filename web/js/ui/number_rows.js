// Columns of numbers in text files: headings first, then rows; commas, semicolons, tabs or blanks between cells. Beside a
// semicolon, a tab or a blank a comma within a cell is a decimal one.

const isDecimalComma = (line) =>
  /[;\t]/.test(line) || (/\d,\d/.test(line) && /\s/.test(line) && !/,\s|\d,\d+,/.test(line));

// Separators at the end of a line begin no cell.
const trimmed = (line) => line.replace(/[\s,;]+$/, "").trimStart();

function cellsOf(line) {
  const text = trimmed(line);
  if (!isDecimalComma(text)) return text.split(/\s*,\s*|\s+/);
  return text
    .split(/\s*[;\t]\s*|\s+/)
    .map((cell) => cell.replace(",", "."))
    .filter((cell) => cell !== "");
}

const headsOf = (line) =>
  trimmed(line)
    .split(/\s*[;\t]\s*|\s*,\s*/)
    .map((cell) => cell.replace(/^["']|["']$/g, ""));

const numberOf = (cell) => (/^[+-]?(\d|\.\d)/.test(cell) ? Number(cell) : NaN);

// {heads, rows: [{line, cells, numbers}]} from the first line of numbers alone to the last line that is not empty; `line`
// counts from 1. `isRow(numbers)` says which line begins the rows.
export function numberRows(text, isRow = (numbers) => numbers.every(Number.isFinite)) {
  const lines = text.replace(/^\uFEFF/, "").split(/\r\n?|\n/);
  const all = lines.map((line, at) => {
    const cells = cellsOf(line);
    return { line: at + 1, cells, numbers: cells.map(numberOf) };
  });
  const first = all.findIndex(({ numbers }) => isRow(numbers));
  if (first < 0) return { heads: [], rows: [] };
  const last = all.findLastIndex(({ cells }) => cells.join("") !== "");
  return {
    heads: first > 0 ? headsOf(lines[first - 1]) : [],
    rows: all.slice(first, last + 1),
  };
}
