// Run r levels + l is record r, scaled to level l. A limit is exceeded somewhere between the last
// level below its first exceedance and that level (a curve may fall again); the lognormal
// distribution of these levels is fitted to the intervals (statistics.h). Runs that failed say
// nothing: they widen an interval.
#include "core/study/fragility.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/excitation/response_spectrum.h"

enum { COST_RUNS = 16, NAMES_SHOWN = 3 };

static const double oscillator_step = 0.35; // CPU of one, in solver steps
static const char *const fragility_measure_names[] = {"pga", NULL};

// clang-format off
static const Field fragility_intensity_fields[] = {
    FIELD_CHOICE(FragilityIntensity, measure, fragility_measure_names, OPTIONAL, "pga: the largest acceleration of the base"),
    FIELD_REAL(FragilityIntensity, period, "s", WITHIN(0.01, 100), OPTIONAL, "in place of measure: the pseudo-acceleration of an oscillator of this period"),
    FIELD_REAL(FragilityIntensity, damping_ratio, NULL, WITHIN(0, RESPONSE_SPECTRUM_DAMPING_MAX), OPTIONAL, "of the oscillator; 0.05 if absent"),
    FIELD_END
};

static const Field fragility_levels_fields[] = {
    FIELD_REALS(FragilityLevels, values, "m/s^2", ANY, FRAGILITY_LEVELS, PRESENCE_OPTIONAL, "intensities above 0, rising"),
    FIELD_REAL(FragilityLevels, from, "m/s^2", ABOVE(0), OPTIONAL, "in place of values: the lowest intensity"),
    FIELD_REAL(FragilityLevels, to, "m/s^2", ABOVE(0), OPTIONAL, "the highest one"),
    FIELD_COUNT(FragilityLevels, count, NULL, WITHIN(2, FRAGILITY_LEVELS), OPTIONAL, "their number, both ends included, at equal differences"),
    FIELD_END
};

static const Field fragility_limit_fields[] = {
    FIELD_CHOICE(FragilityLimit, metric, study_metric_names, REQUIRED, "metric of the summary"),
    FIELD_REAL(FragilityLimit, value, NULL, AT_MIN(0), REQUIRED, "it is exceeded above this, in the metric's unit"),
    FIELD_END
};

static const Field fragility_study_fields[] = {
    FIELD_LIST_OR_NAMES(FragilityStudy, records, pinned_record_fields, "name", FRAGILITY_RECORDS, PRESENCE_REQUIRED, "ground motions that replace the scene's excitation"),
    FIELD_ITEM(FragilityStudy, intensity, fragility_intensity_fields, "measure", PRESENCE_DEFAULT, "measure of a ground motion's strength, by which it is scaled; pga if absent"),
    FIELD_ITEM(FragilityStudy, levels, fragility_levels_fields, "values", PRESENCE_REQUIRED, "intensities to which each record is scaled"),
    FIELD_LIST(FragilityStudy, limits, fragility_limit_fields, FRAGILITY_LIMITS, PRESENCE_REQUIRED, "limit states"),
    FIELD_END
};

static const Field fragility_point_fields[] = {
    FIELD_REAL(FragilityPoint, level, "m/s^2", ANY, OPTIONAL, "intensity"),
    FIELD_ITEM(FragilityPoint, metrics, study_metrics_fields, NULL, PRESENCE_DEFAULT, "of this run; unknown where it failed"),
    FIELD_END
};

static const Field fragility_curve_fields[] = {
    FIELD_TEXT(FragilityCurve, record, 0, PRESENCE_OPTIONAL, 0, "name"),
    FIELD_REAL(FragilityCurve, intensity, "m/s^2", ANY, OPTIONAL, "of the record as it is: level over this is its factor"),
    FIELD_LIST(FragilityCurve, points, fragility_point_fields, 0, PRESENCE_DEFAULT, "by rising level"),
    FIELD_END
};

