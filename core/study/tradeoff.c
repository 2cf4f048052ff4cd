// The rows of a solver's settings say what it can trade: a row "step" or "tolerance" makes
// candidates, whatever the solver is called.
//
// Every point is run once for its errors and then timed, in `repeats` rounds over all points, which
// share a temporary slowdown of the machine. Short runs are timed many at once.
//
// Cost is the smallest CPU time: disturbances make a run longer, never shorter. Even so similar
// times change places from one measurement to the next: among those the closest point is best.
#include "core/study/tradeoff.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/solver.h"

enum {
    DECADES_MAX = 8,  // of steps, from the sample interval down
    SEGMENT_MIN = 16, // samples of a segment
    RATES = 3,
    SHARES = 2,
    STOREYS_MIN = 4, // of a structure with modes to leave out
};
// The finest step: this part of the shortest contact, or of a radian of the fastest mode.
static const double contact_part = 3e-3, radian_part = 1e-3;
static const double tolerance_max = 1e-3, tolerance_min = 1e-14, tolerance_factor = 1e-2;
static const double rate_divisors[RATES] = {2, 4, 8}; // powers of 2, so that samples coincide
static const uint64_t spectrum_divisors[SHARES] = {4, 16};
static const double duration_divisors[SHARES] = {2, 4};

const char *const tradeoff_status_names[] = {"measured", "refused", "failed", NULL};

// clang-format off
const Field tradeoff_point_fields[] = {
    FIELD_TEXT(TradeoffPoint, name, 0, PRESENCE_OPTIONAL, 0, "name for display"),
    FIELD_TEXT(TradeoffPoint, solver, 0, PRESENCE_OPTIONAL, 0, "solver"),
    FIELD_REAL(TradeoffPoint, step, "s", ANY, OPTIONAL, "its step"),
    FIELD_REAL(TradeoffPoint, tolerance, NULL, ANY, OPTIONAL, "its tolerance"),
    FIELD_TEXT(TradeoffPoint, contact_model, 0, PRESENCE_OPTIONAL, 0, "contact model in place of the scene's"),
    FIELD_REAL(TradeoffPoint, sample_rate, "Hz", ANY, OPTIONAL, "sample rate in place of the scene's; the base keeps its own"),
    FIELD_REAL(TradeoffPoint, duration, "s", ANY, OPTIONAL, "duration in place of the scene's"),
    FIELD_COUNT(TradeoffPoint, segment, "samples", AT_MIN(1), OPTIONAL, "segment of the spectra in place of the scene's"),
    FIELD_COUNT(TradeoffPoint, modes, NULL, AT_MIN(1), OPTIONAL, "number of modes kept; all if absent"),
    FIELD_CHOICE(TradeoffPoint, status, tradeoff_status_names, TRADEOFF_MEASURED, "measured; refused: too expensive or invalid; failed: the run ended early"),
    FIELD_TEXT(TradeoffPoint, why, 0, PRESENCE_OPTIONAL, 0, "why it was not measured"),
    FIELD_REAL(TradeoffPoint, cpu_minimum, "s", ANY, OPTIONAL, "CPU time of a run with the scene's own output, the smallest timing; a measurement, not repeatable"),
    FIELD_REAL(TradeoffPoint, cpu_median, "s", ANY, OPTIONAL, "median of the timings; a measurement"),
    FIELD_COUNT(TradeoffPoint, runs, NULL, AT_MIN(0), 0, "number of timed runs: short ones are timed many at once"),
    FIELD_REAL(TradeoffPoint, steps, NULL, ANY, OPTIONAL, "solver steps"),
    FIELD_ITEM(TradeoffPoint, errors, error_fields, NULL, PRESENCE_DEFAULT, "differences from the reference"),
    FIELD_FLAG(TradeoffPoint, is_best, false, "no other point is both cheaper and closer by the metric; follows from measured times"),
    FIELD_END
};
// clang-format on

// Sets the number of this name, if the rows have one.
static void candidate_set(const Field *fields, void *item, const char *name, double value) {
    size_t offset = 0;
    const Field *row = fields_find(fields, name, &offset);
    if (row == NULL || isnan(value))
        return;
    void *member = (char *)item + offset + row->offset;
    if (row->kind == FIELD_KIND_COUNT)
        *(uint64_t *)member = (uint64_t)value;
    else
        *(double *)member = value;
}

