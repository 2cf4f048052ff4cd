// The width of an element in pixels, between bounds; what shows it is drawn again when it changes.
import { useLayoutEffect, useState } from "./preact.js";

export function useWidth(ref, least = 0, most = Infinity) {
  const [width, setWidth] = useState(0);
  useLayoutEffect(() => {
    const measure = () => {
      const room = ref.current?.clientWidth ?? 0;
      setWidth(Math.round(Math.min(most, Math.max(least, room))));
    };
    measure();
    const observer = new ResizeObserver(measure);
    observer.observe(ref.current);
    return () => observer.disconnect();
  }, []);
  return width;
}
