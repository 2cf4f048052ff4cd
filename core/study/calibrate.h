// The study "calibrate": parameters of a scene fitted to measured motions, with their uncertainty
// and whether the motions determine them.
#ifndef CORE_STUDY_CALIBRATE_H
#define CORE_STUDY_CALIBRATE_H

#include "core/study/axis.h"

enum { CALIBRATE_PARAMETERS = 12, CALIBRATE_STARTS = 64 };
enum { MEASURED_CHANNELS = 16, MEASURED_SAMPLES = 1 << 17 };

// Sample i is at start + i interval.
typedef struct MeasuredChannel {
    char *channel;
    Reals samples;
    double interval, start; // [s]
    double deviation;       // standard deviation of the noise; NAN: unknown
} MeasuredChannel;

typedef struct MeasuredChannels {
    MeasuredChannel *at;
    size_t count;
} MeasuredChannels;

static inline double measured_time(const MeasuredChannel *measured, size_t sample) {
    return measured->start + (double)sample * measured->interval;
}
double measured_rms(const MeasuredChannel *measured); // about the mean, in the channel's unit

typedef enum CalibrateFit { CALIBRATE_TIME, CALIBRATE_PSD } CalibrateFit;
extern const char *const calibrate_fit_names[];

// The request.
typedef struct CalibrateStudy {
    Variant variant;
    StudyAxes parameters; // ranges
    MeasuredChannels measured;
    int fit;          // CalibrateFit
    double max_shift; // [s]
    uint64_t starts, search_seed;
    StudyNames names;
} CalibrateStudy;

typedef enum CalibrateVerdict {
    CALIBRATE_EXPLAINED,
    CALIBRATE_NOT_EXPLAINED,
    CALIBRATE_NOT_IDENTIFIABLE
} CalibrateVerdict;
extern const char *const calibrate_verdict_names[];

// A fitted parameter. NAN and empty: unknown.
typedef struct CalibratedParameter {
    StudyMember member;
    char *unit;
    double value, standard_error; // in `unit`, as the next
    Reals interval_95;
    int identifiable; // 0, 1 or CHOICE_ABSENT
} CalibratedParameter;

typedef struct CalibratedParameters {
    CalibratedParameter *at;
    size_t count;
} CalibratedParameters;

// Difference of the fit from one measured channel.
typedef struct CalibrationResidual {
    char *channel, *unit;     // "dB" of spectra
    double rms, measured_rms; // in `unit`, as the next
    double deviation;         // of the noise, given or estimated
    uint64_t samples;         // compared
} CalibrationResidual;

typedef struct CalibrationResiduals {
    CalibrationResidual *at;
    size_t count;
} CalibrationResiduals;

// One channel for a chart, thinned.
typedef struct CalibrationMotion {
    char *channel, *unit;
    bool is_spectrum;
    Reals at; // times [s] or frequencies [Hz]
    Reals measured, fitted;
} CalibrationMotion;

typedef struct CalibrationMotions {
    CalibrationMotion *at;
    size_t count;
} CalibrationMotions;

// An accepted step of the search.
typedef struct CalibrationStep {
    uint64_t index, start; // the number of its start
    double until;          // end of the part that is fitted [s]
    Reals values;
    double shift, cost; // [s], weighted sum of squared residuals
} CalibrationStep;

typedef struct CalibrationSteps {
    CalibrationStep *at;
    size_t count;
} CalibrationSteps;

// The answer.
typedef struct Calibration {
    Variant variant;
    StudyRuns made;
    int fit; // CalibrateFit that was used
    CalibratedParameters parameters;
    Rows correlation;
    double shift, shift_error; // [s]
    CalibrationResiduals residuals;
    double chi_square; // of the channels with a given deviation
    uint64_t freedom;  // its degrees of freedom
    int verdict;       // CalibrateVerdict
    char *detail;
    CalibrationMotions motions;
    CalibrationSteps history;
} Calibration;

#endif