static const Field fragility_fractile_fields[] = {
    FIELD_CHOICE(FragilityFractile, metric, study_metric_names, OPTIONAL, "metric of the summary"),
    FIELD_REAL(FragilityFractile, level, "m/s^2", ANY, OPTIONAL, "intensity"),
    FIELD_COUNT(FragilityFractile, count, NULL, AT_MIN(0), 0, "records whose value is known"),
    FIELD_REAL(FragilityFractile, p16, NULL, ANY, OPTIONAL, "16 % of the records are below"),
    FIELD_REAL(FragilityFractile, p50, NULL, ANY, OPTIONAL, "half of the records are below"),
    FIELD_REAL(FragilityFractile, p84, NULL, ANY, OPTIONAL, "84 % of the records are below"),
    FIELD_END
};

static const Field fragility_state_fields[] = {
    FIELD_CHOICE(FragilityState, metric, study_metric_names, OPTIONAL, "metric of the summary"),
    FIELD_REAL(FragilityState, value, NULL, ANY, OPTIONAL, "its limit"),
    FIELD_COUNT(FragilityState, exceeded, NULL, AT_MIN(0), 0, "records that exceed it at some level"),
    FIELD_REAL(FragilityState, median, "m/s^2", ANY, OPTIONAL, "intensity at which half of all ground motions exceed it"),
    FIELD_REALS_OR_NULL(FragilityState, median_interval_95, "m/s^2", "its 95 % confidence interval"),
    FIELD_REAL(FragilityState, dispersion, NULL, ANY, OPTIONAL, "standard deviation of the logarithm of that intensity"),
    FIELD_REALS_OR_NULL(FragilityState, dispersion_interval_95, NULL, "its 95 % confidence interval"),
    FIELD_END
};

static const Field fragility_answer_fields[] = {
    FIELD_BASE(Fragility, made, study_runs_fields),
    FIELD_ITEM(Fragility, intensity, fragility_intensity_fields, NULL, PRESENCE_DEFAULT, "measure of the levels"),
    FIELD_LIST(Fragility, curves, fragility_curve_fields, 0, PRESENCE_DEFAULT, "record by record"),
    FIELD_LIST(Fragility, fractiles, fragility_fractile_fields, 0, PRESENCE_DEFAULT, "metric by metric, by rising level"),
    FIELD_LIST(Fragility, limits, fragility_state_fields, 0, PRESENCE_DEFAULT, "limit states: lognormal distributions by maximum likelihood"),
    FIELD_END
};
// clang-format on

static const NamedRecord *fragility_record(const FragilityStudy *study, size_t index) {
    return (const NamedRecord *)(const void *)study->records.at[index].named;
}

// --- the request ---

static Status fragility_complete_intensity(FragilityIntensity *intensity, Problem *problem) {
    const bool has_period = !isnan(intensity->period);
    if (intensity->measure != CHOICE_ABSENT && has_period)
        return problem_add(problem, STATUS_INVALID, "/study/intensity",
                           "has a measure and a period: leave one of them out");
    if (!has_period && !isnan(intensity->damping_ratio))
        return problem_add(problem, STATUS_INVALID, "/study/intensity/damping_ratio",
                           "needs the period of the oscillator");
    if (!has_period)
        intensity->measure = 0;
    else if (isnan(intensity->damping_ratio))
        intensity->damping_ratio = 0.05;
    return STATUS_OK;
}

static Status fragility_complete_levels(FragilityLevels *levels, Problem *problem) {
    char place[] = "/study/levels";
    Reals *values = &levels->values;
    const StudyAxis axis = {.pointer = place,
                            .values = {NULL, values->count},
                            .from = levels->from,
                            .to = levels->to,
                            .count = levels->count,
                            .spacing = CHOICE_ABSENT};
    TRY(study_axis_check(&axis, true, place, problem));
    if (values->count == 0) {
        if (!(axis.from < axis.to))
            return problem_add(problem, STATUS_INVALID, place,
                               "from must be below to, is %s m/s^2, to is %s m/s^2",
                               real_text(axis.from).at, real_text(axis.to).at);
        TRY(status_made(reals_allocate(values, (size_t)axis.count)));
        for (size_t i = 0; i < values->count; i++)
            values->at[i] = study_axis_value(&axis, i).number;
        levels->from = levels->to = (double)NAN;
        levels->count = COUNT_ABSENT;
    }
    for (size_t i = 0; i < values->count; i++)
        if (!(values->at[i] > (i > 0 ? values->at[i - 1] : 0)))
            return problem_add_real(
                problem, STATUS_INVALID, json_pointer_at(place, i).at, values->at[i], "m/s^2",
                i > 0 ? "must be above the one before it: levels rise" : "must be above 0 m/s^2");
    return STATUS_OK;
}

