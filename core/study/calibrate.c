// Weighted least squares from several starts. All numbers of the search lie in [0, 1]: parameter i
// is from + u_i (to - from), or from (to / from)^(u_i) where the range spans two decades.
//
// The sum of squared differences from an impacting motion has many local minima, most of them made
// by the late part of the record, where small errors have grown. The search fits the first eighth
// of the record, then a quarter, a half and the whole, each from the result of the one before:
//
//     screen      points that fill the space, on the first eighth; the best become starts
//     fit         each start by Levenberg and Marquardt's method, all side by side
//     covariance  derivatives at the best point by central differences
//
// Members are runs in batches: of each start that is not done the derivatives by all parameters, or
// one step. The next batch is made when the last of this one is folded.
//
// Where errors grow so fast that the motion cannot be predicted to the end of the record, its first
// part is fitted; where this does not determine all parameters, spectra are.
#include "core/study/calibrate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/philox.h"
#include "core/math/least_squares.h"
#include "core/math/student_t.h"
#include "core/study/sampling.h"

enum {
    VARIABLES = CALIBRATE_PARAMETERS + 1, // and the shift
    SCREENED_FIRST = 32,                  // points for each start in the first window
    SCREENED = 16,                        // and in later ones
    WINDOWS = 7,                          // of the record, each longer than the one before
    SAMPLES_MIN = 16,
    SPECTRUM_SAMPLES_MIN = 64,
    STEPS_FIRST = 15, // of a start in a window, tried
    STEPS_LAST = 60,
    REPEATS = 3, // of the last window, with new estimates of the noise
    RETRIES = 3, // of a window that fits worse than the one before
    KEPT_MIN = 3,
    REFINEMENTS = 3, // of differences
    EXPLORED = 96,   // points around the best fit
    EXPLORATIONS_MIN = 2,
    EXPLORATIONS = 6,
    IMPROVED = 5, // of them that are fitted
    HISTORY_MAX = 4096,
    MOTION_POINTS = 1000,
    LAGS = 20,
};

static const double confidence = 0.95;
static const double window_growth = 1.4142; // of the length of windows
static const double sensitive = 2.5,
                    rough = 4; // growth of the effect of a parameter from window to window
static const double difference_share = 0.5; // of the deviation of one parameter alone
static const double difference_first = 1e-5, difference_min = 1e-9, difference_max = 1e-4,
                    difference_chaos = 5e-2;
static const double difference_change = 3; // factor above which derivatives are made again
static const double one_sided = 4;         // ratio of squares
static const double damping_first = 1e-3, damping_max = 1e12;
// A decrease below this part of the variance of the noise ends a fit.
static const double tolerance_first = 1e-2, tolerance_last = 1e-4;
static const double scatter = 2, scatter_max = 0.5; // standard errors; of the range
static const double same_point = 1e-3;              // starts this close are one
static const double hopeless = 10;                  // times the least cost: dropped after a window
static const double predictable = 1 / 3.0; // of the trust horizon: errors have grown 2000 times
static const double enough = 0.2; // half width of an interval of the window before, of the range
static const double undetermined = 0.5; // half width of an interval, of the range
static const double rival = 0.25;       // of the range: a valley this far away that fits as well
static const double structured = 0.05;  // of the motion: rms of residuals that is not explained
static const double quantile_95 = 1.645, quantile_999 = 3.09; // one-sided, normal
static const double spectrum_misfit = 3;                      // of the expected rms
// Sum of the squared correlations of neighbouring frequencies, for Hann's window.
static const double correlated_bins = 1.94;

const char *const calibrate_fit_names[] = {"time", "psd", NULL};
const char *const calibrate_verdict_names[] = {"explained", "not_explained", "not_identifiable",
                                               NULL};

// clang-format off
static const Field calibrate_study_fields[] = {
    FIELD_LIST(CalibrateStudy, parameters, study_variable_fields, CALIBRATE_PARAMETERS, PRESENCE_REQUIRED, "numbers of the scene to be fitted, each within a range from ... to"),
    FIELD_LIST(CalibrateStudy, measured, measured_channel_fields, MEASURED_CHANNELS, PRESENCE_REQUIRED, "measured motions"),
    FIELD_CHOICE(CalibrateStudy, fit, calibrate_fit_names, CALIBRATE_TIME, "time: sample by sample; psd: spectra by Welch's method with the settings of output.psd"),
    FIELD_REAL(CalibrateStudy, max_shift, "s", AT_MIN(0), 0, "the measured times may be wrong by a common shift of at most this, which is fitted too"),
    FIELD_COUNT(CalibrateStudy, starts, NULL, WITHIN(1, CALIBRATE_STARTS), 8, "points from which the search starts"),
    FIELD_COUNT(CalibrateStudy, search_seed, NULL, WITHIN(0, 0x1p53 - 1), 1, "seed of these points"),
    FIELD_BASE(CalibrateStudy, names, study_names_fields),
    FIELD_END
};

const Field calibrated_parameter_fields[] = {
    FIELD_TEXT(CalibratedParameter, pointer, 0, PRESENCE_OPTIONAL, 0, "JSON Pointer to the member"),
    FIELD_TEXTS(CalibratedParameter, pointers, NULL, NULL, 0, PRESENCE_OPTIONAL, 0, "tied members, if there are several"),
    FIELD_TEXT(CalibratedParameter, unit, 0, PRESENCE_OPTIONAL, 0, "of its value"),
    FIELD_REAL(CalibratedParameter, value, NULL, ANY, OPTIONAL, "fitted"),
    FIELD_REAL(CalibratedParameter, standard_error, NULL, ANY, OPTIONAL, "standard deviation of the fitted value; unknown if it is not identifiable"),
    FIELD_REALS(CalibratedParameter, interval_95, NULL, ANY, 0, PRESENCE_OPTIONAL, "95 % confidence interval"),
    {.name = "identifiable", .kind = FIELD_KIND_FLAG, .offset = FIELD_AT(CalibratedParameter, is_identifiable, bool), .presence = PRESENCE_DEFAULT, .doc = "the measured motions determine it within its range"},
    FIELD_END
};

static const Field calibration_residual_fields[] = {
    FIELD_TEXT(CalibrationResidual, channel, 0, PRESENCE_OPTIONAL, 0, "channel"),
    FIELD_TEXT(CalibrationResidual, unit, 0, PRESENCE_OPTIONAL, 0, "of the numbers; dB of spectra"),
    {.name = "value", .kind = FIELD_KIND_REAL, .offset = FIELD_AT(CalibrationResidual, rms, double), .range = ANY, .presence = PRESENCE_OPTIONAL, .doc = "rms of the differences between fit and measurement"},
    FIELD_REAL(CalibrationResidual, measured_rms, NULL, ANY, OPTIONAL, "of the measured motion about its mean"),
    FIELD_REAL(CalibrationResidual, deviation, NULL, ANY, OPTIONAL, "standard deviation of the noise, given or estimated"),
    FIELD_COUNT(CalibrationResidual, samples, NULL, AT_MIN(0), 0, "samples compared"),
    FIELD_END
};

static const Field calibration_motion_fields[] = {
    FIELD_TEXT(CalibrationMotion, channel, 0, PRESENCE_OPTIONAL, 0, "channel"),
    FIELD_TEXT(CalibrationMotion, unit, 0, PRESENCE_OPTIONAL, 0, "of the values"),
    FIELD_FLAG(CalibrationMotion, is_spectrum, false, "of a spectrum: at frequencies [Hz], else at times [s]"),
    FIELD_REALS(CalibrationMotion, at, NULL, ANY, 0, PRESENCE_OPTIONAL, "measured times, not shifted, or frequencies"),
    FIELD_REALS(CalibrationMotion, measured, NULL, ANY, 0, PRESENCE_OPTIONAL, "measured values"),
    FIELD_REALS(CalibrationMotion, fitted, NULL, ANY, 0, PRESENCE_OPTIONAL, "values of the fitted scene"),
    FIELD_END
};

static const Field calibration_step_fields[] = {
    FIELD_COUNT(CalibrationStep, index, NULL, AT_MIN(0), 0, "number of the step"),
    FIELD_COUNT(CalibrationStep, start, NULL, AT_MIN(0), 0, "number of its start"),
    FIELD_REAL(CalibrationStep, until, "s", ANY, OPTIONAL, "end of the part of the record that was fitted"),
    FIELD_REALS(CalibrationStep, values, NULL, ANY, 0, PRESENCE_OPTIONAL, "of the parameters"),
    FIELD_REAL(CalibrationStep, shift, "s", ANY, OPTIONAL, "of the measured times"),
    FIELD_REAL(CalibrationStep, cost, NULL, ANY, OPTIONAL, "weighted sum of squared differences"),
    FIELD_END
};

static const Field calibration_failure_fields[] = {
    FIELD_TEXT(StudyFailure, reason, 0, PRESENCE_OPTIONAL, 0, "reason"),
    FIELD_COUNT(StudyFailure, count, NULL, AT_MIN(1), 0, "runs that failed for this reason"),
    {.name = "first_run", .kind = FIELD_KIND_COUNT, .offset = FIELD_AT(StudyFailure, first, uint64_t), .range = AT_MIN(0), .presence = PRESENCE_OPTIONAL, .doc = "the first of them"},
    FIELD_TEXT(StudyFailure, detail, 0, PRESENCE_OPTIONAL, 0, "reason of the first of them"),
    FIELD_END
};

