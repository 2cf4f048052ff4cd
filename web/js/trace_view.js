// A force trace of a drop test: a widget that reads it from a text file and draws it with the contacts the service detected.
import { h } from "./dom.js";
import { frame } from "./fields.js";
import { plot } from "./plot.js";
import { extent } from "./study_bits.js";
import { number, quantity, words } from "./units.js";

// {interval, force} of lines of a time in s and a force in N; what stands before them is a heading. Beside a semicolon or a
// tab a comma is a decimal one.
function readTrace(text) {
  const all = text.trim().split(/\r?\n/).map((line) => (/[;\t]/.test(line) ? line.replaceAll(",", ".").split(/[;\t]/)
    : line.trim().split(/[,\s]+/)).map(parseFloat));
  const isRow = (row) => row.length === 2 && row.every(Number.isFinite), first = all.findIndex(isRow);
  if (first < 0) throw new Error("No line has two numbers: a time in s and a force in N.");
  const rows = all.slice(first), last = rows.findLastIndex(isRow), [start] = rows[0], interval = (rows[last][0] - start) / last;
  const bad = rows.findIndex((row, at) => !(isRow(row) && Math.abs(row[0] - start - at * interval) <= 0.3 * interval));
  if (bad >= 0) throw new Error(`Line ${first + bad + 1}: a time in s, at even steps, and a force in N.`);
  return { interval: Number(interval.toPrecision(12)), force: rows.map(([, force]) => force) };
}

// A contact in words; or why there is none, or no pulse that fits.
const told = ({ contact, contact_time, restitution, note }) => [
  contact && `${quantity(contact.peak, "N", 3)} at ${quantity(contact.start ?? contact.first, "s", 3)}`,
  contact_time !== null && `T_c ${quantity(contact_time, "s", 3)}, e ${number(restitution, 3)}`, note].filter(Boolean).join(", ");

// What plot() draws of a trace and its rows of the evaluation, undefined while it is awaited. Very many samples are
// drawn as extremes of buckets: no peak is lost.
function picture({ interval, force }, evaluation, rows) {
  const x = [], low = [], high = [], size = Math.ceil(force.length / 20000);
  for (let at = 0; at < force.length; at += size) {
    const [least, most] = extent(force.slice(at, at + size));
    x.push(at * interval);
    low.push(least);
    high.push(most);
  }
  const found = rows.flatMap(({ contact }) => contact ?? []), fits = found.filter(({ pulse }) => pulse.length > 0);
  const points = fits.flatMap(({ start, end, pulse }) => pulse.map((y, at) => [start + (end - start) * at / (pulse.length - 1), y]));
  const gaps = x.filter((time) => fits.every(({ start, end }) => time < start || time > end)).map((time) => [time, null]);
  const [times, pulses] = [0, 1].map((part) => [...points, ...gaps].map((point) => point[part]));
  return {
    summary: evaluation ? `Contacts detected: ${found.length}; ${rows.slice(0, 6).map(told).join("; ")}.`
      : evaluation === null ? "Not evaluated." : "Looking for contacts …",
    spans: found.map(({ first, last, start, end }, k) => ({ from: start ?? first, to: end ?? last, label: k + 1 })),
    series: [{ label: "force", x, ...(size > 1 ? { low, high } : { y: low }) },
      { label: `fitted by ${words(evaluation?.separation)}`, color: 2, width: 2, x: times, y: pulses }],
  };
}

export function traceWidget(context) {
  const { pointer, schema, draft } = context, place = pointer.replace("/force", ""), count = Number(place.match(/\d+$/)) + 1;
  let chart, drawn;
  const file = h("input", { type: "file", onclick: () => (file.value = ""), async onchange() {
    try {
      const read = readTrace(await file.files[0].text());
      draft.say(null, []);
      draft.set(place, { ...draft.get(place), ...read });
    } catch (error) {
      file.value = ""; // one that was read before still counts
      draft.say(draft.check, [{ pointer, detail: error.message }]);
    }
  } });
  const field = frame(context, file, "a text file of times in s and forces in N", schema.description);
  const element = h("div", null, field.element);
  return { element, refresh() {
    const trace = draft.get(place), { evaluation } = draft.check ?? {};
    field.tell([pointer, `${place}/interval`].flatMap(draft.faultsAt));
    if (!trace?.force || (drawn?.[0] === trace.force && drawn[1] === evaluation)) return;
    drawn = [trace.force, evaluation];
    chart ??= plot(element,
      { title: `Force of trace ${count}`, x: { label: "time", unit: "s" }, y: { label: "force", unit: "N" } });
    chart.set(picture(trace, evaluation, evaluation?.rows.filter((row) => row.trace === count) ?? []));
  } };
}
