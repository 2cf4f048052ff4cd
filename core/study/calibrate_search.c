// The search of a calibration. The sum of squared differences from an impacting motion has many
// local minima, most of them made by the late part of the record, where small errors have grown.
// The first part of the record is fitted first, then longer ones, each from points around the
// result of the one before:
//
//     screen      many points, of which the best become starts
//     fit         each start by Levenberg and Marquardt's method, all side by side
//     covariance  derivatives at the best point, on both sides of it, after the last window
//     explore     points around it, near and far; better ones are fitted
//
// A window whose valleys are too narrow to be found with certainty is left: the one before is the
// result then. Members are runs in batches: of each start that is not done the derivatives by all
// variables, or one step. The next batch is listed when the last of this one is folded.
//
// A run is evaluated at the measured times by a cubic through four samples (Lagrange); where the
// times are those of its samples, which is usual, by the samples themselves. Its spectrum is that
// of these values, so that both spectra have the same window, leakage and aliasing.
//
// A spectrum of K averaged segments has a relative deviation of about d = sqrt(1.06 / K) for Hann's
// window and half overlap (Welch 1967). The noise of the measurement adds a constant density N.
// Where the motion can be predicted, its own density S does not scatter, and S + N has the variance
// d^2 (N^2 + 2 N S). Compared are functions of the densities that have the same deviation d at all
// frequencies: sqrt(1 + 2 S / N), or log(S + N) of motions that cannot be predicted and in screens,
// where it has the wider valleys.
#include "core/study/calibrate_search.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/philox.h"
#include "core/math/student_t.h"
#include "core/study/inputs.h"

enum {
    VARIABLES = CALIBRATE_VARIABLES,
    WINDOW_SAMPLES = 64, // at least, in the first window
    SCREENED_FIRST = 32, // points for each start in the first window
    SCREENED = 16,       // and in later ones
    STEPS = 60,          // of a start in a window, tried
    EXPLORED = 192,      // points around the best fit
    EXPLORATIONS = 6,
    HISTORY_MAX = 4096,
    SEGMENTS_MIN = 4,
    RUNS_MAX = 1 << 22, // more than a search can ask for
};

static const double snap = 1e-8; // of a sample interval: a time this close is a sample's
// This share of the noise's densities lies below its quantile, of the normal distribution.
static const double floor_share = 0.1, floor_quantile = -1.2816;
static const double floor_min = 1e-8;  // of the largest density
static const double square_min = 0.25; // of the function of a density: the rest is noise
static const double variance_hann = 1.06;

static const double window_growth = 1.4142; // of the length of windows
static const double growth_max = 4;         // growth of effects by which valleys are missed
static const double difference_share = 0.5; // of the deviation of one parameter alone
static const double difference_first = 1e-5, difference_min = 1e-9, difference_max = 1e-4,
                    difference_chaos = 0.1;
static const double correlation_max = 0.95; // of derivatives that are mostly noise
// Of the variance of the noise: a decrease below it ends a fit, one above it begins another.
static const double tolerance = 1e-3, improvement = 1e-2;
static const double scatter = 2, explored[] = {0.7, 2, 5, 12, 30, 80}; // standard errors
static const double scatter_max = 0.5;                                 // of the range
static const double predictable = 1 / 3.0; // of the trust horizon: errors have grown 2000 times
// Half widths of intervals, of the range: of the window before, and of the result.
static const double half_width_max = 0.2, undetermined = 0.5;
static const double rival_distance_min = 0.25; // of the range, of a valley that fits as well

static const double calibrate_quantile_95 = 1.645; // of the normal distribution, one-sided

// --- Measured motions ---

double measured_rms(const MeasuredChannel *measured) {
    double sum = 0, squares = 0;
    for (size_t i = 0; i < measured->samples.count; i++)
        sum += measured->samples.at[i];
    const double mean = sum / (double)measured->samples.count;
    for (size_t i = 0; i < measured->samples.count; i++)
        squares += (measured->samples.at[i] - mean) * (measured->samples.at[i] - mean);
    return sqrt(squares / (double)measured->samples.count);
}

// Densities of evenly spaced values, without that of frequency 0.
static Status measured_target_spectrum(const MeasuredTarget *target, const double *samples,
                                       FftCache *cache, double *densities, Problem *problem) {
    Columns columns = {0};
    Spectrum spectrum = {0};
    static const char *const units[] = {""};
    TRY(columns_allocate(&columns, 1, target->samples, 0, problem));
    columns_name(&columns, 0, "measured", "");
    memcpy(columns.at[0].values, samples, target->samples * sizeof *samples);
    const Status status = welch_spectrum(&columns, units, 1 / target->measured->interval,
                                         &target->welch, NULL, cache, &spectrum, problem);
    if (status == STATUS_OK)
        memcpy(densities, spectrum.densities.at[0].values + 1,
               target->values.count * sizeof *densities);
    spectrum_clear(&spectrum);
    columns_clear(&columns);
    return status;
}