static const Field calibration_fields[] = {
    FIELD_COUNT(Calibration, runs, NULL, AT_MIN(0), 0, "runs made"),
    FIELD_COUNT(Calibration, failed, NULL, AT_MIN(0), 0, "runs that failed"),
    FIELD_CHOICE(Calibration, fit, calibrate_fit_names, OPTIONAL, "what was fitted in the end"),
    FIELD_LIST(Calibration, parameters, calibrated_parameter_fields, 0, PRESENCE_DEFAULT, "fitted parameters, in the order of the request"),
    FIELD_ROWS(Calibration, correlation, NULL, ANY, 0, PRESENCE_OPTIONAL, "correlation of the fitted values, in that order"),
    FIELD_REAL(Calibration, shift, "s", ANY, OPTIONAL, "by which the measured times are moved to later times"),
    FIELD_REAL(Calibration, shift_error, "s", ANY, OPTIONAL, "standard error of the shift"),
    {.name = "residual_rms", .kind = FIELD_KIND_LIST, .offset = FIELD_LIST_AT(Calibration, residuals), .fields = calibration_residual_fields, .size = sizeof(CalibrationResidual), .presence = PRESENCE_DEFAULT, .doc = "differences between fit and measurement, channel by channel"},
    FIELD_REAL(Calibration, chi_square, NULL, ANY, OPTIONAL, "sum of squared differences over the squared given deviations; unknown without them"),
    FIELD_COUNT(Calibration, freedom, NULL, AT_MIN(0), OPTIONAL, "its degrees of freedom"),
    FIELD_CHOICE(Calibration, verdict, calibrate_verdict_names, OPTIONAL, "whether the fitted scene explains the measured motions, and these determine all parameters"),
    FIELD_TEXT(Calibration, detail, 0, PRESENCE_OPTIONAL, 0, "the verdict in words"),
    FIELD_LIST(Calibration, motions, calibration_motion_fields, 0, PRESENCE_DEFAULT, "measured and fitted motions, thinned"),
    FIELD_LIST(Calibration, history, calibration_step_fields, 0, PRESENCE_DEFAULT, "steps of the search"),
    FIELD_LIST(Calibration, failures, calibration_failure_fields, 0, PRESENCE_DEFAULT, "runs that failed, by their reason"),
    FIELD_LIST(Calibration, warnings, warning_fields, 0, PRESENCE_DEFAULT, "doubts"),
    FIELD_END
};
// clang-format on

static bool calibrate_is_logarithmic(const StudyAxis *axis) {
    return axis->from > 0 && axis->to / axis->from >= 100;
}

static double calibrate_value(const StudyAxis *axis, double u) {
    if (u <= 0 || u >= 1)
        return u <= 0 ? axis->from : axis->to;
    return calibrate_is_logarithmic(axis) ? axis->from * pow(axis->to / axis->from, u)
                                          : axis->from + u * (axis->to - axis->from);
}

// The same beyond the range, for the ends of intervals.
static double calibrate_value_beyond(const StudyAxis *axis, double u) {
    return calibrate_is_logarithmic(axis) ? axis->from * pow(axis->to / axis->from, u)
                                          : axis->from + u * (axis->to - axis->from);
}

static double calibrate_derivative(const StudyAxis *axis, double u) {
    return calibrate_is_logarithmic(axis) ? calibrate_value(axis, u) * log(axis->to / axis->from)
                                          : axis->to - axis->from;
}

// --- the request ---

// The scene of the runs that end at `end`: as many samples as the measured times need, and only the
// measured channels.
static Status calibrate_make_base(const CalibrateStudy *study, const Simulation *simulation,
                                  double end, Simulation *base) {
    TRY(fields_copy(simulation_fields, simulation, base));
    study_run_fix_solver(base);
    const double interval = study->measured.at[0].interval;
    const double rate = base->scene.sample_rate;
    Output *output = &base->output;
    base->scene.sample_rate = fmax(ceil(rate * interval * (1 - 1e-9)), 1) / interval;
    const double samples = ceil(end * base->scene.sample_rate) + 2;
    base->scene.duration = fmin(base->scene.duration, samples / base->scene.sample_rate);
    texts_clear(&output->channels);
    texts_clear(&output->psd.channels);
    output->impacts = output->reduction = false;
    output->statistics_from = 0;
    for (size_t i = 0; i < study->measured.count; i++) {
        bool is_listed = false;
        for (size_t k = 0; k < i; k++)
            is_listed |= strcmp(study->measured.at[i].channel, study->measured.at[k].channel) == 0;
        if (!is_listed)
            TRY(texts_append(&output->channels, study->measured.at[i].channel));
    }
    return STATUS_OK;
}

static Status calibrate_check_measured(const CalibrateStudy *study, const Simulation *simulation,
                                       Problem *problem) {
    const double duration = simulation->scene.duration;
    const size_t min = study->fit == CALIBRATE_PSD ? SPECTRUM_SAMPLES_MIN : SAMPLES_MIN;
    Status status = STATUS_OK;
    size_t samples = 0;
    if (study->measured.count == 0)
        return problem_add(problem, STATUS_INVALID, "/study/measured",
                           "must have at least one measured channel");
    for (size_t i = 0; i < study->measured.count; i++) {
        const MeasuredChannel *measured = &study->measured.at[i];
        const JsonPointer place = json_pointer_at("/study/measured", i);
        const double end = measured_time(measured, measured->samples.count - 1);
        const double from = fmax(measured->start, study->max_shift);
        const double to = fmin(end, duration - study->max_shift);
        samples += measured->samples.count;
        if (end > duration * (1 + 1e-9))
            status = json_pointer_fault(problem, place.at, "samples",
                                        "end at %s s, the scene ends at %s s: give the scene a "
                                        "longer duration, or fewer samples",
                                        real_text(end).at, real_text(duration).at);
        else if (!((to - from) / measured->interval + 1.000001 >= (double)min))
            status = json_pointer_fault(
                problem, place.at, "samples",
                "must be at least %zu within the scene%s, for a fit of %s", min,
                study->max_shift > 0 ? ", also when they are moved by max_shift" : "",
                study->fit == CALIBRATE_PSD ? "spectra" : "motions");
        else if (!(measured_rms(measured) > 0))
            status = json_pointer_fault(problem, place.at, "samples",
                                        "all have the same value: there is no motion to fit");
    }
    if (samples > MEASURED_SAMPLES)
        status = problem_add(problem, STATUS_INVALID, "/study/measured",
                             "has %zu samples in all, at most %d are allowed: give fewer channels, "
                             "or a longer interval",
                             samples, MEASURED_SAMPLES);
    if (study->fit == CALIBRATE_PSD && study->max_shift > 0)
        status = problem_add(problem, STATUS_INVALID, "/study/max_shift",
                             "must be 0 for a fit of spectra, which do not depend on it");
    return status;
}

// Members that are not part of the physics.
static Status calibrate_check_pointer(const char *pointer, const Field *row, bool is_tag,
                                      const char *place, Problem *problem) {
    static const char *const refused[] = {"/sample_rate", "/duration", "/output", "/accuracy"};
    for (size_t i = 0; i < COUNT(refused); i++)
        if (strncmp(pointer, refused[i], strlen(refused[i])) == 0)
            return problem_add(problem, STATUS_INVALID, place,
                               "%s cannot be fitted: give a member of the structure, the dampers, "
                               "the contact or the excitation",
                               pointer);
    if (is_tag || (row->kind != FIELD_KIND_REAL && row->kind != FIELD_KIND_REALS &&
                   row->kind != FIELD_KIND_ROWS))
        return problem_add(problem, STATUS_INVALID, place, "%s is not a real number", pointer);
    return STATUS_OK;
}

// The scene with all parameters in the middle but one.
static Status calibrate_check_end(const CalibrateStudy *study, const Simulation *base,
                                  const SimulationLimits *limits, size_t changed, double u,
                                  Problem *problem) {
    StudyValue values[CALIBRATE_PARAMETERS];
    const StudyAxes *axes = &study->parameters;
    for (size_t i = 0; i < axes->count; i++)
        values[i] = (StudyValue){NULL, calibrate_value(&axes->at[i], i == changed ? u : 0.5)};
    Simulation scene = {0};
    Problem *own = calloc(1, sizeof *own);
    TRY(status_made(own != NULL));
    const Status status =
        study_scene_make(base, axes, values, &study->names, false, limits, &scene, own);
    simulation_clear(&scene);
    static const char before[] = "/output/channels/";
    for (size_t i = 0; i < own->count && i < PROBLEM_FAULTS && status == STATUS_INVALID; i++) {
        const Fault *fault = &own->faults[i];
        if (strncmp(fault->pointer, before, sizeof before - 1) == 0) {
            const size_t channel = strtoul(fault->pointer + sizeof before - 1, NULL, 10);
            const char *name = base->output.channels.at[channel];
            for (size_t k = 0; k < study->measured.count; k++)
                if (strcmp(study->measured.at[k].channel, name) == 0)
                    (void)json_pointer_fault(problem, json_pointer_at("/study/measured", k).at,
                                             "channel", "%s", fault->detail);
            continue;
        }
        const JsonPointer axis = changed < axes->count
                                     ? json_pointer_at("/study/parameters", changed)
                                     : (JsonPointer){"/study/parameters"};
        if (changed < axes->count)
            (void)json_pointer_fault(problem, axis.at, u > 0 ? "to" : "from",
                                     "gives a scene that is not valid: %s: %s", fault->pointer,
                                     fault->detail);
        else
            (void)problem_add(problem, STATUS_INVALID, axis.at,
                              "give, in the middle of their ranges, a scene that is not valid: "
                              "%s: %s",
                              fault->pointer, fault->detail);
    }
    if (status != STATUS_OK && status != STATUS_INVALID)
        (void)problem_set(problem, status, "%s", own->detail);
    free(own);
    return status;
}