// Adds a point with one setting that differs from the scene's, or with none (NULL). Its name is
// "SOLVER, BEFORE VALUE AFTER".
static Status candidate_add(TradeoffPoints *points, const Kind *solver, const char *setting,
                            double value, const char *before, const char *after) {
    char rest[64] = "";
    TradeoffPoint *point = list_append(points, sizeof *point);
    TRY(status_made(point != NULL));
    (void)fields_default(tradeoff_point_fields, point); // absent and 0: nothing to allocate
    if (setting != NULL) {
        candidate_set(tradeoff_point_fields, point, setting, value);
        const bool is_whole = value == floor(value) && value < 1e15;
        snprintf(rest, sizeof rest, is_whole ? ", %s%.0f%s" : ", %s%.6g%s", before, value, after);
    }
    TRY(text_copy(solver->name, &point->solver));
    return status_made(text_format(&point->name, "%s%s", solver->name, rest));
}

// Duration of the shortest contact of a buffer, about, for a free mass [s]; NAN: none.
static double candidate_contact_time(const Buffer *buffer, double mass) {
    static const double pi = 3.14159265358979324;
    double shortest = buffer->contact_time;
    if (isnan(shortest) && buffer->stiffness > 0)
        shortest = pi * sqrt(mass / buffer->stiffness);
    for (size_t i = 0; i < buffer->table.count; i++)
        shortest = fmin(shortest, buffer->table.at[i].contact_time);
    return shortest;
}

static Status candidate_finest_step(const Simulation *simulation, double *finest) {
    StructureRates rates;
    TRY(structure_rates(scene_structure(&simulation->scene), SIZE_MAX, &rates));
    *finest = rates.fastest > 0 ? radian_part / rates.fastest : (double)INFINITY;
    for (size_t i = 0; i < simulation->scene.dampers.count; i++) {
        const Damper *damper = &simulation->scene.dampers.at[i];
        for (int side = SIDE_LEFT; side <= SIDE_RIGHT; side++) {
            const Buffer *buffer = damper_buffer(damper, (Side)side);
            *finest = fmin(*finest, contact_part * candidate_contact_time(buffer, damper->mass));
        }
    }
    return STATUS_OK;
}

static Status candidate_add_steps(TradeoffPoints *points, const Kind *solver,
                                  const Simulation *simulation) {
    double step = 1 / simulation->scene.sample_rate, finest;
    TRY(candidate_finest_step(simulation, &finest));
    for (int i = 0; i < DECADES_MAX; i++, step /= 10) {
        TRY(candidate_add(points, solver, "step", step, "step ", " s"));
        if (step <= finest)
            break;
    }
    return STATUS_OK;
}

static Status candidate_add_tolerances(TradeoffPoints *points, const Kind *solver,
                                       const Range *range) {
    const double min = fmax(range->min, tolerance_min) * (1 - 1e-9);
    for (double own = fmin(tolerance_max, range->max); own >= min; own *= tolerance_factor)
        TRY(candidate_add(points, solver, "tolerance", own, "tolerance ", ""));
    return STATUS_OK;
}

// Less output at full accuracy.
static Status candidate_add_outputs(TradeoffPoints *points, const Kind *solver,
                                    const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    const SpectrumRequest *psd = &simulation->output.psd;
    const size_t shares = psd->channels.count > 0 ? SHARES : 0;
    for (size_t i = 0; i < RATES; i++) {
        const double rate = scene->sample_rate / rate_divisors[i];
        if (rate * scene->duration < SEGMENT_MIN)
            break;
        TRY(candidate_add(points, solver, "sample_rate", rate, "sampled at ", " Hz"));
    }
    for (size_t i = 0; i < shares; i++) {
        const uint64_t segment = psd->segment / spectrum_divisors[i];
        if (segment < SEGMENT_MIN)
            break;
        TRY(candidate_add(points, solver, "segment", (double)segment, "segments of ", ""));
    }
    for (size_t i = 0; i < shares; i++) {
        const double duration = scene->duration / duration_divisors[i];
        if (duration * scene->sample_rate < (double)psd->segment)
            break;
        TRY(candidate_add(points, solver, "duration", duration, "", " s long"));
    }
    return STATUS_OK;
}

