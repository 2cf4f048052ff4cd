// The same structure without its dampers: the motion that the damper is judged by.
import { preview } from "../scene/preview.js";
import { useLoaded } from "../ui/store.js";

const MAX_POINTS = 20000;
const MAX_SAMPLES = 200000; // some 20 ms of CPU; a preview may take 50

// The displacement of one storey without dampers, as a preview that stores nothing: {time, column, summary}; null where there
// is no damper or the run is too long for a preview.
export function useBare(result, channel) {
  return useLoaded(
    async (signal) => {
      const { scene } = result;
      if (scene.dampers.length === 0) return null;
      const number = /_(\d+)$/.exec(channel)?.[1];
      const isFrame = [scene.structure.masses ?? scene.structure.mass].flat().length > 1;
      const name = isFrame && number ? `displacement_${number}` : "displacement";
      if (result.count > MAX_SAMPLES) return null;
      const { study, contact, accuracy, ...rest } = scene; // without contacts the exact solver is right and fast
      const bare = { ...rest, dampers: [], output: { channels: [name], impacts: false } };
      try {
        const answer = await preview({ scene: bare, points: MAX_POINTS }, signal);
        const { start, count, bucket = 1, sample_rate: rate, channels } = answer.series;
        const { values, min: low, max: high } = channels[name];
        const time = Float64Array.from(
          { length: count },
          (_, k) => start + ((k + 0.5) * bucket - 0.5) / rate,
        );
        const column = bucket === 1 ? { values: values ?? low } : { low, high };
        return { time, column, summary: answer.summary };
      } catch (error) {
        if (error.name === "AbortError") throw error;
        return null; // longer than a preview may take, or refused: the chart does without
      }
    },
    [result.id, channel],
  );
}
