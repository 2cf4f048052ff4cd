// The view of each kind of study: its heading, and the component that shows it within a result's context.
export const KINDS = {
  compare: {
    title: "Contact models side by side",
    load: async () => (await import("./compare.js")).CompareStudy,
  },
  sensitivity: {
    title: "What each input changes",
    load: async () => (await import("./sensitivity.js")).SensitivityStudy,
  },
  tradeoff: {
    title: "Error against cost",
    load: async () => (await import("./tradeoff.js")).TradeoffStudy,
  },
  sweep: { title: "Sweep", load: async () => (await import("./sweep.js")).SweepStudy },
  ensemble: { title: "Ensemble", load: async () => (await import("./ensemble.js")).EnsembleStudy },
  optimize: {
    title: "The best values",
    load: async () => (await import("./optimize.js")).OptimizeStudy,
  },
  calibrate: {
    title: "Parameters fitted to a measurement",
    load: async () => (await import("./calibrate.js")).CalibrateStudy,
  },
  response: {
    title: "Response curve",
    load: async () => (await import("./response.js")).ResponseStudy,
  },
  fragility: {
    title: "Fragility",
    load: async () => (await import("./fragility.js")).FragilityStudy,
  },
};
