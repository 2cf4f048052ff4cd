// The points of a sweep one by one: the chosen one with its numbers and ways on, and all as a table.
import { valueText } from "../runs/scene_name.js";
import { html, useMemo } from "../ui/preact.js";
import { submit } from "../api.js";
import { Figures } from "../ui/controls.js";
import { Table } from "../ui/table.js";
import { quantity, title } from "../units.js";
import { JobButton, SceneLink } from "./parts.js";
import { positionsOf, rowAt } from "./sweep_model.js";

const MAX_ROWS = 1000; // of the table

// The point that is chosen: its numbers, its run, its scene. Other points are a step along an axis away.
export function Point({ answer, model, chosen, best, sceneOf, pick, isDrawn }) {
  if (chosen === undefined) {
    if (!isDrawn) return null;
    const first = best >= 0 ? best : 0;
    return html`<p class="hint">
      ${"A click on the chart, or arrow keys and Enter, opens a point. "}
      <button type="button" class="link" onClick=${() => pick(first)}>
        ${best >= 0 ? "Open the best one" : "Open the first one"}
      </button>
    </p>`;
  }
  const index = model.indices[chosen];
  const positions = positionsOf(model, chosen);
  const figures = [
    ...model.varying.map((axis) => [axis.label, textAt(model, axis, chosen)]),
    ...model.metrics.map(({ label, unit, values }) => [label, quantity(values[chosen], unit)]),
    ["Status", title(model.status[chosen])],
  ];
  const move = (axis) => (event) => {
    const next = [...positions];
    next[axis.index] = Number(event.currentTarget.value);
    const row = rowAt(model, next);
    if (row !== undefined) pick(row);
  };
  return html`<section class="point" role="group" aria-label="Point">
    <h3>${`Point ${index}`}</h3>
    ${
      model.isGrid &&
      model.varying.map(
        (axis) =>
          html`<label class="live-slider">
            <span>${axis.label}</span>
            <input
              type="range"
              min="0"
              max=${axis.values.length - 1}
              value=${positions[axis.index]}
              aria-valuetext=${axis.texts[positions[axis.index]]}
              onInput=${move(axis)}
            />
            <output>${axis.texts[positions[axis.index]]}</output>
          </label>`,
      )
    }
    <${Figures} pairs=${figures} />
    <div class="row">
      <${JobButton} label="Run this point" make=${async () => submit(await sceneOf(chosen)())} />
      <${SceneLink}
        className="button"
        label="Change its scene"
        load=${sceneOf(chosen)}
        keys=${[index, answer]}
      />
    </div>
  </section>`;
}

function textAt(model, axis, row) {
  const value = model.isGrid
    ? axis.values[positionsOf(model, row)[axis.index]]
    : model.columns[axis.pointer]?.values[row];
  return valueText(value, axis.unit);
}

export function Points({ answer, model, chosen, pick, isOpen }) {
  const rows = useMemo(() => [...model.indices.keys()].slice(0, MAX_ROWS), [model]);
  const columns = useMemo(
    () => [
      {
        label: "Point",
        isNumeric: true,
        value: (row) => model.indices[row],
        cell: (row) =>
          html`<button type="button" class="link" onClick=${() => pick(row)}>
            ${model.indices[row]}
          </button>`,
      },
      ...model.varying.map((axis) => ({
        label: axis.label,
        unit: axis.isNumeric ? (axis.unit ?? "1") : undefined,
        value: (row) => {
          const value = model.columns[axis.pointer]?.values[row];
          return typeof value === "number" ? value : valueText(value);
        },
      })),
      ...model.metrics.map(({ label, unit, values }) => ({
        label,
        unit: unit ?? "1",
        value: (row) => values[row],
      })),
      { label: "Status", value: (row) => title(model.status[row]) },
    ],
    [model],
  );
  const cut = answer.done > rows.length ? `, ${rows.length} of them here` : "";
  return html`<details open=${isOpen}>
    <summary>All points as a table</summary>
    <${Table}
      caption=${`${answer.done} points${cut}`}
      columns=${columns}
      rows=${rows}
      keyOf=${(row) => row}
      chosenKey=${chosen}
      filter="Words of a row"
    />
  </details>`;
}
