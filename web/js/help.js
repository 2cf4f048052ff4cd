// Headings that have a "?" beside them, and the places of the guide that it leads to.
export const places = {
  Scene: "tutorial", Runs: "studies#progress-and-cancel", Compare: "concepts#channels", Materials: "materials",
  "Ground motions": "ground-motions", Structure: "scene#structure-kinds", Dampers: "scene#dampers-members",
  Contact: "scene#contact-kinds", Excitation: "scene#excitation-kinds", Duration: "scene#accuracy-kinds",
  Output: "scene#output-members", Study: "studies#kinds", Estimate: "studies#cost-and-limits",
  Summary: "concepts#summary", "Motion over time": "concepts#channels", Impacts: "concepts#impacts",
  Spectrum: "scene#output-psd", Energy: "concepts#energy", "How it was computed": "concepts#error-estimate",
  "Take it along": "scripting#formats", "What is known": "concepts#identification", "Review and change": "materials#revisions",
  "What was read": "drop-tests#what-to-measure", "Upload one": "ground-motions#files",
};