static Status fragility_check_records(const FragilityStudy *study, Problem *problem) {
    Status status = study_suite_check(&study->records, "/study/records", problem);
    for (size_t i = 0; i < study->records.count; i++) {
        const NamedRecord *record = fragility_record(study, i);
        if (record == NULL)
            status = STATUS_INVALID; // reported where the names are resolved
        else if (!(record->peak > 0))
            status = problem_add(problem, STATUS_INVALID, json_pointer_at("/study/records", i).at,
                                 "is a base at rest, which no factor scales to a level");
    }
    return status;
}

static Status fragility_check_limits(const FragilityStudy *study, const Simulation *simulation,
                                     Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < study->limits.count; i++) {
        const int metric = study->limits.at[i].metric;
        const JsonPointer place = json_pointer_of(json_pointer_at("/study/limits", i).at, "metric");
        const Status own =
            study_metric_is_reduction(metric)
                ? problem_add(problem, STATUS_INVALID, place.at,
                              "must be a metric that grows with the intensity: a reduction is "
                              "compared with another run")
                : study_metric_check(simulation, metric, place.at, problem);
        status = own != STATUS_OK ? own : status;
    }
    return status;
}

static Status fragility_check_runs(const FragilityStudy *study, Problem *problem) {
    const size_t levels = study->levels.values.count;
    if (study->records.count * levels <= FRAGILITY_RUNS)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/study/levels",
                       "are %zu, which are %zu runs of %zu records, at most %d are allowed: take "
                       "fewer levels or records",
                       levels, study->records.count * levels, study->records.count,
                       (int)FRAGILITY_RUNS);
}

// The scene of a record at a factor, completed. Cleared by simulation_clear in any case.
static Status fragility_make_scene(const Simulation *base, const PinnedRecord *record,
                                   double factor, const SimulationLimits *limits, Simulation *scene,
                                   Problem *problem) {
    TRY(fields_copy(simulation_fields, base, scene));
    TRY(study_scene_use_record(scene, record));
    ((ExcitationRecord *)(void *)scene->scene.excitation)->scale = factor;
    return simulation_complete(scene, limits, NULL, problem);
}

// The scene that all runs start from: without output, and with the first record, so that its own
// samples are not copied for each.
static Status fragility_base(const FragilityStudy *study, const Simulation *simulation,
                             Simulation *base) {
    TRY(study_run_copy(simulation, base));
    texts_clear(&base->output.psd.channels);
    base->output.impacts = false;
    return study_scene_use_record(base, &study->records.at[0]);
}

static Status fragility_complete(void *request, const Simulation *simulation,
                                 const SimulationLimits *limits, Problem *problem) {
    FragilityStudy *study = request;
    (void)limits;
    const Status faults[] = {fragility_complete_intensity(&study->intensity, problem),
                             fragility_complete_levels(&study->levels, problem),
                             fragility_check_limits(study, simulation, problem),
                             fragility_check_records(study, problem)};
    TRY(status_first(faults, COUNT(faults)));
    return fragility_check_runs(study, problem);
}

typedef struct FragilityWork {
    StudyWork work;
    const FragilityStudy *study;
    Fragility *answer;
    size_t levels;
    Simulation base;
} FragilityWork;

