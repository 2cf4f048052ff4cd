// The same structure without its dampers: the motion that the damper is judged by.
import { bareScene, preview } from "../scene/preview.js";
import { useLoaded } from "../ui/hooks.js";
import { columnOf, timesOf } from "./series.js";

const MAX_POINTS = 20000;
const MAX_SAMPLES = 200000; // some 20 ms of CPU; a preview may take 50

// The displacement of one storey without dampers, as a preview that stores nothing: {time, column}; null where there
// is no damper or the run is too long for a preview.
export function useBare(result, channel) {
  return useLoaded(
    async (signal) => {
      if (result.scene.dampers.length === 0 || result.count > MAX_SAMPLES) return null;
      const bare = bareScene(result.scene, /_(\d+)$/.exec(channel)?.[1]);
      try {
        const { series } = await preview({ ...bare, points: MAX_POINTS }, signal);
        return { time: timesOf(series), column: columnOf(series, bare.channel) };
      } catch (error) {
        if (error.name === "AbortError") throw error;
        return null; // longer than a preview may take, or refused: the chart does without
      }
    },
    [result.id, channel],
  );
}