static bool candidate_has_form(const Simulation *simulation, ContactForm form) {
    const Scene *scene = &simulation->scene;
    return scene->dampers.count > 0 &&
           dampers_contact_law(&scene->dampers, scene_contact(scene))->form == form;
}

static bool candidate_is_requested(const Texts *names, const char *name) {
    bool is_named = names->count == 0;
    for (size_t i = 0; i < names->count; i++)
        is_named = is_named || strcmp(names->at[i], name) == 0;
    return is_named;
}

static Status candidate_add_solver(TradeoffPoints *points, const Solver *solver,
                                   const Simulation *simulation) {
    const Kind *kind = &solver->kind;
    // Some solvers use their settings under power laws alone.
    const bool is_used =
        solver->forget_unused == NULL || candidate_has_form(simulation, CONTACT_POWER);
    const Field *tolerance = is_used ? fields_find(kind->fields, "tolerance", NULL) : NULL;
    if (fields_find(kind->fields, "step", NULL) != NULL)
        return candidate_add_steps(points, kind, simulation);
    if (tolerance != NULL)
        TRY(candidate_add_tolerances(points, kind, &tolerance->range));
    // Without its tolerance, if that may be left out.
    return tolerance == NULL || tolerance->presence == PRESENCE_OPTIONAL
               ? candidate_add(points, kind, NULL, NAN, "", "")
               : STATUS_OK;
}

// What is traded with the reference solver: impulses for contacts; half the modes, a quarter, and
// so on down to one; output.
static Status candidate_add_reference(TradeoffPoints *points, const Kind *solver,
                                      const Simulation *simulation) {
    const size_t storeys = structure_storeys(scene_structure(&simulation->scene));
    if (candidate_has_form(simulation, CONTACT_LINEAR)) {
        const char *model = contact_impulse.kind.name;
        TRY(candidate_add(points, solver, NULL, NAN, "", ""));
        TradeoffPoint *point = &points->at[points->count - 1];
        TRY(text_copy(model, &point->contact_model));
        TRY(status_made(text_format(&point->name, "%s, contact %s", solver->name, model)));
    }
    for (size_t modes = storeys / 2; storeys >= STOREYS_MIN && modes > 0; modes /= 2)
        TRY(candidate_add(points, solver, "modes", (double)modes, "",
                          modes == 1 ? " mode" : " modes"));
    return candidate_add_outputs(points, solver, simulation);
}

Status candidate_settings_list(const Texts *names, const Simulation *simulation,
                               TradeoffPoints *points) {
    *points = (TradeoffPoints){NULL, 0};
    for (size_t i = 0; solvers[i] != NULL; i++)
        if (solvers[i]->run != NULL && candidate_is_requested(names, solvers[i]->kind.name))
            TRY(candidate_add_solver(points, solvers[i], simulation));
    if (candidate_is_requested(names, solver_exact.kind.name))
        TRY(candidate_add_reference(points, &solver_exact.kind, simulation));
    for (size_t i = 0; i < points->count; i++)
        points->at[i].estimate = candidate_settings_cost(simulation, &points->at[i]);
    return STATUS_OK;
}

static Status candidate_apply_solver(const TradeoffPoint *point, Simulation *target) {
    Variant *accuracy = variant_new(kind_find(&solver_kinds, point->solver));
    TRY(status_made(accuracy != NULL));
    variant_free(target->accuracy);
    target->accuracy = accuracy;
    candidate_set(accuracy->kind->fields, accuracy, "step", point->step);
    candidate_set(accuracy->kind->fields, accuracy, "tolerance", point->tolerance);
    candidate_set(accuracy->kind->fields, accuracy, "modes",
                  point->modes == COUNT_ABSENT ? (double)NAN : (double)point->modes);
    return STATUS_OK;
}

