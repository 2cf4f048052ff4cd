// What a reader prefers on every page: the units of numbers. Kept by the browser, part of no address.
import { storage } from "./storage.js";
import { createStore } from "./store.js";

const KEY = "impactd.units";

// Each quantity with its SI unit and what it can be written in: the factor of each, "auto" for a prefix that suits the number.
export const unitSettings = [
  { name: "length", label: "Lengths", unit: "m", choices: { auto: null, mm: 1e-3, m: 1 } },
  {
    name: "acceleration",
    label: "Accelerations",
    unit: "m/s^2",
    choices: { "m/s^2": null, g: 9.80665 },
  },
  { name: "force", label: "Forces", unit: "N", choices: { auto: null, N: 1, kN: 1000 } },
];

function load() {
  let kept = {};
  try {
    kept = Object(JSON.parse(storage.get(KEY)));
  } catch {
    // what cannot be read counts as nothing
  }
  const valid = ({ name, choices }) =>
    Object.hasOwn(choices, kept[name]) ? kept[name] : Object.keys(choices)[0];
  return Object.fromEntries(unitSettings.map((setting) => [setting.name, valid(setting)]));
}

export const settings = createStore(load()); // {length, acceleration, force}

settings.subscribe((value) => storage.set(KEY, JSON.stringify(value)));
