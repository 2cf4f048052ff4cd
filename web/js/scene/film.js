// Pictures of a motion to take along: a frame as PNG, a stretch of time as WebM. They are drawn aside, with all words.
import { canvasPng, imageOf, RATIO, saveBlob, standaloneSvg, themeColor } from "../ui/files.js";
import { html, render } from "../ui/preact.js";
import { Picture } from "./drawing.js";
import { layoutOf } from "./layout.js";

const WIDTH = 640;
const TRAIL = 60; // pixels
export const MAX_SECONDS = 30; // s of a film

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
    const { canvas, paint } = canvasFor(stage.svg());
    await paint(frame.text);
    saveBlob(await canvasPng(canvas), `${name}.png`);
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
    const blob = await record({ svg: stage.svg(), seconds, pose, onProgress, signal });
    if (blob) saveBlob(blob, `${name}.webm`);
  } finally {
    stage.remove();
  }
}

const RATE = 30; // frames per second

const TYPES = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];
const typeHere = () => TYPES.find((type) => globalThis.MediaRecorder?.isTypeSupported(type));
export const canRecord = () => Boolean(typeHere());

// A canvas of the drawing's size with room for a line of text, and what paints both as they are now: {canvas, paint(text)}.
function canvasFor(svg) {
  const [width, height] = [svg.width, svg.height].map(({ baseVal }) => baseVal.value * RATIO);
  const even = (pixels) => 2 * Math.ceil(pixels / 2); // as encoders want it
  const canvas = document.createElement("canvas");
  canvas.width = even(width);
  canvas.height = even(height + 28 * RATIO);
  const context = canvas.getContext("2d", { alpha: false });
  const [back, color] = ["var(--front)", "var(--text)"].map(themeColor);
  return {
    canvas,
    async paint(text) {
      const image = await imageOf(standaloneSvg(svg)); // before the canvas is emptied: it may be recorded
      context.fillStyle = back;
      context.fillRect(0, 0, canvas.width, canvas.height);
      context.drawImage(image, 0, 0, width, height);
      context.fillStyle = color;
      context.font = `${13 * RATIO}px Inter, sans-serif`;
      context.fillText(text, 8 * RATIO, canvas.height - 9 * RATIO);
    },
  };
}

// Records `seconds` of film: pose(second) puts the drawing there and returns the line of text, or null while it waits for
// data. The film as a blob; null once the signal has ended it.
async function record({ svg, seconds, pose, onProgress, signal }) {
  const { canvas, paint } = canvasFor(svg);
  const track = canvas.captureStream(RATE);
  const recorder = new MediaRecorder(track, { mimeType: typeHere(), videoBitsPerSecond: 6e6 });
  const chunks = [];
  recorder.ondataavailable = ({ data }) => data.size > 0 && chunks.push(data);
  const ended = new Promise((resolve) => recorder.addEventListener("stop", resolve));
  const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
  let waited = 0; // ms in which the film stood still
  const textAt = async (second) => {
    for (;;) {
      const text = pose(second);
      if (text !== null || signal.aborted) return text;
      if (recorder.state === "recording") recorder.pause();
      const began = performance.now();
      await wait(40);
      waited += performance.now() - began;
    }
  };
  await paint((await textAt(0)) ?? "");
  recorder.start(250);
  waited = 0;
  const began = performance.now();
  for (let second = 0; second < seconds && !signal.aborted;) {
    const text = await textAt(second);
    if (signal.aborted) break;
    if (recorder.state === "paused") recorder.resume();
    await paint(text);
    onProgress(second / seconds);
    const next = performance.now() - began - waited;
    await wait(Math.max(0, second * 1000 + 1000 / RATE - next));
    second = (performance.now() - began - waited) / 1000;
  }
  recorder.stop();
  for (const one of track.getTracks()) one.stop();
  await ended;
  return signal.aborted ? null : new Blob(chunks, { type: "video/webm" });
}