// As if each level were a peak acceleration: its record is not measured yet.
static Status fragility_scene_of(const void *of, size_t run, const SimulationLimits *limits,
                                 Simulation *scene) {
    const FragilityWork *work = of;
    const Reals *levels = &work->study->levels.values;
    const size_t record = run / levels->count;
    return fragility_make_scene(&work->base, &work->study->records.at[record],
                                levels->at[run % levels->count] /
                                    fragility_record(work->study, record)->peak,
                                limits, scene, NULL);
}

// The time to measure the records counts too.
static Status fragility_cost(const void *request, const Simulation *simulation,
                             const SimulationLimits *limits, double *steps) {
    const FragilityStudy *study = request;
    FragilityWork work = {.study = study};
    *steps = 0;
    Status status = fragility_base(study, simulation, &work.base);
    if (status == STATUS_OK)
        status = study_sample_cost(fragility_scene_of, &work,
                                   study->records.count * study->levels.values.count, COST_RUNS,
                                   limits, steps);
    simulation_clear(&work.base);
    for (size_t i = 0; i < study->records.count && !isnan(study->intensity.period); i++) {
        const NamedRecord *record = fragility_record(study, i);
        *steps +=
            oscillator_step * response_spectrum_steps(&study->intensity.period, 1,
                                                      record->samples.count, record->interval);
    }
    return status;
}

static Status fragility_prepare(const void *request, Simulation *simulation, Problem *problem) {
    return study_suite_prepare(&((const FragilityStudy *)request)->records, simulation, problem);
}

static void fragility_references(void *request, StudyReferences *references) {
    FragilityStudy *study = request;
    *references = (StudyReferences){.suite = &study->records, .suite_place = "/study/records"};
}

// --- the work ---

// Measures the records.
static Status fragility_measure(FragilityWork *work, const StudyTools *tools, Problem *problem) {
    const FragilityIntensity *intensity = &work->study->intensity;
    const size_t count = work->study->records.count;
    for (size_t i = 0; i < count; i++) {
        const NamedRecord *record = fragility_record(work->study, i);
        FragilityCurve *curve = list_append(&work->answer->curves, sizeof *curve);
        TRY(status_made(curve != NULL));
        TRY(text_copy(record->name, &curve->record));
        curve->intensity = record->peak;
        TRY(study_advance(tools->progress, (double)i / (double)count, problem));
        if (!isnan(intensity->period)) {
            const double omega = 6.28318530717958647693 / intensity->period;
            if (response_spectrum_make(&record->samples, record->interval, intensity->damping_ratio,
                                       &intensity->period, 1, tools->progress,
                                       &curve->intensity) != STATUS_OK)
                return problem_set(problem, STATUS_CANCELLED, "the study was stopped");
            curve->intensity *= omega * omega;
        }
        if (!(curve->intensity > 0) || !isfinite(curve->intensity))
            return problem_set(problem, STATUS_UNSTABLE,
                               "the intensity of the record %.64s is %g m/s^2, which no factor "
                               "scales to a level",
                               record->name, curve->intensity);
        curve->points.at = calloc(work->levels, sizeof *curve->points.at);
        TRY(status_made(curve->points.at != NULL));
        curve->points.count = work->levels;
        for (size_t l = 0; l < work->levels; l++) {
            FragilityPoint *point = &curve->points.at[l];
            point->level = work->study->levels.values.at[l];
            for (int m = 0; m < STUDY_METRIC_COUNT; m++)
                point->metrics.of[m] = (double)NAN;
        }
    }
    return STATUS_OK;
}

// Warns of records that last longer than the scene.
static Status fragility_warn_of_ends(FragilityWork *work) {
    const double duration = work->work.simulation->scene.duration;
    char names[200] = "";
    size_t count = 0;
    for (size_t i = 0; i < work->study->records.count; i++) {
        const NamedRecord *record = fragility_record(work->study, i);
        if ((double)(record->samples.count - 1) * record->interval <= duration * (1 + 1e-9))
            continue;
        if (count++ < NAMES_SHOWN)
            text_list(names, sizeof names, record->name);
    }
    if (count == 0)
        return STATUS_OK;
    return warnings_add(&work->answer->made.warnings, "/duration",
                        "ends before %zu of the records (%s%s): their ends are left out", count,
                        names, count > NAMES_SHOWN ? ", ..." : "");
}

