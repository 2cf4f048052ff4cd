// The animation to take along: the frame as PNG, the window as a film, whose progress is shown and which can be cancelled.
import { html, useEffect, useRef, useState } from "../ui/preact.js";
import { MAX_SECONDS, canRecord, saveFilm, saveFrame } from "../scene/film.js";
import { announce } from "../ui/announce.js";
import { Failure, IconButton } from "../ui/controls.js";
import { number } from "../units.js";

const DOUBLE_CLICK = 700; // ms

// `frame()` and `frameAt(t)` are {state, trail, text} or null; `pace` is seconds on the screen for one of the motion.
export function FilmTools({ scene, frame, frameAt, window, t, pace, signal }) {
  const [progress, setProgress] = useState(null);
  const [error, setError] = useState(null);
  const stop = useRef(null);
  const began = useRef(0);
  useEffect(() => {
    const cancel = () => stop.current?.abort();
    signal.addEventListener("abort", cancel);
    return cancel;
  }, []);
  const savePng = async () => {
    const now = frame();
    if (now) await saveFrame(scene, now, "motion").catch(setError);
  };
  // The window in view, or as much from the instant on as a film may have.
  const whole = (window.to - window.from) * pace;
  const start = whole > MAX_SECONDS ? Math.min(t, window.to - MAX_SECONDS / pace) : window.from;
  const seconds = Math.min(MAX_SECONDS, whole);
  const film = async () => {
    stop.current = new AbortController();
    began.current = performance.now();
    setError(null);
    setProgress(0);
    try {
      await saveFilm(scene, {
        seconds,
        frameAt: (second) => frameAt(Math.min(window.to, start + second / pace)),
        name: "motion",
        onProgress: setProgress,
        signal: stop.current.signal,
      });
      announce(stop.current.signal.aborted ? "Cancelled" : "The film is saved");
    } catch (problem) {
      setError(problem);
    }
    setProgress(null);
  };
  // One button for both, so that it keeps the focus; the second click of a double one does not cancel.
  const isFilming = progress !== null;
  const press = () => {
    if (!isFilming) film();
    else if (performance.now() - began.current > DOUBLE_CLICK) stop.current.abort();
  };
  const label = isFilming ? "Cancel the film" : `Save as WebM: a film of ${number(seconds, 3)} s`;
  return html`<div class="film-tools">
    <div>
      ${
        isFilming
          ? html`<progress max="1" value=${progress} aria-label="Film"></progress>
              <span>${`${number(progress * seconds, 2)} of ${number(seconds, 3)} s`}</span>`
          : html`<${IconButton} label="Save the frame as PNG" onClick=${savePng}>PNG<//>`
      }
    </div>
    ${
      canRecord() &&
      html`<${IconButton} label=${label} onClick=${press}>${isFilming ? "Cancel" : "WebM"}<//>`
    }
    ${error && html`<${Failure} error=${error} />`}
  </div>`;
}
