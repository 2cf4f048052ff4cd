// What is done with the runs that were chosen: compared, renamed, deleted.
import { link } from "../address.js";
import { ask } from "../api.js";
import { announce } from "../ui/announce.js";
import { Button, Failure } from "../ui/controls.js";
import { html, useEffect, useRef, useState } from "../ui/preact.js";
import { number } from "../units.js";
import { LETTERS, lettered } from "./names.js";

const count = (number) => (number === 1 ? "1 run" : `${number} runs`);
const resultsOf = (rows) => [
  ...new Set(rows.filter((row) => row.result && !row.result_deleted).map((row) => row.result)),
];

function CompareLink({ rows }) {
  const results = resultsOf(rows);
  if (results.length >= 2 && results.length <= LETTERS.length)
    return html`<a class="button primary" href=${link("compare", lettered(results.reverse()))}
      >Compare</a
    >`;
  return html`<button
    type="button"
    disabled
    title=${`Choose 2 to ${LETTERS.length} runs with results`}
  >
    Compare
  </button>`;
}

function RenameForm({ row, onDone, onClose }) {
  const input = useRef(null);
  const [error, setError] = useState(null);
  useEffect(() => input.current.select(), []);
  const save = async (event) => {
    event.preventDefault();
    try {
      await ask("PATCH", `v1/jobs/${row.id}`, { json: { title: input.current.value.trim() } });
      announce("Renamed");
      onDone();
    } catch (problem) {
      setError(problem);
    }
  };
  return html`<form class="row" onSubmit=${save}>
    <label>
      Title
      <input
        ref=${input}
        size="40"
        maxlength="200"
        defaultValue=${row.name}
        aria-invalid=${error !== null || null}
      />
    </label>
    <button class="primary">Save</button>
    <${Button} isQuiet onClick=${onClose}>Not now<//>
    ${error && html`<p class="fault" role="alert">${error.message}</p>`}
  </form>`;
}

// One after the other; those that cannot be deleted are left. The first reason is returned.
async function removeAll(rows) {
  const errors = [];
  for (const row of rows)
    await ask("DELETE", `v1/jobs/${row.id}`, { query: { purge: 1 } }).catch((error) =>
      errors.push(error),
    );
  announce(`Deleted: ${count(rows.length - errors.length)}`);
  return errors[0] ?? null;
}

const chosenText = (shown, hidden) =>
  `${shown || "None"} chosen${hidden > 0 ? `, ${hidden} more hidden by the filter` : ""}`;

// The bar is there before something is chosen, so that the table does not move.
export function Actions({ rows, hidden, isAll, onAll, onNone, onDone }) {
  const [step, setStep] = useState(null); // "rename" or "delete", before it is done
  const [error, setError] = useState(null); // of the last deletion
  const isBusy = rows.some(isOpen);
  const isNone = rows.length === 0;
  const end = () => {
    setStep(null);
    onDone();
  };
  const close = () => setStep(null);
  const begin = (next) => {
    setError(null);
    setStep(next);
  };
  const removeChosen = async () => {
    setError(await removeAll(rows));
    end();
  };
  if (step === "rename" && rows.length === 1)
    return html`<${RenameForm} key=${rows[0].id} row=${rows[0]} onDone=${end} onClose=${close} />`;
  if (step === "delete" && !isNone)
    return html`<div class="row" role="status">
      <span>${`Delete ${count(rows.length)} for good, with results that no other run has?`}</span>
      <${Button} isPrimary onClick=${removeChosen}>Delete for good<//>
      <${Button} isQuiet onClick=${close}>Keep<//>
    </div>`;
  return html`<div class="row" role="group" aria-label="Chosen runs">
    <span class="quiet chosen-count">${chosenText(rows.length, hidden)}</span>
    <${CompareLink} rows=${rows} />
    <${Button} disabled=${rows.length !== 1} onClick=${() => begin("rename")}>Rename<//>
    <${Button} disabled=${isNone || isBusy} onClick=${() => begin("delete")}>Delete<//>
    ${!isAll && html`<${Button} isQuiet onClick=${onAll}>Choose all<//>`}
    ${rows.length + hidden > 0 && html`<${Button} isQuiet onClick=${onNone}>Choose none<//>`}
    ${error && html`<${Failure} error=${error} />`}
  </div>`;
}

export const STATES = {
  accepted: "Waiting",
  running: "Running",
  successful: "Done",
  failed: "Failed",
  dismissed: "Cancelled",
};
const TONES = { running: "warn", successful: "ok", failed: "bad" };

export const isOpen = ({ status }) => status === "accepted" || status === "running";

// With the progress of what goes on, where the job has it.
export const StateBadge = ({ job: { status, progress } }) =>
  html`<span class=${`badge ${TONES[status] ?? ""}`}>${STATES[status]}</span> ${
      status === "running" &&
      progress !== undefined &&
      html`<span class="progress">
        <progress max="100" value=${progress} aria-label="Progress"></progress>
        ${number(Math.floor(progress))} %
      </span>`
    }`;
