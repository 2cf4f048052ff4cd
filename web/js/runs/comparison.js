// Results beside each other: what differs in words, their motions with the difference, their spectra, metrics, inputs and first
// impacts. In the address: channel, from, to.
import { html, useMemo } from "../ui/preact.js";
import { Chart } from "../chart/chart.js";
import { Choice, Failure, optionsOf, Panel } from "../ui/controls.js";
import { useLoaded } from "../ui/hooks.js";
import {
  isWhole,
  loadSeries,
  MAX_SAMPLES,
  seriesOf,
  quietTime,
  differenceOf,
  windowChanges,
  wordOf,
} from "../result/series.js";
import { capital, metricOf, number, quantity, readable, title, words } from "../units.js";
import { bandDifferences, bandSeries, bandText, furthestBand } from "./bands.js";
import { ComparisonTable, FirstImpacts, Pushes } from "./comparison_table.js";
import { isSame } from "./names.js";

const PIXELS = 1600; // buckets of a long series

// Which of two pushes harder, and why.
function pushText(runs) {
  const force = ({ result }) => result.summary.peak_contact_force;
  const contact = ({ result }) =>
    Math.max(...result.plan.derived.map((stop) => stop.contact_time ?? 0));
  const [soft, hard] = runs.toSorted((a, b) => force(a) - force(b));
  const ratio = (a, b, unit) =>
    `${number(a / b, 2)} times as %s (${quantity(a, unit, 3)} against ${quantity(b, unit, 3)})`;
  if (!(force(soft) > 0 && force(hard) > 1.05 * force(soft))) return null;
  const harder = ratio(force(hard), force(soft), "N").replace("%s", `hard as ${soft.label}`);
  const isLonger = contact(soft) > 1.05 * contact(hard) && contact(hard) > 0;
  const longer = ratio(contact(soft), contact(hard), "s").replace("%s", "long over a contact");
  return `${hard.label} pushes ${harder}${isLonger ? `; ${soft.label} pushes ${longer}` : ""}.`;
}

// How much more or less one moves than the first.
function motionText(first, other) {
  const [a, b] = [first, other].map(({ result }) => result.summary.rms_displacement);
  if (!(a > 0) || Math.abs(b / a - 1) < 0.005) return null;
  const share = `${number(Math.abs(100 * (b / a - 1)), 2)} % ${b > a ? "more" : "less"} than`;
  const change = b > 3 * a ? `${number(b / a, 2)} times as much as` : share;
  return `${other.label} moves ${change} ${first.label} (rms ${quantity(b, "m", 3)} against ${quantity(a, "m", 3)}).`;
}

const divergenceOf = (pair) => ((pair.divergence?.time ?? null) === null ? null : pair.divergence);

function partingText([first, ...others], pairs) {
  const parts = others.flatMap((run, at) => {
    const divergence = divergenceOf(pairs[at]);
    if (!divergence) return [];
    const rounding = divergence.is_trusted ? "" : " (or by rounding)";
    return `${run.label} from ${quantity(divergence.time, "s")} on${rounding}`;
  });
  return parts.length > 0
    ? `More than 1 % of the largest displacement apart from ${first.label}: ${parts.join(", ")}.`
    : null;
}

function alikeText(runs, inputs) {
  const isAlike = metricRows(runs).every(({ values }) =>
    values.every((one) => isSame(one, values[0])),
  );
  if (!isAlike) return "They move alike: by less than 0.5 % of the rms displacement apart.";
  return `The results are the same${inputs.length > 0 ? ", though their inputs differ" : ""}.`;
}

function Lesson({ runs, pairs, inputs }) {
  const [first, ...others] = runs;
  const found = [
    ...others.map((other) => motionText(first, other)),
    runs.length === 2 && pushText(runs),
    partingText(runs, pairs),
  ].filter(Boolean);
  const texts = found.length > 0 ? found : [alikeText(runs, inputs)];
  return html`<div class="decision">
    ${texts.map((text, at) => html`<p class=${at === 0 ? "answer" : null}>${text}</p>`)}
  </div>`;
}

// What is called "displacement" in all: a frame's is its top storey's. Undefined where there is none.
const channelIn = (channels, channel) =>
  channels.includes(channel)
    ? channel
    : channels.findLast(
        (one) => /acceleration|^(displacement|velocity)/.test(one) && wordOf(one) === channel,
      );

// The channels that all have, else those of the top storeys.
function commonChannels(runs) {
  const lists = runs.map(({ result }) => result.channels);
  const own = lists[0].filter((channel) => lists.every((list) => list.includes(channel)));
  if (own.some((channel) => /^displacement/.test(channel))) return own;
  const plain = [...new Set(lists[0].map(wordOf))];
  return plain.filter((channel) => lists.every((list) => channelIn(list, channel)));
}

