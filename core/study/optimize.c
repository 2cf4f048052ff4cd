// The members are the runs of the given scene, of the same scene without its dampers, and of one
// candidate after the other; all of them with the same seeds or records, so that candidates differ
// by their values alone:
//
//     member = group * runs + run,  group 0: given, 1: undamped, 2 + c: candidate c
//
// When the last run of a candidate is folded, the search (search.h) proposes further ones. Some are
// proposed before the results of the last are there, so that about PENDING_RUNS members can be made
// at the same time, whatever the number of threads.
#include "core/study/optimize.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/excitation/excitation.h"
#include "core/study/search.h"

enum {
    OBJECTIVES = SEARCH_OBJECTIVES,
    CONSTRAINTS = SEARCH_CONSTRAINTS / 2, // each may have a lower and an upper bound
    RUNS_MAX = 1000,
    RECORDS_MAX = 1000,
    CANDIDATES_MAX = 5000,
    ALL_RUNS_MAX = 1000000, // of all candidates: objectives of each are kept
    PENDING_RUNS = 16,
    VALUES_CHECKED = 256, // of a list, with the request
    COST_SAMPLES = 16,
    GROUPS_BEFORE = 2, // given and undamped
    RIVALS = 5,
    UNKNOWN = STATUS_COUNT, // reason of a failure: a metric that no run has
};

static const double region_tolerance = 0.02, rival_distance = 0.1;

static const char *const optimize_goal_names[] = {"minimize", "maximize", NULL};

// clang-format off
static const Field optimize_objective_fields[] = {
    FIELD_CHOICE(OptimizeObjective, metric, study_metric_names, REQUIRED, "metric of a run"),
    FIELD_CHOICE(OptimizeObjective, goal, optimize_goal_names, OPTIMIZE_MINIMIZE, "the smaller or the larger the better"),
    FIELD_END
};

static const Field optimize_constraint_fields[] = {
    FIELD_CHOICE(OptimizeConstraint, metric, study_metric_names, REQUIRED, "metric of a run"),
    FIELD_REAL(OptimizeConstraint, min, NULL, ANY, OPTIONAL, "smallest allowed value of its statistic, in the unit of the metric"),
    FIELD_REAL(OptimizeConstraint, max, NULL, ANY, OPTIONAL, "largest allowed value"),
    FIELD_END
};

static const Field optimize_over_fields[] = {
    FIELD_COUNT(OptimizeOver, runs, NULL, WITHIN(1, RUNS_MAX), OPTIONAL, "runs of each candidate, each with its own seed of a random base"),
    FIELD_COUNT(OptimizeOver, first_seed, NULL, WITHIN(0, 0x1p53 - 1), OPTIONAL, "the seeds are this one and those that follow it; the excitation's own if absent"),
    FIELD_LIST_OR_NAMES(OptimizeOver, records, pinned_record_fields, "name", RECORDS_MAX, PRESENCE_OPTIONAL, "in place of seeds: uploaded ground motions, one for each run"),
    FIELD_END
};

static const Field optimize_statistic_fields[] = {
    FIELD_TEXT(OptimizeStatistic, of, 8, PRESENCE_OPTIONAL, 0, "mean or max"),
    FIELD_REAL(OptimizeStatistic, quantile, NULL, WITHIN(0, 1), OPTIONAL, "this share of the runs is below"),
    FIELD_END
};

static const Field optimize_study_fields[] = {
    FIELD_LIST(OptimizeStudy, variables, study_variable_fields, SEARCH_VARIABLES, PRESENCE_REQUIRED, "members whose best values are searched: any number of a range, or one of some values"),
    FIELD_LIST(OptimizeStudy, objectives, optimize_objective_fields, OBJECTIVES, PRESENCE_REQUIRED, "what is to be best; of two, the front of the best compromises"),
    FIELD_LIST(OptimizeStudy, constraints, optimize_constraint_fields, CONSTRAINTS, PRESENCE_DEFAULT, "limits on other metrics"),
    FIELD_ITEM(OptimizeStudy, over, optimize_over_fields, NULL, PRESENCE_OPTIONAL, "runs of each candidate, the same ones for all; one run of the scene as it is if absent"),
    FIELD_ITEM(OptimizeStudy, statistic, optimize_statistic_fields, "of", PRESENCE_OPTIONAL, "of objectives and constraints over these runs; mean if absent"),
    FIELD_COUNT(OptimizeStudy, max_candidates, NULL, WITHIN(2, CANDIDATES_MAX), 500, "candidates that are evaluated at most"),
    FIELD_COUNT(OptimizeStudy, search_seed, NULL, WITHIN(0, 0x1p53 - 1), 1, "seed of the search's own random numbers"),
    FIELD_BASE(OptimizeStudy, names, study_names_fields),
    FIELD_END
};

static const Field optimum_value_fields[] = {
    FIELD_TEXT(OptimumValue, pointer, 0, PRESENCE_OPTIONAL, 0, "JSON Pointer to the member, the first one of tied members"),
    FIELD_TEXT(OptimumValue, value, 0, PRESENCE_OPTIONAL, FIELD_SCALARS, "its value"),
    FIELD_END
};

static const Field optimum_objective_fields[] = {
    FIELD_CHOICE(OptimumObjective, metric, study_metric_names, OPTIONAL, "metric"),
    FIELD_REAL(OptimumObjective, value, NULL, ANY, OPTIONAL, "its statistic over the runs"),
    FIELD_REALS_OR_NULL(OptimumObjective, interval_95, NULL, "confidence interval of the statistic over all possible seeds or records, of these values: the best of many is a little better by chance"),
    FIELD_END
};