static Status fragility_begin(void *of, const StudyTools *tools, Problem *problem) {
    FragilityWork *work = of;
    work->study = work->work.study;
    work->answer = work->work.answer;
    work->levels = work->study->levels.values.count;
    work->answer->intensity = work->study->intensity;
    TRY(fragility_base(work->study, work->work.simulation, &work->base));
    TRY(fragility_measure(work, tools, problem));
    TRY(fragility_warn_of_ends(work));
    work->work.members = work->study->records.count * work->levels;
    work->work.part_bytes = sizeof(StudyPart);
    return STATUS_OK;
}

static Status fragility_scene(const void *of, size_t member, Simulation *scene, StudyPart *part,
                              Problem *problem) {
    const FragilityWork *work = of;
    const size_t record = member / work->levels;
    const FragilityCurve *curve = &work->answer->curves.at[record];
    (void)part;
    return fragility_make_scene(&work->base, &work->study->records.at[record],
                                curve->points.at[member % work->levels].level / curve->intensity,
                                work->work.limits, scene, problem);
}

static Status fragility_fold(void *of, size_t member, StudyPart *part) {
    FragilityWork *work = of;
    Fragility *answer = work->answer;
    const RunRecord *run = &part->run;
    TRY(study_runs_add(&answer->made, run, member));
    if (run->status != STATUS_OK)
        return STATUS_OK;
    answer->curves.at[member / work->levels].points.at[member % work->levels].metrics =
        study_metrics_of(run);
    return STATUS_OK;
}

// --- the answer ---

// Values of a metric at a level, sorted; returns how many are known.
static size_t fragility_values(const Fragility *answer, size_t level, int metric, double *values) {
    size_t count = 0;
    for (size_t r = 0; r < answer->curves.count; r++) {
        const double value = answer->curves.at[r].points.at[level].metrics.of[metric];
        if (!isnan(value))
            values[count++] = value;
    }
    reals_sort(values, count);
    return count;
}

// Of metrics that are known somewhere.
static Status fragility_add_fractiles(FragilityWork *work, int metric, double *values) {
    Fragility *answer = work->answer;
    const size_t before = answer->fractiles.count;
    size_t known = 0;
    for (size_t l = 0; l < work->levels; l++) {
        const size_t count = fragility_values(answer, l, metric, values);
        FragilityFractile *fractile = list_append(&answer->fractiles, sizeof *fractile);
        TRY(status_made(fractile != NULL));
        known += count;
        *fractile = (FragilityFractile){metric,
                                        work->study->levels.values.at[l],
                                        count,
                                        statistics_quantile(values, count, 0.16),
                                        statistics_quantile(values, count, 0.5),
                                        statistics_quantile(values, count, 0.84)};
    }
    if (known == 0)
        answer->fractiles.count = before;
    return STATUS_OK;
}

// Where a record first exceeds a limit.
static CensoredNumber fragility_interval(const FragilityCurve *curve, const FragilityLimit *limit) {
    CensoredNumber interval = {0, (double)INFINITY};
    for (size_t l = 0; l < curve->points.count; l++) {
        const FragilityPoint *point = &curve->points.at[l];
        const double value = point->metrics.of[limit->metric];
        if (value > limit->value) {
            interval.high = point->level;
            break;
        }
        if (value <= limit->value)
            interval.low = point->level;
    }
    return interval;
}

