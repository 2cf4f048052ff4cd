// A study of kind "sensitivity": what errors of e and T_c do to k_b and c_b, and to the response.
import { table } from "./dom.js";
import { plot } from "./plot.js";
import { between, lesson, spectrum, spread } from "./study_bits.js";
import { share } from "./result/headlines.js";
import { number, quantity, title, words } from "./units.js";

export function show(host, { result: { study } }) {
  const { restitution_deviation: e, contact_time_deviation: time, statistics, response, failed, made, frequency } = study;
  const errors = e ?? time ? `e off by ${share(e ?? 0)} and T_c by ${share(time ?? 0)}` : "the measured spread";
  const telling = statistics.filter(({ metric }) => /force|rms_displacement/.test(metric));
  const ranges = telling.map(({ metric, q05, q95, value, unit }) =>
    `${words(metric)} from ${between(q05, q95, unit)} (stated ${quantity(value, unit, 3)})`);
  host.append(lesson(made > 0 && `With ${errors}, 90 of 100 runs give ${ranges.join(", ")}.`,
    failed > 0 && `${failed} runs failed and count in nothing.`, study.is_chaotic && `${study.why}.`));
  for (const { channel, unit, value, median, q05, q95 } of study.spectra)
    plot(host, { ...spectrum(channel, unit), at: frequency, series: [{ label: "5 to 95 %", color: 1, low: q05, high: q95 },
      { label: "median", color: 1, dash: true, y: median }, { label: "as stated", color: 2, y: value }],
    summary: `90 of 100 runs: ${number(10 * Math.log10(Math.max(...q95) / Math.max(...q05)), 2)} dB between the band's peaks.` });
  const slope = ({ parameter, slopes }) => ({ label: title(parameter), numeric: true, cell: (at) =>
    (slopes[at].is_settled ? number(slopes[at].derivative, 2) : `not settled ${number(slopes[at].derivative, 2)}`) });
  const part = (label, name, unit) => ({ label, numeric: true,
    cell: (stop) => stop.why ?? `${quantity(stop[name], unit)} ± ${share(stop[`${name}_deviation`] ?? 0)}` });
  const [{ slopes }] = response;
  host.append(table(`The response of ${made} runs with ${errors}`, spread("As stated", "value"), statistics),
    table("Slopes: per cent for one per cent more of each; one that does not settle as the step shrinks is no derivative",
      [{ label: "Number", value: (at) => title(slopes[at].metric) }, ...response.map(slope)], [...slopes.keys()]),
    table("Each stop's stiffness and damping", [{ label: "Stop", value: ({ damper, side }) => `damper ${damper}, ${side}` },
      part("k_b", "stiffness", "N/m"), part("c_b", "damping", "N s/m")], study.contact));
}
