// Frames of a video: an SVG on a canvas, over the page's colour.
import { drawSvg } from "../ui/files.js";

export async function paintSvg(svg, canvas) {
  const color = getComputedStyle(document.body).backgroundColor;
  const { width, height } = svg.viewBox.baseVal;
  svg.setAttribute("width", 2 * Math.round(width / 2)); // codecs want even sizes
  svg.setAttribute("height", 2 * Math.round(height / 2));
  const ground = document.createElementNS("http://www.w3.org/2000/svg", "rect");
  for (const [name, value] of Object.entries({ width: "100%", height: "100%", fill: color }))
    ground.setAttribute(name, value);
  svg.prepend(ground);
  await drawSvg(svg, canvas);
}
