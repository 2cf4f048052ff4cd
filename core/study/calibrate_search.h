// The search of a calibration, and its state, of which the answer is made.
#ifndef CORE_STUDY_CALIBRATE_SEARCH_H
#define CORE_STUDY_CALIBRATE_SEARCH_H

#include <math.h>

#include "core/math/least_squares.h"
#include "core/study/calibrate.h"

enum {
    CALIBRATE_VARIABLES = CALIBRATE_PARAMETERS + 1, // and the shift
    CALIBRATE_WINDOWS = 16, // of the record, each longer than the one before
    CALIBRATE_KEPT = 3,     // starts of the result of a window
};

static const double calibrate_quantile_999 = 3.09; // of the normal distribution, one-sided

// The part of a measured channel that is compared. The measured channel is borrowed.
typedef struct MeasuredTarget {
    const MeasuredChannel *measured;
    size_t first, samples; // the samples in it
    bool is_spectrum, is_logarithmic;
    WelchSettings welch; // of a spectrum
    double floor;        // density of the noise, of both spectra
    Reals values;     // compared: samples, or functions of densities from the second frequency on
    double deviation; // of each
    size_t place;     // of the first value among those of all channels
} MeasuredTarget;

typedef enum StartState {
    START_EVALUATE, // its residuals are wanted
    START_DERIVE,   // its derivatives
    START_TRY,      // a step
    START_DONE
} StartState;

typedef struct CalibrateStart {
    StartState state;
    size_t number;
    LeastSquares fit;
    double differences[CALIBRATE_VARIABLES]; // by which derivatives are taken
    double *residual;                        // weighted; NULL: only the cost is known
    size_t steps;
    double horizon; // of its run: trust horizon [s]
} CalibrateStart;

// A run of the batch.
typedef struct CalibrateRun {
    size_t start, column;
    double step; // of the variable `column`; 0: a point of its own
    bool is_second;
    double at[CALIBRATE_VARIABLES];
} CalibrateRun;

typedef enum CalibrateStage {
    STAGE_SCREEN,
    STAGE_FIT,
    STAGE_COVARIANCE,
    STAGE_EXPLORE
} CalibrateStage;

// Why a parameter is not identifiable.
typedef enum Undetermined {
    UNDETERMINED_NOT,
    UNDETERMINED_WIDE, // its interval is as wide as its range
    UNDETERMINED_RIVAL // another start fits as well
} Undetermined;

typedef struct CalibrateAssessment {
    double covariance[CALIBRATE_VARIABLES * CALIBRATE_VARIABLES]; // of residuals of unit variance
    double errors[CALIBRATE_VARIABLES];                           // standard errors, of the range
    Undetermined reasons[CALIBRATE_VARIABLES];
    double low[CALIBRATE_VARIABLES], high[CALIBRATE_VARIABLES]; // ends of the intervals
    double rivals[CALIBRATE_VARIABLES];
    bool is_ambiguous; // points that the linear model excludes fit as well
    bool is_determined;
} CalibrateAssessment;

// A point of the last window.
typedef struct CalibratePoint {
    double at[CALIBRATE_VARIABLES], cost;
} CalibratePoint;

typedef struct CalibratePoints {
    CalibratePoint *at;
    size_t count;
} CalibratePoints;

// The result of a window.
typedef struct CalibrateResult {
    NormalEquations equations; // of the best point
    double variance, starts[CALIBRATE_KEPT][CALIBRATE_VARIABLES];
    size_t start_count;
} CalibrateResult;

typedef struct CalibrateWork {
    StudyWork work;
    const CalibrateStudy *study;
    Calibration *answer;
    size_t parameters, variables;
    CalibrateStage stage;
    int fit; // CalibrateFit
    double ends[CALIBRATE_WINDOWS];
    size_t windows, window, explorations;
    double limit;    // end of the part that can be fitted [s]; 0: of the record
    bool is_beyond;  // because of its trust horizon
    bool is_chaotic; // spectra are fitted, and the motion cannot be predicted to its end
    bool is_over;
    Simulation base; // of the window
    MeasuredTarget *targets;
    double *deviations; // given or estimated, of each channel
    size_t rows;
    CalibrateStart *starts; // sorted by their cost after each stage
    size_t start_count;
    CalibrateRun *runs; // the batch
    size_t run_count, first;
    double *columns[CALIBRATE_VARIABLES]; // of the start whose derivatives are folded
    int sides;                            // that the last of them is the mean of
    uint64_t draws;
    CalibrateResult results[CALIBRATE_WINDOWS];
    CalibratePoints points; // of the window
    CalibrateAssessment assessment;
} CalibrateWork;

typedef struct CalibratePart {
    StudyPart part;
    const CalibrateRun *run;
    double *residual;
} CalibratePart;

static inline double calibrate_shift(const CalibrateWork *work, const double *at) {
    return work->variables > work->parameters
               ? (2 * at[work->parameters] - 1) * work->study->max_shift
               : 0;
}

// Of so many residuals. 1.94 is the sum of the squared correlations of neighbouring frequencies of
// a spectrum, for Hann's window.
static inline double calibrate_independent(const CalibrateWork *work, double residuals) {
    return work->fit == CALIBRATE_PSD ? residuals / 1.94 : residuals;
}

static inline double calibrate_density(const MeasuredTarget *target, double value) {
    return target->is_logarithmic ? exp(value) : target->floor * (1 + value * value) / 2;
}

static inline double calibrate_sum_squares(const double *values, size_t count) {
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += values[i] * values[i];
    return sum;
}

// The quantile of chi square from that of the normal distribution (Wilson and Hilferty 1931).
static inline double calibrate_chi_square(double freedom, double quantile) {
    const double variance = 2 / (9 * freedom);
    return freedom * pow(1 - variance + quantile * sqrt(variance), 3);
}

static inline bool calibrate_is_logarithmic(const StudyAxis *axis) {
    return axis->from > 0 && axis->to / axis->from >= 100;
}

// The value at u, which lies in [0, 1] but for the ends of intervals.
static inline double calibrate_value(const StudyAxis *axis, double u) {
    if (u == 0 || u == 1)
        return u == 0 ? axis->from : axis->to;
    return calibrate_is_logarithmic(axis) ? axis->from * pow(axis->to / axis->from, u)
                                          : axis->from + u * (axis->to - axis->from);
}

// The scene of the runs that end at `end` [s], with these measured channels alone.
Status calibrate_make_base(const MeasuredChannels *measured, const Simulation *simulation,
                           double end, Simulation *base);

// Runs that a search makes on average, in so many windows.
double calibrate_expect_runs(const CalibrateStudy *study, const Simulation *simulation,
                             double windows);

// The functions of the StudyKind of these names.
Status calibrate_begin(void *work, const StudyTools *tools, Problem *problem);
Status calibrate_scene(const void *work, size_t member, Simulation *scene, StudyPart *part,
                       Problem *problem);
Status calibrate_keep(const void *work, const Outcome *outcome, const StudyTools *tools,
                      StudyPart *part, Problem *problem);
Status calibrate_fold(void *work, size_t member, StudyPart *part);
void calibrate_clear_part(StudyPart *part);
void calibrate_free(void *work);

#endif