static Status calibrate_check_ends(const CalibrateStudy *study, const Simulation *simulation,
                                   const SimulationLimits *limits, Problem *problem) {
    Simulation base = {0};
    const size_t count = study->parameters.count;
    Status status = calibrate_make_base(study, simulation, simulation->scene.duration, &base);
    if (status == STATUS_OK)
        status = calibrate_check_end(study, &base, limits, count, 0.5, problem);
    for (size_t i = 0; i < 2 * count && status == STATUS_OK; i++)
        status = calibrate_check_end(study, &base, limits, i / 2, (double)(i % 2), problem);
    simulation_clear(&base);
    return status;
}

static Status calibrate_complete(void *request, const Simulation *simulation,
                                 const SimulationLimits *limits, Problem *problem) {
    CalibrateStudy *study = request;
    static const char place[] = "/study/parameters";
    const StudyAxes *axes = &study->parameters;
    Status status = study_axes_check(axes, false, place, problem);
    if (axes->count == 0)
        status =
            problem_add(problem, STATUS_INVALID, place, "must have at least one parameter to fit");
    for (size_t i = 0; i < axes->count; i++)
        if (axes->at[i].values.count > 0)
            status = json_pointer_fault(problem, json_pointer_at(place, i).at, "values",
                                        "cannot be fitted: give a range, from and to");
    status = study_first_failure(status, calibrate_check_measured(study, simulation, problem));
    TRY(status);
    TRY(study_axes_find(axes, simulation, place, problem));
    Simulation scene = {0};
    status = fields_copy(simulation_fields, simulation, &scene);
    for (size_t i = 0; i < axes->count && status != STATUS_NO_MEMORY; i++) {
        bool is_tag = false;
        const JsonPointer own = json_pointer_at(place, i);
        const Field *row = study_axis_find(&axes->at[i], &scene, &is_tag, own.at, problem);
        for (size_t k = 0; row != NULL && k < study_axis_pointer_count(&axes->at[i]); k++)
            if (calibrate_check_pointer(study_axis_pointer(&axes->at[i], k), row, is_tag, own.at,
                                        problem) != STATUS_OK)
                status = STATUS_INVALID;
    }
    simulation_clear(&scene);
    TRY(status);
    return calibrate_check_ends(study, simulation, limits, problem);
}

// Runs of the search at the full duration, about.
static double calibrate_expected(const CalibrateStudy *study) {
    return (double)study->starts * (2 + 6 * (double)(study->parameters.count + 1));
}

static Status calibrate_cost(const void *request, const Simulation *simulation,
                             const SimulationLimits *limits, double *steps) {
    const CalibrateStudy *study = request;
    Simulation base = {0};
    (void)limits;
    const Status status = calibrate_make_base(study, simulation, simulation->scene.duration, &base);
    if (status == STATUS_OK)
        *steps = calibrate_expected(study) * simulation_cost(&base).steps;
    simulation_clear(&base);
    return status;
}

static void calibrate_references(void *request, StudyReferences *references) {
    CalibrateStudy *study = request;
    *references = (StudyReferences){
        .axes = &study->parameters, .axes_place = "/study/parameters", .names = &study->names};
}

// --- the search ---

typedef enum StartState {
    START_EVALUATE, // its residuals are wanted
    START_DERIVE,   // its derivatives
    START_TRY,      // a step
    START_DONE,
    START_DROPPED
} StartState;

typedef struct CalibrateStart {
    StartState state;
    size_t number;
    double at[VARIABLES], trial[VARIABLES];
    double before[VARIABLES]; // at the beginning of the window
    double cost, damping, growth, predicted;
    double differences[VARIABLES]; // by which derivatives are taken
    NormalEquations equations;
    double *residual, *slope; // weighted; by the shift in its unit range
    size_t steps;
    double horizon, error; // of its run: trust horizon [s] and estimated error
} CalibrateStart;

// A run of the batch.
typedef struct CalibrateRun {
    size_t start, column;
    double step; // of the variable `column`; 0: a point of its own
    bool is_second;
    double at[VARIABLES];
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
    UNDETERMINED_WIDE,  // its interval is as wide as its range
    UNDETERMINED_RIVAL, // another start fits as well
    UNDETERMINED_BOUND  // the best value is beyond its range
} Undetermined;

typedef struct CalibrateAssessment {
    double covariance[VARIABLES * VARIABLES]; // of residuals of unit variance
    double errors[VARIABLES];                 // standard errors, of the range
    double variance;                          // of the residuals
    double t;                                 // half width of an interval over its standard error
    Undetermined reasons[VARIABLES];
    double low[VARIABLES], high[VARIABLES]; // ends of the intervals
    double rivals[VARIABLES];
    bool is_ambiguous; // points that the linear model excludes fit as well
    bool is_determined;
} CalibrateAssessment;

// A point of the last window.
typedef struct CalibratePoint {
    double at[VARIABLES], cost;
} CalibratePoint;

typedef struct CalibratePoints {
    CalibratePoint *at;
    size_t count;
} CalibratePoints;

// The result of a window.
typedef struct CalibrateResult {
    NormalEquations equations; // of the best point
    double variance, starts[KEPT_MIN][VARIABLES];
    size_t start_count, rows;
} CalibrateResult;

typedef struct CalibrateWork {
    StudyWork work;
    const CalibrateStudy *study;
    Calibration *answer;
    size_t parameters, variables;
    CalibrateStage stage;
    int fit; // CalibrateFit
    double ends[WINDOWS];
    size_t windows, window, repeats;
    bool is_limited; // the record is longer than can be predicted
    bool is_beyond;  // because of its trust horizon
    bool is_chaotic; // and spectra are fitted therefore
    double horizon;  // where the fit ends then [s]
    Simulation base; // of the window
    MeasuredTarget *targets;
    double *deviations; // given or estimated, of each channel
    size_t rows;
    CalibrateStart *starts;
    size_t start_count;
    CalibrateRun *runs; // the batch
    size_t run_count, first;
    double *columns[VARIABLES]; // of the start whose derivatives are folded
    double norms[VARIABLES];    // their squares
    size_t refinements;
    uint64_t draws;
    size_t explorations, retries;
    CalibrateResult results[WINDOWS];
    CalibratePoints points; // of the window
    CalibrateAssessment assessment;
} CalibrateWork;

typedef struct CalibratePart {
    StudyPart part;
    const CalibrateRun *run;
    double *residual, *slope;
} CalibratePart;

static bool calibrate_has_shift(const CalibrateWork *work) {
    return work->variables > work->parameters;
}

static double calibrate_shift(const CalibrateWork *work, const double *at) {
    return calibrate_has_shift(work) ? (2 * at[work->parameters] - 1) * work->study->max_shift : 0;
}

static Status calibrate_scene(const void *of, size_t member, Simulation *scene, StudyPart *part,
                              Problem *problem) {
    const CalibrateWork *work = of;
    const StudyAxes *axes = &work->study->parameters;
    const CalibrateRun *run = &work->runs[member - work->first];
    StudyValue values[CALIBRATE_PARAMETERS];
    ((CalibratePart *)(void *)part)->run = run;
    for (size_t i = 0; i < axes->count; i++)
        values[i] = (StudyValue){NULL, calibrate_value(&axes->at[i], run->at[i])};
    return study_scene_make(&work->base, axes, values, &work->study->names, false,
                            work->work.limits, scene, problem);
}

static Status calibrate_keep(const void *of, const Outcome *outcome, const StudyTools *tools,
                             StudyPart *base, Problem *problem) {
    const CalibrateWork *work = of;
    CalibratePart *part = (CalibratePart *)(void *)base;
    const bool has_slope = calibrate_has_shift(work) && part->run->step == 0;
    FftCache *cache = tools->workspace != NULL ? &tools->workspace->transforms : NULL;
    part->residual = calloc(work->rows + 1, sizeof(double));
    part->slope = has_slope ? calloc(work->rows + 1, sizeof(double)) : NULL;
    TRY(status_made(part->residual != NULL && (part->slope != NULL || !has_slope)));
    for (size_t c = 0; c < work->study->measured.count; c++) {
        const MeasuredTarget *target = &work->targets[c];
        double *residual = part->residual + target->place;
        double *slope = has_slope ? part->slope + target->place : NULL;
        TRY(measured_target_model(target, &outcome->response, calibrate_shift(work, part->run->at),
                                  cache, residual, slope, problem));
        for (size_t i = 0; i < target->values.count; i++) {
            residual[i] = (residual[i] - target->values.at[i]) / target->deviation;
            if (has_slope)
                slope[i] *= 2 * work->study->max_shift / target->deviation;
        }
    }
    return STATUS_OK;
}

static void calibrate_clear_part(StudyPart *base) {
    CalibratePart *part = (CalibratePart *)(void *)base;
    free(part->residual);
    free(part->slope);
}

// Variance of a residual, which is 1 if the deviations are right.
static double calibrate_variance(const CalibrateWork *work, double cost) {
    const size_t freedom = work->rows > work->variables ? work->rows - work->variables : 1;
    return cost / (double)freedom;
}