// A coarser spectrum keeps its share of overlap.
static void candidate_apply_output(const TradeoffPoint *point, Simulation *target) {
    SpectrumRequest *psd = &target->output.psd;
    double share = 1;
    if (!isnan(point->sample_rate)) {
        share = point->sample_rate / target->scene.sample_rate;
        target->scene.sample_rate = point->sample_rate;
    }
    if (!isnan(point->duration))
        target->scene.duration = point->duration;
    if (point->segment != COUNT_ABSENT && psd->channels.count > 0)
        share = (double)point->segment / (double)psd->segment;
    if (psd->channels.count > 0 && share != 1) {
        psd->segment = (uint64_t)fmax(1, floor((double)psd->segment * share));
        psd->overlap = (uint64_t)floor((double)psd->overlap * share);
        if (psd->overlap >= psd->segment)
            psd->overlap = psd->segment - 1;
    }
    target->output.impacts = true; // errors are counted from them
    target->output.reduction = false;
    const double last = floor(target->scene.duration * target->scene.sample_rate * (1 + 1e-12)) /
                        target->scene.sample_rate;
    target->output.statistics_from = fmin(target->output.statistics_from, last);
}

Status candidate_settings_apply(const Simulation *simulation, const TradeoffPoint *point,
                                const SimulationLimits *limits, Simulation *target,
                                Problem *problem) {
    Status status = fields_copy(simulation_fields, simulation, target);
    if (status == STATUS_OK)
        status = candidate_apply_solver(point, target);
    if (status == STATUS_OK && point->contact_model != NULL)
        status = simulation_use_impulses(target, problem);
    TRY(status);
    candidate_apply_output(point, target);
    return simulation_complete(target, limits, NULL, problem);
}

double candidate_settings_cost(const Simulation *simulation, const TradeoffPoint *point) {
    Simulation view = *simulation; // borrows all but what the point changes
    view.accuracy = NULL;
    if (candidate_apply_solver(point, &view) != STATUS_OK)
        return 0; // the run will fail
    candidate_apply_output(point, &view);
    const double steps = simulation_cost(&view).steps;
    variant_free(view.accuracy);
    return steps;
}

enum { SOLVERS_MAX = 32, REPEATS_MAX = 1000, BATCH_MAX = 10000 }; // runs of a timing
static const double batch_seconds = 5e-3;                         // of CPU, at least, of a timing
static const double batch_steps = 1e5;                            // about as many solver steps
static const double similar = 1.25; // times as long is within the noise of a measurement

static const double default_errors[METRIC_COUNT] = {1e-3, 1e-2, 1e-2, 0, 0.1, 1e-3, 1e-2, 1e-2};

// clang-format off
static const Field tradeoff_study_fields[] = {
    FIELD_REAL(TradeoffStudy, error, NULL, AT_MIN(0), OPTIONAL, "wanted error, in the metric's unit; if absent 1e-3, for mean_acceleration, peak_force, peak_storey_drift and peak_base_shear 1e-2, for impacts 0, for psd 0.1 dB"),
    FIELD_CHOICE(TradeoffStudy, metric, metric_names, METRIC_DISPLACEMENT, "metric of the error"),
    FIELD_COUNT(TradeoffStudy, repeats, NULL, WITHIN(1, REPEATS_MAX), 5, "timings of each point, of which the smallest and the median are reported"),
    FIELD_TEXTS(TradeoffStudy, solvers, NULL, NULL, SOLVERS_MAX, PRESENCE_OPTIONAL, 0, "solvers to try; all if absent"),
    FIELD_REAL(TradeoffStudy, point_steps, NULL, WITHIN(1, 1e15), 5e7, "limit on the estimated solver steps of a point; a more expensive one is refused"),
    FIELD_COUNT(TradeoffStudy, trial, NULL, AT_MIN(1), 1, "another number measures the CPU times again; the same number returns the stored answer"),
    FIELD_END
};

static const Field tradeoff_reference_fields[] = {
    FIELD_TEXT(TradeoffReference, solver, 0, PRESENCE_OPTIONAL, 0, "reference solver"),
    FIELD_BASE(TradeoffReference, yardstick, reference_summary_fields),
    FIELD_END
};