// The function of a density that is compared.
static double measured_target_scale(const MeasuredTarget *target, double density) {
    return target->is_logarithmic ? log(fmax(density, target->floor))
                                  : sqrt(fmax(2 * density / target->floor - 1, square_min));
}

static Status measured_target_make_spectrum(MeasuredTarget *target, const SpectrumRequest *psd) {
    const MeasuredChannel *measured = target->measured;
    const size_t max = target->samples / SEGMENTS_MIN;
    WelchSettings *welch = &target->welch;
    *welch = (WelchSettings){
        .segment = psd->segment < max ? (size_t)psd->segment : max,
        .window = psd->window != CHOICE_ABSENT ? psd->window : (int)WELCH_HANN,
        .detrend = psd->detrend != CHOICE_ABSENT ? psd->detrend : (int)WELCH_DETREND_CONSTANT};
    welch->overlap = psd->overlap < welch->segment ? (size_t)psd->overlap : welch->segment / 2;
    TRY(status_made(reals_allocate(&target->values, welch->segment / 2)));
    const size_t count = target->values.count;
    double *values = target->values.at;
    TRY(measured_target_spectrum(target, &measured->samples.at[target->first], NULL, values, NULL));
    const size_t hop = welch->segment - welch->overlap;
    const double segments = (double)((target->samples - welch->overlap) / hop);
    target->deviation = sqrt(variance_hann / segments);
    Reals sorted = {NULL, 0};
    TRY(study_copy_reals(values, count, &sorted));
    reals_sort(sorted.at, count);
    const double freedom = 2 / (target->deviation * target->deviation);
    target->floor = isnan(measured->deviation)
                        ? sorted.at[(size_t)(floor_share * (double)count)] * freedom /
                              calibrate_chi_square(freedom, floor_quantile)
                        : 2 * measured->deviation * measured->deviation * measured->interval;
    target->floor = fmax(target->floor, floor_min * sorted.at[count - 1]);
    free(sorted.at);
    for (size_t i = 0; i < count; i++)
        values[i] = measured_target_scale(target, values[i]);
    return STATUS_OK;
}

// The samples from `from` to `to` [s], both included, or their spectrum.
static Status measured_target_make(const CalibrateWork *work, size_t channel, double from,
                                   double to, MeasuredTarget *target) {
    const MeasuredChannel *measured = &work->study->measured.at[channel];
    const double interval = measured->interval, last = (double)measured->samples.count - 1;
    const double low = fmax(ceil((from - measured->start) / interval - snap), 0);
    const double high = fmin(floor((to - measured->start) / interval + snap), last);
    free(target->values.at);
    *target = (MeasuredTarget){.measured = measured,
                               .is_spectrum = work->fit == CALIBRATE_PSD,
                               .is_logarithmic = work->is_chaotic || work->stage == STAGE_SCREEN,
                               .deviation = work->deviations[channel]};
    if (high < low)
        return STATUS_OK;
    target->first = (size_t)low;
    target->samples = (size_t)(high - low) + 1;
    if (target->is_spectrum)
        return measured_target_make_spectrum(target, &work->work.simulation->output.psd);
    return study_copy_reals(&measured->samples.at[target->first], target->samples, &target->values);
}

// The cubic through the four samples around a place, in sample intervals from the first.
static double measured_interpolate(const double *samples, size_t count, double place) {
    const double near = nearbyint(place);
    if (fabs(place - near) < snap || count < 4)
        return samples[(size_t)fmin(fmax(near, 0), (double)(count - 1))];
    const double first = fmin(fmax(floor(place) - 1, 0), (double)(count - 4));
    const double *y = &samples[(size_t)first], x = place - first;
    return -y[0] * (x - 1) * (x - 2) * (x - 3) / 6 + y[1] * x * (x - 2) * (x - 3) / 2 -
           y[2] * x * (x - 1) * (x - 3) / 2 + y[3] * x * (x - 1) * (x - 2) / 6;
}

