// The runs, newest first: what became of each, and a way to stop those that go on.
import { link, note, read } from "./address.js";
import { ask, remove } from "./api.js";
import { button, failure, fill, h, help, table, tell } from "./dom.js";
import { moment, quantity, title } from "./units.js";

const STATES = { accepted: "Waiting", running: "Running", successful: "Done", failed: "Failed", dismissed: "Cancelled" };
const COLOURS = { running: "warn", successful: "ok", failed: "bad" };
const KINDS = ["none", "compare", "sensitivity", "tradeoff", "sweep", "ensemble"];
const AGAIN_MS = 1500; // between looks at what goes on

export const isOpen = (job) => job.status === "accepted" || job.status === "running";
export const badge = ({ status }) => h("span", { class: `badge ${COLOURS[status] ?? ""}` }, STATES[status]);
export const named = (job) => job.title ?? `A ${job.study ?? "run"} without a title`;

export const page = {
  title: () => "Runs",
  show(host) {
    let last = "", isAgain = false;
    const list = h("div.runs", null, "Loading …");
    const choice = (name, values) => h("select", { name }, h("option", { value: "" }, "All"),
      values.map((value) => h("option", { value }, STATES[value] ?? title(value))));
    const search = h("form.row", { role: "search", oninput: choose, onsubmit: (event) => event.preventDefault() },
      h("label", null, "Title or label ", h("input", { name: "q", type: "search" })),
      h("label", null, "State ", choice("status", Object.keys(STATES))), h("label", null, "Study ", choice("kind", KINDS)));
    fill(host, help("Runs"), h("h1", null, "Runs"), search, list);

    function choose() {
      note({ ...Object.fromEntries(new FormData(search)), before: null });
      load();
    }

    async function load() {
      const asked = location.hash, { query } = read();
      try {
        const response = await ask("GET", "v1/jobs", { query }), text = await response.text();
        if (asked !== location.hash || text === last) return;
        last = text;
        draw(JSON.parse(text).jobs, query, /[?&]before=([^&>]+).*rel="next"/.exec(response.headers.get("Link"))?.[1]);
      } catch (error) {
        if (asked === location.hash) fill(list, failure(error));
        last = "";
        isAgain = true;
      }
    }

    function draw(jobs, query, before) {
      const focused = list.contains(document.activeElement) ? document.activeElement.id : "";
      isAgain = jobs.some(isOpen);
      fill(list, jobs.length > 0 ? table("Runs, newest first", columns, jobs)
        : h("p", null, "There is no such run. ", h("a", { href: "#/scene" }, "Begin with a scene")),
      before && h("a", { href: link("jobs", { ...query, before }) }, "Older runs"));
      if (focused) (document.getElementById(focused) ?? list.querySelector("a"))?.focus({ preventScroll: true });
    }

    function cancel(job, pressed) {
      document.getElementById(job.id).focus();
      pressed.disabled = true;
      remove(`v1/jobs/${job.id}`).then(() => (tell(`Cancelled: ${named(job)}`), load()), (error) => pressed.after(failure(error)));
    }
    const target = (job) => (job.result && !job.result_deleted ? `results/${job.result}` : `jobs/${job.id}`);
    const columns = [
      { label: "Run", cell: (job) => [h("a", { id: job.id, href: link(target(job)) }, named(job)), " ",
        job.labels && h("span.hint", null, job.labels.join(", "), " "),
        isOpen(job) && button("Cancel", ({ target }) => cancel(job, target),
          { id: `stop-${job.id}`, "aria-label": `Cancel ${named(job)}` })] },
      { label: "State", cell: badge },
      { label: "Study", cell: (job) => job.study && title(job.study) },
      { label: "Submitted", cell: (job) => moment(job.created) },
      { label: "Took", numeric: true, cell: (job) => (job.cached ? "known already" : isOpen(job) ? `${Math.floor(job.progress)} %`
        : quantity(job.timing.run, "s", 2)) },
    ];

    function follow() {
      const { query } = read();
      for (const field of search) field.value = query[field.name] ?? "";
      load();
    }
    follow();
    const timer = setInterval(() => isAgain && !document.hidden && load(), AGAIN_MS);
    return { change: follow, leave: () => clearInterval(timer) };
  },
};
