// Scales of charts: from values to pixels and back, and where their ticks stand.

// A scale maps `domain` to `pixels`, both [first, last]: scale.to(value), scale.from(pixel).
export function linearScale(domain, pixels) {
  const [low, high] = domain;
  const [first, last] = pixels;
  const factor = (last - first) / (high - low || 1);
  return {
    domain,
    pixels,
    isLog: false,
    to: (value) => first + (value - low) * factor,
    from: (pixel) => low + (pixel - first) / factor,
  };
}

export function logScale(domain, pixels) {
  const powers = linearScale(domain.map(Math.log10), pixels);
  return {
    domain,
    pixels,
    isLog: true,
    to: (value) => powers.to(Math.log10(value)),
    from: (pixel) => 10 ** powers.from(pixel),
  };
}

// The smallest of 1, 2, 2.5, 5 times a power of ten that is at least `least`.
export function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * [1, 2, 2.5, 5, 10].find((step) => step * power >= least * 0.999999);
}

function linearTicks([low, high], most) {
  if (!(high > low)) return [low];
  const step = roundStep((high - low) / Math.max(1, most));
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.floor(high / step + 1e-9) - first + 1;
  // Beyond the digits of numbers there are no ticks between the ends.
  if (!(count >= 1 && count < 1000) || Math.abs(first) > 1e12) return [low];
  return Array.from({ length: count }, (_, at) => Number(((first + at) * step).toPrecision(12)));
}

// Ticks of a decade by how many have room.
const DECADES = [
  [9, [1, 2, 3, 4, 5, 6, 7, 8, 9]],
  [3, [1, 2, 5]],
  [-Infinity, [1]],
];

// At 1 to 9 of a decade, at 1, 2 and 5, or at some powers of ten, as there is room.
function logTicks([low, high], most) {
  if (!(low > 0 && high > low && high < Infinity)) return [];
  const decades = Math.log10(high / low);
  const room = most / Math.max(0.3, decades); // ticks in a decade
  const [, digits] = DECADES.find(([least]) => room >= least);
  const every = Math.max(1, Math.ceil(1 / room));
  const ticks = [];
  for (let power = Math.floor(Math.log10(low)); 10 ** power <= high; power++)
    if (power % every === 0) for (const digit of digits) ticks.push(Number(`${digit}e${power}`));
  return ticks.filter((value) => value >= low * 0.999999 && value <= high * 1.000001);
}

// At least two where there can be.
export function ticksOf(scale, most) {
  const ticks = (scale.isLog ? logTicks : linearTicks)(scale.domain, most);
  return ticks.length < 2 && most < 20 ? ticksOf(scale, 2 * most) : ticks;
}

// [least, largest] of the numbers in arrays, of positive ones only where `isLog`; null where there are none.
export function extentOf(arrays, isLog = false) {
  let low = Infinity;
  let high = -Infinity;
  for (const values of arrays) {
    const [least, largest] = endsOf(values, isLog);
    if (least < low) low = least;
    if (largest > high) high = largest;
  }
  return low <= high ? [low, high] : null;
}

// Of one array; remembered, as arrays are not changed.
const ends = [new WeakMap(), new WeakMap()];
function endsOf(values, isLog) {
  const known = ends[Number(isLog)].get(values);
  if (known) return known;
  let low = Infinity;
  let high = -Infinity;
  for (let at = 0; at < values.length; at++) {
    const value = values[at];
    if (!Number.isFinite(value) || (isLog && value <= 0)) continue;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  ends[Number(isLog)].set(values, [low, high]);
  return [low, high];
}

// The domain of an axis that shows these values with room around them.
export function paddedDomain(extent, isLog, part = 0.06) {
  if (extent === null) return isLog ? [0.1, 10] : [-1, 1];
  const [low, high] = extent;
  if (part === 0 && low < high) return extent;
  if (isLog) {
    const room = Math.max((high / low) ** part, 1.02);
    return [low / room, high * room];
  }
  const room = (high - low) * part || Math.abs(high) * 0.1 || 1;
  return [low - room, high + room];
}