// The weighted residuals of a run whose measured times are moved by `shift` [s].
static Status measured_target_compare(const MeasuredTarget *target, const Response *response,
                                      double shift, FftCache *cache, double *residual,
                                      Problem *problem) {
    const Column *column = columns_find(&response->series, target->measured->channel);
    Reals motion = {NULL, 0};
    if (target->samples == 0)
        return STATUS_OK;
    if (column == NULL)
        return problem_set(problem, STATUS_INTERNAL, "the run lacks a channel");
    TRY(status_made(reals_allocate(&motion, target->samples)));
    for (size_t i = 0; i < target->samples; i++) {
        const double time = measured_time(target->measured, target->first + i) + shift;
        motion.at[i] =
            measured_interpolate(column->values, response->count, time * response->sample_rate);
    }
    Status status = STATUS_OK;
    if (target->is_spectrum)
        status = measured_target_spectrum(target, motion.at, cache, motion.at, problem);
    for (size_t i = 0; i < target->values.count && status == STATUS_OK; i++) {
        const double value = target->is_spectrum
                                 ? measured_target_scale(target, motion.at[i] + target->floor)
                                 : motion.at[i];
        residual[i] = (value - target->values.at[i]) / target->deviation;
    }
    free(motion.at);
    return status;
}

// --- The runs ---

Status calibrate_make_base(const MeasuredChannels *measured, const Simulation *simulation,
                           double end, Simulation *base) {
    TRY(fields_copy(simulation_fields, simulation, base));
    study_run_fix_solver(base);
    // As many samples as the measured times need.
    const double interval = measured->at[0].interval, rate = base->scene.sample_rate;
    Output *output = &base->output;
    base->scene.sample_rate = fmax(ceil(rate * interval * (1 - 1e-9)), 1) / interval;
    const double samples = ceil(end * base->scene.sample_rate) + 2;
    base->scene.duration = fmin(base->scene.duration, samples / base->scene.sample_rate);
    texts_clear(&output->channels);
    texts_clear(&output->psd.channels);
    output->impacts = output->reduction = false;
    output->statistics_from = 0;
    for (size_t i = 0; i < measured->count; i++) {
        bool is_listed = false;
        for (size_t k = 0; k < i; k++)
            is_listed |= strcmp(measured->at[i].channel, measured->at[k].channel) == 0;
        if (!is_listed)
            TRY(texts_append(&output->channels, measured->at[i].channel));
    }
    return STATUS_OK;
}

Status calibrate_scene(const void *of, size_t member, Simulation *scene, StudyPart *part,
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

Status calibrate_keep(const void *of, const Outcome *outcome, const StudyTools *tools,
                      StudyPart *base, Problem *problem) {
    const CalibrateWork *work = of;
    CalibratePart *part = (CalibratePart *)(void *)base;
    FftCache *cache = tools->workspace != NULL ? &tools->workspace->transforms : NULL;
    part->residual = calloc(work->rows + 1, sizeof(double));
    TRY(status_made(part->residual != NULL));
    for (size_t c = 0; c < work->study->measured.count; c++)
        TRY(measured_target_compare(&work->targets[c], &outcome->response,
                                    calibrate_shift(work, part->run->at), cache,
                                    part->residual + work->targets[c].place, problem));
    return STATUS_OK;
}

void calibrate_clear_part(StudyPart *part) {
    free(((CalibratePart *)(void *)part)->residual);
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
        const double *at = start->fit.at;
        if (start->state == START_EVALUATE || start->state == START_TRY)
            calibrate_add_run(work, i, 0, 0, start->state == START_TRY ? start->fit.trial : at);
        for (size_t k = 0; k < work->variables && start->state == START_DERIVE; k++) {
            const double difference = start->differences[k];
            calibrate_add_run(work, i, k, at[k] + difference <= 1 ? difference : -difference, at);
            if (work->stage == STAGE_FIT)
                continue;
            calibrate_add_run(work, i, k, at[k] - difference >= 0 ? -difference : difference, at);
            work->runs[work->run_count - 1].is_second = true;
        }
    }
}

// --- Starts ---

// Variance of a residual, which is 1 if the deviations are right.
static double calibrate_variance(const CalibrateWork *work, double cost) {
    const size_t freedom = work->rows > work->variables ? work->rows - work->variables : 1;
    return cost / (double)freedom;
}

static int calibrate_compare_starts(const void *a, const void *b) {
    const CalibrateStart *x = a, *y = b;
    if (x->fit.cost != y->fit.cost)
        return x->fit.cost < y->fit.cost ? -1 : 1;
    return (x->number > y->number) - (x->number < y->number);
}

static void calibrate_truncate_starts(CalibrateWork *work, size_t count) {
    for (size_t i = count; i < work->start_count; i++) {
        free(work->starts[i].residual);
        work->starts[i].residual = NULL;
    }
    if (count < work->start_count)
        work->start_count = count;
}

