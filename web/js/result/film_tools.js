// The animation to take along: the frame as PNG, the window as a film, whose progress is shown and which can be cancelled.
import { html, useEffect, useRef, useState } from "../ui/preact.js";
import { LONGEST, saveFilm, saveFrame } from "../scene/film.js";
import { canRecord } from "../scene/video.js";
import { announce } from "../ui/announce.js";
import { Failure, IconButton } from "../ui/controls.js";
import { number } from "../units.js";

// `frame()` and `frameAt(t)` are {state, trail, text} or null; `pace` is seconds on the screen for one of the motion.
export function FilmTools({ scene, frame, frameAt, window, t, pace, signal }) {
  const [progress, setProgress] = useState(null);
  const [error, setError] = useState(null);
  const stop = useRef(null);
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
  const start = whole > LONGEST ? Math.min(t, window.to - LONGEST / pace) : window.from;
  const seconds = Math.min(LONGEST, whole);
  const film = async () => {
    stop.current = new AbortController();
    setError(null);
    setProgress(0);
    try {
      const first = start;
      await saveFilm(scene, {
        seconds,
        frameAt: (second) => frameAt(Math.min(window.to, first + second / pace)),
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
  if (progress !== null)
    return html`<div class="film-tools">
      <progress max="1" value=${progress} aria-label="Film"></progress>
      <span>${`${number(progress * seconds, 2)} of ${number(seconds, 3)} s`}</span>
      <${IconButton} label="Cancel the film" onClick=${() => stop.current.abort()}>Cancel<//>
    </div>`;
  return html`<div class="film-tools">
    <${IconButton} label="Save the frame as PNG" onClick=${savePng}>PNG<//>
    ${
      canRecord() &&
      html`<${IconButton} label=${`Save as WebM: a film of ${number(seconds, 3)} s`} onClick=${film}
        >WebM<//
      >`
    }
    ${error && html`<${Failure} error=${error} />`}
  </div>`;
}
