// Files that the page makes: saving them, and pictures from SVG.
export function saveBlob(blob, name) {
  const url = URL.createObjectURL(blob);
  const anchor = Object.assign(document.createElement("a"), { href: url, download: name });
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(url), 60000);
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
export function plainColor(text) {
  const parts = /^color\(srgb ([\d.e-]+) ([\d.e-]+) ([\d.e-]+)(?: \/ ([\d.]+))?\)$/.exec(text);
  if (!parts) return text;
  const [red, green, blue] = parts.slice(1, 4).map((part) => Math.round(Number(part) * 255));
  return `rgba(${red}, ${green}, ${blue}, ${parts[4] ?? 1})`;
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

// Draws an SVG element with `width` and `height` on a canvas, `ratio` pixels per pixel.
async function drawSvg(svg, canvas, ratio = 2) {
  const [width, height] = ["width", "height"].map((name) => Number(svg.getAttribute(name)));
  const url = URL.createObjectURL(svgBlob(svg));
  try {
    const image = new Image();
    image.src = url;
    await image.decode(); // before the canvas is emptied: somebody may be recording it
    Object.assign(canvas, { width: width * ratio, height: height * ratio });
    canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  } finally {
    URL.revokeObjectURL(url);
  }
}

export async function pngBlob(svg, ratio = 2) {
  const canvas = document.createElement("canvas");
  await drawSvg(svg, canvas, ratio);
  return new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
}