// A difference is half of the deviation that noise gives one parameter alone: the derivatives are
// those over the range that matters, also where samples jump as an impact passes them.
static double calibrate_set_differences(const CalibrateWork *work, CalibrateStart *start) {
    const NormalEquations *equations = &start->equations;
    const double variance = calibrate_variance(work, start->cost);
    double change = 1;
    for (size_t i = 0; i < work->parameters && !work->is_chaotic; i++) {
        const double slope = equations->matrix[i * (equations->count + 1)];
        const double wanted = slope > 0 ? difference_share * sqrt(variance / slope) : 1;
        const double difference = fmin(fmax(wanted, difference_min), difference_max);
        const double ratio = difference / start->differences[i];
        change = fmax(change, fmax(ratio, 1 / ratio));
        start->differences[i] = difference;
    }
    return change;
}

static CalibrateStart *calibrate_best(const CalibrateWork *work) {
    CalibrateStart *best = NULL;
    for (size_t i = 0; i < work->start_count; i++) {
        CalibrateStart *start = &work->starts[i];
        if (start->state != START_DROPPED && (best == NULL || start->cost < best->cost))
            best = start;
    }
    return best;
}

// Opens the window: what is compared, the scene of its runs, and all starts to be evaluated.
// `is_new`: costs before are of others.
static Status calibrate_open(CalibrateWork *work, bool is_new) {
    const CalibrateStudy *study = work->study;
    const Simulation *simulation = work->work.simulation;
    const double duration = simulation->scene.duration, end = work->ends[work->window];
    simulation_clear(&work->base);
    TRY(calibrate_make_base(study, simulation, end + study->max_shift, &work->base));
    // Costs of the screen and the fit of a window are comparable.
    if (work->stage == STAGE_SCREEN || is_new) {
        free(work->points.at);
        work->points = (CalibratePoints){NULL, 0};
    }
    work->rows = 0;
    for (size_t c = 0; c < study->measured.count; c++) {
        MeasuredTarget *target = &work->targets[c];
        measured_target_clear(target);
        TRY(measured_target_make(
            &study->measured.at[c], study->max_shift, fmin(end, duration - study->max_shift),
            work->fit == CALIBRATE_PSD ? &simulation->output.psd : NULL, target, NULL));
        if (!target->is_spectrum)
            target->deviation = work->deviations[c];
        target->place = work->rows;
        work->rows += target->values.count;
    }
    for (size_t i = 0; i < work->start_count; i++) {
        CalibrateStart *start = &work->starts[i];
        if (start->state == START_DROPPED)
            continue;
        start->state = START_EVALUATE;
        start->steps = 0;
        start->damping = damping_first;
        start->growth = 2;
        for (size_t k = 0; k < work->parameters; k++)
            start->differences[k] = work->is_chaotic            ? difference_chaos
                                    : start->differences[k] > 0 ? start->differences[k]
                                                                : difference_first;
        memcpy(start->before, start->at, sizeof start->at);
    }
    return STATUS_OK;
}

static void calibrate_drop(CalibrateStart *start) {
    start->state = START_DROPPED;
    free(start->residual);
    free(start->slope);
    start->residual = start->slope = NULL;
    start->cost = (double)INFINITY;
}

// The points of the screen: a Sobol sequence, and the middle as the first.
static Status calibrate_place_starts(CalibrateWork *work) {
    Sampling sampling;
    TRY(sampling_make(SAMPLING_SOBOL, work->study->search_seed, work->start_count, work->variables,
                      &sampling));
    for (size_t k = 0; k < work->start_count; k++) {
        work->starts[k].number = k;
        for (size_t i = 0; i < work->variables; i++)
            work->starts[k].at[i] = k == 0 ? 0.5 : sampling_coordinate(&sampling, k, i);
    }
    sampling_clear(&sampling);
    return STATUS_OK;
}

static int calibrate_compare_cost(const void *a, const void *b) {
    const CalibrateStart *x = a, *y = b;
    if (x->cost != y->cost)
        return x->cost < y->cost ? -1 : 1;
    return (x->number > y->number) - (x->number < y->number);
}

static int calibrate_compare_number(const void *a, const void *b) {
    const CalibrateStart *x = a, *y = b;
    return (x->number > y->number) - (x->number < y->number);
}

// Half of the starts are the best points of the screen, the others the first of the rest, so that
// they do not all lie in one valley.
static void calibrate_choose_starts(CalibrateWork *work) {
    const size_t wanted = (size_t)work->study->starts, best = (wanted + 1) / 2;
    qsort(work->starts, work->start_count, sizeof *work->starts, calibrate_compare_cost);
    qsort(work->starts + best, work->start_count - best, sizeof *work->starts,
          calibrate_compare_number);
    size_t kept = 0;
    for (size_t i = 0; i < work->start_count; i++) {
        if (work->starts[i].state == START_DROPPED || kept == wanted) {
            calibrate_drop(&work->starts[i]);
            continue;
        }
        const CalibrateStart start = work->starts[i];
        work->starts[i] = (CalibrateStart){.state = START_DROPPED};
        work->starts[kept] = start;
        work->starts[kept].number = kept;
        kept++;
    }
    work->start_count = kept;
}

// Start `k` becomes a point around its parent, drawn from what the fit leaves open: the standard
// errors times `scale`.
static void calibrate_draw_start(CalibrateWork *work, size_t k, const CalibrateStart *parent,
                                 double scale) {
    CalibrateStart *start = &work->starts[k];
    double normal[VARIABLES + 1], step[VARIABLES], largest = 0;
    philox_normal_pairs(work->study->search_seed, work->draws++, 0, (work->variables + 1) / 2,
                        normal);
    least_squares_draw(&parent->equations, normal, step);
    for (size_t i = 0; i < work->variables; i++) {
        step[i] *= scale * sqrt(calibrate_variance(work, parent->cost));
        largest = fmax(largest, fabs(step[i]));
    }
    *start = (CalibrateStart){.state = START_EVALUATE, .number = k};
    memcpy(start->differences, parent->differences, sizeof start->differences);
    for (size_t i = 0; i < work->variables; i++) {
        // Reflected at the bounds.
        const double at = fabs(parent->at[i] + step[i] * fmin(1, scatter_max / largest));
        start->at[i] = fmax(at > 1 ? 2 - at : at, 0);
    }
}

// Adds points around those that were fitted, to be screened on the next window, whose valleys are
// narrower.
static void calibrate_scatter_starts(CalibrateWork *work) {
    const size_t parents = work->start_count, all = SCREENED * (size_t)work->study->starts;
    for (size_t k = parents; k < all; k++)
        calibrate_draw_start(work, k, &work->starts[k % parents], scatter);
    work->start_count = all;
}

// Leaves only the best point and others around it, near and far, that are to be explored.
static void calibrate_explore(CalibrateWork *work) {
    static const double scales[] = {0.7, 2, 5, 12, 30, 80};
    qsort(work->starts, work->start_count, sizeof *work->starts, calibrate_compare_cost);
    for (size_t k = 1; k < work->start_count; k++)
        calibrate_drop(&work->starts[k]);
    for (size_t k = 1; k < EXPLORED; k++)
        calibrate_draw_start(work, k, &work->starts[0], scales[k % COUNT(scales)]);
    work->start_count = EXPLORED;
}

// Whether a point was found that is better than the best fit. These points are fitted next; if
// there is none, only the best fit is left.
static bool calibrate_improve(CalibrateWork *work) {
    const double cost = work->starts[0].cost;
    const double better = cost - tolerance_first * calibrate_variance(work, cost);
    size_t kept = 1;
    qsort(work->starts + 1, work->start_count - 1, sizeof *work->starts, calibrate_compare_cost);
    while (kept < IMPROVED && work->starts[kept].cost < better)
        kept++;
    for (size_t k = kept; k < work->start_count; k++)
        calibrate_drop(&work->starts[k]);
    work->start_count = kept;
    return kept > 1;
}

static Status calibrate_add_step(CalibrateWork *work, const CalibrateStart *start) {
    CalibrationSteps *history = &work->answer->history;
    if (history->count >= HISTORY_MAX)
        return STATUS_OK;
    CalibrationStep *step = list_grow(history, sizeof *step);
    TRY(status_made(step != NULL));
    *step = (CalibrationStep){.index = history->count - 1,
                              .start = start->number,
                              .until = work->ends[work->window],
                              .shift = calibrate_shift(work, start->at),
                              .cost = start->cost};
    TRY(status_made(reals_allocate(&step->values, work->parameters)));
    for (size_t i = 0; i < work->parameters; i++)
        step->values.at[i] = calibrate_value(&work->study->parameters.at[i], start->at[i]);
    return STATUS_OK;
}

// Takes the residuals of a run at the start's new point.
static Status calibrate_move(CalibrateWork *work, CalibrateStart *start, const double *at,
                             double cost, CalibratePart *part) {
    free(start->residual);
    free(start->slope);
    start->residual = part->residual;
    start->slope = part->slope;
    part->residual = part->slope = NULL;
    memmove(start->at, at, sizeof start->at);
    start->cost = cost;
    start->horizon = part->part.run.summary.trust_horizon;
    start->error = part->part.run.summary.error_estimate;
    return work->stage == STAGE_FIT ? calibrate_add_step(work, start) : STATUS_OK;
}

static bool calibrate_is_last(const CalibrateWork *work) {
    return work->window + 1 == work->windows;
}

// The next step to try, or the end of the fit.
static void calibrate_plan_step(CalibrateWork *work, CalibrateStart *start) {
    const bool is_last = calibrate_is_last(work);
    const double tolerance = is_last ? tolerance_last : tolerance_first;
    start->state = START_DONE;
    if (start->steps >= (is_last ? STEPS_LAST : STEPS_FIRST) || start->damping > damping_max)
        return;
    start->predicted =
        least_squares_step(&start->equations, start->damping, start->at, start->trial);
    if (start->predicted > tolerance * calibrate_variance(work, start->cost))
        start->state = START_TRY;
}

