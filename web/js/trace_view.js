// A force trace of a drop test: a widget that reads it from a text file and draws it with the contacts the service detected.
import { h } from "./dom.js";
import { labelled } from "./material_parts.js";
import { plot } from "./plot.js";
import { number, quantity } from "./units.js";

// {interval, force} of lines of a time in s and a force in N; what stands before them is a heading.
function readTrace(text) {
  const all = text.trim().split(/\r?\n/).map((line) => line.trim().split(/[,;\s]+/).map(Number));
  const rows = all.slice(all.findIndex((row) => row.length === 2 && row.every(Number.isFinite)));
  const [start] = rows[0], interval = (rows.at(-1)[0] - start) / (rows.length - 1);
  const bad = rows.findIndex(([time, force], at) =>
    !(Math.abs(time - start - at * interval) <= 0.3 * interval && Number.isFinite(force)));
  if (bad >= 0) throw new Error(`Line ${all.length - rows.length + bad + 1}: a time in s, at even steps, and a force in N.`);
  return { interval: Number(interval.toPrecision(12)), force: rows.map(([, force]) => force) };
}

const told = ({ contact: { peak, first }, contact_time, restitution }) => `; ${quantity(peak, "N", 3)} at ${
  quantity(first, "s", 3)}, T_c ${quantity(contact_time, "s", 3)}, e ${number(restitution, 3)}`;

export function traceWidget({ pointer, draft }) {
  const place = pointer.replace("/force", ""), count = Number(place.match(/\d+$/)) + 1;
  const fault = h("p", { class: "fault", role: "alert" });
  let chart, shown;
  const file = h("input", { type: "file", accept: ".csv,.txt,.dat", onclick: () => (file.value = ""), async onchange() {
    try {
      const trace = readTrace(await file.files[0].text());
      draft.set(place, { ...draft.get(place), ...trace });
    } catch (error) {
      draft.say(null, [{ pointer, detail: error.message }]);
    }
  } });
  const element = h("div", null, labelled("Text file of time [s] and force [N]", file), fault);
  draft.signal.addEventListener("abort", () => chart?.destroy());
  return { element, refresh() {
    fault.textContent = draft.faultsAt(pointer).map(({ detail }) => detail).join("; ");
    if (!draft.get(pointer) || shown === draft.check) return;
    shown = draft.check;
    const { force, interval } = draft.get(place);
    const found = shown?.evaluation?.rows.filter(({ trace, contact }) => trace === count && contact !== null) ?? [];
    chart ??= plot(element,
      { title: `Force of trace ${count}`, x: { label: "time", unit: "s" }, y: { label: "force", unit: "N" } });
    chart.set({
      summary: `Contacts detected: ${found.length}${found.slice(0, 6).map(told).join("")}.`,
      series: [{ label: "force", color: 1, x: force.map((_, at) => at * interval), y: force }],
      spans: found.map(({ contact: { first, last } }, k) => ({ from: first, to: last, label: k + 1 })),
    });
  } };
}
