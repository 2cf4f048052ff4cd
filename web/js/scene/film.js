// Pictures of a motion to take along: a frame as PNG, a stretch of time as WebM. They are drawn aside, with all words.
import { saveBlob } from "../ui/files.js";
import { html, render } from "../ui/preact.js";
import { Picture } from "./drawing.js";
import { layoutOf } from "./layout.js";
import { framePng, record } from "./video.js";

const WIDTH = 640;
const TRAIL = 60; // pixels
export const LONGEST = 30; // s of a film

// A place outside of the window where frames are drawn: {svg(), draw(state, trail), remove()}.
function makeStage({ model, stroke, peak, hasTrail }) {
  const host = document.body.appendChild(document.createElement("div"));
  host.className = "drawing film";
  host.ariaHidden = "true";
  const layout = layoutOf(model, { width: WIDTH, stroke, trail: hasTrail ? TRAIL : 0 });
  return {
    svg: () => host.querySelector("svg"),
    draw: (state, trail) =>
      render(
        html`<${Picture}
          model=${model}
          layout=${layout}
          state=${state}
          peak=${peak}
          trail=${trail}
        />`,
        host,
      ),
    remove() {
      render(null, host);
      host.remove();
    },
  };
}

// `scene` is {model, stroke, peak, hasTrail}, `frame` {state, trail, text}.
export async function saveFrame(scene, frame, name) {
  const stage = makeStage(scene);
  try {
    stage.draw(frame.state, frame.trail);
    saveBlob(await framePng(stage.svg(), frame.text), `${name}.png`);
  } finally {
    stage.remove();
  }
}

// frameAt(second of the film) is such a frame, or null while its data are on their way.
export async function saveFilm(scene, { seconds, frameAt, name, onProgress, signal }) {
  const stage = makeStage(scene);
  const pose = (second) => {
    const frame = frameAt(second);
    if (frame === null) return null;
    stage.draw(frame.state, frame.trail);
    return frame.text;
  };
  try {
    stage.draw({ displacements: [] }, null);
    const blob = await record({ svg: stage.svg, seconds, pose, onProgress, signal });
    if (blob) saveBlob(blob, `${name}.webm`);
  } finally {
    stage.remove();
  }
}
