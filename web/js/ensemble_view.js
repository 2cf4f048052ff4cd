// The study "ensemble": means over many seeds with their confidence and spread.
import { table } from "./dom.js";
import { plot } from "./plot.js";
import { between, lesson, member, metric, plain, range, sceneLink, spectrum, spread, text, value } from "./study_bits.js";
import { number, quantity, words } from "./units.js";

export function show(host, { result: { scene, study } }) {
  const { runs, failed, failures, target, trust } = study, sure = `mean, ${number(study.confidence * 100, 2)} %`;
  host.append(lesson(target ? `${target.is_kept ? "" : "Not kept: "}${words(target.why)}.` : `${runs} runs were made.`,
    `${trust.whole} of ${trust.whole + trust.beyond + trust.unknown} paths are right to their ends, ${trust.beyond} outlast what rounding lets be known.`,
    failed > 0 && `${failed} runs failed and count in nothing: ${failures[0].detail}`));
  for (const { channel, unit, mean, low, high, standard_deviation: deviation } of study.spectra) {
    const most = mean.indexOf(Math.max(...mean)), times = (power) => mean.map((m, k) => m * (1 + deviation[k] / m) ** power);
    const bands = () => [{ label: "one run, by a standard deviation", color: 8, low: times(-1), high: times(1) },
      { label: sure, color: 2, low, high }];
    plot(host, { ...spectrum(channel, unit), at: study.frequency, series: [...(low ? bands() : []), { label: "mean", y: mean }],
      summary: `The mean is largest at ${quantity(study.frequency[most], "Hz", 3)}: ${quantity(mean[most], unit, 3)}.` });
  }
  const seeded = (seed) => study.inputs.length ? `seed ${seed}` : sceneLink(`seed ${seed}`, { ...plain(scene), excitation: { ...scene.excitation, seed } });
  host.append(table(`Each number over ${runs} runs`, [...spread("Mean", "mean"),
    { label: `The ${sure}`, numeric: true, cell: ({ low, high, unit }) => between(low, high, unit) },
    { label: "Largest", numeric: true, cell: (one) => [quantity(one.maximum, one.unit, 3), " ", seeded(one.maximum_seed)] },
  ], Object.entries(study.statistics).map(([metric, one]) => ({ ...one, metric })).filter(({ count }) => count > 0)));
  const shares = study.indices?.filter(({ first }) => first !== null) ?? [];
  if (shares.length) host.append(table("Shares of the inputs in the variance", [metric,
    text("Input", ({ pointer }) => member(pointer)), value("Alone", "first"), range("first_interval_95"), value("In all", "total"), range("total_interval_95")], shares));
}