// A motion by its samples; nothing where only their range is known.
const samplesOf = ({ time, column: { values } }) =>
  values && { start: time[0], interval: time[1] - time[0], values };

const largestOf = (values) =>
  values.reduce((most, value) => Math.max(most, Math.abs(value ?? 0)), 0);

// The series of one channel of each run: [{run, time, column}].
function useMotions(runs, channel, window) {
  const areWhole = runs.every(({ result }) => isWhole(result));
  return useLoaded(
    (signal) =>
      Promise.all(
        runs
          .filter((run) => run.end > window.from)
          .map(async (run) => {
            const { path, result, end } = run;
            const within = { from: window.from, to: Math.min(window.to, end) };
            const own = channelIn(result.channels, channel);
            const options = { path, result, channels: [own], window: within };
            const { time, columns } = await loadSeries({ ...options, pixels: PIXELS, signal });
            return { run, time, column: columns.get(own) };
          }),
      ),
    [runs, channel, ...(areWhole ? [] : [window.from, window.to])],
  );
}

function Motions({ runs, pairs, query, change }) {
  const channels = commonChannels(runs);
  const channel = channels.includes(query.channel) ? query.channel : channels[0];
  const end = Math.max(...runs.map((run) => run.end));
  const given = [Number(query.from ?? 0), Number(query.to ?? end)];
  const isGiven = query.from !== undefined || query.to !== undefined;
  const window = given[0] < given[1] ? { from: given[0], to: given[1] } : { from: 0, to: end };
  const loaded = useMotions(runs, channel, window);
  const [differences, isAllSame, quiet] = useMemo(() => {
    const [first, ...others] = loaded.data ?? [];
    const signals = loaded.data?.map(samplesOf) ?? [];
    const found = others.map((other, at) => {
      const pair = [signals[0], signals[at + 1]];
      return { ...(pair.every(Boolean) && differenceOf(...pair)), run: other.run };
    });
    const isNoise = ({ y }) => y && largestOf(y) <= 1e-9 * largestOf(first.column.values);
    const motions = (loaded.data ?? []).map(({ time, column: { values } }) => ({ time, values }));
    return [
      found.filter((one) => one.x && !isNoise(one)),
      found.length > 0 && found.every(isNoise),
      quietTime(motions, end),
    ];
  }, [loaded.data]);
  if (channels.length === 0) return html`<p>They have no channel in common.</p>`;
  const isTop = runs.some(({ result }) => !result.channels.includes(channel));
  const range = isGiven ? [window.from, window.to] : quiet && [0, quiet];
  const setRange = (next) => change(windowChanges(next, quiet, end), true);
  const isFirst = loaded.data?.[0]?.run === runs[0];
  const unit = runs[0].result.units[channelIn(runs[0].result.channels, channel)];
  const rules = runs.slice(1).flatMap((run, at) => {
    const divergence = divergenceOf(pairs[at]);
    return divergence
      ? [
          {
            x: divergence.time,
            label: runs.length < 4 ? `${run.label} differs` : "",
            color: run.color,
          },
        ]
      : [];
  });
  const x = { label: "Time", unit: "s", domain: [0, end] };
  const shared = { x, range, onRange: setRange, group: "comparison" };
  return html`${channels.length > 1 && html`<p><${ChannelChoice} channels=${channels} channel=${channel} change=${change} /></p>`}
  ${isTop && html`<p class="hint">Of a frame the top storey is shown.</p>`}
  ${loaded.error && html`<${Failure} error=${loaded.error} />`}
  ${
    loaded.data
      ? html`<${Chart}
            ...${shared}
            title="Over time"
            y=${{ label: title(channel), unit }}
            height=${250}
            isCompact=${isFirst && differences.length > 0}
            rules=${rules}
            series=${loaded.data.map(({ run, time, column }) => seriesOf(run.label, run.color, time, column))}
          />
          ${
            isFirst &&
            differences.length > 0 &&
            html`<${Chart}
              ...${shared}
              title="Difference over time"
              y=${{ label: `Difference to ${runs[0].label}`, unit }}
              height=${150}
              series=${differences.map(({ run, x: time, y }) => ({ label: `${run.label} less ${runs[0].label}`, color: run.color, x: time, y }))}
            />`
          }
          ${
            isFirst &&
            differences.length === 0 &&
            !isAllSame &&
            html`<p class="hint">
              ${`With more than ${number(MAX_SAMPLES)} samples only their range is drawn: zoom in to see the difference.`}
            </p>`
          }
          ${isFirst && isAllSame && html`<p class="hint">The motions differ by rounding at most.</p>`}`
      : html`<p class="quiet">Loading …</p>`
  }`;
}

const ChannelChoice = ({ channels, channel, change }) =>
  html`<${Choice}
    label="Channel"
    options=${optionsOf(channels)}
    value=${channel}
    onChange=${(value) => change({ channel: value }, true)}
  />`;