static const Field tradeoff_recommendation_fields[] = {
    FIELD_COUNT(TradeoffRecommendation, point, NULL, AT_MIN(1), OPTIONAL, "number of the point, from 1: the cheapest that keeps the error, or the closest that takes at most 1.25 times as long; unknown: none keeps it; follows from measured times"),
    FIELD_TEXT(TradeoffRecommendation, why, 0, PRESENCE_OPTIONAL, 0, "the reason"),
    FIELD_END
};

static const Field tradeoff_answer_fields[] = {
    FIELD_CHOICE(Tradeoff, metric, metric_names, OPTIONAL, "metric of the wanted error"),
    FIELD_REAL(Tradeoff, error, NULL, ANY, OPTIONAL, "wanted error"),
    FIELD_COUNT(Tradeoff, repeats, NULL, AT_MIN(1), OPTIONAL, "timings of each point"),
    FIELD_COUNT(Tradeoff, trial, NULL, AT_MIN(1), OPTIONAL, "number of the measurement"),
    FIELD_ITEM(Tradeoff, reference, tradeoff_reference_fields, NULL, PRESENCE_DEFAULT, "reference of all points"),
    FIELD_LIST(Tradeoff, points, tradeoff_point_fields, 0, PRESENCE_DEFAULT, "settings tried"),
    FIELD_ITEM(Tradeoff, recommendation, tradeoff_recommendation_fields, NULL, PRESENCE_DEFAULT, "the recommended point"),
    FIELD_END
};
// clang-format on

static Status tradeoff_check_solvers(const TradeoffStudy *study, Problem *problem) {
    const char *names[SOLVERS_MAX + 1] = {NULL};
    for (size_t i = 0, count = 0; solvers[i] != NULL && count < SOLVERS_MAX; i++)
        if (solvers[i]->run != NULL)
            names[count++] = solvers[i]->kind.name;
    return study_run_check_names(&study->solvers, names, "solvers", problem);
}

// All storeys are compared, whatever channels the scene requests.
static Status tradeoff_check_values(const Simulation *simulation, const SimulationLimits *limits,
                                    Problem *problem) {
    const double storeys = (double)structure_storeys(scene_structure(&simulation->scene));
    const double values = 2 * storeys * (double)scene_sample_count(&simulation->scene);
    if (limits == NULL || limits->samples == 0 || values <= 4 * (double)limits->samples)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/study",
                       "compares displacement and mean_acceleration of every storey, %.3g values, "
                       "must be at most %.3g: take a shorter duration or a lower sample_rate",
                       values, 4 * (double)limits->samples);
}

// Of the reference and of another run.
static double tradeoff_bytes(const Simulation *simulation) {
    const double storeys = (double)structure_storeys(scene_structure(&simulation->scene));
    return sizeof(double) * 4 * storeys * (double)scene_sample_count(&simulation->scene);
}

static Status tradeoff_complete(void *request, const Simulation *simulation,
                                const SimulationLimits *limits, Problem *problem) {
    TradeoffStudy *study = request;
    if (study->metric == CHOICE_ABSENT)
        study->metric = METRIC_DISPLACEMENT;
    if (isnan(study->error))
        study->error = default_errors[study->metric];
    const Status metric =
        simulation_check_metric(simulation, metric_names[study->metric], "/study/metric", problem);
    const Status names = tradeoff_check_solvers(study, problem);
    const Status values = tradeoff_check_values(simulation, limits, problem);
    return study_first_failure(study_first_failure(metric, names), values);
}

// Limits of one point.
static SimulationLimits tradeoff_limits(const TradeoffStudy *study,
                                        const SimulationLimits *limits) {
    SimulationLimits own = limits != NULL ? *limits : (SimulationLimits){0};
    if (!(own.steps > 0) || own.steps > study->point_steps)
        own.steps = study->point_steps;
    return own;
}

// Estimated solver steps of all points that are run, and of their timings.
static double tradeoff_all_steps(const TradeoffStudy *study, const TradeoffPoints *points,
                                 double max) {
    double all = 0;
    for (size_t i = 0; i < points->count; i++) {
        const double steps = points->at[i].estimate;
        if (steps <= max)
            all += steps +
                   (double)study->repeats * (steps > batch_steps ? steps : batch_steps + steps);
    }
    return all;
}

