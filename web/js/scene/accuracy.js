// How exact a run is to be and what that costs: fields, and a slider over what a study measured on this scene.
import { link } from "../address.js";
import { follow, get, remove, submit } from "../api.js";
import { useDraft, useNews } from "../form/draft.js";
import { Form } from "../form/form.js";
import { Failure } from "../ui/controls.js";
import { html, useRef, useState } from "../ui/preact.js";
import { number, quantity } from "../units.js";

const OTHERS = ["contact_model", "sample_rate", "duration", "segment"]; // change more than the accuracy
const tidy = (_, value) =>
  typeof value === "number" ? Number(value.toPrecision(12)) : (value ?? undefined);
const sentenceOf = ({ name, error, cost, isBest }) =>
  `${name}: wrong by ${number(error * 100, 2)} % of the peak, ${quantity(cost, "s", 2)}. ${
    isBest ? "" : "Beaten: another way errs less and costs less."
  }`;

// The ways measured, the largest error first.
const stopsOf = ({ points }) =>
  points
    .filter(
      (point) =>
        point.status === "measured" &&
        point.errors.displacement !== null &&
        OTHERS.every((name) => point[name] === null),
    )
    .map(
      ({ name, solver, step, tolerance, modes, cpu_minimum: cost, errors, is_best: isBest }) => ({
        name,
        cost,
        isBest,
        error: errors.displacement,
        setting: JSON.parse(JSON.stringify({ solver, step, tolerance, modes }, tidy)),
      }),
    )
    .sort((a, b) => b.error - a.error || b.cost - a.cost);

// The scene without what the slider changes.
const studyOf = (scene) => ({
  ...scene,
  accuracy: undefined,
  study: { kind: "tradeoff", repeats: 2 },
});

export function Accuracy({ pointer, schema, draft, options }) {
  const [measured, setMeasured] = useState(null); // {stops, asked, result}
  const [news, setNews] = useState(null);
  const [progress, setProgress] = useState(null);
  const job = useRef(null);
  const measure = async () => {
    const asked = JSON.stringify(studyOf(draft.scene));
    setNews("Every solver runs this scene …");
    setProgress(0);
    job.current = submit(JSON.parse(asked));
    try {
      const now = await follow(await job.current, ({ progress: part }) => setProgress(part ?? 0));
      const isDone = now.status === "successful";
      setNews(isDone ? null : (now.problem?.detail ?? "Cancelled: nothing was measured."));
      if (isDone) {
        const stops = stopsOf(await get(`v1/results/${now.result}/tradeoff.json`));
        setMeasured({ stops, asked, result: now.result });
      }
    } catch (error) {
      setNews(html`<${Failure} error=${error} />`);
    }
    job.current = null;
    setProgress(null);
  };
  const cancel = () => job.current.then(({ id }) => remove(`v1/jobs/${id}`)).catch(() => {}); // it may be done by now
  const isMeasuring = progress !== null;
  return html`<${Form}
      ...${{ ...options, widgets: [] }}
      schema=${schema}
      draft=${draft}
      pointer=${pointer}
      label=""
    />
    ${measured && measured.stops.length > 0 && html`<${Trade} measured=${measured} draft=${draft} pointer=${pointer} />`}
    <div class="row">
      <button type="button" onClick=${isMeasuring ? cancel : measure}>
        ${isMeasuring ? "Cancel" : "Measure the trade on this scene"}
      </button>
      ${isMeasuring && html`<progress max="100" value=${progress} aria-label="Measuring"></progress>`}
    </div>
    <div class="hint" role="status">${news}</div>`;
}

function Trade({ measured, draft, pointer }) {
  useNews(draft, (news) => news.pointer !== undefined);
  const value = useDraft(draft, pointer);
  const { stops, asked, result } = measured;
  const last = stops.length - 1;
  const chosen = JSON.stringify(value);
  const found = stops.findIndex(({ setting }) => JSON.stringify(setting) === chosen);
  const at = found < 0 ? last : found;
  const best = stops
    .filter(({ isBest }) => isBest)
    .map(({ name }) => name)
    .join("; ");
  const isOther = asked !== JSON.stringify(studyOf(draft.scene));
  const sentence = sentenceOf(stops[at]);
  const move = (event) => draft.set(pointer, stops[event.currentTarget.value].setting);
  return html`<div>
    <p>
      ${isOther ? "Measured on another scene." : `Worth having: ${best}. All others err and cost more.`}
    </p>
    <label class="trade"
      >From the crudest to the most exact
      <input
        type="range"
        min="0"
        max=${last}
        value=${at}
        aria-valuetext=${sentence}
        onInput=${move}
    /></label>
    <p>${sentence}</p>
    <a href=${link(`results/${result}`)}>The whole measurement</a>
  </div>`;
}