static const Field optimum_best_fields[] = {
    FIELD_LIST(OptimumBest, values, optimum_value_fields, 0, PRESENCE_OPTIONAL, "of the variables"),
    FIELD_LIST(OptimumBest, objectives, optimum_objective_fields, 0, PRESENCE_OPTIONAL, "its objectives"),
    FIELD_ITEM(OptimumBest, metrics, study_metrics_fields, NULL, PRESENCE_DEFAULT, "the statistic of every metric"),
    FIELD_FLAG(OptimumBest, feasible, false, "whether it keeps the constraints"),
    FIELD_END
};

static const Field optimum_scene_fields[] = {
    FIELD_ITEM(OptimumScene, metrics, study_metrics_fields, NULL, PRESENCE_DEFAULT, "the statistic of every metric over the same runs"),
    FIELD_END
};

static const Field optimum_interval_fields[] = {
    FIELD_TEXT(OptimumInterval, pointer, 0, PRESENCE_OPTIONAL, 0, "of the variable"),
    FIELD_REAL(OptimumInterval, low, NULL, ANY, OPTIONAL, "smallest value; null of a choice without order"),
    FIELD_REAL(OptimumInterval, high, NULL, ANY, OPTIONAL, "largest value"),
    FIELD_END
};

static const Field optimum_rival_fields[] = {
    FIELD_LIST(OptimumRival, values, optimum_value_fields, 0, PRESENCE_DEFAULT, "of the variables"),
    FIELD_REAL(OptimumRival, difference, NULL, ANY, OPTIONAL, "its first objective less that of the best"),
    FIELD_REALS_OR_NULL(OptimumRival, interval_95, NULL, "confidence interval of the mean difference, over the runs in pairs: where it contains 0, the two cannot be told apart"),
    FIELD_END
};

const Field optimum_candidate_fields[] = {
    FIELD_COUNT(OptimumCandidate, index, NULL, AT_MIN(0), OPTIONAL, "number of the candidate, from 0"),
    FIELD_LIST(OptimumCandidate, values, optimum_value_fields, 0, PRESENCE_DEFAULT, "of the variables"),
    FIELD_REALS_OR_NULL(OptimumCandidate, objectives, NULL, "its objectives; null: a run has failed"),
    FIELD_FLAG(OptimumCandidate, feasible, false, "whether it keeps the constraints"),
    FIELD_END
};

static const Field optimum_failure_fields[] = {
    FIELD_TEXT(StudyFailure, reason, 0, PRESENCE_OPTIONAL, 0, "reason"),
    FIELD_COUNT(StudyFailure, count, NULL, AT_MIN(1), 0, "runs that failed for this reason"),
    {.name = "first_run", .kind = FIELD_KIND_COUNT, .offset = FIELD_AT(StudyFailure, first, uint64_t), .range = AT_MIN(0), .presence = PRESENCE_OPTIONAL, .doc = "the first of them: the runs of the given scene, of that without dampers, then of each candidate"},
    FIELD_TEXT(StudyFailure, detail, 0, PRESENCE_OPTIONAL, 0, "reason of the first of them"),
    FIELD_END
};

static const Field optimum_answer_fields[] = {
    FIELD_COUNT(Optimum, candidates, NULL, AT_MIN(0), 0, "candidates evaluated"),
    FIELD_COUNT(Optimum, runs, NULL, AT_MIN(0), 0, "runs made"),
    FIELD_COUNT(Optimum, failed, NULL, AT_MIN(0), 0, "runs that failed; their candidates are infeasible"),
    FIELD_LIST(Optimum, objectives, optimize_objective_fields, 0, PRESENCE_DEFAULT, "as requested, in the order of the candidates' values"),
    FIELD_ITEM_OR_NULL(Optimum, best, optimum_best_fields, PRESENCE_OPTIONAL, "the best feasible candidate, of two objectives the best compromise; null: none is feasible"),
    FIELD_ITEM(Optimum, given, optimum_scene_fields, NULL, PRESENCE_DEFAULT, "the scene as it is"),
    FIELD_ITEM(Optimum, undamped, optimum_scene_fields, NULL, PRESENCE_DEFAULT, "the same scene without its dampers"),
    FIELD_LIST(Optimum, region, optimum_interval_fields, 0, PRESENCE_DEFAULT, "where each variable alone may be: the objective is within 2 % of the best and the constraints hold, as the search's model of all candidates predicts"),
    FIELD_LIST(Optimum, rivals, optimum_rival_fields, 0, PRESENCE_DEFAULT, "the next best candidates whose values differ clearly"),
    FIELD_LIST(Optimum, front, optimum_candidate_fields, 0, PRESENCE_DEFAULT, "of two objectives: candidates that no other beats in both, by the first"),
    FIELD_LIST(Optimum, history, optimum_candidate_fields, 0, PRESENCE_DEFAULT, "every candidate, in their order"),
    FIELD_LIST(Optimum, failures, optimum_failure_fields, 0, PRESENCE_DEFAULT, "runs that failed, by their reason"),
    FIELD_LIST(Optimum, warnings, warning_fields, 0, PRESENCE_DEFAULT, "what is doubtful"),
    FIELD_END
};
// clang-format on

static bool optimize_has_seeds(const OptimizeStudy *study) {
    return study->over.runs != COUNT_ABSENT;
}

static size_t optimize_runs(const OptimizeStudy *study) {
    return optimize_has_seeds(study)       ? (size_t)study->over.runs
           : study->over.records.count > 0 ? study->over.records.count
                                           : 1;
}

static bool optimize_needs_reduction(const OptimizeStudy *study) {
    bool needs_reduction = false;
    for (size_t i = 0; i < study->objectives.count; i++)
        needs_reduction |= study_metric_is_reduction(study->objectives.at[i].metric);
    for (size_t i = 0; i < study->constraints.count; i++)
        needs_reduction |= study_metric_is_reduction(study->constraints.at[i].metric);
    return needs_reduction;
}