// Sorts the starts by their cost, without those whose runs failed.
static void calibrate_sort_starts(CalibrateWork *work) {
    size_t kept = work->start_count;
    qsort(work->starts, kept, sizeof *work->starts, calibrate_compare_starts);
    while (kept > 0 && !isfinite(work->starts[kept - 1].fit.cost))
        kept--;
    calibrate_truncate_starts(work, kept);
}

// Start `k` becomes a point around its parent, drawn from what the fit leaves open: the standard
// errors times `scale`.
static void calibrate_draw_start(CalibrateWork *work, size_t k, const CalibrateStart *parent,
                                 double scale) {
    CalibrateStart *start = &work->starts[k];
    double normal[VARIABLES + 1], step[VARIABLES], largest = 0;
    philox_normal_pairs(work->study->search_seed, work->draws++, 0, (work->variables + 1) / 2,
                        normal);
    least_squares_draw(&parent->fit.equations, normal, step);
    for (size_t i = 0; i < work->variables; i++) {
        step[i] *= scale * sqrt(calibrate_variance(work, parent->fit.cost));
        largest = fmax(largest, fabs(step[i]));
    }
    *start = (CalibrateStart){.state = START_EVALUATE, .number = k};
    memcpy(start->differences, parent->differences, sizeof start->differences);
    for (size_t i = 0; i < work->variables; i++) {
        // Reflected at the bounds.
        const double at = fabs(parent->fit.at[i] + step[i] * fmin(1, scatter_max / largest));
        start->fit.at[i] = fmax(at > 1 ? 2 - at : at, 0);
    }
}

// Leaves the best starts and adds points around them, `count` in all, at these multiples of their
// standard errors.
static void calibrate_scatter_starts(CalibrateWork *work, size_t parents, size_t count,
                                     const double *scales, size_t scale_count) {
    calibrate_truncate_starts(work, parents);
    parents = work->start_count;
    for (size_t k = parents; k < count; k++)
        calibrate_draw_start(work, k, &work->starts[k % parents], scales[k % scale_count]);
    work->start_count = count;
}

// --- Derivatives and steps ---

static Status calibrate_add_step(CalibrateWork *work, const CalibrateStart *start) {
    CalibrationSteps *history = &work->answer->history;
    if (history->count >= HISTORY_MAX)
        return STATUS_OK;
    CalibrationStep *step = list_grow(history, sizeof *step);
    TRY(status_made(step != NULL));
    *step = (CalibrationStep){.index = history->count - 1,
                              .start = start->number,
                              .until = work->ends[work->window],
                              .shift = calibrate_shift(work, start->fit.at),
                              .cost = start->fit.cost};
    TRY(status_made(reals_allocate(&step->values, work->parameters)));
    for (size_t i = 0; i < work->parameters; i++)
        step->values.at[i] = calibrate_value(&work->study->parameters.at[i], start->fit.at[i]);
    return STATUS_OK;
}

// The next step to try, or the end of the fit.
static void calibrate_plan_step(CalibrateWork *work, CalibrateStart *start) {
    const double decrease = tolerance * calibrate_variance(work, start->fit.cost);
    const bool is_next = start->steps < STEPS && least_squares_step(&start->fit, decrease);
    start->state = is_next ? START_TRY : START_DONE;
}

// A difference is half of the deviation that noise gives one parameter alone: the derivatives are
// those over the range that matters, also where samples jump as an impact passes them.
static void calibrate_set_differences(const CalibrateWork *work, CalibrateStart *start) {
    const NormalEquations *equations = &start->fit.equations;
    const double variance = calibrate_variance(work, start->fit.cost);
    for (size_t i = 0; i < work->variables && !work->is_chaotic; i++) {
        const double slope = equations->matrix[i * (equations->count + 1)];
        const double wanted = slope > 0 ? difference_share * sqrt(variance / slope) : 1;
        start->differences[i] = fmin(fmax(wanted, difference_min), difference_max);
    }
}

// Spectra of motions that cannot be predicted differ from run to run as from the measured one. What
// that adds to the squares of the derivatives is removed from them.
static void calibrate_remove_noise(const CalibrateWork *work, double cost, double *matrix) {
    const size_t n = work->variables;
    const double step = difference_chaos * (work->stage == STAGE_FIT ? 1 : 2);
    const double noise = 2 * cost / (step * step);
    for (size_t i = 0; i < n * n; i += n + 1)
        matrix[i] = fmax(matrix[i] - noise, 1e-3 * noise);
    for (size_t i = 0; i < n * n; i++) {
        const double max =
            correlation_max * sqrt(matrix[i / n * (n + 1)] * matrix[i % n * (n + 1)]);
        if (i % (n + 1) != 0)
            matrix[i] = fmin(fmax(matrix[i], -max), max);
    }
}

