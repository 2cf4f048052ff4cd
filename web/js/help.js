// Headings that have a "?" beside them, and the places of the guide that it leads to.
export const places = {
  Scene: "dashboard#describe-a-scene",
  Runs: "studies#progress-and-cancel",
  Compare: "dashboard#compare",
  Materials: "materials",
  "Ground motions": "ground-motions",
  Structure: "scene#structure-kinds",
  Dampers: "scene#dampers-members",
  Contact: "scene#contact-kinds",
  Excitation: "scene#excitation-kinds",
  Duration: "scene#accuracy-kinds",
  Output: "scene#output-members",
  Study: "studies#kinds",
  Estimate: "studies#cost-and-limits",
  Summary: "concepts#summary",
  "Motion over time": "concepts#channels",
  Impacts: "concepts#impacts",
  Spectrum: "scene#output-psd",
  Energy: "concepts#energy",
  "How it was computed": "concepts#error-estimate",
  "Take it along": "scripting#formats",
  "What is known": "concepts#identification",
  "Review and change": "materials#revisions",
  "What was read": "drop-tests#what-to-measure",
  "Upload one": "ground-motions#files",
  Derived: "materials#which-masses-e-and-t_c-belong-to",
  Revisions: "materials#revisions",
  "Response spectrum": "ground-motions#response-spectra",
  Proposal: "drop-tests#make-a-revision-of-it",
  "Add and exchange": "materials#share-and-exchange",
};

// What a "?" says in one sentence before it leads to the guide: name -> [sentence, place].
export const hints = {
  "Restitution e": [
    "The speed after the contact divided by the speed before it: 1 loses no energy, 0 loses all.",
    "concepts#impacts",
  ],
  "Error estimate": [
    "The largest error of the displacement over the whole run, as a share of its largest value.",
    "concepts#error-estimate",
  ],
  "Trust horizon": [
    "Up to this time the motion is right to a millionth of its largest value; later only statistics and spectra hold.",
    "concepts#trust-horizon",
  ],
  "Mean acceleration": [
    "The change of velocity over each sample interval, divided by it: it contains every impulse, as an accelerometer does.",
    "concepts#channels",
  ],
};