static void optimize_clear_dampers(Simulation *scene) {
    Dampers *dampers = &scene->scene.dampers;
    for (size_t i = 0; i < dampers->count; i++)
        fields_clear(damper_fields, &dampers->at[i]);
    free(dampers->at);
    *dampers = (Dampers){NULL, 0};
}

// The scene of given values with the seed or the record of a run; NULL values: those of the scene.
static Status optimize_scene_make(const OptimizeStudy *study, const Simulation *simulation,
                                  const StudyValue *values, bool has_dampers, size_t run,
                                  const SimulationLimits *limits, Simulation *scene,
                                  Problem *problem) {
    StudyValue own[SEARCH_VARIABLES];
    for (size_t j = 0; j < SEARCH_VARIABLES; j++)
        own[j] = (StudyValue){NULL, (double)NAN};
    TRY(study_scene_make(simulation, &study->variables, values != NULL ? values : own,
                         &study->names, true, limits, scene, problem));
    study_run_fix_solver(scene);
    scene->output.reduction = has_dampers && optimize_needs_reduction(study);
    if (optimize_has_seeds(study))
        ((ExcitationRandom *)(void *)scene->scene.excitation)->seed = study->over.first_seed + run;
    if (study->over.records.count > 0)
        TRY(study_scene_use_record(scene, &study->over.records.at[run]));
    if (!has_dampers)
        optimize_clear_dampers(scene);
    return has_dampers && study->over.records.count == 0
               ? STATUS_OK
               : simulation_complete(scene, limits, NULL, problem);
}

// --- The request ---

static Status optimize_check_metric(const Simulation *simulation, int metric, const char *list,
                                    size_t index, Problem *problem) {
    const JsonPointer own = json_pointer_at(list, index);
    return study_metric_check(simulation, metric, json_pointer_of(own.at, "metric").at, problem);
}

static Status optimize_check_metrics(const OptimizeStudy *study, const Simulation *simulation,
                                     Problem *problem) {
    static const char objectives[] = "/study/objectives", constraints[] = "/study/constraints";
    Status status = STATUS_OK;
    if (study->objectives.count == 0)
        status = problem_add(problem, STATUS_INVALID, objectives,
                             "must have one objective, or two for a front");
    for (size_t i = 0; i < study->objectives.count; i++) {
        const int metric = study->objectives.at[i].metric;
        if (i > 0 && metric == study->objectives.at[0].metric)
            status = json_pointer_fault(problem, json_pointer_at(objectives, i).at, "metric",
                                        "is that of the first objective: give another one");
        if (optimize_check_metric(simulation, metric, objectives, i, problem) != STATUS_OK)
            status = STATUS_INVALID;
    }
    for (size_t i = 0; i < study->constraints.count; i++) {
        const OptimizeConstraint *constraint = &study->constraints.at[i];
        const JsonPointer own = json_pointer_at(constraints, i);
        if (isnan(constraint->min) && isnan(constraint->max))
            status = problem_add(problem, STATUS_INVALID, own.at, "needs min, max or both");
        if (constraint->min > constraint->max)
            status = json_pointer_fault_real(
                problem, own.at, "min", constraint->min, study_metric_unit(constraint->metric),
                "must be at most max, which is %s", real_text(constraint->max).at);
        if (optimize_check_metric(simulation, constraint->metric, constraints, i, problem) !=
            STATUS_OK)
            status = STATUS_INVALID;
    }
    return status;
}

static Status optimize_check_statistic(const OptimizeStudy *study, Problem *problem) {
    const OptimizeStatistic *statistic = &study->statistic;
    if (statistic->of != NULL && !isnan(statistic->quantile))
        return problem_add(problem, STATUS_INVALID, "/study/statistic",
                           "is both %.8s and a quantile: leave one of them out", statistic->of);
    if (statistic->of != NULL && strcmp(statistic->of, "mean") != 0 &&
        strcmp(statistic->of, "max") != 0)
        return problem_add(problem, STATUS_INVALID, "/study/statistic",
                           "must be \"mean\", \"max\" or {\"quantile\": q}");
    if (statistic->quantile == 0 || statistic->quantile == 1)
        return problem_add(problem, STATUS_INVALID, "/study/statistic/quantile",
                           "must be above 0 and below 1; \"max\" is the largest");
    return STATUS_OK;
}

static Status optimize_complete_over(OptimizeStudy *study, const Simulation *simulation,
                                     Problem *problem) {
    static const char place[] = "/study/over";
    const Excitation *excitation = scene_excitation(&simulation->scene);
    OptimizeOver *over = &study->over;
    const bool has_records = over->records.count > 0;
    if (!optimize_has_seeds(study) && over->first_seed != COUNT_ABSENT)
        return problem_add(problem, STATUS_INVALID, place, "needs runs beside first_seed");
    if (optimize_has_seeds(study) && has_records)
        return problem_add(problem, STATUS_INVALID, place,
                           "has runs and records: leave one of them out");
    for (size_t i = 0; i < over->records.count; i++)
        if (over->records.at[i].named == NULL)
            return problem_add(problem, STATUS_INVALID,
                               json_pointer_at("/study/over/records", i).at,
                               "is a record that is not loaded");
    if (!optimize_has_seeds(study))
        return STATUS_OK;
    if (excitation_kind(excitation) != &excitation_random)
        return problem_add(problem, STATUS_INVALID, "/study/over/runs",
                           "are seeds of a random base: /excitation/kind must be random, is %s",
                           excitation_kind(excitation)->kind.name);
    if (over->first_seed == COUNT_ABSENT)
        over->first_seed = ((const ExcitationRandom *)(const void *)excitation)->seed;
    if ((double)over->first_seed + (double)(over->runs - 1) > 0x1p53 - 1)
        return problem_add(problem, STATUS_INVALID, "/study/over/first_seed",
                           "is too large for %llu runs: seeds end at 2^53 - 1",
                           (unsigned long long)over->runs);
    return STATUS_OK;
}

