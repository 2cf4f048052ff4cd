// What a scene is in a few words, and values of its inputs.
import { capital, quantity, words } from "../units.js";

// "sponge" of "sponge@1", "zero force" of "zero_force", "15 mm".
export function valueText(value, unit, digits) {
  if (typeof value === "number") return quantity(value, unit, digits);
  if (value === undefined || value === null) return "–";
  return words(String(value).replace(/@\d+$/, "")).slice(0, 60);
}

// Of the first damper's buffer.
export function materialOf(scene) {
  const [damper] = scene.dampers ?? [];
  const buffer = damper?.buffer ?? damper?.left_buffer;
  if (!damper) return "no damper";
  return buffer?.material ? valueText(buffer.material) : "a damper";
}

// What a result is called whose jobs have no title: "Sponge, clearance 15 mm, free".
export function sceneName(scene) {
  const clearance = scene.dampers?.[0]?.clearance;
  const kind = words(scene.excitation?.kind ?? "free");
  const size = clearance === undefined ? [] : [`clearance ${valueText(clearance, "m")}`];
  return capital([materialOf(scene), ...size, kind].join(", "));
}