static Status tradeoff_cost(const void *request, const Simulation *simulation,
                            const SimulationLimits *limits, double *steps) {
    const TradeoffStudy *study = request;
    Tradeoff answer = {0};
    const Status status = candidate_settings_list(&study->solvers, simulation, &answer.points);
    *steps = tradeoff_all_steps(study, &answer.points, tradeoff_limits(study, limits).steps);
    fields_clear(tradeoff_answer_fields, &answer);
    return status;
}

typedef struct TradeoffRun {
    StudyWork work;
    const TradeoffStudy *study;
    const Simulation *simulation;
    const StudyTools *tools;
    SimulationLimits limits; // of a point
    Tradeoff *answer;
    Outcome *reference;
    double *times;    // [s], `repeats` of each point
    double done, all; // estimated steps
} TradeoffRun;

// Removes the steps finer than one that is too expensive already.
static void tradeoff_trim(TradeoffRun *run) {
    TradeoffPoints *points = &run->answer->points;
    size_t count = 0;
    for (size_t i = 0; i < points->count; i++) {
        TradeoffPoint *point = &points->at[i];
        const TradeoffPoint *before = count > 0 ? &points->at[count - 1] : NULL;
        if (before != NULL && !isnan(point->step) && point->estimate > run->limits.steps &&
            before->estimate > run->limits.steps && strcmp(point->solver, before->solver) == 0)
            fields_clear(tradeoff_point_fields, point);
        else
            points->at[count++] = *point;
    }
    points->count = count;
}

// Runs a scene; `steps` are its part of the progress.
static Status tradeoff_run(TradeoffRun *run, const Simulation *simulation,
                           const SimulationLimits *limits, double steps, Outcome **outcome,
                           Problem *problem) {
    const Progress progress = progress_range_view(
        &(ProgressRange){run->tools->progress, run->done / run->all, steps / run->all, 0});
    return simulation_run(simulation, limits, &progress, run->tools->workspace, outcome, problem);
}

static Status tradeoff_run_reference(TradeoffRun *run, Problem *problem) {
    TradeoffReference *reference = &run->answer->reference;
    TradeoffPoint exact;
    Simulation simulation = {0};
    (void)fields_default(tradeoff_point_fields, &exact);
    TRY(text_copy(solver_exact.kind.name, &reference->solver));
    exact.solver = reference->solver;
    Status status =
        candidate_settings_apply(run->simulation, &exact, run->tools->limits, &simulation, problem);
    if (status == STATUS_OK)
        status = error_metrics_request(&simulation, problem);
    if (status == STATUS_OK)
        status = tradeoff_run(run, &simulation, run->tools->limits, batch_steps, &run->reference,
                              problem);
    simulation_clear(&simulation);
    run->done += batch_steps;
    return status;
}

// Runs a point and measures its errors. A point that fails is a row with its reason.
static Status tradeoff_measure(TradeoffRun *run, size_t index, Problem *problem) {
    TradeoffPoint *point = &run->answer->points.at[index];
    const double steps = point->estimate;
    Simulation simulation = {0};
    Outcome *outcome = NULL;
    Status status;
    if (steps > run->limits.steps)
        status = problem_set(problem, STATUS_LIMIT,
                             "would take about %.2g solver steps, more than the %.2g that one "
                             "point may take",
                             steps, run->limits.steps);
    else
        status =
            candidate_settings_apply(run->simulation, point, &run->limits, &simulation, problem);
    if (status == STATUS_OK)
        status = error_metrics_request(&simulation, problem);
    point->status = status == STATUS_OK ? TRADEOFF_FAILED : TRADEOFF_REFUSED;
    if (status == STATUS_OK)
        status = tradeoff_run(run, &simulation, &run->limits, steps, &outcome, problem);
    if (status == STATUS_OK) {
        const bool has_motion = isnan(point->duration) && point->segment == COUNT_ABSENT;
        point->status = TRADEOFF_MEASURED;
        point->steps = floor(outcome->steps + 0.5); // parts of one are counted too
        point->errors = error_metrics_measure(run->reference, outcome, has_motion);
    } else if (!study_run_ends_study(status)) {
        status = text_copy(problem->count > 0 ? problem->faults[0].detail : problem->detail,
                           &point->why);
        problem_clear(problem);
    }
    if (steps <= run->limits.steps)
        run->done += steps;
    outcome_unref(outcome);
    simulation_clear(&simulation);
    return status;
}