// Where the values of one variable alone, in the given scene, make an invalid scene.
static Status optimize_check_value(const OptimizeStudy *study, const Simulation *simulation,
                                   size_t variable, StudyValue value, const char *place,
                                   const SimulationLimits *limits, Problem *scratch,
                                   Problem *problem) {
    StudyValue values[SEARCH_VARIABLES];
    Simulation scene;
    for (size_t j = 0; j < SEARCH_VARIABLES; j++)
        values[j] = (StudyValue){NULL, (double)NAN};
    values[variable] = value;
    problem_clear(scratch);
    const Status status = study_scene_make(simulation, &study->variables, values, &study->names,
                                           true, limits, &scene, scratch);
    simulation_clear(&scene);
    return status == STATUS_INVALID ? problem_add(problem, status, place, "%s", scratch->detail)
                                    : status;
}

static Status optimize_check_values(const OptimizeStudy *study, const Simulation *simulation,
                                    const SimulationLimits *limits, Problem *problem) {
    Problem *scratch = malloc(sizeof *scratch);
    Status status = status_made(scratch != NULL);
    for (size_t i = 0; i < study->variables.count && scratch != NULL; i++) {
        const StudyAxis *axis = &study->variables.at[i];
        const JsonPointer own = json_pointer_at("/study/variables", i);
        const JsonPointer list = json_pointer_of(own.at, "values");
        const size_t count =
            axis->values.count < VALUES_CHECKED ? axis->values.count : VALUES_CHECKED;
        for (size_t k = 0; k < (study_axis_is_range(axis) ? 2 : count); k++) {
            const StudyValue value = study_axis_is_range(axis)
                                         ? (StudyValue){NULL, k == 0 ? axis->from : axis->to}
                                         : study_axis_value(axis, k);
            const Status one = optimize_check_value(
                study, simulation, i, value,
                study_axis_is_range(axis) ? json_pointer_of(own.at, k == 0 ? "from" : "to").at
                                          : json_pointer_at(list.at, k).at,
                limits, scratch, problem);
            if (one != STATUS_OK && one != STATUS_INVALID) {
                free(scratch);
                return one;
            }
            status = study_first_failure(status, one);
        }
    }
    free(scratch);
    return status;
}

static Status optimize_check_runs(const OptimizeStudy *study, Problem *problem) {
    const size_t runs = optimize_runs(study);
    if (study->max_candidates <= ALL_RUNS_MAX / runs)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/study/max_candidates",
                       "must be at most %zu with %zu runs each, is %llu", ALL_RUNS_MAX / runs, runs,
                       (unsigned long long)study->max_candidates);
}

static Status optimize_complete(void *request, const Simulation *simulation,
                                const SimulationLimits *limits, Problem *problem) {
    OptimizeStudy *study = request;
    static const char place[] = "/study/variables";
    if (study->variables.count == 0)
        return problem_add(problem, STATUS_INVALID, place, "must have at least one variable");
    const Status all[] = {
        study_axes_check(&study->variables, false, place, problem),
        optimize_check_metrics(study, simulation, problem),
        optimize_check_statistic(study, problem),
        optimize_complete_over(study, simulation, problem),
        optimize_check_runs(study, problem),
    };
    TRY(all[0]);
    TRY(study_axes_find(&study->variables, simulation, place, problem));
    TRY(optimize_check_values(study, simulation, limits, problem));
    TRY(status_first(all, COUNT(all)));
    Simulation scene;
    for (size_t i = 0; i < study->over.records.count; i++) {
        const Status status =
            optimize_scene_make(study, simulation, NULL, true, i, limits, &scene, problem);
        simulation_clear(&scene);
        TRY(status);
    }
    return STATUS_OK;
}

static void optimize_references(void *request, StudyReferences *references) {
    OptimizeStudy *study = request;
    *references = (StudyReferences){.axes = &study->variables,
                                    .axes_place = "/study/variables",
                                    .names = &study->names,
                                    .suite = &study->over.records,
                                    .suite_place = "/study/over/records"};
}

// --- Variables ---

typedef struct OptimizeVariable {
    const StudyAxis *axis;
    bool is_whole; // a range of whole numbers, which the search takes for a choice
} OptimizeVariable;

// Whether all values are numbers that rise or fall.
static bool optimize_is_ordered(const StudyAxis *axis) {
    double last = 0, direction = 0;
    for (size_t k = 0; k < axis->values.count; k++) {
        char *end;
        const double number = strtod(axis->values.at[k], &end);
        const double step = k > 0 ? number - last : 0;
        if (*end != '\0' || end == axis->values.at[k] || step * direction < 0 ||
            (k > 0 && step == 0))
            return false;
        direction = step;
        last = number;
    }
    return true;
}

