// Videos that the browser records from a canvas, in real time.
const FRAMES = 30; // a second
const TYPES = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];

export const canRecord = () =>
  Boolean(globalThis.MediaRecorder && HTMLCanvasElement.prototype.captureStream);

// A WebM of `seconds`: paint(part) draws the frame at a part of it, from 0 to 1, on the canvas, and may take its time.
// onProgress(part) is called with each frame; once `signal` is aborted there is no video (an AbortError).
export async function recordVideo({ canvas, seconds, paint, onProgress, signal }) {
  const mimeType = TYPES.find((type) => MediaRecorder.isTypeSupported(type));
  await paint(0); // a stream of a canvas without a context is refused
  const recorder = new MediaRecorder(canvas.captureStream(FRAMES), {
    mimeType,
    videoBitsPerSecond: 4e6,
  });
  const chunks = [];
  recorder.ondataavailable = ({ data }) => chunks.push(data);
  const stopped = new Promise((resolve) => {
    recorder.onstop = resolve;
  });
  recorder.start();
  const begin = performance.now();
  try {
    for (let part = 0; part < 1;) {
      signal.throwIfAborted();
      await new Promise((resolve) => setTimeout(resolve, 1000 / FRAMES));
      part = Math.min(1, (performance.now() - begin) / (1000 * seconds));
      await paint(part);
      onProgress(part);
    }
  } finally {
    recorder.stop();
    await stopped;
  }
  return new Blob(chunks, { type: "video/webm" });
}
