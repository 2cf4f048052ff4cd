// The six numbers that a result is opened for: the damper's effect, impacts, the largest force, how exact it is.
import { html } from "../ui/preact.js";
import { Headlines } from "../ui/controls.js";
import { number, quantity, share } from "../units.js";
import { useResult } from "./context.js";

// A metric with and without the damper: reductions are relative to the structure alone.
function effect(label, summary, units, name, place) {
  const value = summary[name];
  const reduction = summary[`${name}_reduction`];
  if (value === null || value === undefined) return null;
  if (reduction === null || reduction === undefined)
    return { label, value: quantity(value, units[name]), place };
  const without = reduction < 1 ? quantity(value / (1 - reduction), units[name], 3) : "–";
  const isLess = reduction > 0.0005;
  const isMore = reduction < -0.0005;
  const change = `${isMore ? "+" : "−"}${number(Math.abs(100 * reduction), 3)} %`;
  return {
    label,
    value: isLess || isMore ? change : "no change",
    note: `${quantity(value, units[name], 3)}, bare ${without}`,
    tone: (isLess && "good") || (isMore && "worse") || "",
    place,
  };
}

function accuracy({ error_estimate: error, trust_horizon: horizon }) {
  const help = "Error estimate";
  if (error === null) return { label: "Accuracy", value: "not known", help };
  if (horizon !== null)
    return {
      label: "Accuracy",
      value: `to ${quantity(horizon, "s", 3)}`,
      note: "later only statistics and spectra hold",
      tone: "limited",
      help: "Trust horizon",
    };
  return {
    label: "Accuracy",
    value: error === 0 ? "exact" : share(error, 2),
    note: error > 0 && "of the largest displacement",
    help,
  };
}

export function ResultHeadlines() {
  const { result } = useResult();
  const { summary, units, scene } = result;
  const hasDamper = scene.dampers.length > 0;
  const isImpulse = result.plan.contact_model === "impulse";
  const items = [
    effect(
      hasDamper ? "Motion, rms" : "Displacement, rms",
      summary,
      units,
      "rms_displacement",
      "concepts#summary",
    ),
    effect(
      hasDamper ? "Motion, peak" : "Displacement, peak",
      summary,
      units,
      "peak_displacement",
      "concepts#summary",
    ),
    effect("Acceleration, rms", summary, units, "rms_acceleration", "concepts#summary"),
    hasDamper && { label: "Impacts", value: number(summary.impacts, 7), place: "concepts#impacts" },
    hasDamper && {
      label: "Largest force",
      value: isImpulse ? "–" : quantity(summary.peak_contact_force, "N"),
      note: isImpulse && "impulses take no time",
      place: "concepts#impacts",
    },
    accuracy(summary),
  ];
  return html`<${Headlines} items=${items.filter(Boolean)} />`;
}