static Status optimize_variables(const OptimizeStudy *study, const Simulation *simulation,
                                 OptimizeVariable *variables, SearchSpace *space,
                                 Problem *problem) {
    Simulation scene;
    Status status = fields_copy(simulation_fields, simulation, &scene);
    for (size_t j = 0; j < study->variables.count && status == STATUS_OK; j++) {
        const StudyAxis *axis = &study->variables.at[j];
        bool is_tag;
        const Field *field = study_axis_find(axis, &scene, &is_tag,
                                             json_pointer_at("/study/variables", j).at, problem);
        if (field == NULL) {
            status = STATUS_INVALID;
            break;
        }
        const bool is_range = study_axis_is_range(axis);
        variables[j].axis = axis;
        variables[j].is_whole = is_range && field->kind == FIELD_KIND_COUNT;
        if (variables[j].is_whole)
            space->variable[j] =
                (SearchVariable){(size_t)fmin(floor(axis->to) - ceil(axis->from) + 1, 1e9), true};
        else if (!is_range)
            space->variable[j] = (SearchVariable){axis->values.count, optimize_is_ordered(axis)};
    }
    simulation_clear(&scene);
    return status;
}

static StudyValue optimize_variable_value(const OptimizeVariable *variable, double number) {
    const StudyAxis *axis = variable->axis;
    if (variable->is_whole)
        return (StudyValue){NULL, ceil(axis->from) + number};
    if (!study_axis_is_range(axis))
        return study_axis_value(axis, (size_t)number);
    return (StudyValue){NULL,
                        number == 1 ? axis->to : axis->from + number * (axis->to - axis->from)};
}

// --- The work ---

typedef struct OptimizeWork {
    StudyWork work;
    const OptimizeStudy *study;
    Optimum *answer;
    Search *search;
    OptimizeVariable variables[SEARCH_VARIABLES];
    size_t runs, pending; // of a candidate; candidates that may be without results
    RunAggregate aggregate;
    bool has_force;
    StudyMetrics *collected; // of the runs of a group
    bool is_failed;          // a run of the group
    StudyMetrics *metrics;   // candidate by candidate
    double *objectives;      // of every run, as the search sees them
} OptimizeWork;

static double optimize_sign(const OptimizeStudy *study, size_t objective) {
    return study->objectives.at[objective].goal == OPTIMIZE_MAXIMIZE ? -1 : 1;
}

static void optimize_values(const OptimizeWork *work, size_t candidate, StudyValue *values) {
    const double *point = search_point(work->search, candidate);
    for (size_t j = 0; j < work->study->variables.count; j++)
        values[j] = optimize_variable_value(&work->variables[j], point[j]);
}

static Status optimize_scene(const void *of, size_t member, Simulation *scene, StudyPart *part,
                             Problem *problem) {
    const OptimizeWork *work = of;
    const size_t group = member / work->runs;
    StudyValue values[SEARCH_VARIABLES];
    (void)part;
    if (group >= GROUPS_BEFORE)
        optimize_values(work, group - GROUPS_BEFORE, values);
    return optimize_scene_make(work->study, work->work.simulation,
                               group >= GROUPS_BEFORE ? values : NULL, group != 1,
                               member % work->runs, work->work.limits, scene, problem);
}

// Proposes candidates as long as no more than `pending` of the model are without results.
static Status optimize_propose(OptimizeWork *work) {
    Search *search = work->search;
    const size_t sample = search_sample(search), added = search_added(search);
    const size_t until = added + work->pending > sample ? added + work->pending : sample;
    while (search_proposed(search) < until && search_proposed(search) < search_candidates(search))
        TRY(search_propose(search));
    work->work.wanted = (GROUPS_BEFORE + search_proposed(search)) * work->runs;
    return STATUS_OK;
}

// How far a bound is exceeded, relative to it.
static double optimize_excess(double over, double bound) {
    return over / (bound != 0 ? fabs(bound) : 1);
}

static void optimize_results(const OptimizeStudy *study, const StudyMetrics *metrics,
                             double *results) {
    size_t count = 0;
    for (size_t i = 0; i < study->objectives.count; i++)
        results[count++] = optimize_sign(study, i) * metrics->of[study->objectives.at[i].metric];
    for (size_t i = 0; i < study->constraints.count; i++) {
        const OptimizeConstraint *constraint = &study->constraints.at[i];
        const double value = metrics->of[constraint->metric];
        if (!isnan(constraint->min))
            results[count++] = optimize_excess(constraint->min - value, constraint->min);
        if (!isnan(constraint->max))
            results[count++] = optimize_excess(value - constraint->max, constraint->max);
    }
}

static Status optimize_close_candidate(OptimizeWork *work, size_t candidate,
                                       const StudyMetrics *metrics) {
    const OptimizeStudy *study = work->study;
    const size_t objectives = study->objectives.count;
    double results[OBJECTIVES + SEARCH_CONSTRAINTS];
    work->metrics[candidate] = *metrics;
    optimize_results(study, metrics, results);
    for (size_t run = 0; run < work->runs; run++)
        for (size_t i = 0; i < objectives; i++)
            work->objectives[(candidate * work->runs + run) * objectives + i] =
                work->collected[run].of[study->objectives.at[i].metric];
    search_add(work->search, results);
    work->answer->candidates++;
    // All runs ended, and yet: a metric has no number.
    if (!work->is_failed && search_violation(work->search, candidate) == (double)INFINITY)
        TRY(study_failures_add(&work->answer->failures, UNKNOWN, "unknown",
                               (candidate + GROUPS_BEFORE) * work->runs,
                               "an objective or constraint is unknown"));
    return optimize_propose(work);
}

// The statistics over the runs of a group whose last one is there.
static Status optimize_close(OptimizeWork *work, size_t group, double *column) {
    StudyMetrics metrics;
    for (int i = 0; i < STUDY_METRIC_COUNT; i++) {
        for (size_t run = 0; run < work->runs; run++)
            column[run] = work->collected[run].of[i];
        metrics.of[i] =
            work->is_failed ? (double)NAN : run_aggregate(&work->aggregate, column, work->runs);
    }
    if (group == 0)
        work->answer->given.metrics = metrics;
    else if (group == 1)
        work->answer->undamped.metrics = metrics;
    else
        return optimize_close_candidate(work, group - GROUPS_BEFORE, &metrics);
    return STATUS_OK;
}