// One timing: as many runs as take batch_seconds.
static Status tradeoff_time(TradeoffRun *run, size_t index, size_t round, Problem *problem) {
    TradeoffPoint *point = &run->answer->points.at[index];
    const StudyTools *tools = run->tools;
    Simulation simulation = {0};
    // Its limits were checked before.
    Status status = candidate_settings_apply(run->simulation, point, NULL, &simulation, problem);
    const double steps = point->estimate;
    const double end = run->done + fmax(steps, batch_steps);
    size_t runs = 0;
    double took = 0;
    const double began = tools->cpu(tools->cpu_context);
    while (status == STATUS_OK && runs < BATCH_MAX && took < batch_seconds) {
        Outcome *outcome = NULL;
        const double share = fmin(steps, end - run->done);
        status = tradeoff_run(run, &simulation, &run->limits, share, &outcome, problem);
        outcome_unref(outcome);
        run->done += share;
        runs++;
        took = tools->cpu(tools->cpu_context) - began;
    }
    simulation_clear(&simulation);
    TRY(status);
    run->times[index * run->study->repeats + round] = took / (double)runs;
    point->runs += runs;
    run->done = end;
    return STATUS_OK;
}

static Status tradeoff_time_all(TradeoffRun *run, Problem *problem) {
    const TradeoffPoints *points = &run->answer->points;
    const size_t repeats = run->study->repeats;
    for (size_t round = 0; round < repeats; round++)
        for (size_t i = 0; i < points->count; i++) {
            TRY(study_advance(run->tools->progress, run->done / run->all, problem));
            if (points->at[i].status == TRADEOFF_MEASURED)
                TRY(tradeoff_time(run, i, round, problem));
        }
    for (size_t i = 0; i < points->count; i++) {
        TradeoffPoint *point = &points->at[i];
        double *times = &run->times[i * repeats];
        if (point->status != TRADEOFF_MEASURED)
            continue;
        reals_sort(times, repeats);
        point->cpu_minimum = times[0];
        point->cpu_median = (times[(repeats - 1) / 2] + times[repeats / 2]) / 2;
    }
    return STATUS_OK;
}

// A point's error; NAN if it was not measured.
static double tradeoff_point_error(const TradeoffPoint *point, int metric) {
    return point->status == TRADEOFF_MEASURED && !isnan(point->cpu_minimum)
               ? error_metrics_by(&point->errors, metric)
               : (double)NAN;
}

void tradeoff_mark_best(TradeoffPoints *points, int metric) {
    for (size_t i = 0; i < points->count; i++) {
        TradeoffPoint *point = &points->at[i];
        const double cpu = point->cpu_minimum, error = tradeoff_point_error(point, metric);
        point->is_best = !isnan(error);
        for (size_t j = 0; j < points->count && point->is_best; j++) {
            const double other = tradeoff_point_error(&points->at[j], metric);
            const double time = points->at[j].cpu_minimum;
            point->is_best = !(time <= cpu && other <= error && (time < cpu || other < error));
        }
    }
}

// The cheapest point, or the closest, of those with at most this error and CPU time, without
// `without`; NULL: none.
static const TradeoffPoint *tradeoff_find(const TradeoffPoints *points, int metric, bool is_closest,
                                          double max_error, double max_cpu,
                                          const TradeoffPoint *without) {
    const TradeoffPoint *found = NULL;
    double least = INFINITY;
    for (size_t i = 0; i < points->count; i++) {
        const TradeoffPoint *point = &points->at[i];
        const double error = tradeoff_point_error(point, metric), cpu = point->cpu_minimum;
        if (point == without || !(error <= max_error && cpu <= max_cpu) ||
            (found != NULL && !((is_closest ? error : cpu) < least)))
            continue;
        found = point;
        least = is_closest ? error : cpu;
    }
    return found;
}

