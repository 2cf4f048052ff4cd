// The power spectra of a result, others laid over them. In the address: psd (channel), psd_from, psd_to (Hz), overlay (ids),
// smooth (third octaves), axes (linear).
import { html, useMemo } from "../ui/preact.js";
import { get } from "../api.js";
import { Chart } from "../chart/chart.js";
import { Choice, Failure, Loaded, optionsOf } from "../ui/controls.js";
import { useLoaded } from "../ui/hooks.js";
import { latestResults } from "../runs/names.js";
import { number, pretty, words } from "../units.js";
import { useResult } from "./context.js";

const MAX_OVERLAYS = 7; // there are 8 colours

const NO_NAMES = new Map();
const NONE = [];

const load = (id) => get(`v1/results/${encodeURIComponent(id)}/psd.json`);

// The mean of each value's third octave: from 2^(-1/6) to 2^(1/6) of its frequency.
function thirdOctaves(frequencies, values) {
  const sums = [0];
  for (const value of values) sums.push(sums[sums.length - 1] + value);
  const ratio = 2 ** (1 / 6);
  let low = 0;
  let high = 0;
  return values.map((value, index) => {
    const at = frequencies[index];
    if (!(at > 0)) return value;
    while (frequencies[low] < at / ratio) low++;
    while (high < values.length && frequencies[high] <= at * ratio) high++;
    return (sums[high] - sums[low]) / (high - low);
  });
}

function peakOf({ x, y }, range) {
  let best = -1;
  for (let index = 0; index < x.length; index++) {
    const isIn = x[index] > 0 && (!range || (x[index] >= range[0] && x[index] <= range[1]));
    if (isIn && (best < 0 || y[index] > y[best])) best = index;
  }
  return best;
}

export function Spectrum() {
  const { result, query } = useResult();
  const ids = (query.overlay ?? "").split(",").filter(Boolean).slice(0, MAX_OVERLAYS);
  const hasPsd = Boolean(result.links.psd);
  const own = useLoaded(async () => (hasPsd ? load(result.id) : null), [result.id]);
  const names = useLoaded(() => latestResults(20), [result.id]);
  const others = useLoaded(
    () => Promise.all(ids.map((id) => load(id).catch(() => null))),
    [ids.join()],
  );
  if (!hasPsd) return html`<p>The scene asked for no spectrum.</p>`;
  return html`<${Loaded} loaded=${own}>
    ${(psd) =>
      html`<${SpectrumChart} psd=${psd} names=${names} ids=${ids} others=${others.data ?? NONE} />`}
  <//>`;
}

function SpectrumChart({ psd, names, ids, others }) {
  const { result, query, change } = useResult();
  const known = names.data ?? NO_NAMES;
  const channels = Object.keys(psd.channels);
  const channel = channels.includes(query.psd) ? query.psd : channels[0];
  const isSmooth = query.smooth === "1";
  const isLinear = query.axes === "linear";
  const { unit } = psd.channels[channel];
  const from = Number(query.psd_from);
  const to = Number(query.psd_to);
  const range = to > from ? [from, to] : null;
  const series = useMemo(
    () =>
      [psd, ...others].map((run, at) => {
        const x = run?.frequency.values ?? [];
        const y = run?.channels[channel]?.values ?? [];
        const label = at === 0 ? "this result" : (known.get(ids[at - 1]) ?? "another");
        return { label, color: `c${at + 1}`, x, y: isSmooth ? thirdOctaves(x, y) : y };
      }),
    [psd, others, known, channel, isSmooth],
  );
  const best = peakOf(series[0], range);
  const { x, y } = series[0];
  const summary =
    best < 0
      ? "No values in view."
      : `Largest ${number(y[best], 3)} ${pretty(unit)} at ${number(x[best])} Hz${range ? " in view" : ""}.`;
  const toggle = (id) => {
    const next = ids.includes(id) ? ids.filter((one) => one !== id) : [...ids, id];
    change({ overlay: next.join() || null }, true);
  };
  const choices = [...known].filter(([id]) => id !== result.id);
  return html`<div class="row">
      ${
        channels.length > 1 &&
        html`<${Choice}
          label="Channel"
          options=${optionsOf(channels)}
          value=${channel}
          onChange=${(value) => change({ psd: value }, true)}
        />`
      }
      <${Choice}
        label="Smoothing"
        options=${[
          { value: false, label: "As estimated" },
          { value: true, label: "Third octaves" },
        ]}
        value=${isSmooth}
        onChange=${(value) => change({ smooth: value ? 1 : null })}
      />
      <${Choice}
        label="Axes"
        options=${[
          { value: false, label: "Logarithmic" },
          { value: true, label: "Linear" },
        ]}
        value=${isLinear}
        onChange=${(value) => change({ axes: value ? "linear" : null })}
      />
    </div>
    <${Chart}
      title=${`Spectrum of the ${words(channel)}`}
      description=${summary}
      height=${280}
      x=${{ label: "Frequency", unit: "Hz", log: !isLinear }}
      y=${{ label: `Power spectral density of the ${words(channel)}`, unit, log: !isLinear }}
      series=${series}
      rules=${result.plan.modes.slice(0, 12).map((mode, at) => ({ x: mode.frequency, label: `mode ${at + 1}` }))}
      range=${range}
      onRange=${(next) => change({ psd_from: next?.[0].toPrecision(8), psd_to: next?.[1].toPrecision(8) }, true)}
    />
    <p class="hint">
      ${`${summary} Welch's method: ${psd.segments} segments of ${psd.segment} samples, window ${psd.window}.`}
    </p>
    <details open=${ids.length > 0}>
      <summary>Overlay other results</summary>
      ${choices.map(
        ([id, label]) =>
          html`<div>
            <label
              ><input type="checkbox" checked=${ids.includes(id)} onChange=${() => toggle(id)} />
              ${label}</label
            >
          </div>`,
      )}
      ${names.error && html`<${Failure} error=${names.error} />`}
      ${names.data && choices.length === 0 && html`<p class="quiet">There is no other result yet.</p>`}
    </details>`;
}