static Status optimize_fold(void *of, size_t member, StudyPart *part) {
    OptimizeWork *work = of;
    const size_t run = member % work->runs;
    work->is_failed = work->is_failed && run > 0;
    work->answer->runs++;
    work->collected[run] = study_metrics_of(&part->run);
    if (!work->has_force)
        work->collected[run].peak_contact_force = (double)NAN;
    if (part->run.why != NULL) {
        work->is_failed = true;
        work->answer->failed++;
        TRY(study_failures_add(&work->answer->failures, (int)part->run.status,
                               status_slug(part->run.status), member, part->run.why));
    }
    if (run + 1 < work->runs)
        return STATUS_OK;
    double *column = calloc(work->runs, sizeof *column);
    TRY(status_made(column != NULL));
    const Status status = optimize_close(work, member / work->runs, column);
    free(column);
    return status;
}

static void optimize_free(void *of) {
    OptimizeWork *work = of;
    search_free(work->search);
    free(work->collected);
    free(work->metrics);
    free(work->objectives);
}

static Status optimize_begin(void *of, const StudyTools *tools, Problem *problem) {
    OptimizeWork *work = of;
    const OptimizeStudy *study = work->study = work->work.study;
    SearchSpace space = {.variables = study->variables.count,
                         .objectives = study->objectives.count,
                         .candidates = (size_t)study->max_candidates,
                         .seed = study->search_seed};
    (void)tools;
    work->answer = work->work.answer;
    for (size_t i = 0; i < study->objectives.count; i++) {
        OptimizeObjective *objective = list_append(&work->answer->objectives, sizeof *objective);
        TRY(status_made(objective != NULL));
        *objective = study->objectives.at[i];
    }
    work->runs = optimize_runs(study);
    work->pending = 1 + (PENDING_RUNS - 1) / work->runs;
    work->aggregate =
        (RunAggregate){study->statistic.of != NULL && strcmp(study->statistic.of, "max") == 0,
                       study->statistic.quantile};
    work->has_force = simulation_has_force(work->work.simulation);
    for (size_t i = 0; i < study->constraints.count; i++)
        space.constraints += (size_t)!isnan(study->constraints.at[i].min) +
                             (size_t)!isnan(study->constraints.at[i].max);
    TRY(optimize_variables(study, work->work.simulation, work->variables, &space, problem));
    TRY(search_new(&space, &work->search));
    const size_t candidates = search_candidates(work->search);
    work->collected = calloc(work->runs, sizeof *work->collected);
    work->metrics = calloc(candidates, sizeof *work->metrics);
    work->objectives =
        calloc(candidates * work->runs * study->objectives.count, sizeof *work->objectives);
    TRY(status_made(work->collected != NULL && work->metrics != NULL && work->objectives != NULL));
    work->work.members = (GROUPS_BEFORE + candidates) * work->runs;
    work->work.bytes = candidates * work->runs * study->objectives.count * sizeof(double);
    work->work.part_bytes = sizeof(StudyPart);
    return optimize_propose(work);
}

// --- The answer ---

static Status optimum_put_values(const OptimizeWork *work, size_t candidate,
                                 OptimumValues *target) {
    StudyValue values[SEARCH_VARIABLES];
    optimize_values(work, candidate, values);
    for (size_t j = 0; j < work->study->variables.count; j++) {
        OptimumValue *value = list_append(target, sizeof *value);
        TRY(status_made(value != NULL));
        TRY(text_copy(study_axis_pointer(work->variables[j].axis, 0), &value->pointer));
        TRY(text_copy(values[j].json != NULL ? values[j].json : real_text(values[j].number).at,
                      &value->value));
    }
    return STATUS_OK;
}

static Status optimum_put_candidate(const OptimizeWork *work, size_t candidate,
                                    OptimumCandidates *target) {
    OptimumCandidate *row = list_append(target, sizeof *row);
    TRY(status_made(row != NULL));
    row->index = candidate;
    row->feasible = search_violation(work->search, candidate) == 0;
    TRY(optimum_put_values(work, candidate, &row->values));
    if (search_violation(work->search, candidate) == (double)INFINITY)
        return STATUS_OK;
    for (size_t i = 0; i < work->study->objectives.count; i++)
        TRY(study_add_real(work->metrics[candidate].of[work->study->objectives.at[i].metric],
                           &row->objectives));
    return STATUS_OK;
}

static const double *optimum_runs(const OptimizeWork *work, size_t candidate) {
    return work->objectives + candidate * work->runs * work->study->objectives.count;
}

// None where it is unknown.
static Status optimum_put_interval(const double interval[2], Reals *target) {
    return isnan(interval[0]) ? STATUS_OK : study_copy_reals(interval, 2, target);
}

static Status optimum_put_best(const OptimizeWork *work, size_t candidate, double *column) {
    OptimumBest *best = &work->answer->best;
    const size_t objectives = work->study->objectives.count;
    best->feasible = true;
    best->metrics = work->metrics[candidate];
    for (size_t i = 0; i < objectives; i++) {
        OptimumObjective *objective = list_append(&best->objectives, sizeof *objective);
        TRY(status_made(objective != NULL));
        double interval[2];
        for (size_t run = 0; run < work->runs; run++)
            column[run] = optimum_runs(work, candidate)[run * objectives + i];
        run_aggregate_interval(&work->aggregate, column, work->runs, interval);
        objective->metric = work->study->objectives.at[i].metric;
        objective->value = best->metrics.of[objective->metric];
        TRY(optimum_put_interval(interval, &objective->interval_95));
    }
    return optimum_put_values(work, candidate, &best->values);
}

