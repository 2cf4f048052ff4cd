// The state of a job in words and colours.
import { html } from "../ui/preact.js";
import { number } from "../units.js";

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