static void calibrate_fold_column(CalibrateWork *work, CalibrateStart *start,
                                  const CalibrateRun *run, const CalibratePart *part) {
    // The mean of the sides whose runs ended; 0 without any.
    double *column = work->columns[run->column];
    if (!run->is_second) {
        memset(column, 0, work->rows * sizeof *column);
        work->sides = 0;
    }
    work->sides += part->residual != NULL;
    for (size_t i = 0; i < work->rows && part->residual != NULL; i++) {
        const double slope = (part->residual[i] - start->residual[i]) / run->step;
        column[i] += (slope - column[i]) / work->sides;
    }
    if (run->column + 1 < work->variables || (work->stage != STAGE_FIT && !run->is_second))
        return;
    normal_equations_make((const double *const *)work->columns, work->variables, start->residual,
                          work->rows, &start->fit.equations);
    if (work->is_chaotic)
        calibrate_remove_noise(work, start->fit.cost, start->fit.equations.matrix);
    calibrate_set_differences(work, start);
    if (work->stage == STAGE_FIT)
        calibrate_plan_step(work, start);
    else
        start->state = START_DONE;
}

// Folds the run of a point or of a step.
static Status calibrate_fold_point(CalibrateWork *work, const CalibrateRun *run,
                                   CalibratePart *part) {
    CalibrateStart *start = &work->starts[run->start];
    const double before = start->fit.cost;
    const double cost = part->residual != NULL ? calibrate_sum_squares(part->residual, work->rows)
                                               : (double)INFINITY;
    if (isfinite(cost)) {
        CalibratePoint *point = list_grow(&work->points, sizeof *point);
        TRY(status_made(point != NULL));
        point->cost = cost;
        memcpy(point->at, run->at, sizeof point->at);
    }
    const bool is_step = start->state == START_TRY;
    start->steps += is_step;
    if (is_step && !least_squares_move(&start->fit, cost)) {
        calibrate_plan_step(work, start);
        return STATUS_OK;
    }
    start->fit.cost = cost;
    start->horizon = part->part.run.summary.trust_horizon;
    start->state = START_DONE;
    if (work->stage != STAGE_FIT || !isfinite(cost)) // only the cost is needed of so many points
        return STATUS_OK;
    free(start->residual);
    start->residual = part->residual;
    part->residual = NULL;
    if (!is_step || before - cost >= tolerance * calibrate_variance(work, cost))
        start->state = START_DERIVE;
    return calibrate_add_step(work, start);
}

// --- Stages ---

// All starts are to be evaluated.
static void calibrate_begin_stage(CalibrateWork *work, CalibrateStage stage) {
    work->stage = stage;
    for (size_t i = 0; i < work->start_count; i++) {
        CalibrateStart *start = &work->starts[i];
        start->state = START_EVALUATE;
        start->steps = 0;
        least_squares_begin(&start->fit);
        for (size_t k = 0; k < work->variables; k++)
            start->differences[k] = work->is_chaotic            ? difference_chaos
                                    : start->differences[k] > 0 ? start->differences[k]
                                                                : difference_first;
    }
}

// Opens the window: what is compared, and the scene of its runs.
static Status calibrate_open(CalibrateWork *work, CalibrateStage stage) {
    const CalibrateStudy *study = work->study;
    const Simulation *simulation = work->work.simulation;
    const double duration = simulation->scene.duration, end = work->ends[work->window];
    work->stage = stage;
    simulation_clear(&work->base);
    TRY(calibrate_make_base(&study->measured, simulation, end + study->max_shift, &work->base));
    free(work->points.at); // their costs are of other differences
    work->points = (CalibratePoints){NULL, 0};
    work->rows = 0;
    for (size_t c = 0; c < study->measured.count; c++) {
        MeasuredTarget *target = &work->targets[c];
        TRY(measured_target_make(work, c, study->max_shift, fmin(end, duration - study->max_shift),
                                 target));
        target->place = work->rows;
        work->rows += target->values.count;
    }
    calibrate_begin_stage(work, stage);
    return STATUS_OK;
}

// New estimates of the noise, from the best fit.
static void calibrate_estimate_noise(CalibrateWork *work) {
    for (size_t c = 0; c < work->study->measured.count; c++) {
        const MeasuredTarget *target = &work->targets[c];
        const double count = (double)target->values.count;
        if (!isnan(target->measured->deviation) || target->is_spectrum || count == 0)
            continue;
        const double sum =
            calibrate_sum_squares(work->starts[0].residual + target->place, target->values.count);
        const double fitted = (double)work->variables * count / (double)work->rows;
        work->deviations[c] = fmax(target->deviation * sqrt(sum / fmax(count - fitted, 1)),
                                   1e-9 * measured_rms(target->measured));
    }
}