static Status optimum_put_region(OptimizeWork *work, size_t candidate) {
    const double tolerance = region_tolerance * fabs(search_results(work->search, candidate)[0]);
    for (size_t j = 0; j < work->study->variables.count; j++) {
        OptimumInterval *interval = list_append(&work->answer->region, sizeof *interval);
        const OptimizeVariable *variable = &work->variables[j];
        double ends[2];
        TRY(status_made(interval != NULL));
        TRY(text_copy(study_axis_pointer(variable->axis, 0), &interval->pointer));
        TRY(search_region(work->search, candidate, j, tolerance, &ends[0], &ends[1]));
        interval->low = interval->high = (double)NAN;
        if (isnan(ends[0]))
            continue;
        for (size_t k = 0; k < 2; k++) {
            const StudyValue value = optimize_variable_value(variable, ends[k]);
            ends[k] = value.json != NULL ? strtod(value.json, NULL) : value.number;
        }
        interval->low = fmin(ends[0], ends[1]);
        interval->high = fmax(ends[0], ends[1]);
    }
    return STATUS_OK;
}

static Status optimum_put_rival(const OptimizeWork *work, size_t best, size_t candidate,
                                double *column) {
    static const RunAggregate mean = {false, (double)NAN};
    OptimumRival *rival = list_append(&work->answer->rivals, sizeof *rival);
    double interval[2] = {(double)NAN, (double)NAN};
    TRY(status_made(rival != NULL));
    TRY(optimum_put_values(work, candidate, &rival->values));
    const int metric = work->study->objectives.at[0].metric;
    rival->difference = work->metrics[candidate].of[metric] - work->metrics[best].of[metric];
    for (size_t run = 0; run < work->runs; run++)
        column[run] = optimum_runs(work, candidate)[run] - optimum_runs(work, best)[run];
    if (!work->aggregate.is_max && isnan(work->aggregate.quantile))
        run_aggregate_interval(&mean, column, work->runs, interval);
    return optimum_put_interval(interval, &rival->interval_95);
}

// The best candidates in turn whose distance from the best and from each other is large enough.
static Status optimum_put_rivals(const OptimizeWork *work, size_t best, double *column) {
    const Search *search = work->search;
    size_t taken[1 + RIVALS] = {best};
    for (size_t count = 1; count <= RIVALS; count++) {
        size_t next = SIZE_MAX;
        for (size_t i = 0; i < search_added(search); i++) {
            bool is_near = search_violation(search, i) > 0;
            for (size_t k = 0; k < count && !is_near; k++)
                is_near = search_distance(search, i, taken[k]) < rival_distance;
            if (!is_near && (next == SIZE_MAX ||
                             search_results(search, i)[0] < search_results(search, next)[0]))
                next = i;
        }
        if (next == SIZE_MAX)
            break;
        taken[count] = next;
        TRY(optimum_put_rival(work, best, next, column));
    }
    return STATUS_OK;
}

typedef struct OptimumPoint {
    double first, second;
    size_t candidate;
} OptimumPoint;

static int optimum_compare(const void *a, const void *b) {
    const OptimumPoint *x = a, *y = b;
    if (x->first != y->first)
        return x->first < y->first ? -1 : 1;
    if (x->second != y->second)
        return x->second < y->second ? -1 : 1;
    return (x->candidate > y->candidate) - (x->candidate < y->candidate);
}

// The front, and as the best its candidate nearest to both best values.
static Status optimum_put_front(const OptimizeWork *work, size_t *best) {
    const Search *search = work->search;
    OptimumPoint *points = calloc(search_added(search) + 1, sizeof *points);
    size_t count = 0, front = 0;
    Status status = status_made(points != NULL);
    for (size_t i = 0; points != NULL && i < search_added(search); i++)
        if (search_violation(search, i) == 0)
            points[count++] =
                (OptimumPoint){search_results(search, i)[0], search_results(search, i)[1], i};
    if (count > 0)
        qsort(points, count, sizeof *points, optimum_compare);
    for (size_t i = 0; i < count; i++)
        if (front == 0 || points[i].second < points[front - 1].second)
            points[front++] = points[i];
    double nearest = INFINITY;
    for (size_t i = 0; i < front && status == STATUS_OK; i++) {
        const double a = points[front - 1].first - points[0].first,
                     b = points[0].second - points[front - 1].second;
        const double distance = fmax(a > 0 ? (points[i].first - points[0].first) / a : 0,
                                     b > 0 ? (points[i].second - points[front - 1].second) / b : 0);
        if (distance < nearest) {
            nearest = distance;
            *best = points[i].candidate;
        }
        status = optimum_put_candidate(work, points[i].candidate, &work->answer->front);
    }
    free(points);
    return status;
}

// Names the constraint whose violation makes the least infeasible candidate infeasible.
static Status optimum_warn_infeasible(const OptimizeWork *work) {
    const OptimizeStudy *study = work->study;
    const Search *search = work->search;
    Warnings *warnings = &work->answer->warnings;
    size_t least = 0;
    for (size_t i = 1; i < search_added(search); i++)
        if (search_violation(search, i) < search_violation(search, least))
            least = i;
    const double violation = search_violation(search, least);
    if (violation == (double)INFINITY)
        return warnings_add(warnings, "/study/variables",
                            "no candidate could be run: see the failures");
    const double *result = search_results(search, least) + study->objectives.count;
    for (size_t i = 0; i < study->constraints.count; i++) {
        const OptimizeConstraint *constraint = &study->constraints.at[i];
        const double bounds[] = {constraint->min, constraint->max};
        for (size_t k = 0; k < COUNT(bounds); k++)
            if (!isnan(bounds[k]) && *result++ == violation)
                return warnings_add(
                    warnings, json_pointer_at("/study/constraints", i).at,
                    "no candidate keeps the constraints: %s, which must be at %s %s, is violated "
                    "least, by candidate %zu with %s",
                    study_metric_names[constraint->metric], k == 0 ? "least" : "most",
                    real_text(bounds[k]).at, least,
                    real_text(work->metrics[least].of[constraint->metric]).at);
    }
    return STATUS_OK;
}

