// A force trace of a drop test: read from a text file, drawn with the contacts that the service found and the pulses that fit.
import { Chart } from "../chart/chart.js";
import { faultText, FileInput } from "../ui/controls.js";
import { useId } from "../ui/hooks.js";
import { numberRows } from "../ui/number_rows.js";
import { html, useRef } from "../ui/preact.js";
import { number, pretty, quantity, words } from "../units.js";

const MAX_NAMED = 6; // contacts in the sentence

// {interval, force} of lines of a time in s and a force in N; what stands before them is a heading.
function readTrace(text) {
  const isRow = (numbers) => numbers.length === 2 && numbers.every(Number.isFinite);
  const { rows } = numberRows(text, isRow);
  if (rows.length === 0) throw new Error("No line has two numbers: a time in s and a force in N.");
  const last = rows.findLastIndex(({ numbers }) => isRow(numbers));
  const [start] = rows[0].numbers;
  const interval = (rows[last].numbers[0] - start) / last;
  const isEven = ([time], at) => Math.abs(time - start - at * interval) <= 0.3 * interval;
  const bad = rows.find(({ numbers }, at) => !(isRow(numbers) && isEven(numbers, at)));
  if (bad) throw new Error(`Line ${bad.line}: a time in s, at even steps, and a force in N.`);
  return {
    interval: Number(interval.toPrecision(12)),
    force: rows.map(({ numbers }) => numbers[1]),
  };
}

// A contact in words; or why there is none, or no pulse that fits.
function contactText({ contact, contact_time: time, restitution, note }) {
  const parts = [];
  if (contact)
    parts.push(
      `${quantity(contact.peak, "N", 3)} at ${quantity(contact.start ?? contact.first, "s", 3)}`,
    );
  if (time !== null)
    parts.push(`contact time ${quantity(time, "s", 3)}, e ${number(restitution, 3)}`);
  if (note) parts.push(note);
  return parts.join(", ");
}

function summaryOf(evaluation, rows, contacts) {
  if (evaluation === null) return "Not evaluated.";
  if (evaluation === undefined) return "Looking for contacts …";
  const named = rows.slice(0, MAX_NAMED).map(contactText).join("; ");
  return `Contacts detected: ${contacts.length}; ${named}.`;
}

// The pulses as one line with gaps between them.
function pulseLine(contacts) {
  const points = contacts.flatMap(({ start, end, pulse }) => [
    ...pulse.map((force, at) => [start + ((end - start) * at) / (pulse.length - 1), force]),
    [end, null],
  ]);
  return { x: points.map(([time]) => time), y: points.map(([, force]) => force) };
}

function TraceChart({ trace, number: count, evaluation }) {
  const rows = evaluation?.rows.filter((row) => row.trace === count) ?? [];
  const contacts = rows.flatMap(({ contact }) => contact ?? []);
  const fitted = contacts.filter(({ pulse }) => pulse.length > 0);
  const times = useRef({});
  if (times.current.force !== trace.force)
    times.current = { force: trace.force, x: trace.force.map((_, at) => at * trace.interval) };
  const series = [{ label: "force", color: "force", x: times.current.x, y: trace.force }];
  if (fitted.length > 0)
    series.push({
      label: `fitted by ${words(evaluation.separation)}`,
      color: "c1",
      lineWidth: 2,
      ...pulseLine(fitted),
    });
  const spans = contacts.map(({ first, last, start, end }, at) => ({
    from: start ?? first,
    to: end ?? last,
    label: String(at + 1),
  }));
  return html`<p class="hint">${summaryOf(evaluation, rows, contacts)}</p>
    <${Chart}
      title=${`Force of trace ${count}`}
      height=${150}
      x=${{ label: "Time", unit: "s" }}
      y=${{ label: "Force", unit: "N" }}
      series=${series}
      spans=${spans}
    />`;
}

export function TraceField({ pointer, schema, label, draft }) {
  const id = useId("trace");
  const place = pointer.replace("/force", "");
  const trace = draft.get(place);
  const count = Number(place.match(/\d+$/)) + 1;
  const faults = [pointer, `${place}/interval`].flatMap(draft.faultsAt);
  const read = async (event) => {
    const input = event.currentTarget;
    try {
      const found = readTrace(await input.files[0].text());
      draft.setCheck(null, []);
      draft.set(place, { ...draft.get(place), ...found });
    } catch (error) {
      input.value = ""; // one that was read before still counts
      draft.setCheck(draft.check, [{ pointer, detail: error.message }]);
    }
  };
  return html`<div class="field">
      <label for=${id}>${label}<span class="unit">${` [${pretty(schema["x-unit"])}]`}</span></label>
      <${FileInput}
        id=${id}
        aria-describedby=${`${id}-hint ${id}-fault`}
        aria-invalid=${faults.length > 0}
        onChange=${read}
      />
      <p class="hint" id=${`${id}-hint`}>
        ${`a text file of times in s and forces in N; ${schema.description}`}
      </p>
      <p class="fault" id=${`${id}-fault`}>${faults.slice(0, 3).map(faultText).join("; ")}</p>
    </div>
    ${
      trace?.force &&
      html`<${TraceChart} trace=${trace} number=${count} evaluation=${draft.check?.evaluation} />`
    }`;
}