// Nielsen's rule (1999) for the damping.
static Status calibrate_fold_step(CalibrateWork *work, CalibrateStart *start, double cost,
                                  CalibratePart *part) {
    const double gain = (start->cost - cost) / start->predicted;
    const bool is_last = calibrate_is_last(work);
    start->steps++;
    if (!(gain > 1e-4)) {
        start->damping *= start->growth;
        start->growth *= 2;
        calibrate_plan_step(work, start);
        return STATUS_OK;
    }
    const double tolerance = (is_last ? tolerance_last : tolerance_first);
    const bool is_small = start->cost - cost < tolerance * calibrate_variance(work, cost);
    start->damping *= fmax(1 / 3.0, 1 - pow(2 * gain - 1, 3));
    start->growth = 2;
    TRY(calibrate_move(work, start, start->trial, cost, part));
    start->state = is_small ? START_DONE : START_DERIVE;
    return STATUS_OK;
}

static double calibrate_sum_squares(const double *values, size_t count) {
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += values[i] * values[i];
    return sum;
}

// Spectra of motions that cannot be predicted differ from run to run as from the measured one. What
// that adds to the squares of the derivatives is removed from them.
static void calibrate_remove_noise(const CalibrateWork *work, CalibrateStart *start) {
    const size_t n = work->variables;
    for (size_t i = 0; i < work->parameters; i++) {
        const double step = start->differences[i], sides = work->stage == STAGE_FIT ? 1 : 2;
        const double noise = 2 * start->cost / (step * step * sides * sides);
        double *square = &start->equations.matrix[i * (n + 1)];
        *square = fmax(*square - noise, 1e-3 * noise);
    }
}

// Of the best point each column is made twice, on both sides. A difference is much larger than that
// of the other side where an impact begins or ends within it: then the smaller one is used.
static void calibrate_fold_column(CalibrateWork *work, CalibrateStart *start,
                                  const CalibrateRun *run, const CalibratePart *part) {
    double *column = work->columns[run->column], *norm = &work->norms[run->column];
    double squares = (double)INFINITY;
    if (!run->is_second)
        *norm = (double)INFINITY;
    if (part->residual != NULL) {
        for (size_t i = 0; i < work->rows; i++)
            part->residual[i] = (part->residual[i] - start->residual[i]) / run->step;
        squares = calibrate_sum_squares(part->residual, work->rows);
    }
    const bool is_replaced = squares < *norm / one_sided, is_added = squares < *norm * one_sided;
    for (size_t i = 0; i < work->rows && isfinite(squares) && (is_replaced || is_added); i++)
        column[i] = is_replaced ? part->residual[i] : (column[i] + part->residual[i]) / 2;
    if (is_replaced)
        *norm = squares;
    if (!isfinite(*norm)) // no run ended
        memset(column, 0, work->rows * sizeof *column);
    if ((work->stage == STAGE_COVARIANCE && !run->is_second) || run->column + 1 < work->parameters)
        return;
    const double *columns[VARIABLES];
    for (size_t i = 0; i < work->variables; i++)
        columns[i] = i < work->parameters ? work->columns[i] : start->slope;
    normal_equations_make(columns, work->variables, start->residual, work->rows, &start->equations);
    if (work->is_chaotic)
        calibrate_remove_noise(work, start);
    const double change = calibrate_set_differences(work, start);
    if (work->stage == STAGE_FIT)
        calibrate_plan_step(work, start);
    else if (change < difference_change || work->refinements++ == REFINEMENTS)
        start->state = START_DONE;
}

static Status calibrate_fold_part(CalibrateWork *work, const CalibrateRun *run,
                                  CalibratePart *part) {
    CalibrateStart *start = &work->starts[run->start];
    if (run->step != 0) {
        calibrate_fold_column(work, start, run, part);
        return STATUS_OK;
    }
    const double cost = part->residual != NULL ? calibrate_sum_squares(part->residual, work->rows)
                                               : (double)INFINITY;
    if (calibrate_is_last(work) && isfinite(cost)) {
        CalibratePoint *point = list_grow(&work->points, sizeof *point);
        TRY(status_made(point != NULL));
        point->cost = cost;
        memcpy(point->at, run->at, sizeof point->at);
    }
    if (start->state == START_TRY)
        return calibrate_fold_step(work, start, cost, part);
    if (!isfinite(cost)) {
        calibrate_drop(start);
        return STATUS_OK;
    }
    if (work->stage != STAGE_FIT) { // only the cost is needed of so many points
        start->state = START_DONE;
        start->cost = cost;
        start->horizon = part->part.run.summary.trust_horizon;
        return STATUS_OK;
    }
    start->state = START_DERIVE;
    return calibrate_move(work, start, start->at, cost, part);
}

static void calibrate_add_run(CalibrateWork *work, size_t start, size_t column, double step,
                              const double *at) {
    CalibrateRun *run = &work->runs[work->run_count++];
    *run = (CalibrateRun){.start = start, .column = column, .step = step};
    memcpy(run->at, at, sizeof run->at);
    if (step != 0)
        run->at[column] += step;
}

// The runs that the starts want.
static void calibrate_list_runs(CalibrateWork *work) {
    work->run_count = 0;
    for (size_t i = 0; i < work->start_count; i++) {
        const CalibrateStart *start = &work->starts[i];
        if (start->state == START_EVALUATE || start->state == START_TRY)
            calibrate_add_run(work, i, 0, 0, start->state == START_TRY ? start->trial : start->at);
        for (size_t k = 0; k < work->parameters && start->state == START_DERIVE; k++) {
            const double u = start->at[k], difference = start->differences[k];
            calibrate_add_run(work, i, k, u + difference <= 1 ? difference : -difference,
                              start->at);
            if (work->stage == STAGE_FIT)
                continue;
            calibrate_add_run(work, i, k, u - difference >= 0 ? -difference : difference,
                              start->at);
            work->runs[work->run_count - 1].is_second = true;
        }
    }
}

// New estimates of the noise, from the best fit. Returns the largest relative change.
static double calibrate_estimate_noise(CalibrateWork *work) {
    const CalibrateStart *best = calibrate_best(work);
    double change = 0;
    for (size_t c = 0; c < work->study->measured.count && best != NULL; c++) {
        const MeasuredTarget *target = &work->targets[c];
        const size_t count = target->values.count;
        if (!isnan(target->measured->deviation) || target->is_spectrum || count == 0)
            continue;
        const double sum = calibrate_sum_squares(best->residual + target->place, count);
        const double fitted = (double)work->variables * (double)count / (double)work->rows;
        const double share = sqrt(sum / fmax((double)count - fitted, 1));
        const double min = 1e-9 * measured_rms(target->measured);
        work->deviations[c] = fmax(share * target->deviation, min);
        change = fmax(change, fabs(log(work->deviations[c] / target->deviation)));
    }
    return change;
}

// Starts that have become one, and those that are far from the best, are dropped.
static void calibrate_thin_starts(CalibrateWork *work) {
    qsort(work->starts, work->start_count, sizeof *work->starts, calibrate_compare_cost);
    size_t kept = 0;
    for (size_t i = 0; i < work->start_count; i++) {
        CalibrateStart *start = &work->starts[i];
        if (start->state == START_DROPPED)
            continue;
        bool is_same = false;
        for (size_t k = 0; k < i && !is_same; k++) {
            double distance = work->starts[k].state == START_DROPPED ? 1 : 0;
            for (size_t j = 0; j < work->variables; j++)
                distance = fmax(distance, fabs(start->at[j] - work->starts[k].at[j]));
            is_same = distance < same_point;
        }
        if (is_same || (kept >= KEPT_MIN && start->cost > hopeless * work->starts[0].cost))
            calibrate_drop(start);
        else
            kept++;
    }
    qsort(work->starts, work->start_count, sizeof *work->starts, calibrate_compare_cost);
    work->start_count = kept;
}

// Keeps the result of the window.
static void calibrate_save(CalibrateWork *work) {
    CalibrateResult *result = &work->results[work->window];
    const CalibrateStart *best = calibrate_best(work);
    *result = (CalibrateResult){.equations = best->equations,
                                .variance = calibrate_variance(work, best->cost),
                                .rows = work->rows};
    for (size_t i = 0; i < work->start_count && i < KEPT_MIN; i++)
        memcpy(result->starts[result->start_count++], work->starts[i].at, sizeof best->at);
}

// Whether the window before is a result on its own, and this one is so much more sensitive that
// its valleys may have been missed.
static bool calibrate_may_return(const CalibrateWork *work, double limit) {
    if (work->window == 0 || work->fit == CALIBRATE_PSD)
        return false;
    const CalibrateResult *before = &work->results[work->window - 1];
    const CalibrateStart *best = calibrate_best(work);
    const size_t n = work->variables;
    const double variance = calibrate_variance(work, best->cost);
    double covariance[VARIABLES * VARIABLES], growth = 0;
    least_squares_covariance(&before->equations, covariance);
    for (size_t i = 0; i < work->parameters; i++) {
        if (!(2 * sqrt(before->variance * covariance[i * n + i]) < enough))
            return false;
        growth = fmax(growth, best->equations.matrix[i * n + i] * before->variance /
                                  (before->equations.matrix[i * n + i] * variance));
    }
    return growth > limit * limit;
}

