// One run while it goes on: how far it is, how to stop it, why it failed. What came out is the result's page.
import { link, replace } from "../address.js";
import { follow, get, remove } from "../api.js";
import { announce } from "../ui/announce.js";
import { Button, Failure, Loaded, Notice } from "../ui/controls.js";
import { pageOf } from "../ui/page.js";
import { Sweep } from "../study/sweep.js";
import { html, useEffect, useRef, useState } from "../ui/preact.js";
import { useLoaded, useQuery } from "../ui/hooks.js";
import { moment, number, pretty } from "../units.js";
import { isOpen, StateBadge } from "./actions.js";

const timeText = (seconds) =>
  seconds < 120 ? `${number(seconds, 2)} s` : `${Math.round(seconds / 60)} min`;

// How long it has run, and how long it will at this pace.
function stateText({ status, progress, timing: { run } }) {
  if (status === "accepted") return "Waits for a free worker.";
  if (status !== "running") return `Ended after ${timeText(run)}.`;
  const left = progress > 1 ? `, about ${timeText((run * (100 - progress)) / progress)} left` : "";
  return `${number(progress, 3)} % after ${timeText(run)}${left}.`;
}

const clusterText = ({ chunks, done, running, queued, reason }) =>
  `On the cluster ${done} of ${chunks} parts are done, ${running} run and ${queued} wait` +
  `${reason ? `: ${reason}` : ""}.`;

// The rows of a sweep as they finish.
function SweepRows({ job, path }) {
  const address = useQuery();
  if (job.study !== "sweep" || !(job.progress > 5)) return null; // before, its scene alone runs
  return html`<${Sweep}
    path=${`${path}/table.json`}
    points=${0}
    jobId=${job.id}
    ...${address}
    again=${job.progress}
  />`;
}

function Run({ first, path }) {
  const [job, setJob] = useState(first);
  const [error, setError] = useState(null);
  const change = useRef(null);
  const isGoing = isOpen(job);
  useEffect(() => {
    if (isOpen(first)) follow(first, setJob).catch(setError);
  }, []);
  const isDone = job.status === "successful" && !job.result_deleted;
  useEffect(() => {
    if (isDone) replace(`results/${job.result}`);
  }, [isDone]);
  const cancel = async () => {
    setJob(await remove(path));
    change.current.focus();
    announce("Cancelled");
  };
  return html`<h1>${pretty(job.title ?? `A ${job.study ?? "run"} without a title`)}</h1>
    <section class="panel" aria-label="State">
      <p>
        <${StateBadge}
          job=${{ status: job.status }}
        />${` submitted ${moment(job.created)}. ${stateText(job)}`}
      </p>
      ${isGoing && html`<progress max="100" value=${job.progress} aria-label="Progress"></progress>`}
      ${job.cluster && html`<p>${clusterText(job.cluster)}</p>`}
      ${
        job.isLost &&
        html`<${Notice}
          kind="warn"
          title="The server does not answer; the run continues when it is back"
        />`
      }
      ${job.problem && html`<${Failure} error=${job.problem} />`}
      ${job.result_deleted && html`<${Notice} title="Its result was deleted" />`}
      ${error && html`<${Failure} error=${error} />`}
      <div class="row">
        ${isGoing && html`<${Button} onClick=${cancel}>Cancel<//>`}
        <a class="button" ref=${change} href=${link("scene", { job: job.id })}>Change the scene</a>
      </div>
    </section>
    <${SweepRows} job=${job} path=${path} />`;
}

function RunPage({ address: { path: parts } }) {
  const path = `v1/jobs/${encodeURIComponent(parts[1])}`;
  const loaded = useLoaded((signal) => get(path, null, signal), [path]);
  return html`<${Loaded} loaded=${loaded} heading="Run">
    ${(job) => html`<${Run} first=${job} path=${path} />`}
  <//>`;
}

export const page = pageOf(() => "Run", RunPage);
