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
    fill(host, h("h1", null, "Run"), "Loading …");
    let job = await get(path), heard = 0, rows = null, isLooking = false;
    const state = h("p"), time = h("p", { class: "quiet" }), told = h("div"), table = h("div");
    const bar = h("progress", { max: 100, "aria-label": "Progress" });
    const cancelButton = button("Cancel", cancel);
    const change = h("a", { class: "button", href: link("scene", { job: id }) }, "Change the scene");
    fill(host, h("h1", null, named(job)),
      h("section", { class: "panel" }, state, bar, time, told, h("div", { class: "row" }, cancelButton, change)), table);

    const fail = faults(told);

    function draw(news) {
      job = news;
      heard = performance.now();
      if (job.status === "successful" && !job.result_deleted) return swap(`results/${job.result}`);
      fill(state, badge(job), ` submitted ${moment(job.created)}`);
      const hadFocus = document.activeElement === cancelButton;
      bar.value = job.progress;
      bar.hidden = cancelButton.hidden = !isOpen(job);
      if (hadFocus && !isOpen(job)) change.focus();
      fill(told, job.isLost && notice("warn", "The service does not answer; the run goes on when it is back"),
        job.problem && failure(job.problem),
        job.result_deleted && notice("info", "Its result was deleted"));
      tick();
    }

    // Between the news too: how long it has run, how long it will at this pace, and which rows of a sweep are there.
    function tick() {
      const { run } = job.timing, since = isOpen(job) && !job.isLost ? (performance.now() - heard) / 1000 : 0;
      const left = job.progress < 1 ? 0 : (run * (100 - job.progress)) / job.progress - since;
      fill(time, job.status === "accepted" ? "Waits for a free worker." : !isOpen(job) ? `Ended after ${span(run)}.`
        : `${number(job.progress, 3)} % after ${span(run + since)}${left > 1 ? `, about ${span(left)} left` : ""}.`);
      if (job.study === "sweep" && job.progress > 5 && !isLooking) look().catch(fail); // up to there its scene alone runs
    }

    async function look() {
      isLooking = true;
      const { sweepView } = await import("./sweep_view.js");
      rows ??= await sweepView(table, `${path}/table.json`, id);
      await rows.refresh();
      isLooking = !isOpen(job);
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

    const timer = setInterval(tick, 1000);
    draw(job);
    if (isOpen(job)) follow(job, draw, signal).catch(fail);
    return { leave: () => clearInterval(timer) };
  },
};