// Whether the window before is a result on its own, and the effect of a parameter has grown by more
// than `limit` since: valleys of this one may have been missed.
static bool calibrate_may_return(const CalibrateWork *work, double limit) {
    const CalibrateResult *before = &work->results[work->window - (work->window > 0)];
    const LeastSquares *fit = &work->starts[0].fit;
    const size_t n = work->variables;
    const double variance = calibrate_variance(work, fit->cost);
    double covariance[VARIABLES * VARIABLES], growth = 0;
    if (work->window == 0 || work->fit == CALIBRATE_PSD)
        return false;
    least_squares_covariance(&before->equations, covariance);
    for (size_t i = 0; i < n * n; i += n + 1) {
        if (i < n * work->parameters &&
            !(2 * sqrt(before->variance * covariance[i]) < half_width_max))
            return false;
        growth = fmax(growth, fit->equations.matrix[i] * before->variance /
                                  (before->equations.matrix[i] * variance));
    }
    return growth > limit * limit;
}

// The window before becomes the last one, and begins with its result.
static Status calibrate_return(CalibrateWork *work) {
    const CalibrateResult *result = &work->results[--work->window];
    work->windows = work->window + 1;
    work->limit = work->ends[work->window];
    work->explorations = 0;
    calibrate_truncate_starts(work, 0);
    work->start_count = result->start_count;
    for (size_t i = 0; i < work->start_count; i++) {
        work->starts[i] = (CalibrateStart){.number = i};
        memcpy(work->starts[i].fit.at, result->starts[i], sizeof result->starts[i]);
    }
    return calibrate_open(work, STAGE_FIT);
}

// Increase of the cost from the best point in the linear model.
static double calibrate_predict(const LeastSquares *fit, const double *at) {
    const NormalEquations *equations = &fit->equations;
    const size_t n = equations->count;
    double cost = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++)
            cost += (at[i] - fit->at[i]) * equations->matrix[i * n + k] * (at[k] - fit->at[k]);
    return cost;
}

// The uncertainty of the best point.
static void calibrate_assess(CalibrateWork *work) {
    const LeastSquares *fit = &work->starts[0].fit;
    CalibrateAssessment *found = &work->assessment;
    const size_t n = work->variables;
    const double freedom =
        fmax(floor(calibrate_independent(work, (double)work->rows)) - (double)n, 1);
    bool is_estimated = work->fit == CALIBRATE_PSD;
    for (size_t c = 0; c < work->study->measured.count; c++)
        is_estimated |= isnan(work->study->measured.at[c].deviation);
    const double variance = is_estimated ? fmax(fit->cost / freedom, 1e-300) : 1;
    const double t = student_t_quantile(0.95, is_estimated ? (size_t)freedom : 0);
    least_squares_covariance(&fit->equations, found->covariance);
    for (size_t i = 0; i < n; i++) {
        found->errors[i] = sqrt(variance * found->covariance[i * n + i]);
        found->low[i] = fit->at[i] - t * found->errors[i];
        found->high[i] = fit->at[i] + t * found->errors[i];
        found->rivals[i] = (double)NAN;
    }
    // A point of the search that fits as well although the linear model excludes it, as one in
    // another valley does, belongs to the intervals. Costs of chaotic motions scatter.
    found->is_ambiguous = false;
    const double noise = work->is_chaotic ? calibrate_quantile_999 * sqrt(2 * freedom) : 0;
    const double limit =
        (calibrate_chi_square((double)n, calibrate_quantile_95) + noise) * variance;
    for (size_t k = 0; k < work->points.count; k++) {
        const CalibratePoint *point = &work->points.at[k];
        if (point->cost - fit->cost > limit || calibrate_predict(fit, point->at) < 2 * limit)
            continue;
        found->is_ambiguous = true;
        for (size_t i = 0; i < n; i++) {
            found->low[i] = fmin(found->low[i], point->at[i]);
            found->high[i] = fmax(found->high[i], point->at[i]);
            if (fabs(point->at[i] - fit->at[i]) > rival_distance_min)
                found->rivals[i] = point->at[i];
        }
    }
    found->is_determined = true;
    for (size_t i = 0; i < work->parameters; i++) {
        found->reasons[i] = !(t * found->errors[i] < undetermined) ? UNDETERMINED_WIDE
                            : !isnan(found->rivals[i])             ? UNDETERMINED_RIVAL
                                                                   : UNDETERMINED_NOT;
        found->is_determined &= found->reasons[i] == UNDETERMINED_NOT;
    }
}

