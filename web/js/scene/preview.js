// What a scene does while it is edited: runs that the service keeps nothing of, one at a time, always the newest scene.
import { check, post } from "../api.js";
import { timesOf } from "../result/series.js";
import { channelNamer, storeyCount } from "./channels.js";

const MAX_COST = 0.05; // s of processor time that a preview may take
const LARGE = 20; // storeys: such scenes are asked what they cost before they are run

export const isTooLong = ({ cost }) => cost.cpu_seconds > MAX_COST;
export const tooLong = () => new Error("This run is too long for a preview; Run shows it.");

// A run that the service keeps nothing of.
export async function preview({ scene, points }, signal) {
  if (storeyCount(scene) > LARGE && isTooLong(await check(scene))) throw tooLong();
  return post(`v1/preview?points=${points}`, scene, { signal });
}

// Keeps asking while scenes come by preview.ask(asked), an object {scene, points, …}; `show({asked, data, error})` is called after
// each answer. Stops with the signal.
export function makePreview(show, signal) {
  let wanted = null;
  let isBusy = false;
  async function run() {
    if (isBusy || wanted === null || signal.aborted) return;
    const asked = wanted;
    wanted = null;
    isBusy = true;
    try {
      show({ asked, data: await preview(asked, signal), error: null });
    } catch (error) {
      if (error.name !== "AbortError") show({ asked, data: null, error });
    }
    isBusy = false;
    run();
  }
  return {
    ask(next) {
      wanted = next;
      run();
    },
  };
}

// The scene as it is previewed: without a study, with the channels that are drawn.
export function previewScene({ study, title, labels, ...scene }) {
  const { dampers = [] } = scene;
  const damper = dampers[0];
  const nameOf = channelNamer(scene);
  const channels = [nameOf("displacement", damper?.storey ?? storeyCount(scene))];
  if (damper) channels.push(nameOf("damper_displacement", 1));
  return {
    scene: { ...scene, output: { channels, impacts: false } },
    channels,
    damper,
    name: dampers.length > 1 ? "Free mass 1" : "Free mass",
  };
}

// The same without dampers, with the motion of a storey: the exact solver does, whatever the scene asks for.
export function bareScene({ study, title, labels, contact, accuracy, ...rest }, storey) {
  const scene = { ...rest, dampers: [] };
  const usual = rest.dampers?.[0]?.storey ?? storeyCount(rest);
  const channel = channelNamer(scene)("displacement", storey ?? usual);
  return { scene: { ...scene, output: { channels: [channel], impacts: false } }, channel };
}

// The samples of a channel as a chart takes them; of buckets the two ends, one after the other, so that no peak is lost.
export function samplesOf({ series }, channel) {
  const { start, count, bucket = 1, sample_rate: rate } = series;
  const { values, min, max } = series.channels[channel];
  const width = bucket / rate;
  if (values || bucket === 1) return { x: timesOf(series), y: values ?? min };
  const x = new Float64Array(2 * count);
  const y = new Float64Array(2 * count);
  for (let k = 0; k < count; k++) {
    // The order within a bucket is not known: that which goes on from the bucket before.
    const isUp = k === 0 || Math.abs(min[k] - y[2 * k - 1]) <= Math.abs(max[k] - y[2 * k - 1]);
    x[2 * k] = start + (k + 0.25) * width;
    x[2 * k + 1] = start + (k + 0.75) * width;
    y[2 * k] = isUp ? min[k] : max[k];
    y[2 * k + 1] = isUp ? max[k] : min[k];
  }
  return { x, y };
}