// The window before becomes the last one.
static Status calibrate_return(CalibrateWork *work) {
    const CalibrateResult *before = &work->results[--work->window];
    work->windows = work->window + 1;
    work->horizon = work->ends[work->window];
    work->is_limited = true;
    work->stage = STAGE_FIT;
    work->explorations = 0;
    for (size_t i = 0; i < work->start_count; i++)
        calibrate_drop(&work->starts[i]);
    work->start_count = before->start_count;
    for (size_t i = 0; i < work->start_count; i++) {
        work->starts[i] = (CalibrateStart){.number = i};
        memcpy(work->starts[i].at, before->starts[i], sizeof before->starts[i]);
    }
    return calibrate_open(work, true);
}

// Whether the noise of this window is larger than was given, or than that of the window before.
static bool calibrate_is_worse(const CalibrateWork *work, double quantile) {
    if (work->window == 0)
        return false;
    const double uncertain =
        2 / (double)work->rows + 2 / (double)work->results[work->window - 1].rows;
    return calibrate_variance(work, calibrate_best(work)->cost) > 1 + quantile * sqrt(uncertain);
}

// Searches the window again from the result of the one before, beside what was found.
static Status calibrate_search_again(CalibrateWork *work) {
    const CalibrateResult *before = &work->results[work->window - 1];
    const size_t kept = work->start_count < KEPT_MIN ? work->start_count : KEPT_MIN;
    for (size_t i = kept; i < work->start_count; i++)
        calibrate_drop(&work->starts[i]);
    for (size_t i = 0; i < before->start_count; i++) {
        CalibrateStart *start = &work->starts[kept + i];
        *start =
            (CalibrateStart){.number = kept + i, .cost = before->variance * (double)work->rows};
        start->equations = before->equations;
        memcpy(start->at, before->starts[i], sizeof start->at);
    }
    work->start_count = kept + before->start_count;
    calibrate_scatter_starts(work);
    work->stage = STAGE_SCREEN;
    return calibrate_open(work, true);
}

// Where the motion cannot be predicted to the end of the window, the one before is the last, or
// the part of the first one that can.
static bool calibrate_is_beyond_horizon(const CalibrateWork *work) {
    return work->fit == CALIBRATE_TIME && !isnan(calibrate_best(work)->horizon);
}

static Status calibrate_limit(CalibrateWork *work) {
    if (work->window > 0)
        return calibrate_return(work);
    work->ends[0] = work->horizon = predictable * calibrate_best(work)->horizon;
    work->windows = 1;
    work->is_limited = true;
    return calibrate_open(work, true);
}

static Status calibrate_open_spectra(CalibrateWork *work) {
    work->fit = CALIBRATE_PSD;
    work->is_chaotic = true;
    work->explorations = 0;
    work->stage = STAGE_FIT;
    work->windows = 1;
    work->window = 0;
    work->ends[0] = work->work.simulation->scene.duration;
    return calibrate_open(work, true);
}

// Whether the end of an interval lies outside: the fit is at a bound, and moves beyond it in the
// linear model by more than two standard errors.
static bool calibrate_is_pulled(const CalibrateStart *start, const double *covariance, double scale,
                                size_t i) {
    const size_t n = start->equations.count;
    double step = 0;
    for (size_t k = 0; k < n; k++)
        step -= covariance[i * n + k] * start->equations.gradient[k];
    const double error = sqrt(scale * covariance[i * n + i]);
    return (start->at[i] < 1e-9 && step < -2 * error) ||
           (start->at[i] > 1 - 1e-9 && step > 2 * error);
}

// The quantile of chi square from that of the normal distribution (Wilson and Hilferty 1931).
static double calibrate_chi_square(double freedom, double quantile) {
    const double variance = 2 / (9 * freedom);
    return freedom * pow(1 - variance + quantile * sqrt(variance), 3);
}

// Increase of the cost from the best point in the linear model.
static double calibrate_predict(const CalibrateStart *best, const double *at) {
    const NormalEquations *equations = &best->equations;
    const size_t n = equations->count;
    double cost = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++)
            cost += (at[i] - best->at[i]) * equations->matrix[i * n + k] * (at[k] - best->at[k]);
    return cost;
}

// The uncertainty of the best point.
static void calibrate_assess(CalibrateWork *work) {
    const CalibrateStart *best = calibrate_best(work);
    CalibrateAssessment *found = &work->assessment;
    const size_t n = work->variables;
    bool is_estimated = work->fit == CALIBRATE_PSD;
    for (size_t c = 0; c < work->study->measured.count; c++)
        is_estimated |= isnan(work->study->measured.at[c].deviation);
    const double share = work->fit == CALIBRATE_PSD ? correlated_bins : 1;
    const double freedom = fmax(floor((double)work->rows / share) - (double)n, 1);
    found->variance = is_estimated ? fmax(share * best->cost / (share * freedom), 1e-300) : 1;
    found->t = student_t_quantile(confidence, is_estimated ? (size_t)freedom : 0);
    least_squares_covariance(&best->equations, found->covariance);
    for (size_t i = 0; i < n; i++) {
        found->errors[i] = sqrt(found->variance * found->covariance[i * n + i]);
        found->low[i] = best->at[i] - found->t * found->errors[i];
        found->high[i] = best->at[i] + found->t * found->errors[i];
        found->rivals[i] = (double)NAN;
    }
    // A point of the search that fits as well although the linear model excludes it, as one in
    // another valley does, belongs to the intervals.
    found->is_ambiguous = false;
    const double limit = calibrate_chi_square((double)n, quantile_95) * found->variance;
    for (size_t k = 0; k < work->points.count; k++) {
        const CalibratePoint *point = &work->points.at[k];
        if (point->cost - best->cost > limit || calibrate_predict(best, point->at) < 2 * limit)
            continue;
        found->is_ambiguous = true;
        for (size_t i = 0; i < n; i++) {
            found->low[i] = fmin(found->low[i], point->at[i]);
            found->high[i] = fmax(found->high[i], point->at[i]);
            if (fabs(point->at[i] - best->at[i]) > rival)
                found->rivals[i] = point->at[i];
        }
    }
    found->is_determined = true;
    for (size_t i = 0; i < work->parameters; i++) {
        found->reasons[i] = !(found->t * found->errors[i] < undetermined) ? UNDETERMINED_WIDE
                            : !isnan(found->rivals[i])                    ? UNDETERMINED_RIVAL
                            : calibrate_is_pulled(best, found->covariance, found->variance, i)
                                ? UNDETERMINED_BOUND
                                : UNDETERMINED_NOT;
        found->is_determined &= found->reasons[i] == UNDETERMINED_NOT;
    }
}

// Goes to the next stage when no start wants a run.
static Status calibrate_advance(CalibrateWork *work, bool *is_over) {
    CalibrateStart *best = calibrate_best(work);
    if (best == NULL) {
        *is_over = true;
        return STATUS_OK;
    }
    if (work->stage == STAGE_SCREEN) {
        // Spectra are compared over the whole record also where it cannot be predicted.
        work->is_chaotic = work->fit == CALIBRATE_PSD && !isnan(best->horizon);
        calibrate_choose_starts(work);
        work->stage = STAGE_FIT;
        return calibrate_open(work, false);
    }
    if (work->stage == STAGE_FIT) {
        const double change = calibrate_estimate_noise(work);
        calibrate_thin_starts(work);
        if (calibrate_is_beyond_horizon(work) && !work->is_limited) {
            work->is_beyond = true;
            return calibrate_limit(work);
        }
        if (calibrate_may_return(work, rough))
            return calibrate_return(work);
        if (calibrate_is_worse(work, quantile_95) && work->retries++ < RETRIES)
            return calibrate_search_again(work);
        calibrate_save(work);
        if (!calibrate_is_last(work)) {
            calibrate_scatter_starts(work);
            work->window++;
            work->retries = 0;
            work->stage = STAGE_SCREEN;
            return calibrate_open(work, true);
        }
        if (work->study->measured.count > 1 && change > 0.1 && work->repeats++ < REPEATS)
            return calibrate_open(work, true);
        work->stage = STAGE_COVARIANCE;
        work->refinements = 0;
        best = calibrate_best(work);
        best->state = START_DERIVE;
        return STATUS_OK;
    }
    if (work->stage == STAGE_COVARIANCE && work->explorations < EXPLORATIONS) {
        work->explorations++;
        work->stage = STAGE_EXPLORE;
        calibrate_explore(work);
        return STATUS_OK;
    }
    if (work->stage == STAGE_EXPLORE) {
        if (calibrate_improve(work)) {
            work->stage = STAGE_FIT;
            return calibrate_open(work, false);
        }
        if (work->explorations < EXPLORATIONS_MIN) {
            work->explorations++;
            calibrate_explore(work);
            return STATUS_OK;
        }
    }
    if (calibrate_is_worse(work, quantile_999) && calibrate_may_return(work, sensitive))
        return calibrate_return(work);
    calibrate_assess(work);
    if (work->assessment.is_ambiguous && calibrate_may_return(work, 1))
        return calibrate_return(work);
    if (!work->assessment.is_determined && work->is_beyond && work->fit == CALIBRATE_TIME)
        return calibrate_open_spectra(work);
    *is_over = true;
    return STATUS_OK;
}

static Status calibrate_continue(CalibrateWork *work) {
    StudyWork *study = &work->work;
    bool is_over = false;
    work->first = study->wanted;
    calibrate_list_runs(work);
    while (work->run_count == 0 && !is_over) {
        TRY(calibrate_advance(work, &is_over));
        if (!is_over)
            calibrate_list_runs(work);
    }
    if (work->run_count > study->members - study->wanted)
        work->run_count = study->members - study->wanted;
    study->wanted += work->run_count;
    study->expected = study->expected > study->wanted ? study->expected : study->wanted;
    return STATUS_OK;
}

