// NumPy's file of one array of float64, in Fortran order as the service writes series: a Float64Array for each column.
export function readNpy(buffer) {
  const view = new DataView(buffer);
  const isVersion1 = view.getUint8(6) === 1;
  const length = isVersion1 ? view.getUint16(8, true) : view.getUint32(8, true);
  const start = (isVersion1 ? 10 : 12) + length;
  const header = new TextDecoder("latin1").decode(new Uint8Array(buffer, start - length, length));
  const shape = /'shape':\s*\((\d+),\s*(\d*)\)/.exec(header);
  if (!shape || !/'descr':\s*'<f8'/.test(header))
    throw new Error("The series is not an array of float64.");
  const rows = Number(shape[1]);
  const columns = Number(shape[2] || 1);
  return Array.from(
    { length: columns },
    (_, at) => new Float64Array(buffer.slice(start + 8 * rows * at, start + 8 * rows * (at + 1))),
  );
}
