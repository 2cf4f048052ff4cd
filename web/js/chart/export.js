// What can be taken from a chart: its picture (PNG, SVG) and its numbers.
import { html } from "../ui/preact.js";
import { fileName, pngBlob, saveBlob, standaloneSvg, svgBlob, themeColor } from "../ui/files.js";
import { CopyButton, IconButton, tabbed } from "../ui/controls.js";
import { axisUnit } from "./axis.js";
import { number, pretty } from "../units.js";
import { ink } from "./series.js";

const HEAD = 34; // pixels above the plot: heading and legend
const SVG = "http://www.w3.org/2000/svg";
const MAX_ROWS = 1000;

function element(name, attributes, text) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  return node;
}

const colorOf = (name) => themeColor(ink(name));

// The chart as a picture that stands alone: heading, legend and background are part of it.
function picture(svg, heading, series) {
  const plot = standaloneSvg(svg);
  const [width, height] = ["width", "height"].map((name) => Number(svg.getAttribute(name)));
  const whole = element("svg", {
    xmlns: SVG,
    width,
    height: height + HEAD,
    viewBox: `0 0 ${width} ${height + HEAD}`,
  });
  whole.setAttribute("font-family", plot.getAttribute("font-family"));
  const text = { fill: colorOf("text"), "font-size": 13 };
  whole.append(element("title", {}, heading));
  whole.append(element("rect", { width, height: height + HEAD, fill: colorOf("front") }));
  whole.append(element("text", { x: 8, y: 19, "font-weight": 600, ...text }, heading));
  let x = width - 8;
  for (const one of [...series].reverse()) {
    if (series.length < 2) break;
    whole.append(
      element(
        "text",
        { x, y: 19, "text-anchor": "end", "font-size": 12, fill: text.fill },
        one.label,
      ),
    );
    x -= one.label.length * 6.6 + 8;
    const fill = colorOf(one.color);
    whole.append(element("rect", { x: x - 12, y: 13, width: 14, height: 3, fill }));
    x -= 26;
  }
  plot.setAttribute("y", HEAD);
  whole.append(plot);
  return whole;
}

export function ChartTools({
  title,
  heading,
  series,
  svg,
  isZoomed,
  onWhole,
  hasNumbers,
  onNumbers,
}) {
  const name = fileName(title);
  const make = () => picture(svg.current, heading, series);
  const savePng = async () => saveBlob(await pngBlob(make()), `${name}.png`);
  const saveSvg = () => saveBlob(svgBlob(make()), `${name}.svg`);
  return html`<div class="chart-tools">
    ${isZoomed && html`<${IconButton} label=${`Show the whole: ${title}`} onClick=${onWhole}>Whole<//>`}
    ${series.length > 0 && html`<${IconButton} label=${`Numbers: ${title}`} pressed=${hasNumbers} onClick=${onNumbers}>Numbers<//>`}
    <${IconButton} label=${`Save as PNG: ${title}`} onClick=${savePng}>PNG<//>
    <${IconButton} label=${`Save as SVG: ${title}`} onClick=${saveSvg}>SVG<//>
  </div>`;
}

// Rows by x: a cell for each series that has a value there.
function rowsOf(series) {
  const rows = new Map();
  series.forEach((one, column) => {
    const values = one.low ? one.high : one.y;
    for (let index = 0; index < one.x.length && rows.size < 20 * MAX_ROWS; index++) {
      const x = one.x[index];
      if (!rows.has(x)) rows.set(x, []);
      rows.get(x)[column] ??= values[index];
    }
  });
  return [...rows].sort((a, b) => a[0] - b[0]);
}

// The numbers of a chart as a table.
export function DataTable({ title, series, x, y }) {
  const rows = rowsOf(series);
  const heads = [
    axisUnit(x, [0, 1]).title,
    ...series.map((one) => `${one.label} [${pretty(one.unit ?? y.unit ?? "1")}]`),
  ];
  const lines = () =>
    tabbed([
      heads,
      ...rows.map(([at, cells]) => [at, ...series.map((_, column) => cells[column] ?? "")]),
    ]);
  const xText = (at) => (x.categories ? x.categories[at] : number(at, 6));
  const yText = (value) => (y.categories ? y.categories[value] : number(value, 6));
  const isCut = rows.length > MAX_ROWS;
  return html`<div class="chart-data">
    <${CopyButton} text=${lines} label="Copy the table" />
    ${isCut && html`<span>The first ${MAX_ROWS} of ${rows.length} rows; all of them are copied.</span>`}
    <div class="scroll" tabindex="0" role="region" aria-label=${`Numbers of ${title}`}>
      <table>
        <thead>
          <tr>
            ${heads.map((head) => html`<th scope="col" class="number">${head}</th>`)}
          </tr>
        </thead>
        <tbody>
          ${rows.slice(0, MAX_ROWS).map(
            ([at, cells]) =>
              html`<tr>
                <th scope="row" class="number">${xText(at)}</th>
                ${series.map((_, column) => html`<td class="number">${yText(cells[column])}</td>`)}
              </tr>`,
          )}
        </tbody>
      </table>
    </div>
  </div>`;
}