const isSeen = (bands) => bands.some(({ level }) => Math.abs(level) > 1e-6); // above rounding

function spectrumText(first, others, pairs) {
  const parts = others.flatMap(({ run, bands }) => {
    const level = pairs[run.at - 1]?.psd?.[0]?.level ?? null;
    const most = furthestBand(bands);
    const there = most && `most ${bandText(most)}`;
    const texts = [level !== null && `by ${number(level, 2)} dB`, there].filter(Boolean);
    return isSeen(bands) && texts.length > 0 ? `${run.label} ${texts.join(", ")}` : [];
  });
  if (parts.length === 0) return "The spectra do not differ.";
  return `Apart from ${first.label}: ${parts.join("; ")}.`;
}

function Spectra({ runs, pairs }) {
  const all = Object.keys(runs[0].psd?.channels ?? {});
  const channel = pairs[0].psd?.[0]?.channel ?? (all.length > 0 ? wordOf(all[0]) : undefined);
  const densityOf = ({ psd }) => psd?.channels[channelIn(Object.keys(psd.channels), channel)];
  const [first, ...others] = useMemo(
    () =>
      runs
        .map((run, at) => ({ ...run, at, density: densityOf(run) }))
        .filter(({ density }) => density)
        .map((run) => ({ ...run, x: run.psd.frequency.values, y: run.density.values })),
    [runs, channel],
  );
  if (!channel || others.length === 0 || first.at !== 0)
    return html`<p>They have no spectrum in common.</p>`;
  const levels = others.map((run) => ({ run, bands: bandDifferences(first, run) }));
  const text = spectrumText(first, levels, pairs);
  const x = { label: "Frequency", unit: "Hz", log: true };
  const bands = levels.flatMap((one) => one.bands);
  if (bands.length === 0) return html`<p>One of the spectra is zero everywhere.</p>`;
  const ends = [
    Math.min(...bands.map(({ low }) => low)),
    Math.max(...bands.map(({ high }) => high)),
  ];
  return html`<p>${text}</p>
    <div class="columns">
      <${Chart}
        title=${`Spectrum of the ${words(channel)}`}
        description=${text}
        height=${220}
        x=${x}
        y=${{ label: "Density", unit: first.density.unit, log: true }}
        series=${[first, ...others].map(({ label, color, x: at, y }) => ({ label, color, x: at, y }))}
        group="spectra"
      />
      ${
        isSeen(bands) &&
        html`<${Chart}
          title="Level difference by third octaves"
          height=${220}
          x=${{ ...x, domain: ends }}
          y=${{ label: `Level over ${first.label}`, unit: "dB" }}
          series=${levels.map(({ run, bands }) => bandSeries(run.label, run.color, bands))}
          group="spectra"
        />`
      }
    </div>`;
}

// Of the summary, what is not the same for all.
function metricRows(runs) {
  const { summary, units } = runs[0].result;
  return Object.keys(summary)
    .filter((name) => !/residual|estimate/.test(name))
    .map((name) => ({
      name,
      unit: units[name],
      values: runs.map(({ result }) => metricOf(result.summary, name)),
    }));
}

export function Comparison({ comparison: { runs, pairs, inputs }, query, change }) {
  const warnings = [...new Set(pairs.flatMap((pair) => pair.warnings.map(({ detail }) => detail)))];
  const hasImpacts = runs.some(({ impact }) => impact);
  const isNarrow = runs.length === 2; // tables of two runs stand beside the charts
  return html`<div class="comparison">
    <${Lesson} runs=${runs} pairs=${pairs} inputs=${inputs} />
    <div class=${isNarrow ? "split compare" : "compare"}>
      <div>
        <${Panel} title="Motion">
          <${Motions} runs=${runs} pairs=${pairs} query=${query} change=${change} />
        <//>
        <${Panel} title="Spectra" help="Spectrum"><${Spectra} runs=${runs} pairs=${pairs} /><//>
        <${Pushes} runs=${runs} />
      </div>
      <div class=${isNarrow ? null : "columns"}>
        <${Panel} title="Metrics" help="Summary">
          <${ComparisonTable}
            caption="Numbers that differ"
            head="Metric"
            runs=${runs}
            rows=${metricRows(runs)}
            isDiffering
          />
        <//>
        ${
          hasImpacts &&
          html`<${Panel} title="First impacts" help="Impacts"><${FirstImpacts} runs=${runs} /><//>`
        }
        <${Panel} title="Inputs">
          <${ComparisonTable}
            caption="Inputs that differ"
            head="Input"
            runs=${runs}
            rows=${inputs}
          />
          ${warnings.map((text) => html`<p class="hint">${capital(readable(text))}.</p>`)}
        <//>
      </div>
    </div>
  </div>`;
}
