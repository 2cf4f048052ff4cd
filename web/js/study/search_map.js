// The search over two numbers: every candidate at its place, coloured by the objective, the best one ringed.
import { axisUnit } from "../chart/axis.js";
import { Chart } from "../chart/chart.js";
import { paddedDomain } from "../chart/scale.js";
import { html } from "../ui/preact.js";
import { quantity } from "../units.js";
import { levelsOf, shade } from "./contour.js";
import { ColorScale, UpwardTitle, partOf } from "./contours.js";
import { extentOfValues } from "./parts.js";

// `axes` are the two, {label, unit}; `points` {at: [x, y], value, isBest}.
export function SearchMap({ title, label, unit, axes, points }) {
  const known = points.filter(({ value }) => Number.isFinite(value));
  const [low, high] = extentOfValues(known.map(({ value }) => value)) ?? [0, 0];
  const isLog = low > 0 && high > 50 * low;
  const levels = levelsOf(low, high, 9, isLog);
  const colorOf = (value) =>
    shade(
      partOf(
        levels,
        levels.findLastIndex((level) => level <= value),
      ),
    );
  const [x, y] = axes.map((axis, index) => ({
    ...axis,
    domain: paddedDomain(extentOfValues(known.map(({ at }) => at[index])), false, 0.04),
  }));
  const { factor, title: heading } = axisUnit({ label, unit, log: isLog }, [low, high]);
  const draw = (plot) => html`
    ${known
      .toSorted((a, b) => b.value - a.value) // the best ones above
      .map(
        ({ at, value, isBest }) =>
          html`<circle
            cx=${plot.x.to(at[0])}
            cy=${plot.y.to(at[1])}
            r=${isBest ? 8 : 5}
            style=${{ fill: colorOf(value), stroke: `var(--${isBest ? "ok" : "edge"})`, strokeWidth: isBest ? 3 : 1 }}
          >
            <title>
              ${`${axes.map((axis, index) => `${axis.label} ${quantity(at[index], axis.unit)}`).join(", ")}: ${quantity(value, unit)}`}
            </title>
          </circle>`,
      )}
    <${UpwardTitle} axis=${y} plot=${plot} />
  `;
  return html`<${Chart}
      title=${title}
      heading=${heading}
      description=${`${label} of ${known.length} candidates from ${quantity(low, unit)} to ${quantity(high, unit)}; the best one is ringed.`}
      height=${300}
      isFixed
      x=${x}
      y=${y}
      series=${[]}
    >
      ${draw}
    <//>
    <${ColorScale} levels=${levels} factor=${factor} />`;
}