// After the fit of a window: the next one, or the covariance of the best point.
static Status calibrate_end_window(CalibrateWork *work) {
    const CalibrateStart *best = work->starts;
    calibrate_estimate_noise(work);
    if (work->fit == CALIBRATE_TIME && !isnan(best->horizon) && work->limit == 0) {
        // The motion cannot be predicted to the end of the window: the one before is the last, or
        // the part of the first one that can.
        work->is_beyond = true;
        if (work->window > 0)
            return calibrate_return(work);
        // Not 0, which is no limit.
        work->ends[0] = work->limit =
            best->horizon > 0 ? predictable * best->horizon : work->study->measured.at[0].interval;
        work->windows = 1;
        return calibrate_open(work, STAGE_FIT);
    }
    if (calibrate_may_return(work, growth_max))
        return calibrate_return(work);
    calibrate_truncate_starts(work, CALIBRATE_KEPT);
    CalibrateResult *result = &work->results[work->window];
    *result = (CalibrateResult){.equations = best->fit.equations,
                                .variance = calibrate_variance(work, best->fit.cost),
                                .start_count = work->start_count};
    for (size_t i = 0; i < work->start_count; i++)
        memcpy(result->starts[i], work->starts[i].fit.at, sizeof result->starts[i]);
    if (work->window + 1 < work->windows) {
        calibrate_scatter_starts(work, CALIBRATE_KEPT, SCREENED * (size_t)work->study->starts,
                                 &scatter, 1);
        work->window++; // its valleys are narrower
        return calibrate_open(work, STAGE_SCREEN);
    }
    work->stage = STAGE_COVARIANCE;
    work->starts[0].state = START_DERIVE;
    return STATUS_OK;
}

// After the exploration: the result, or the window before, or spectra.
static Status calibrate_end_search(CalibrateWork *work) {
    calibrate_truncate_starts(work, 1);
    calibrate_assess(work);
    if (work->assessment.is_ambiguous && calibrate_may_return(work, 1))
        return calibrate_return(work);
    work->is_over =
        work->assessment.is_determined || !work->is_beyond || work->fit == CALIBRATE_PSD;
    if (work->is_over)
        return STATUS_OK;
    work->fit = CALIBRATE_PSD;
    work->variables = work->parameters; // spectra do not depend on the shift
    work->is_chaotic = true;
    work->explorations = work->window = 0;
    work->windows = 1;
    work->ends[0] = work->work.simulation->scene.duration;
    return calibrate_open(work, STAGE_FIT);
}

// Whether a better point than the best fit was found around it.
static bool calibrate_is_improved(const CalibrateWork *work) {
    const double cost = work->starts[0].fit.cost;
    for (size_t k = 1; k < work->start_count; k++)
        if (work->starts[k].fit.cost < cost - improvement * calibrate_variance(work, cost))
            return work->explorations < EXPLORATIONS;
    return false;
}

// Goes to the next stage when no start wants a run.
static Status calibrate_advance(CalibrateWork *work) {
    if (work->stage == STAGE_EXPLORE && !calibrate_is_improved(work))
        return calibrate_end_search(work);
    calibrate_sort_starts(work);
    if (work->start_count == 0 && work->window > 0) {
        TRY(calibrate_return(work));
        const double end = work->limit;
        work->limit = 0; // the reason is another one
        return warnings_add(&work->answer->made.warnings, "/study/measured",
                            "all runs that went beyond %.3g s failed: only the samples before were "
                            "fitted",
                            end);
    }
    work->is_over = work->start_count == 0;
    if (work->is_over)
        return STATUS_OK;
    if (work->stage == STAGE_FIT)
        return calibrate_end_window(work);
    if (work->stage == STAGE_COVARIANCE) {
        calibrate_scatter_starts(work, 1, EXPLORED, explored, COUNT(explored));
        work->stage = STAGE_EXPLORE;
        work->explorations++;
        return STATUS_OK;
    }
    // Spectra are compared over the whole record also where it cannot be predicted.
    work->is_chaotic = work->fit == CALIBRATE_PSD && !isnan(work->starts[0].horizon);
    calibrate_truncate_starts(work, (size_t)work->study->starts);
    if (work->fit == CALIBRATE_PSD)
        return calibrate_open(work, STAGE_FIT);
    calibrate_begin_stage(work, STAGE_FIT);
    return STATUS_OK;
}

double calibrate_expect_runs(const CalibrateStudy *study, const Simulation *simulation,
                             double windows) {
    const double iterations = simulation->scene.dampers.count > 0 ? 10 : 4;
    const double variables = (double)study->parameters.count + (study->max_shift > 0);
    return (double)study->starts * windows * (SCREENED + iterations * (variables + 1)) + EXPLORED;
}

