// By what an answer's accuracy is asked for and told. Not how it is measured: that is
// simulation/compare.h. Used by solve/ (what is asked), plan/ (what is told) and all behind them.
#ifndef CORE_RESULT_METRIC_H
#define CORE_RESULT_METRIC_H

typedef enum Metric {
    METRIC_DISPLACEMENT,
    METRIC_MEAN_ACCELERATION,
    METRIC_PEAK_FORCE,
    METRIC_IMPACTS,
    METRIC_PSD,
    METRIC_RMS_DISPLACEMENT,
    METRICS
} Metric;

extern const char *const metric_names[]; // NULL-terminated
extern const char *const metric_units[]; // to stand behind a number: "", " dB"

#endif
