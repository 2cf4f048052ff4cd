// One run while it goes on: how far it is, how to stop it, why it failed. What came out is the result's page.
import { link, swap } from "./address.js";
import { follow, get, remove } from "./api.js";
import { button, failure, faults, fill, h, notice, tell } from "./dom.js";
import { badge, isOpen, named } from "./jobs_page.js";
import { moment, number } from "./units.js";

const span = (seconds) => (seconds < 120 ? `${number(seconds, 2)} s` : `${Math.round(seconds / 60)} min`);

export const page = {
  title: () => "Run",
  async show(host, address, signal) {
    const id = address.path[1], path = `v1/jobs/${encodeURIComponent(id)}`;
    let job = await get(path), looks = 0, isLooking = false;
    const state = h("p"), told = h("div"), news = h("div"), table = h("div"), fail = faults(news);
    const bar = h("progress", { max: 100, "aria-label": "Progress" }), cancelButton = button("Cancel", cancel);
    const change = h("a.button", { href: link("scene", { job: id }) }, "Change the scene");
    fill(host, h("h1", null, named(job)), h("section.panel", null, state, bar, told, news,
      h("div.row", null, cancelButton, change)), table);

    // How long it has run, how long it will at this pace, which rows of a sweep are there.
    function draw(next) {
      job = next;
      const { status, progress, timing: { run } } = job, isGoing = isOpen(job);
      if (status === "successful" && !job.result_deleted) return swap(`results/${job.result}`);
      fill(state, badge(job), ` submitted ${moment(job.created)}. `, status === "accepted" ? "Waits for a free worker."
        : !isGoing ? `Ended after ${span(run)}.` : `${number(progress, 3)} % after ${span(run)}${
          progress > 1 ? `, about ${span((run * (100 - progress)) / progress)} left` : ""}.`);
      if (document.activeElement === cancelButton && !isGoing) change.focus();
      bar.value = progress;
      bar.hidden = cancelButton.hidden = !isGoing;
      fill(told, job.isLost && notice("warn", "The server does not answer; the run continues when it is back"),
        job.problem && failure(job.problem),
        job.result_deleted && notice("info", "Its result was deleted"));
      // Before, its scene alone runs.
      if (job.study === "sweep" && progress > 5 && !isLooking) look().catch(fail).finally(() => (isLooking = !isOpen(job)));
    }

    async function look() {
      isLooking = true;
      const { showSweep } = await import("./study/sweep.js");
      showSweep(table, { path: `${path}/table.json`, points: 0, jobId: id, again: (looks += 1) });
    }

    async function cancel() {
      cancelButton.disabled = true;
      try {
        draw(await remove(path));
        change.focus();
        tell("Cancelled");
      } catch (error) {
        cancelButton.disabled = false;
        fail(error);
      }
    }

    draw(job);
    if (isOpen(job)) follow(job, draw, signal).catch(fail);
  },
};
