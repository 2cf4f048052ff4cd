// Every page with something on it: addresses for test_pages.mjs and shots.mjs.
import { pace } from "./support.mjs";

// Makes what the pages show, in a daemon that has nothing yet: [{name, hash, wants}], `wants` being a text that the page says
// when it is there.
export async function pages(daemon) {
  const result = async (name, changes) => (await daemon.run(name, changes)).result;
  const sponge = await result("paper_free_sponge"), aluminium = await result("paper_free_aluminium");
  const samples = Array.from({ length: 501 }, (_, at) => 2 * Math.sin(at / 8) * Math.exp(-(((at - 250) / 90) ** 2)));
  await daemon.ask("POST", "/v1/records", { name: "shake", interval: 0.01, samples });
  await daemon.ask("POST", "/v1/materials", { slug: "felt", name: "Felt", restitution: 0.3, contact_time: 0.02, source: "a drop test" });
  const list = [
    { name: "scene", hash: "#/scene", wants: /Run/ },
    { name: "scene-frame", hash: "#/scene?example=frame_two_dampers", wants: /Run/ },
    { name: "runs", hash: "#/jobs", wants: /sponge/ },
    { name: "result", hash: `#/results/${sponge}`, wants: /impact/ },
    { name: "result-impulse", hash: `#/results/${await result("paper_free_sponge", { contact: { model: "impulse" } })}`, wants: /impact/ },
    { name: "result-frame", hash: `#/results/${await result("frame_two_dampers")}`, wants: /impact/ },
    { name: "report", hash: `#/results/${sponge}/report`, wants: /Inputs/ },
    { name: "compare", hash: `#/compare?a=${sponge}&b=${aluminium}`, wants: /force/ },
    { name: "compare-empty", hash: "#/compare", wants: /./ },
    { name: "materials", hash: "#/materials", wants: /Sponge/ },
    { name: "material", hash: "#/materials/sponge", wants: /Sponge/ },
    { name: "measure", hash: "#/materials/felt/measure", wants: /Felt/ },
    { name: "records", hash: "#/records", wants: /shake/ },
    { name: "record", hash: "#/records/shake", wants: /shake/ },
    { name: "shell", hash: "#/shell", wants: /curl/ },
    { name: "missing", hash: "#/nothing", wants: /no page/ },
  ];
  const tradeoff = { study: { kind: "tradeoff", solvers: ["exact", "rk4", "newmark"] } };
  const studies = [["sweep_clearance_buffer"], ["sweep_frequency"], ["compare_sponge"], ["sensitivity_sponge"], ["ensemble_random_sponge"],
    ["paper_free_sponge", tradeoff]];
  for (const [name, changes] of studies)
    list.push({ name: `study-${changes ? "tradeoff" : name}`, hash: `#/results/${await result(name, changes)}`, wants: /./ });
  const failing = [{ pointer: "/dampers/0/clearance", values: [0.02, 0.01, 0.02] }, { pointer: "/dampers/0/position", from: 0, to: 0.006, count: 3000 }];
  const { id } = await daemon.ask("POST", "/v1/jobs", { ...(await daemon.example("paper_free_sponge")), study: { kind: "sweep", axes: failing } });
  list.push({ name: "run-failed", hash: `#/jobs/${id}`, wants: /Failed/ });
  return list;
}

// Goes to an address, or does what leads there, and waits until nothing is on its way: neither an answer nor a text that says so.
export async function settle(page, address, { wants }) {
  const open = new Set();
  const begin = (request) => open.add(request), end = (request) => open.delete(request);
  page.on("request", begin);
  page.on("requestfinished", end);
  page.on("requestfailed", end);
  await (typeof address === "string" ? page.goto(address) : address());
  const until = Date.now() + 30000 * pace.slow;
  for (let quiet = 0; quiet < 5; ) {
    const text = await page.locator("main").innerText().catch(() => "");
    const isCalm = open.size === 0 && wants.test(text) && !/Loading …|Wait …/.test(text) && (await page.locator("main h1").count()) > 0;
    quiet = isCalm ? quiet + 1 : 0;
    if (Date.now() > until) throw new Error(`${page.url()} does not come to rest: ${open.size} answers are awaited; it says ${text.slice(0, 300)}`);
    await new Promise((resolve) => setTimeout(resolve, 40));
  }
  page.off("request", begin);
  page.off("requestfinished", end);
  page.off("requestfailed", end);
}
