// Parameters fitted to a measurement: what they are and how well they are known, the measured and the fitted motion, what is
// left between them.
import { labelOf } from "../runs/names.js";
import { html, useMemo } from "../ui/preact.js";
import { link } from "../address.js";
import { get } from "../api.js";
import { Chart } from "../chart/chart.js";
import { useResult } from "../result/context.js";
import { Table } from "../ui/table.js";
import { number, quantity, share, title, words, yesNo } from "../units.js";
import {
  Bars,
  Decision,
  SceneLink,
  intervals,
  pointerOf,
  quantities,
  remarkText,
  remarksOf,
} from "./parts.js";

// "25 ± 0.03 ms"
function parameterText({ value, standard_error: error, unit }) {
  const text = quantity(value, unit);
  return Number.isFinite(error) ? `${text} ± ${quantity(error, unit, 2)}` : text;
}

export function CalibrateStudy() {
  const { result, path } = useResult();
  const { study } = result;
  const { parameters, detail, motions, residual_rms: residuals, shift } = study;
  const found = parameters
    .map((one) => `${labelOf(pointerOf(one))} ${parameterText(one)}`)
    .join(", ");
  const remarks = [
    remarkText(detail),
    shift !== 0 &&
      shift !== null &&
      `The measurement begins ${quantity(shift, "s")} later than the scene.`,
    ...remarksOf(study),
  ];
  // Materials whose numbers were fitted: each can have them as its next revision.
  const isOfBuffer = parameters.some((one) => /restitution|contact_time/.test(pointerOf(one)));
  const use = html`<${SceneLink}
      className="button primary"
      label="Run the scene with these values"
      load=${() => get(`${path}/calibration/scene`)}
      keys=${[result.id]}
    />
    ${
      isOfBuffer &&
      result.materials.map(
        ({ slug }) =>
          html`<a
            class="button"
            href=${link(`materials/${slug}/measure`, { calibration: result.id })}
            >${`Propose a revision of ${words(slug)}`}</a
          >`,
      )
    }`;
  return html`<${Decision} more=${remarks} actions=${use}>${title(study.verdict)}: ${found}.<//>
    ${motions.map((motion, at) => html`<${Motion} key=${at} motion=${motion} />`)}
    <${Intervals} parameters=${parameters} />
    <${Parameters} parameters=${parameters} />
    ${residuals && html`<${Residuals} residuals=${residuals} />`}`;
}

function Motion({ motion: { channel, unit, is_spectrum: isSpectrum, at, measured, fitted } }) {
  const difference = useMemo(
    () => measured.map((value, index) => value - fitted[index]),
    [measured, fitted],
  );
  const x = isSpectrum
    ? { label: "Frequency", unit: "Hz", log: true }
    : { label: "Time", unit: "s" };
  const y = { label: title(channel), unit, log: isSpectrum };
  const name = isSpectrum ? `Spectrum of the ${words(channel)}` : title(channel);
  const series = [
    { label: "measured", color: "text", lineWidth: 1, x: at, y: measured },
    { label: "fitted", color: "c2", x: at, y: fitted },
  ];
  const left = [{ label: "measured less fitted", color: "c6", x: at, y: difference }];
  return html`<${Chart}
      title=${name}
      height=${220}
      x=${x}
      y=${y}
      series=${series}
      group="fit"
      isCompact=${!isSpectrum}
    />
    ${!isSpectrum && html`<${Chart} title=${`${name}, measured less fitted`} height=${110} x=${x} y=${{ label: "Measured less fitted", unit }} series=${left} group="fit" />`}`;
}

// Each interval as a part of its value: which parameter is known best.
function Intervals({ parameters }) {
  const rows = parameters
    .filter(({ value, interval_95: interval }) => value !== 0 && interval)
    .map((one) => ({
      label: title(labelOf(pointerOf(one))),
      from: 100 * (one.interval_95[0] / one.value - 1),
      to: 100 * (one.interval_95[1] / one.value - 1),
      color: one.identifiable === false ? "c6" : "c1",
      text: `± ${share((one.interval_95[1] - one.interval_95[0]) / 2 / Math.abs(one.value), 2)}`,
    }));
  if (rows.length === 0) return null;
  return html`<${Bars}
    title="How well each is known"
    x=${{ label: "95 % interval about the value [%]", unit: "1" }}
    rows=${rows}
  />`;
}

function Parameters({ parameters }) {
  const columns = [
    { label: "Parameter", value: (one) => title(labelOf(pointerOf(one))) },
    quantities("Value", ({ value }) => value),
    quantities("Standard error", (one) => one.standard_error, 3),
    intervals("95 %", (one) => one.interval_95),
    { label: "Identifiable", value: ({ identifiable }) => yesNo[identifiable] ?? null },
  ];
  return html`<${Table} caption="Parameters" columns=${columns} rows=${parameters} />`;
}

function Residuals({ residuals }) {
  const columns = [
    { label: "Channel", value: ({ channel }) => title(channel) },
    quantities("RMS of what is left", ({ value }) => value, 3),
    quantities("Measured RMS", (one) => one.measured_rms, 3),
    {
      label: "Part",
      isNumeric: true,
      value: (one) => one.value / one.measured_rms,
      cell: (one) => share(one.value / one.measured_rms, 3),
    },
    quantities("Stated noise", ({ deviation }) => deviation, 3),
    { label: "Samples", isNumeric: true, value: ({ samples }) => number(samples, 9) },
  ];
  return html`<${Table} caption="Residuals" columns=${columns} rows=${residuals} />`;
}