static Status calibrate_fold(void *of, size_t member, StudyPart *part) {
    CalibrateWork *work = of;
    Calibration *answer = work->answer;
    const RunRecord *run = &part->run;
    answer->runs++;
    if (run->status != STATUS_OK) {
        answer->failed++;
        TRY(study_failures_add(&answer->failures, (int)run->status, status_slug(run->status),
                               member, run->why));
    }
    TRY(calibrate_fold_part(work, &work->runs[member - work->first],
                            (CalibratePart *)(void *)part));
    return member + 1 == work->work.wanted ? calibrate_continue(work) : STATUS_OK;
}

// --- the answer ---

static const char *calibrate_pointer(const CalibrateWork *work, size_t i) {
    return study_axis_pointer(&work->study->parameters.at[i], 0);
}

static Status calibrate_report_parameter(CalibrateWork *work, size_t i, Simulation *scene) {
    const StudyAxis *axis = &work->study->parameters.at[i];
    const CalibrateStart *best = calibrate_best(work);
    const CalibrateAssessment *found = &work->assessment;
    CalibratedParameter *parameter = list_append(&work->answer->parameters, sizeof *parameter);
    TRY(status_made(parameter != NULL));
    parameter->value = parameter->standard_error = (double)NAN;
    TRY(text_copy(calibrate_pointer(work, i), &parameter->pointer));
    for (size_t k = 0; k < axis->pointers.count; k++)
        TRY(texts_append(&parameter->pointers, axis->pointers.at[k]));
    bool is_tag = false;
    const Field *row = study_axis_find(axis, scene, &is_tag, "", NULL);
    TRY(text_copy(row != NULL ? row->unit : NULL, &parameter->unit));
    if (best == NULL)
        return STATUS_OK;
    const double u = best->at[i];
    parameter->value = calibrate_value(axis, u);
    parameter->is_identifiable = found->reasons[i] == UNDETERMINED_NOT;
    if (found->reasons[i] == UNDETERMINED_WIDE)
        return STATUS_OK;
    parameter->standard_error = found->errors[i] * calibrate_derivative(axis, u);
    TRY(status_made(reals_allocate(&parameter->interval_95, 2)));
    parameter->interval_95.at[0] = calibrate_value_beyond(axis, found->low[i]);
    parameter->interval_95.at[1] = calibrate_value_beyond(axis, found->high[i]);
    return STATUS_OK;
}

static double calibrate_correlation(const CalibrateWork *work, size_t i, size_t k) {
    const double *covariance = work->assessment.covariance;
    const size_t n = work->variables;
    const double product = covariance[i * n + i] * covariance[k * n + k];
    return i == k ? 1 : isfinite(product) ? covariance[i * n + k] / sqrt(product) : (double)NAN;
}

static Status calibrate_report_correlation(CalibrateWork *work) {
    for (size_t i = 0; i < work->parameters; i++) {
        Reals *row = list_append(&work->answer->correlation, sizeof *row);
        TRY(status_made(row != NULL && reals_allocate(row, work->parameters)));
        for (size_t k = 0; k < work->parameters; k++)
            row->at[k] = calibrate_correlation(work, i, k);
    }
    return STATUS_OK;
}

static Status calibrate_report_channel(CalibrateWork *work, size_t c) {
    const MeasuredTarget *target = &work->targets[c];
    const CalibrateStart *best = calibrate_best(work);
    const size_t count = target->values.count;
    const double *own = best->residual + target->place;
    CalibrationResidual *residual = list_append(&work->answer->residuals, sizeof *residual);
    CalibrationMotion *motion = list_append(&work->answer->motions, sizeof *motion);
    TRY(status_made(residual != NULL && motion != NULL));
    size_t number;
    const MeasuredChannel *measured = target->measured;
    const Channel *channel = channel_find(measured->channel, &number);
    const double decibels = target->is_spectrum ? 10 / log(10) : 1;
    const char *unit = target->is_spectrum ? "dB" : channel->unit;
    residual->rms =
        decibels * target->deviation * sqrt(calibrate_sum_squares(own, count) / (double)count);
    residual->measured_rms = target->is_spectrum ? (double)NAN : measured_rms(measured);
    residual->deviation = decibels * target->deviation;
    residual->samples = target->samples;
    motion->is_spectrum = target->is_spectrum;
    TRY(text_copy(measured->channel, &residual->channel));
    TRY(text_copy(unit, &residual->unit));
    TRY(text_copy(measured->channel, &motion->channel));
    TRY(text_copy(target->is_spectrum ? channel->psd_unit : unit, &motion->unit));
    const size_t stride = (count + MOTION_POINTS - 1) / MOTION_POINTS,
                 points = (count - 1) / stride + 1;
    TRY(status_made(reals_allocate(&motion->at, points) &&
                    reals_allocate(&motion->measured, points) &&
                    reals_allocate(&motion->fitted, points)));
    for (size_t k = 0; k < points; k++) {
        const size_t i = k * stride;
        const double value = target->values.at[i], fitted = value + target->deviation * own[i];
        motion->at.at[k] =
            target->is_spectrum
                ? (double)(i + 1) / ((double)target->welch.segment * measured->interval)
                : measured_time(measured, target->first + i);
        motion->measured.at[k] = target->is_spectrum ? exp(value) : value;
        motion->fitted.at[k] = target->is_spectrum ? exp(fitted) : fitted;
    }
    return STATUS_OK;
}

// Whether residuals are correlated in time (Ljung and Box 1978).
static bool calibrate_is_correlated(const double *residual, size_t count) {
    const double squares = calibrate_sum_squares(residual, count), n = (double)count;
    double sum = 0;
    const size_t lags = count / 4 < LAGS ? count / 4 : LAGS;
    for (size_t lag = 1; lag <= lags; lag++) {
        double products = 0;
        for (size_t i = lag; i < count; i++)
            products += residual[i] * residual[i - lag];
        sum += products * products / (squares * squares) / (n - (double)lag);
    }
    return squares > 0 && n * (n + 2) * sum > calibrate_chi_square((double)lags, quantile_999);
}

// Whether the model explains the measured motions, and a sentence if not.
static Status calibrate_check_fit(CalibrateWork *work, bool *is_explained) {
    Calibration *answer = work->answer;
    const CalibrateStart *best = calibrate_best(work);
    double chi_square = 0;
    size_t given = 0;
    *is_explained = true;
    for (size_t c = 0; c < work->study->measured.count && *is_explained; c++) {
        const MeasuredTarget *target = &work->targets[c];
        const CalibrationResidual *residual = &answer->residuals.at[c];
        const double *own = best->residual + target->place;
        const size_t count = target->values.count;
        if (target->is_spectrum) {
            // Two estimated spectra, if both are of motions that cannot be predicted.
            *is_explained = residual->rms < spectrum_misfit * residual->deviation *
                                                (work->is_chaotic ? sqrt(2) : 1);
            if (!*is_explained)
                return status_made(text_format(
                    &answer->detail,
                    "the spectrum of %s differs from the best fit by %.2g dB rms, and %.2g dB "
                    "would be expected of spectra of this length",
                    residual->channel, residual->rms, residual->deviation));
        } else if (!isnan(target->measured->deviation)) {
            chi_square += calibrate_sum_squares(own, count);
            given += count;
        } else if (count > 0 && calibrate_is_correlated(own, count)) {
            *is_explained = residual->rms < structured * residual->measured_rms;
            if (!*is_explained)
                return status_made(text_format(
                    &answer->detail,
                    "the differences of %s from the best fit, %.2g %s rms or %.2g %% of the "
                    "motion, are correlated in time, which noise is not",
                    residual->channel, residual->rms, residual->unit,
                    100 * residual->rms / residual->measured_rms));
            TRY(warnings_add(&answer->warnings, json_pointer_at("/study/measured", c).at,
                             "the differences of %s from the fit, %.2g %s rms, are correlated in "
                             "time: the true intervals are wider than those given",
                             residual->channel, residual->rms, residual->unit));
        }
    }
    if (given == 0)
        return STATUS_OK;
    answer->chi_square = chi_square;
    answer->freedom = given > work->variables ? given - work->variables : 1;
    const double freedom = (double)answer->freedom,
                 limit = calibrate_chi_square(freedom, quantile_999);
    *is_explained = chi_square <= limit;
    if (!*is_explained)
        return status_made(text_format(&answer->detail,
                                       "the differences from the best fit are %.3g times as large "
                                       "as the given deviation: chi square is %.4g for %.0f "
                                       "degrees of freedom, noise exceeds %.4g once in a thousand "
                                       "times",
                                       sqrt(chi_square / freedom), chi_square, freedom, limit));
    return STATUS_OK;
}

// Why a parameter is not identifiable.
static Status calibrate_explain(CalibrateWork *work, size_t i) {
    const CalibrateAssessment *found = &work->assessment;
    const StudyAxis *axis = &work->study->parameters.at[i];
    const char *pointer = calibrate_pointer(work, i);
    char **detail = &work->answer->detail;
    if (found->reasons[i] == UNDETERMINED_RIVAL)
        return status_made(text_format(detail,
                                       "%s is not determined: %.4g and %.4g fit equally well",
                                       pointer, calibrate_value(axis, calibrate_best(work)->at[i]),
                                       calibrate_value(axis, found->rivals[i])));
    if (found->reasons[i] == UNDETERMINED_BOUND)
        return status_made(text_format(
            detail, "%s ends at %.4g, the end of its range: the best value lies beyond, widen it",
            pointer, calibrate_value(axis, calibrate_best(work)->at[i])));
    size_t partner = i;
    for (size_t k = 0; k < work->parameters; k++)
        if (k != i && found->reasons[k] == UNDETERMINED_WIDE &&
            fabs(calibrate_correlation(work, i, k)) > 0.9)
            partner = k;
    if (partner != i)
        return status_made(text_format(detail,
                                       "%s and %s are not determined one by one: only a "
                                       "combination of them is (their correlation is %.4f)",
                                       pointer, calibrate_pointer(work, partner),
                                       calibrate_correlation(work, i, partner)));
    return status_made(
        text_format(detail,
                    isfinite(found->errors[i])
                        ? "%s is not determined: its 95 %% interval is as wide as its range"
                        : "%s is not determined: it does not change the measured channels",
                    pointer));
}