// Why there is no distribution. `intervals`: of the `count` records that have one.
static Status fragility_warn_unknown(Warnings *warnings, const char *place,
                                     const CensoredNumber *intervals, size_t count,
                                     size_t exceeded) {
    char why[160] = "the levels do not separate the records: take more levels around the "
                    "exceedance, or more records";
    size_t below = 0, same = 0;
    for (size_t i = 0; i < count; i++) {
        below += intervals[i].low > 0;
        same += intervals[i].low == intervals[0].low && intervals[i].high == intervals[0].high;
    }
    if (count == 0)
        snprintf(why, sizeof why, "no run has this metric: see the failures");
    else if (exceeded == 0)
        snprintf(why, sizeof why, "no record exceeds it: take higher levels");
    else if (below == 0)
        snprintf(why, sizeof why, "every record exceeds it at the lowest level: take lower levels");
    else if (same == count)
        snprintf(why, sizeof why,
                 "the levels do not separate the records: take more levels between %s and %s m/s^2",
                 real_text(intervals[0].low).at, real_text(intervals[0].high).at);
    return warnings_add(warnings, place, "median and dispersion are unknown: %s", why);
}

static Status fragility_add_state(FragilityWork *work, size_t index, CensoredNumber *intervals) {
    Fragility *answer = work->answer;
    const FragilityLimit *limit = &work->study->limits.at[index];
    FragilityState *state = list_append(&answer->limits, sizeof *state);
    TRY(status_made(state != NULL));
    *state = (FragilityState){.metric = limit->metric,
                              .value = limit->value,
                              .median = (double)NAN,
                              .dispersion = (double)NAN};
    size_t count = 0;
    for (size_t r = 0; r < answer->curves.count; r++) {
        const CensoredNumber interval = fragility_interval(&answer->curves.at[r], limit);
        if (interval.low > 0 || interval.high < (double)INFINITY)
            intervals[count++] = interval;
        state->exceeded += interval.high < (double)INFINITY;
    }
    LognormalFit fit;
    if (!lognormal_fit(intervals, count, STATISTICS_CONFIDENCE, &fit))
        return fragility_warn_unknown(&answer->made.warnings,
                                      json_pointer_at("/study/limits", index).at, intervals, count,
                                      state->exceeded);
    state->median = fit.median;
    state->dispersion = fit.dispersion;
    TRY(study_copy_reals(fit.median_interval, 2, &state->median_interval_95));
    return study_copy_reals(fit.dispersion_interval, 2, &state->dispersion_interval_95);
}

static Status fragility_end(void *of, const StudyTools *tools, Problem *problem) {
    FragilityWork *work = of;
    const size_t records = work->study->records.count;
    double *values = calloc(records, sizeof *values);
    CensoredNumber *intervals = calloc(records, sizeof *intervals);
    Status status = status_made(values != NULL && intervals != NULL);
    for (int m = 0; m < STUDY_METRIC_COUNT && status == STATUS_OK; m++) {
        status = study_advance(tools->progress, 1, problem);
        if (status == STATUS_OK)
            status = fragility_add_fractiles(work, m, values);
    }
    for (size_t i = 0; i < work->study->limits.count && status == STATUS_OK; i++) {
        status = study_advance(tools->progress, 1, problem);
        if (status == STATUS_OK)
            status = fragility_add_state(work, i, intervals);
    }
    free(values);
    free(intervals);
    return status == STATUS_OK ? study_runs_warn(&work->answer->made) : status;
}

static void fragility_free(void *of) {
    FragilityWork *work = of;
    simulation_clear(&work->base);
}

const StudyKind study_fragility = {
    .kind = {"fragility",
             "a suite of ground motions at rising intensities, and the limits exceeded",
             fragility_study_fields, sizeof(FragilityStudy)},
    .answer = &(const Kind){"fragility", "curves of all records, and the fitted distributions",
                            fragility_answer_fields, sizeof(Fragility)},
    .shorten = "take fewer records or levels, or a shorter duration",
    .references = fragility_references,
    .prepare = fragility_prepare,
    .max_runs = 1000,
    .complete = fragility_complete,
    .cost = fragility_cost,
    .work_size = sizeof(FragilityWork),
    .part_size = sizeof(StudyPart),
    .begin = fragility_begin,
    .scene = fragility_scene,
    .fold = fragility_fold,
    .end = fragility_end,
    .free = fragility_free,
};