static void calibrate_estimate_runs(CalibrateWork *work) {
    const size_t expected =
        (size_t)calibrate_expect_runs(work->study, work->work.simulation, (double)work->windows);
    work->work.expected = work->work.wanted > expected ? work->work.wanted : expected;
}

static Status calibrate_continue(CalibrateWork *work) {
    StudyWork *study = &work->work;
    work->first = study->wanted;
    calibrate_list_runs(work);
    while (work->run_count == 0 && !work->is_over) {
        TRY(calibrate_advance(work));
        if (!work->is_over)
            calibrate_list_runs(work);
    }
    study->wanted += work->run_count;
    calibrate_estimate_runs(work);
    return STATUS_OK;
}

Status calibrate_fold(void *of, size_t member, StudyPart *part) {
    CalibrateWork *work = of;
    const CalibrateRun *run = &work->runs[member - work->first];
    TRY(study_runs_add(&work->answer->made, &part->run, member));
    if (run->step != 0)
        calibrate_fold_column(work, &work->starts[run->start], run,
                              (const CalibratePart *)(const void *)part);
    else
        TRY(calibrate_fold_point(work, run, (CalibratePart *)(void *)part));
    return member + 1 == work->work.wanted ? calibrate_continue(work) : STATUS_OK;
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
    for (int k = CALIBRATE_WINDOWS - 1; k >= 0; k--) {
        const double share = pow(window_growth, -k);
        const double end = fmax(from + share * (to - from), from + 2 * work->study->max_shift);
        const double last = work->windows > 0 ? work->ends[work->windows - 1] : from;
        const bool is_short =
            share * (double)samples < (double)(WINDOW_SAMPLES + 4 * work->variables);
        if (k == 0 || (work->fit == CALIBRATE_TIME && !is_short && end > last && end < to))
            work->ends[work->windows++] = k == 0 ? to : end;
    }
}

// The points of the first screen: a Sobol sequence, and the middle as the first.
static void calibrate_place_starts(CalibrateWork *work) {
    const Sampling sampling = {SAMPLING_SOBOL, work->study->search_seed, work->start_count};
    for (size_t k = 0; k < work->start_count; k++) {
        work->starts[k].number = k;
        for (size_t i = 0; i < work->variables; i++)
            work->starts[k].fit.at[i] = k == 0 ? 0.5 : sampling_coordinate(&sampling, k, i);
    }
}

Status calibrate_begin(void *of, const StudyTools *tools, Problem *problem) {
    CalibrateWork *work = of;
    const CalibrateStudy *study = work->study = work->work.study;
    (void)tools;
    (void)problem;
    work->answer = work->work.answer;
    const size_t count = study->measured.count, starts = (size_t)study->starts;
    work->parameters = study->parameters.count;
    work->variables = work->parameters + (study->max_shift > 0);
    work->fit = study->fit;
    const size_t screened = SCREENED_FIRST * starts;
    work->targets = calloc(count, sizeof *work->targets);
    work->deviations = calloc(count, sizeof *work->deviations);
    work->starts = calloc(screened + EXPLORED, sizeof *work->starts);
    work->runs = calloc(screened + EXPLORED + 2 * starts * VARIABLES, sizeof *work->runs);
    TRY(status_made(work->targets != NULL && work->deviations != NULL && work->starts != NULL &&
                    work->runs != NULL));
    work->start_count = screened;
    size_t rows = 0;
    for (size_t c = 0; c < count; c++) {
        const MeasuredChannel *measured = &study->measured.at[c];
        work->deviations[c] =
            isnan(measured->deviation) ? measured_rms(measured) : measured->deviation;
        rows += measured->samples.count;
    }
    for (size_t i = 0; i < work->variables; i++)
        TRY(status_made((work->columns[i] = calloc(rows + 1, sizeof(double))) != NULL));
    calibrate_make_windows(work);
    calibrate_place_starts(work);
    TRY(calibrate_open(work, STAGE_SCREEN));
    calibrate_list_runs(work);
    work->work.members = RUNS_MAX;
    work->work.wanted = work->run_count;
    calibrate_estimate_runs(work);
    work->work.part_bytes = sizeof(CalibratePart) + rows * sizeof(double);
    return STATUS_OK;
}

void calibrate_free(void *of) {
    CalibrateWork *work = of;
    calibrate_truncate_starts(work, 0);
    for (size_t i = 0; i < VARIABLES; i++)
        free(work->columns[i]);
    for (size_t c = 0; work->targets != NULL && c < work->study->measured.count; c++)
        free(work->targets[c].values.at);
    simulation_clear(&work->base);
    free(work->targets);
    free(work->deviations);
    free(work->points.at);
    free(work->starts);
    free(work->runs);
}
