// A study of kind "compare": contact models over one scene, beside the scene's own run, which is the first.
import { numbers, spectra } from "./beside.js";
import { hint } from "./dom.js";
import { lesson } from "./study_bits.js";
import { number, quantity, words } from "./units.js";

export function show(host, { result: { study, units } }) {
  const runs = study.entries.filter(({ status }) => status === "run").map((entry, at) => ({ ...entry, label: words(entry.name),
    color: (at % 8) + 1, x: study.frequency, y: entry.density, level: entry.psd.level }));
  const impulse = runs.find((run, at) => at > 0 && run.contact_model === "impulse");
  if (impulse) host.append(lesson(`The impulse model's spectrum is off by ${number(impulse.level, 2)} dB: `
    + `its contacts take no time, these ${quantity(runs[0].contacts.mean_duration, "s", 2)} on average.`));
  spectra(host, study.channel, study.unit, runs);
  host.append(numbers(runs, units, [["Mean contact", "s", (run) => run.contacts.mean_duration],
    ["Spectrum apart by", "dB", (run) => run.level], [`Parts by ${study.part * 100} %`, "s", (run) => run.divergence.time]]),
  ...study.entries.filter(({ status }) => status !== "run").map(({ name, why }) =>
    hint(`Not run: ${words(name)}. ${why}`)));
}
