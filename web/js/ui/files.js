// Files that are saved: those that the page makes, those of the service; pictures from SVG.
import { address, ask, token } from "../api.js";

export const RATIO = 2; // pixels of a picture for one of the page

const saveLink = (href, name) =>
  Object.assign(document.createElement("a"), { href, download: name }).click();

export function saveBlob(blob, name) {
  const url = URL.createObjectURL(blob);
  saveLink(url, name);
  setTimeout(() => URL.revokeObjectURL(url), 60000);
}

// A file of the service. With a token it is fetched first, since a link cannot carry one.
export async function save(path, name) {
  if (!token()) saveLink(address(path), name);
  else saveBlob(await (await ask("GET", path, { signal: null })).blob(), name);
}

// "Peak force, 3 N" as "peak-force-3-n".
export const fileName = (title) =>
  title
    .toLowerCase()
    .replace(/[^a-z0-9]+/g, "-")
    .replace(/^-|-$/g, "") || "chart";

const SVG = "http://www.w3.org/2000/svg";
const PAINT = [
  "fill",
  "fill-opacity",
  "stroke",
  "stroke-width",
  "stroke-dasharray",
  "stroke-linecap",
  "stroke-linejoin",
  "stroke-opacity",
  "opacity",
  "paint-order",
  "font-size",
  "font-weight",
  "text-anchor",
];

// Colours of style.css are mixed for the screen; "color(srgb r g b / a)" is not known outside of browsers.
function plainColor(text) {
  const parts = /^color\(srgb ([\d.e-]+) ([\d.e-]+) ([\d.e-]+)(?: \/ ([\d.]+))?\)$/.exec(text);
  if (!parts) return text;
  const [red, green, blue] = parts.slice(1, 4).map((part) => Math.round(Number(part) * 255));
  return `rgba(${red}, ${green}, ${blue}, ${parts[4] ?? 1})`;
}

// A colour of the page's style sheet as this theme has it: a computed value, unlike the pair of light-dark().
export function themeColor(text) {
  const probe = document.body.appendChild(document.createElement("span"));
  probe.style.color = text;
  const found = plainColor(getComputedStyle(probe).color);
  probe.remove();
  return found;
}

// A copy of an SVG element that looks the same without the page's style sheet.
export function standaloneSvg(source) {
  const copy = source.cloneNode(true);
  const copies = copy.querySelectorAll("*");
  source.querySelectorAll("*").forEach((node, index) => {
    const style = getComputedStyle(node);
    for (const name of PAINT) {
      const value = style.getPropertyValue(name);
      if (value && value !== "normal") copies[index].setAttribute(name, plainColor(value));
    }
    copies[index].removeAttribute("class");
    copies[index].removeAttribute("style");
  });
  copy.setAttribute("xmlns", SVG);
  copy.setAttribute("font-family", "Inter, Helvetica, Arial, sans-serif");
  copy.removeAttribute("aria-hidden");
  return copy;
}

export const svgBlob = (svg) =>
  new Blob([new XMLSerializer().serializeToString(svg)], { type: "image/svg+xml" });

// An SVG element as an image that a canvas can draw.
export async function imageOf(svg) {
  const url = URL.createObjectURL(svgBlob(svg));
  try {
    const image = new Image();
    image.src = url;
    await image.decode();
    return image;
  } finally {
    URL.revokeObjectURL(url);
  }
}

export const canvasPng = (canvas) => new Promise((resolve) => canvas.toBlob(resolve, "image/png"));

// A picture of an SVG element with `width` and `height`, RATIO pixels per pixel.
export async function pngBlob(svg) {
  const [width, height] = ["width", "height"].map((name) => RATIO * Number(svg.getAttribute(name)));
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  canvas.getContext("2d").drawImage(await imageOf(svg), 0, 0, width, height);
  return canvasPng(canvas);
}