static Status optimum_warn_best(const OptimizeWork *work, size_t best) {
    const OptimizeStudy *study = work->study;
    Warnings *warnings = &work->answer->warnings;
    const double *point = search_point(work->search, best);
    double given[OBJECTIVES + SEARCH_CONSTRAINTS];
    for (size_t j = 0; j < study->variables.count; j++)
        if (study_axis_is_range(work->variables[j].axis) && !work->variables[j].is_whole &&
            (point[j] < 0.01 || point[j] > 0.99))
            TRY(warnings_add(warnings, json_pointer_at("/study/variables", j).at,
                             "the best value is at the end of the range: a wider one may have a "
                             "better value"));
    optimize_results(study, &work->answer->given.metrics, given);
    bool is_feasible = !isnan(given[0]);
    for (size_t i = study->objectives.count; i < COUNT(given) && is_feasible; i++)
        is_feasible =
            i >= study->objectives.count + 2 * study->constraints.count || !(given[i] > 0);
    if (study->objectives.count == 1 && is_feasible &&
        given[0] < search_results(work->search, best)[0])
        TRY(warnings_add(warnings, "/study/max_candidates",
                         "the given scene is better than every candidate: allow more of them, or "
                         "ranges that contain its values"));
    return STATUS_OK;
}

static Status optimize_end(void *of, const StudyTools *tools, Problem *problem) {
    OptimizeWork *work = of;
    size_t best = SIZE_MAX;
    (void)tools;
    (void)problem;
    for (size_t i = 0; i < search_added(work->search); i++)
        TRY(optimum_put_candidate(work, i, &work->answer->history));
    if (work->study->objectives.count == 1)
        best = search_best(work->search, 0);
    else
        TRY(optimum_put_front(work, &best));
    if (best == SIZE_MAX)
        return optimum_warn_infeasible(work);
    double *column = calloc(work->runs, sizeof *column);
    Status status = status_made(column != NULL);
    if (status == STATUS_OK)
        status = optimum_put_best(work, best, column);
    if (status == STATUS_OK && work->study->objectives.count == 1)
        status = optimum_put_region(work, best);
    if (status == STATUS_OK && work->study->objectives.count == 1)
        status = optimum_put_rivals(work, best, column);
    free(column);
    TRY(status);
    return optimum_warn_best(work, best);
}

// From a sample of the candidates: some need many more steps than others.
static Status optimize_cost(const void *request, const Simulation *simulation,
                            const SimulationLimits *limits, double *steps) {
    const OptimizeStudy *study = request;
    SearchSpace space = {.variables = study->variables.count,
                         .objectives = 1,
                         .candidates = COST_SAMPLES,
                         .seed = study->search_seed};
    OptimizeVariable variables[SEARCH_VARIABLES];
    Search *search;
    double sum = 0;
    TRY(optimize_variables(study, simulation, variables, &space, NULL));
    TRY(search_new(&space, &search));
    const size_t sample = search_sample(search);
    Status status = STATUS_OK;
    for (size_t i = 0; i < sample && status == STATUS_OK; i++) {
        StudyValue values[SEARCH_VARIABLES];
        Simulation scene;
        status = search_propose(search);
        if (status != STATUS_OK)
            break;
        for (size_t j = 0; j < study->variables.count; j++)
            values[j] = optimize_variable_value(&variables[j], search_point(search, i)[j]);
        if (optimize_scene_make(study, simulation, values, true, 0, limits, &scene, NULL) ==
            STATUS_OK)
            sum += simulation_cost(&scene).steps / (double)sample;
        simulation_clear(&scene);
    }
    search_free(search);
    *steps = sum * (double)(study->max_candidates + GROUPS_BEFORE) * (double)optimize_runs(study);
    // The search itself, measured: 10 ms for a candidate with 8 variables.
    if (study->max_candidates > sample)
        *steps += (double)study->max_candidates * 1e-3 * (double)(2 + study->variables.count) /
                  SOLVER_STEP;
    return status;
}

static Status optimize_solution(const void *request, const Variant *answer,
                                struct StudyValue *values, Problem *problem) {
    const OptimizeStudy *study = request;
    const OptimumBest *best = &((const Optimum *)(const void *)answer)->best;
    if (best->values.count != study->variables.count)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "no candidate keeps the constraints: there is no best scene");
    for (size_t j = 0; j < study->variables.count; j++)
        values[j] = (StudyValue){best->values.at[j].value, (double)NAN};
    return STATUS_OK;
}

const StudyKind study_optimize = {
    .kind = {"optimize", "the best values of some members, for one metric or two",
             optimize_study_fields, sizeof(OptimizeStudy)},
    .answer = &(const Kind){"optimize", "the best candidate, and how sure it is",
                            optimum_answer_fields, sizeof(Optimum)},
    .shorten = "ask for fewer candidates, or fewer runs of each",
    .document = "optimum",
    .references = optimize_references,
    .max_runs = 1000,
    .complete = optimize_complete,
    .cost = optimize_cost,
    .work_size = sizeof(OptimizeWork),
    .part_size = sizeof(StudyPart),
    .begin = optimize_begin,
    .scene = optimize_scene,
    .fold = optimize_fold,
    .end = optimize_end,
    .solution = optimize_solution,
    .free = optimize_free,
};