static Status calibrate_report_verdict(CalibrateWork *work) {
    Calibration *answer = work->answer;
    bool is_explained;
    TRY(calibrate_check_fit(work, &is_explained));
    if (!is_explained) {
        answer->verdict = CALIBRATE_NOT_EXPLAINED;
        // The errors are those of noise, not of the model.
        for (size_t i = 0; i < work->parameters; i++) {
            CalibratedParameter *parameter = &answer->parameters.at[i];
            parameter->standard_error = (double)NAN;
            free(parameter->interval_95.at);
            parameter->interval_95 = (Reals){NULL, 0};
        }
        return STATUS_OK;
    }
    for (size_t i = 0; i < work->parameters; i++)
        if (work->assessment.reasons[i] != UNDETERMINED_NOT) {
            answer->verdict = CALIBRATE_NOT_IDENTIFIABLE;
            return calibrate_explain(work, i);
        }
    answer->verdict = CALIBRATE_EXPLAINED;
    const CalibrationResidual *first = &answer->residuals.at[0];
    return status_made(text_format(
        &answer->detail,
        "the fitted scene explains the measured motions to within their noise (%s: %.3g %s rms), "
        "and they determine all parameters",
        first->channel, first->rms, first->unit));
}

static Status calibrate_warn(CalibrateWork *work) {
    Calibration *answer = work->answer;
    const CalibrateStart *best = calibrate_best(work);
    if (work->is_limited && work->fit == CALIBRATE_TIME)
        TRY(warnings_add(&answer->warnings, "/study/measured",
                         "small errors grow too fast to predict the motion beyond about %.3g s: "
                         "only the samples before were fitted",
                         work->horizon));
    if (work->is_limited && work->fit == CALIBRATE_PSD)
        TRY(warnings_add(&answer->warnings, "/study/fit",
                         "small errors grow too fast to predict the motion beyond about %.3g s, "
                         "which is too short to determine the parameters: spectra were fitted",
                         work->horizon));
    if (work->study->fit == CALIBRATE_PSD && work->is_chaotic)
        TRY(warnings_add(&answer->warnings, "/study/fit",
                         "the motion cannot be predicted to the end of the record: its spectrum "
                         "changes with the smallest errors, and the fit is accordingly uncertain"));
    for (size_t i = 0; i < work->parameters; i++)
        if (best->at[i] < 1e-9 || best->at[i] > 1 - 1e-9)
            TRY(warnings_add(&answer->warnings, json_pointer_at("/study/parameters", i).at,
                             "the best value, %.4g, is the end of the range: a wider range may fit "
                             "better",
                             calibrate_value(&work->study->parameters.at[i], best->at[i])));
    if (calibrate_has_shift(work) && fabs(best->at[work->parameters] - 0.5) > 0.5 - 1e-9)
        TRY(warnings_add(&answer->warnings, "/study/max_shift",
                         "the fitted shift is the largest allowed one"));
    return STATUS_OK;
}

static Status calibrate_end(void *of, const StudyTools *tools, Problem *problem) {
    CalibrateWork *work = of;
    Calibration *answer = work->answer;
    const CalibrateStart *best = calibrate_best(work);
    Simulation scene = {0};
    (void)tools;
    (void)problem;
    answer->fit = work->fit;
    Status status = fields_copy(simulation_fields, work->work.simulation, &scene);
    for (size_t i = 0; i < work->parameters && status == STATUS_OK; i++)
        status = calibrate_report_parameter(work, i, &scene);
    simulation_clear(&scene);
    TRY(status);
    if (best == NULL) {
        answer->verdict = CALIBRATE_NOT_EXPLAINED;
        return status_made(text_format(&answer->detail, "none of the %llu runs ended: see failures",
                                       (unsigned long long)answer->runs));
    }
    TRY(calibrate_report_correlation(work));
    for (size_t c = 0; c < work->study->measured.count; c++)
        TRY(calibrate_report_channel(work, c));
    answer->shift = calibrate_shift(work, best->at);
    if (calibrate_has_shift(work))
        answer->shift_error =
            work->assessment.errors[work->parameters] * 2 * work->study->max_shift;
    TRY(calibrate_report_verdict(work));
    return calibrate_warn(work);
}

static void calibrate_free(void *of) {
    CalibrateWork *work = of;
    for (size_t i = 0; i < work->start_count; i++)
        calibrate_drop(&work->starts[i]);
    for (size_t i = 0; i < VARIABLES; i++)
        free(work->columns[i]);
    for (size_t c = 0; work->targets != NULL && c < work->study->measured.count; c++)
        measured_target_clear(&work->targets[c]);
    simulation_clear(&work->base);
    free(work->targets);
    free(work->deviations);
    free(work->points.at);
    free(work->starts);
    free(work->runs);
}

// Parts of the record that are fitted one after the other; of spectra the whole alone.
static void calibrate_make_windows(CalibrateWork *work) {
    const MeasuredChannels *measured = &work->study->measured;
    double from = (double)INFINITY, to = 0;
    size_t samples = 0;
    for (size_t c = 0; c < measured->count; c++) {
        const MeasuredChannel *channel = &measured->at[c];
        from = fmin(from, channel->start);
        to = fmax(to, measured_time(channel, channel->samples.count - 1));
        samples += channel->samples.count;
    }
    for (int k = WINDOWS - 1; k >= 0; k--) {
        const double share = pow(window_growth, -k);
        const bool is_short = share * (double)samples < (double)(SAMPLES_MIN + 4 * work->variables);
        if (k == 0 || (work->fit == CALIBRATE_TIME && !is_short))
            work->ends[work->windows++] =
                k == 0 ? to : fmax(from + share * (to - from), from + 2 * work->study->max_shift);
    }
}

static Status calibrate_begin(void *of, const StudyTools *tools, Problem *problem) {
    CalibrateWork *work = of;
    const CalibrateStudy *study = work->study = work->work.study;
    const size_t count = study->measured.count, starts = (size_t)study->starts;
    (void)tools;
    (void)problem;
    work->answer = work->work.answer;
    work->parameters = study->parameters.count;
    work->variables = work->parameters + (study->max_shift > 0);
    work->fit = study->fit;
    work->start_count = SCREENED_FIRST * starts;
    work->targets = calloc(count, sizeof *work->targets);
    work->deviations = calloc(count, sizeof *work->deviations);
    work->starts = calloc(work->start_count + EXPLORED, sizeof *work->starts);
    work->runs =
        calloc(work->start_count + EXPLORED + (starts + IMPROVED) * VARIABLES, sizeof *work->runs);
    TRY(status_made(work->targets != NULL && work->deviations != NULL && work->starts != NULL &&
                    work->runs != NULL));
    size_t rows = 0;
    for (size_t c = 0; c < count; c++) {
        const MeasuredChannel *measured = &study->measured.at[c];
        work->deviations[c] =
            isnan(measured->deviation) ? measured_rms(measured) : measured->deviation;
        rows += measured->samples.count;
    }
    for (size_t i = 0; i < work->parameters; i++)
        TRY(status_made((work->columns[i] = calloc(rows + 1, sizeof(double))) != NULL));
    calibrate_make_windows(work);
    TRY(calibrate_place_starts(work));
    TRY(calibrate_open(work, true));
    calibrate_list_runs(work);
    // Every start takes all its steps in every window, with every estimate of the noise.
    // And again for every exploration.
    const size_t rounds =
        (WINDOWS + 1) * (RETRIES + 1) * (STEPS_FIRST + SCREENED) + (REPEATS + 3) * STEPS_LAST;
    work->work.members = work->start_count +
                         EXPLORATIONS * (EXPLORED + IMPROVED * STEPS_LAST * (VARIABLES + 1)) +
                         starts * (rounds + 12) * (work->parameters + 1) + 4 * VARIABLES;
    work->work.wanted = work->run_count;
    work->work.part_bytes = sizeof(CalibratePart) + 2 * rows * sizeof(double);
    work->work.bytes = (2 * starts + work->parameters) * rows * sizeof(double);
    return STATUS_OK;
}

const StudyKind study_calibrate = {
    .kind = {"calibrate", "parameters of the scene fitted to measured motions",
             calibrate_study_fields, sizeof(CalibrateStudy)},
    .answer = &(const Kind){"calibrate", "fitted parameters and their uncertainty",
                            calibration_fields, sizeof(Calibration)},
    .shorten = "ask for fewer starts or parameters, or a shorter record",
    .document = "calibration",
    .references = calibrate_references,
    .max_runs = 1000,
    .complete = calibrate_complete,
    .cost = calibrate_cost,
    .work_size = sizeof(CalibrateWork),
    .part_size = sizeof(CalibratePart),
    .begin = calibrate_begin,
    .scene = calibrate_scene,
    .keep = calibrate_keep,
    .fold = calibrate_fold,
    .end = calibrate_end,
    .clear = calibrate_clear_part,
    .free = calibrate_free,
};