Status tradeoff_recommend(const TradeoffPoints *points, int metric, double error,
                          TradeoffRecommendation *recommendation) {
    const char *name = metric_names[metric], *unit = metric_units[metric];
    const TradeoffPoint *cheapest = tradeoff_find(points, metric, false, error, INFINITY, NULL);
    const TradeoffPoint *best =
        tradeoff_find(points, metric, true, INFINITY,
                      cheapest != NULL ? similar * cheapest->cpu_minimum : (double)INFINITY, NULL);
    char **why = &recommendation->why;
    recommendation->point = COUNT_ABSENT;
    if (best == NULL || cheapest == NULL)
        return status_made(
            best == NULL
                ? text_format(why, "no point has an error of %s", name)
                : text_format(why, "no point keeps %s within %.3g%s; the closest, %s, is at %.2g%s",
                              name, error, unit, best->name, tradeoff_point_error(best, metric),
                              unit));
    if (!(tradeoff_point_error(best, metric) < tradeoff_point_error(cheapest, metric)))
        best = cheapest;
    const TradeoffPoint *next = tradeoff_find(points, metric, false, error, INFINITY, best);
    char others[256] = "; no other point keeps it";
    if (next != NULL)
        snprintf(others, sizeof others, "; the cheapest other is %.100s: %.2g%s in %.3g s",
                 next->name, tradeoff_point_error(next, metric), unit, next->cpu_minimum);
    recommendation->point = (uint64_t)(best - points->at) + 1;
    return status_made(text_format(why, "%s keeps %s within %.3g%s: %.2g%s in %.3g s%s", best->name,
                                   name, error, unit, tradeoff_point_error(best, metric), unit,
                                   best->cpu_minimum, others));
}

static Status tradeoff_run_all(TradeoffRun *run, Problem *problem) {
    Tradeoff *answer = run->answer;
    const TradeoffStudy *study = run->study;
    TradeoffPoints *points = &answer->points;
    tradeoff_trim(run);
    run->all += tradeoff_all_steps(study, points, run->limits.steps);
    TRY(tradeoff_run_reference(run, problem));
    answer->reference.yardstick = error_metrics_reference(run->reference);
    for (size_t i = 0; i < points->count; i++)
        TRY(tradeoff_measure(run, i, problem));
    outcome_unref(run->reference);
    run->reference = NULL;
    TRY(tradeoff_time_all(run, problem));
    tradeoff_mark_best(points, study->metric);
    return tradeoff_recommend(points, study->metric, study->error, &answer->recommendation);
}

static Status tradeoff_begin(void *of, const StudyTools *tools, Problem *problem) {
    TradeoffRun *run = of;
    const TradeoffStudy *study = run->study = run->work.study;
    Tradeoff *answer = run->answer = run->work.answer;
    answer->metric = study->metric;
    answer->error = study->error;
    answer->repeats = study->repeats;
    answer->trial = study->trial;
    run->simulation = run->work.simulation;
    run->tools = tools;
    run->limits = tradeoff_limits(study, tools->limits);
    run->all = batch_steps;
    TRY(candidate_settings_list(&study->solvers, run->simulation, &answer->points));
    run->times = calloc(answer->points.count * study->repeats + 1, sizeof *run->times);
    TRY(status_made(run->times != NULL));
    return tradeoff_run_all(run, problem);
}

static void tradeoff_free(void *of) {
    TradeoffRun *run = of;
    outcome_unref(run->reference);
    free(run->times);
}

const StudyKind study_tradeoff = {
    .kind = {"tradeoff",
             "error against CPU time over solvers, steps and other settings traded for speed",
             tradeoff_study_fields, sizeof(TradeoffStudy)},
    .answer = &(const Kind){"tradeoff", "accuracy against CPU time, measured",
                            tradeoff_answer_fields, sizeof(Tradeoff)},
    .shorten = "ask for fewer solvers or repeats, or lower point_steps",
    .is_measured = true,
    .complete = tradeoff_complete,
    .cost = tradeoff_cost,
    .bytes = tradeoff_bytes,
    .work_size = sizeof(TradeoffRun),
    .begin = tradeoff_begin,
    .free = tradeoff_free,
};
