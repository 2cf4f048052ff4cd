// The search of a calibration. The sum of squared differences from an impacting motion has many
// local minima, most of them made by the late part of the record, where small errors have grown.
// The first part of the record is fitted first, then longer ones, each from points around the
// result of the one before:
//
//     screen      many points, of which the best become starts
//     fit         each start by Levenberg and Marquardt's method, all side by side
//     covariance  derivatives at the best point, after the last window
//     explore     points around it, near and far; better ones are fitted
//
// A window whose valleys are too narrow to be found with certainty is left: the one before is the
// result then. Members are runs in batches: of each start that is not done the derivatives by all
// parameters, or one step. The next batch is listed when the last of this one is folded.
//
// A run is evaluated at the measured times by a cubic through four samples (Lagrange); where the
// times are those of its samples, which is usual, by the samples themselves. Its spectrum is that
// of these values, so that both spectra have the same window, leakage and aliasing.
//
// A spectrum of K averaged segments has a relative deviation of about sqrt(1.06 / K) for Hann's
// window and half overlap (Welch 1967). The noise of the measurement adds a constant density.
#include "core/study/calibrate_search.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/philox.h"
#include "core/math/student_t.h"
#include "core/study/inputs.h"

enum {
    VARIABLES = CALIBRATE_VARIABLES,
    WINDOWS = CALIBRATE_WINDOWS,
    KEPT_MIN = CALIBRATE_KEPT,
    WINDOW_SAMPLES = 64, // at least, in the first window
    SCREENED_FIRST = 32, // points for each start in the first window
    SCREENED = 16,       // and in later ones
    STEPS_FIRST = 15,    // of a start in a window, tried
    STEPS_LAST = 60,
    REPEATS = 3,     // of the last window, with new estimates of the noise
    RETRIES = 3,     // of a window that fits worse than the one before
    REFINEMENTS = 3, // of differences
    EXPLORED = 96,   // points around the best fit
    EXPLORATIONS_MIN = 2,
    EXPLORATIONS = 6,
    IMPROVED = 5, // of them that are fitted
    HISTORY_MAX = 4096,
    SEGMENTS_MIN = 4,
};

static const double confidence = 0.95;
static const double window_growth = 1.4142; // of the length of windows
// Growth of the effect of a parameter from window to window: where the result may be missed, and
// where it will be.
static const double sensitive = 2.5, rough = 4;
static const double difference_share = 0.5; // of the deviation of one parameter alone
static const double difference_first = 1e-5, difference_min = 1e-9, difference_max = 1e-4,
                    difference_chaos = 5e-2;
static const double correlation_max = 0.95; // of derivatives that are mostly noise
static const double difference_change = 3;  // factor above which derivatives are made again
static const double one_sided = 4;          // ratio of squares
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
// Sum of the squared correlations of neighbouring frequencies, for Hann's window.
static const double correlated_bins = 1.94;

static const double snap = 1e-6;       // of a sample interval: a time this close is a sample's
static const double slope_step = 1e-2; // of a sample interval
static const double floor_share = 0.1; // of the measured densities lies below the noise's
static const double floor_min = 1e-12; // of the largest density
static const double variance_hann = 1.06;

double measured_rms(const MeasuredChannel *measured) {
    double sum = 0, squares = 0;
    for (size_t i = 0; i < measured->samples.count; i++)
        sum += measured->samples.at[i];
    const double mean = sum / (double)measured->samples.count;
    for (size_t i = 0; i < measured->samples.count; i++)
        squares += (measured->samples.at[i] - mean) * (measured->samples.at[i] - mean);
    return sqrt(squares / (double)measured->samples.count);
}

