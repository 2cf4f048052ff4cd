// The impacts in the window of time as rows, and one at full detail with the part that pulls: view.impact, its number from 1,
// else the hardest of the rows.
import { get } from "./api.js";
import { button, figures, fill, h, table } from "./dom.js";
import { plot } from "./plot.js";
import { figure } from "./plan_view.js";
import { share } from "./summary_view.js";
import { number, quantity } from "./units.js";

const MOST = 500; // rows: some 50 kB as transferred
const FIGURES = [["Approach", "approach_speed", "m/s"], ["Separation", "separation_speed", "m/s"], ["e", "restitution"],
  ["Contact time", "duration", "s"], ["Peak force", "peak_force", "N"], ["Impulse", "impulse", "N s"],
  ["Energy lost", "energy_lost", "J"]];

export const section = { title: "Impacts", show };

async function show(host, context) {
  const { ledger, path, result } = context, { count, resting } = await ledger.count(), total = count + resting;
  if (!ledger.isListed || total === 0) return host.append(`No impact is listed; there were ${number(count)}.`);
  const choose = (nth) => context.change({ impact: Math.min(total, Math.max(1, nth)) }, true);
  const field = h("input", { type: "number", min: 1, max: total, onchange: () => choose(field.value) });
  const current = () => Number(context.view.impact) || shown.number, step = (by) => () => choose(current() + by);
  const one = h("div"), all = h("div");
  const columns = [
    { label: "Impact", numeric: true, value: (row) => row.number, cell: ({ number: nth }) =>
      button(nth, () => (choose(nth), host.scrollIntoView()), { class: "quiet sort", "aria-label": `Show impact ${nth}` }) },
    { label: "Start", numeric: true, value: ({ start }) => start, cell: ({ start }) => quantity(start, "s", 7) },
    { label: "Damper, stop", value: ({ damper, side, kind }) => `${damper}, ${side}${kind === "resting" ? ", resting" : ""}` },
    ...FIGURES.map(figure)];

  let wanted, listed, shown;
  async function follow({ impact: nth }) {
    const { from, to } = context.window, key = [from, to, nth].join();
    if (key === wanted) return;
    wanted = key;
    const isAsked = nth >= 1 && nth <= total;
    field.value = isAsked ? Math.round(nth) : ""; // at once: what is typed from now on stays
    const { impacts, count: here } = await ledger.window(from, to, MOST), isCut = here > MOST;
    const [hardest] = impacts.toSorted((a, b) => (b.peak_force ?? b.impulse) - (a.peak_force ?? a.impulse));
    const impact = isAsked ? await ledger.at(nth) : hardest ?? await ledger.at(1);
    const isBlow = impact.kind === "impact" && result.plan.contact_model === "impulse";
    const force = isBlow ? null : await get(`${path}/impacts/${impact.number}/force.json`);
    if (key !== wanted) return;
    if (impacts !== listed) fill(all, table(`${number(here)} in this window of time${isCut ? `, here the first ${MOST}` : ""}`,
      columns, impacts, { sort: !isCut }));
    if (impact.number !== shown?.number) {
      const box = h("div.columns", null, !force && "An impulse takes no time and has no force.");
      fill(one, figures(columns.slice(1).map(({ label, value, cell = value }) => [label, cell(impact)])), box);
      if (force) charts(box, impact, force);
    }
    [listed, shown] = [impacts, impact];
    field.value ||= impact.number;
  }
  const see = () => ledger.at(current()).then((row) => {
    const { start, end, duration, number: nth } = row ?? shown, around = 4 * duration || 40 / result.sample_rate;
    context.change({ impact: nth, from: Math.max(0, start - around), to: (end ?? start) + around }, true);
  }, () => {}); // follow() tells it
  await follow(context.view);
  fill(host, h("div.row", null, button("← Previous", step(-1)), h("label", null, "Impact ", field), `of ${number(total)}`,
    button("Next →", step(1)), button("See it in the series", see)), one, all);
  return { follow };
}

function charts(host, { number: nth, start, kind, energy_lost: lost }, { time, channels }) {
  const { contact_force: { values: N }, penetration: { values: deep } } = channels, at = time.values.map((t) => t - start);
  const push = Math.max(...N), pull = -Math.min(0, ...N), deepest = Math.max(...deep), turn = deep.indexOf(deepest);
  const pulling = at.at(-1) * (N.filter((value) => value < 0).length / N.length);
  const chart = (name, unit, summary, series) => plot(host.appendChild(h("div")), { title: `Impact ${nth}: force over ${name}`,
    summary, height: 260, x: { label: name, unit }, y: { label: "force, positive pushing", unit: "N" }, series });
  chart("time", "s", pull <= 1e-9 * push ? "The contact never pulls." : `For ${quantity(pulling, "s", 2)} the contact pulls, ` +
    `with up to ${quantity(pull, "N")}, ${share(pull / push)} of the push: a real buffer would let go there.`, [
    { label: "force", color: 1, x: at, y: N, width: 2 },
    { label: "pulls", color: 6, x: at, low: N.map((value) => Math.min(value, 0)), high: N.map(() => 0) }]);
  if (kind === "impact") chart("penetration", "m",
    `Up to ${quantity(deepest, "m")} deep; the branches enclose the energy lost, ${quantity(lost, "J")}.`, [
      { label: "pressing in", color: 1, x: deep.slice(0, turn + 1), y: N.slice(0, turn + 1) },
      { label: "coming back", color: 2, x: deep.slice(turn), y: N.slice(turn) }]);
}
