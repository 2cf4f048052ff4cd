// Power spectral densities by Welch's method: segments of one length in seconds, so that signals of different sample rates
// have the same resolution. Hann windows, half overlapped, without their means.

// The discrete Fourier transform in place, of a length that is a power of two.
function transform(re, im) {
  const count = re.length;
  for (let at = 1, reversed = 0; at < count; at++) {
    let bit = count >> 1;
    for (; reversed & bit; bit >>= 1) reversed ^= bit;
    reversed |= bit;
    if (at < reversed) {
      [re[at], re[reversed]] = [re[reversed], re[at]];
      [im[at], im[reversed]] = [im[reversed], im[at]];
    }
  }
  for (let size = 2; size <= count; size *= 2) {
    const half = size / 2;
    for (let k = 0; k < half; k++) {
      const [cos, sin] = [Math.cos((2 * Math.PI * k) / size), -Math.sin((2 * Math.PI * k) / size)];
      for (let start = k; start < count; start += size) {
        const other = start + half;
        const real = re[other] * cos - im[other] * sin;
        const imaginary = re[other] * sin + im[other] * cos;
        re[other] = re[start] - real;
        im[other] = im[start] - imaginary;
        re[start] += real;
        im[start] += imaginary;
      }
    }
  }
}

// {x: frequencies, y: densities}, one-sided, of {start, interval, values} between two instants, by segments of `seconds`.
export function welch({ start, interval, values }, { from, to, seconds }) {
  const length = Math.min(values.length, Math.max(16, Math.round(seconds / interval)));
  const padded = 2 ** Math.ceil(Math.log2(length));
  const window = Float64Array.from(
    { length },
    (_, at) => 0.5 - 0.5 * Math.cos((2 * Math.PI * at) / length),
  );
  const power = window.reduce((sum, one) => sum + one * one, 0);
  const y = new Float64Array(padded / 2 + 1);
  // As many for every signal over these instants, beginning at the same ones.
  const segments = Math.max(1, Math.floor((2 * (to - from)) / seconds + 1e-6) - 1);
  for (let segment = 0; segment < segments; segment++) {
    const instant = from + (segment * seconds) / 2;
    const place = Math.round((instant - start) / interval);
    const first = Math.max(0, Math.min(values.length - length, place));
    const re = new Float64Array(padded);
    const im = new Float64Array(padded);
    let mean = 0;
    for (let at = 0; at < length; at++) mean += values[first + at] / length;
    for (let at = 0; at < length; at++) re[at] = (values[first + at] - mean) * window[at];
    transform(re, im);
    for (let k = 0; k < y.length; k++) y[k] += re[k] * re[k] + im[k] * im[k];
  }
  const isInner = (k) => k > 0 && k < padded / 2;
  return {
    x: Float64Array.from(y, (_, k) => k / (padded * interval)),
    y: y.map((sum, k) => ((isInner(k) ? 2 : 1) * sum * interval) / (segments * power)),
  };
}