void measured_target_clear(MeasuredTarget *target) {
    free(target->values.at);
    *target = (MeasuredTarget){.measured = NULL};
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

static Status measured_target_make_spectrum(MeasuredTarget *target, const SpectrumRequest *psd,
                                            Problem *problem) {
    const MeasuredChannel *measured = target->measured;
    const size_t max = target->samples / SEGMENTS_MIN;
    WelchSettings *welch = &target->welch;
    *welch = (WelchSettings){
        .segment = psd->segment == COUNT_ABSENT ? max : (size_t)psd->segment,
        .window = psd->window != CHOICE_ABSENT ? psd->window : (int)WELCH_HANN,
        .detrend = psd->detrend != CHOICE_ABSENT ? psd->detrend : (int)WELCH_DETREND_CONSTANT};
    welch->segment = welch->segment < max ? welch->segment : max;
    welch->overlap = psd->overlap < welch->segment ? (size_t)psd->overlap : welch->segment / 2;
    TRY(status_made(reals_allocate(&target->values, welch->segment / 2)));
    double *values = target->values.at;
    TRY(measured_target_spectrum(target, &measured->samples.at[target->first], NULL, values,
                                 problem));
    Reals sorted = {NULL, 0};
    TRY(status_made(reals_allocate(&sorted, target->values.count)));
    memcpy(sorted.at, values, sorted.count * sizeof *values);
    reals_sort(sorted.at, sorted.count);
    const double largest = sorted.at[sorted.count - 1];
    target->floor = isnan(measured->deviation)
                        ? sorted.at[(size_t)(floor_share * (double)sorted.count)]
                        : 2 * measured->deviation * measured->deviation * measured->interval;
    target->floor = fmax(target->floor, floor_min * largest);
    free(sorted.at);
    for (size_t i = 0; i < target->values.count; i++)
        values[i] = log(fmax(values[i], target->floor));
    const size_t hop = welch->segment - welch->overlap;
    const double segments = (double)((target->samples - welch->overlap) / hop);
    target->deviation = sqrt(variance_hann / segments);
    return STATUS_OK;
}

Status measured_target_make(const MeasuredChannel *measured, double from, double to,
                            const SpectrumRequest *psd, MeasuredTarget *target, Problem *problem) {
    const double interval = measured->interval, last = (double)measured->samples.count - 1;
    const double low = fmax(ceil((from - measured->start) / interval - snap), 0);
    const double high = fmin(floor((to - measured->start) / interval + snap), last);
    *target = (MeasuredTarget){.measured = measured, .is_spectrum = psd != NULL};
    if (high < low)
        return STATUS_OK;
    target->first = (size_t)low;
    target->samples = (size_t)(high - low) + 1;
    if (psd != NULL)
        return measured_target_make_spectrum(target, psd, problem);
    target->deviation = measured->deviation;
    TRY(status_made(reals_allocate(&target->values, target->samples)));
    memcpy(target->values.at, &measured->samples.at[target->first],
           target->samples * sizeof(double));
    return STATUS_OK;
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

Status measured_target_model(const MeasuredTarget *target, const Response *response, double shift,
                             FftCache *cache, double *values, double *slopes, Problem *problem) {
    const MeasuredChannel *measured = target->measured;
    const Column *column = columns_find(&response->series, measured->channel);
    const double rate = response->sample_rate;
    if (target->samples == 0)
        return STATUS_OK;
    if (column == NULL)
        return problem_set(problem, STATUS_INTERNAL, "the run lacks a channel");
    Reals motion = {NULL, 0};
    if (target->is_spectrum)
        TRY(status_made(reals_allocate(&motion, target->samples)));
    double *at = target->is_spectrum ? motion.at : values;
    for (size_t i = 0; i < target->samples; i++) {
        const double place = (measured_time(measured, target->first + i) + shift) * rate;
        at[i] = measured_interpolate(column->values, response->count, place);
        if (slopes == NULL || target->is_spectrum)
            continue;
        const double after =
            measured_interpolate(column->values, response->count, place + slope_step);
        const double before =
            measured_interpolate(column->values, response->count, place - slope_step);
        slopes[i] = (after - before) * rate / (2 * slope_step);
    }
    if (!target->is_spectrum)
        return STATUS_OK;
    const Status status = measured_target_spectrum(target, motion.at, cache, values, problem);
    free(motion.at);
    for (size_t i = 0; i < target->values.count; i++) {
        values[i] = log(values[i] + target->floor);
        if (slopes != NULL)
            slopes[i] = 0;
    }
    return status;
}

// The scene of the runs that end at `end`: as many samples as the measured times need, and only the
// measured channels.
Status calibrate_make_base(const CalibrateStudy *study, const Simulation *simulation, double end,
                           Simulation *base) {
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

CalibrateStart *calibrate_best(const CalibrateWork *work) {
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
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++) {
            double *matrix = start->equations.matrix;
            const double max = correlation_max * sqrt(matrix[i * (n + 1)] * matrix[k * (n + 1)]);
            if (i != k)
                matrix[i * n + k] = fmin(fmax(matrix[i * n + k], -max), max);
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
    if (work->window == 0 || work->fit == CALIBRATE_PSD || work->is_final)
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

// Whether the noise of this window is larger than was given, or than that of the window before.
static bool calibrate_is_worse(const CalibrateWork *work, double quantile) {
    if (work->window == 0)
        return false;
    const double uncertain =
        2 / (double)work->rows + 2 / (double)work->results[work->window - 1].rows;
    return calibrate_variance(work, calibrate_best(work)->cost) > 1 + quantile * sqrt(uncertain);
}

// Makes the window the last one, and begins with its result.
static Status calibrate_reopen(CalibrateWork *work) {
    const CalibrateResult *result = &work->results[work->window];
    work->windows = work->window + 1;
    work->horizon = work->ends[work->window];
    work->is_limited = work->window + 1 < work->all_windows;
    work->stage = STAGE_FIT;
    work->explorations = 0;
    for (size_t i = 0; i < work->start_count; i++)
        calibrate_drop(&work->starts[i]);
    work->start_count = result->start_count;
    for (size_t i = 0; i < work->start_count; i++) {
        work->starts[i] = (CalibrateStart){.number = i};
        memcpy(work->starts[i].at, result->starts[i], sizeof result->starts[i]);
    }
    return calibrate_open(work, true);
}

// The window before becomes the last one.
static Status calibrate_return(CalibrateWork *work) {
    calibrate_save(work);
    work->results[work->window].is_worse = calibrate_is_worse(work, calibrate_quantile_999);
    work->window--;
    return calibrate_reopen(work);
}

// The window that was left is the last one after all: the one before determines less.
static Status calibrate_go_forward(CalibrateWork *work) {
    work->is_final = true;
    work->window++;
    return calibrate_reopen(work);
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
    const double limit = calibrate_chi_square((double)n, calibrate_quantile_95) * found->variance;
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
        if (calibrate_is_worse(work, calibrate_quantile_95) && work->retries++ < RETRIES)
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
    if (calibrate_is_worse(work, calibrate_quantile_999) && calibrate_may_return(work, sensitive))
        return calibrate_return(work);
    calibrate_assess(work);
    if (work->assessment.is_ambiguous && calibrate_may_return(work, 1))
        return calibrate_return(work);
    const CalibrateResult *longer = &work->results[work->window + 1];
    if (!work->assessment.is_determined && work->fit == CALIBRATE_TIME && !work->is_final &&
        !work->is_beyond && longer->start_count > 0 && !longer->is_worse)
        return calibrate_go_forward(work);
    if (work->is_final && work->assessment.is_ambiguous && !work->is_settled) {
        // Neither does: the shorter one is the honest result.
        work->is_settled = true;
        work->window--;
        return calibrate_reopen(work);
    }
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
    // Most of them are short.
    const size_t expected =
        (size_t)work->study->starts * (130 + 20 * (work->parameters + 1)) + 3 * EXPLORED;
    study->expected = study->wanted > expected ? study->wanted : expected;
    return STATUS_OK;
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
        const bool is_short =
            share * (double)samples < (double)(WINDOW_SAMPLES + 4 * work->variables);
        if (k == 0 || (work->fit == CALIBRATE_TIME && !is_short))
            work->ends[work->windows++] =
                k == 0 ? to : fmax(from + share * (to - from), from + 2 * work->study->max_shift);
    }
}
Status calibrate_search_begin(CalibrateWork *work) {
    const CalibrateStudy *study = work->study;
    const size_t count = study->measured.count, starts = (size_t)study->starts;
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
    work->all_windows = work->windows;
    TRY(calibrate_place_starts(work));
    TRY(calibrate_open(work, true));
    calibrate_list_runs(work);
    // Every start takes all its steps in every window, with every estimate of the noise and after
    // every exploration, and each window is returned to.
    const size_t rounds =
        (WINDOWS + 1) * (RETRIES + 1) * (STEPS_FIRST + SCREENED) + (REPEATS + 3) * STEPS_LAST;
    work->work.members =
        work->start_count +
        WINDOWS * (EXPLORATIONS * (EXPLORED + (IMPROVED * STEPS_LAST + 8) * (VARIABLES + 1)) +
                   starts * (rounds + 12) * (work->parameters + 1));
    work->work.wanted = work->run_count;
    work->work.part_bytes = sizeof(CalibratePart) + 2 * rows * sizeof(double);
    work->work.bytes = (2 * starts + work->parameters) * rows * sizeof(double);
    return STATUS_OK;
}
Status calibrate_search_fold(CalibrateWork *work, size_t member, CalibratePart *part) {
    TRY(calibrate_fold_part(work, &work->runs[member - work->first], part));
    return member + 1 == work->work.wanted ? calibrate_continue(work) : STATUS_OK;
}

void calibrate_search_free(CalibrateWork *work) {
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
