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
    PENDING_RUNS = 16,      // about so many can be made at the same time
    PENDING_SHARE = 32,     // about one of so many candidates may be without results
    VALUES_CHECKED = 256,   // of a list, with the request
    COST_SAMPLES = 16,
    UNDAMPED = 1,      // group of runs; 0: the given scene
    GROUPS_BEFORE = 2, // the first one of a candidate
    RIVALS = 5,
};

static const double region_tolerance = 0.02, rival_distance = 0.1;

static const char *const optimize_goal_names[] = {"minimize", "maximize", NULL};
static const char *const optimize_statistic_names[] = {"mean", "max", "quantile", NULL};

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
    FIELD_COUNT(OptimizeOver, runs, NULL, WITHIN(0, RUNS_MAX), 0, "runs of each candidate, each with its own seed of a random base; 0: one for each record"),
    FIELD_COUNT(OptimizeOver, first_seed, NULL, WITHIN(0, 0x1p53 - 1), OPTIONAL, "the seeds are this one and those that follow it; the excitation's own if absent"),
    FIELD_LIST_OR_NAMES(OptimizeOver, records, pinned_record_fields, "name", RECORDS_MAX, PRESENCE_OPTIONAL, "in place of seeds: uploaded ground motions, one for each run"),
    FIELD_END
};

static const Field optimize_statistic_fields[] = {
    FIELD_CHOICE(OptimizeStatistic, of, optimize_statistic_names, OPTIMIZE_QUANTILE, "mean, largest value or a quantile"),
    FIELD_REAL(OptimizeStatistic, quantile, NULL, WITHIN(0, 1), OPTIONAL, "this share of the runs is below it"),
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
    FIELD_BASE(OptimumValue, member, study_member_fields),
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
    FIELD_BASE(OptimumInterval, member, study_member_fields),
    FIELD_REAL(OptimumInterval, low, NULL, ANY, OPTIONAL, "smallest value; null of a choice without order, which is that of the best"),
    FIELD_REAL(OptimumInterval, high, NULL, ANY, OPTIONAL, "largest value"),
    FIELD_END
};

static const Field optimum_rival_fields[] = {
    FIELD_LIST(OptimumRival, values, optimum_value_fields, 0, PRESENCE_DEFAULT, "of the variables"),
    FIELD_REAL(OptimumRival, difference, NULL, ANY, OPTIONAL, "its first objective less that of the best"),
    FIELD_REALS_OR_NULL(OptimumRival, interval_95, NULL, "confidence interval of the mean difference, over the runs in pairs: where it contains 0, the two cannot be distinguished"),
    FIELD_END
};

static const Field optimum_candidate_fields[] = {
    FIELD_COUNT(OptimumCandidate, index, NULL, AT_MIN(0), OPTIONAL, "number of the candidate, from 0"),
    FIELD_LIST(OptimumCandidate, values, optimum_value_fields, 0, PRESENCE_DEFAULT, "of the variables"),
    FIELD_REALS_OR_NULL(OptimumCandidate, objectives, NULL, "its objectives; null: a run has failed"),
    FIELD_FLAG(OptimumCandidate, feasible, false, "whether it keeps the constraints"),
    FIELD_END
};

static const Field optimum_answer_fields[] = {
    FIELD_COUNT(Optimum, candidates, NULL, AT_MIN(0), 0, "candidates evaluated"),
    FIELD_BASE(Optimum, made, study_runs_fields),
    FIELD_LIST(Optimum, objectives, optimize_objective_fields, 0, PRESENCE_DEFAULT, "as requested, in the order of the candidates' values"),
    FIELD_ITEM_OR_NULL(Optimum, best, optimum_best_fields, PRESENCE_OPTIONAL, "the best feasible candidate, of two objectives the best compromise; null: none is feasible"),
    FIELD_ITEM(Optimum, given, optimum_scene_fields, NULL, PRESENCE_DEFAULT, "the scene as it is"),
    FIELD_ITEM(Optimum, undamped, optimum_scene_fields, NULL, PRESENCE_DEFAULT, "the same scene without its dampers"),
    FIELD_LIST(Optimum, region, optimum_interval_fields, 0, PRESENCE_DEFAULT, "a box around the best whose ends are values of candidates. Every candidate of the history within all of its intervals keeps the constraints and has an objective within 2 % of the best. Equally good candidates beyond worse ones are outside"),
    FIELD_LIST(Optimum, rivals, optimum_rival_fields, 0, PRESENCE_DEFAULT, "the next best candidates whose values differ clearly"),
    FIELD_LIST(Optimum, front, optimum_candidate_fields, 0, PRESENCE_DEFAULT, "of two objectives: candidates that no other beats in both, by the first"),
    FIELD_LIST(Optimum, history, optimum_candidate_fields, 0, PRESENCE_DEFAULT, "every candidate, in their order"),
    FIELD_END
};
// clang-format on

static bool optimize_has_seeds(const OptimizeStudy *study) {
    return study->over.runs != COUNT_ABSENT && study->over.runs > 0;
}

static size_t optimize_runs(const OptimizeStudy *study) {
    return optimize_has_seeds(study)       ? (size_t)study->over.runs
           : study->over.records.count > 0 ? study->over.records.count
                                           : 1;
}

// A number that the search makes smaller, or a bound that it keeps, of the metric m:
// sign (m - bound) / scale.
typedef struct OptimizeResult {
    int metric;
    double sign, bound, scale;
    size_t constraint; // whose bound it is
} OptimizeResult;

typedef struct OptimizeWork {
    StudyWork work;
    const OptimizeStudy *study;
    Optimum *answer;
    Search *search;
    OptimizeResult result[SEARCH_RESULTS];
    size_t results;
    size_t runs, pending; // of a candidate; candidates that may be without results
    RunAggregate aggregate;
    bool is_failed;          // a run of the group
    StudyMetrics *collected; // of the runs of a group
    double *column;          // one metric of them
    StudyMetrics *metrics;   // candidate by candidate
    double *objectives;      // of every run: candidate by candidate, objective by objective
} OptimizeWork;

// --- The space of the search, and the scenes of its points ---

// Whether all values are numbers that rise or fall.
static bool optimize_is_ordered(const StudyAxis *axis) {
    double number[3] = {0, 0, 0}; // the last ones
    for (size_t k = 0; k < axis->values.count; k++) {
        const char *text = axis->values.at[k];
        char *end;
        memmove(number, number + 1, 2 * sizeof *number);
        number[2] = strtod(text, &end);
        if (*end != '\0' || end == text || (k > 0 && number[2] == number[1]) ||
            (k > 1 && (number[2] > number[1]) != (number[1] > number[0])))
            return false;
    }
    return true;
}

// The variables of the search: a range of whole numbers is a choice with an order.
static Status optimize_variables(const OptimizeWork *work, SearchSpace *space, Problem *problem) {
    const StudyAxes *axes = &work->study->variables;
    const Field *rows[SEARCH_VARIABLES];
    bool are_tags[SEARCH_VARIABLES];
    TRY(study_axes_find(axes, work->work.simulation, "/study/variables", rows, are_tags, problem));
    for (; space->variables < axes->count; space->variables++) {
        const StudyAxis *axis = &axes->at[space->variables];
        SearchVariable *variable = &space->variable[space->variables];
        if (!study_axis_is_range(axis))
            *variable = (SearchVariable){axis->values.count, optimize_is_ordered(axis)};
        else if (rows[space->variables]->kind == FIELD_KIND_COUNT)
            *variable =
                (SearchVariable){(size_t)fmin(floor(axis->to) - ceil(axis->from) + 1, 1e9), true};
    }
    return STATUS_OK;
}

static Status optimize_search_new(OptimizeWork *work, Problem *problem) {
    const OptimizeStudy *study = work->study;
    SearchSpace space = {.objectives = study->objectives.count,
                         .candidates = (size_t)study->max_candidates,
                         .seed = study->search_seed};
    TRY(optimize_variables(work, &space, problem));
    for (size_t i = 0; i < study->objectives.count; i++)
        work->result[work->results++] = (OptimizeResult){
            study->objectives.at[i].metric,
            study->objectives.at[i].goal == OPTIMIZE_MAXIMIZE ? -1 : 1, 0, 1, SIZE_MAX};
    for (size_t i = 0; i < 2 * study->constraints.count; i++) {
        const OptimizeConstraint *constraint = &study->constraints.at[i / 2];
        const double bound = i % 2 == 0 ? constraint->min : constraint->max;
        if (!isnan(bound))
            work->result[work->results++] =
                (OptimizeResult){constraint->metric, i % 2 == 0 ? -1 : 1, bound,
                                 bound != 0 ? fabs(bound) : 1, i / 2};
    }
    space.constraints = work->results - space.objectives;
    return search_new(&space, &work->search);
}

static StudyValue optimize_value(const OptimizeWork *work, size_t variable, double number) {
    const StudyAxis *axis = &work->study->variables.at[variable];
    if (!study_axis_is_range(axis))
        return study_axis_value(axis, (size_t)number);
    if (work->search->space.variable[variable].values > 0)
        return (StudyValue){NULL, ceil(axis->from) + number};
    const double inside = axis->from + number * (axis->to - axis->from);
    return (StudyValue){NULL, number == 1 ? axis->to : fmin(inside, axis->to)};
}

// Of the candidate of a group; NAN, which leaves those of the scene, before the first one.
static void optimize_values(const OptimizeWork *work, size_t group, StudyValue *values) {
    for (size_t j = 0; j < work->study->variables.count; j++)
        values[j] =
            group < GROUPS_BEFORE
                ? (StudyValue){NULL, (double)NAN}
                : optimize_value(work, j, search_point(work->search, group - GROUPS_BEFORE)[j]);
}

static void optimize_clear_dampers(Simulation *scene) {
    Dampers *dampers = &scene->scene.dampers;
    for (size_t i = 0; i < dampers->count; i++)
        fields_clear(damper_fields, &dampers->at[i]);
    free(dampers->at);
    *dampers = (Dampers){NULL, 0};
}

static Status optimize_scene(const void *of, size_t member, Simulation *scene, StudyPart *part,
                             Problem *problem) {
    const OptimizeWork *work = of;
    const OptimizeStudy *study = work->study;
    const SimulationLimits *limits = work->work.limits;
    const size_t group = member / work->runs, run = member % work->runs;
    const bool has_records = study->over.records.count > 0;
    StudyValue values[SEARCH_VARIABLES];
    (void)part;
    optimize_values(work, group, values);
    TRY(study_scene_make(work->work.simulation, &study->variables, values, &study->names, true,
                         limits, scene, problem));
    study_run_fix_solver(scene);
    for (size_t i = 0; i < work->results && group != UNDAMPED; i++)
        scene->output.reduction |= study_metric_is_reduction(work->result[i].metric);
    if (optimize_has_seeds(study))
        ((ExcitationRandom *)(void *)scene->scene.excitation)->seed = study->over.first_seed + run;
    if (has_records)
        TRY(study_scene_use_record(scene, &study->over.records.at[run]));
    if (group == UNDAMPED)
        optimize_clear_dampers(scene);
    return has_records || group == UNDAMPED ? simulation_complete(scene, limits, NULL, problem)
                                            : STATUS_OK;
}

// --- The request ---

static Status optimize_check_metric(const Simulation *simulation, int metric, const char *place,
                                    Problem *problem) {
    return study_metric_check(simulation, metric, json_pointer_of(place, "metric").at, problem);
}

static Status optimize_check_metrics(const OptimizeStudy *study, const Simulation *simulation,
                                     Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < study->objectives.count; i++) {
        const int metric = study->objectives.at[i].metric;
        const JsonPointer own = json_pointer_at("/study/objectives", i);
        status =
            study_first_failure(status, optimize_check_metric(simulation, metric, own.at, problem));
        if (i > 0 && metric == study->objectives.at[0].metric)
            status = json_pointer_fault(problem, own.at, "metric",
                                        "is that of the first objective: give another one");
    }
    for (size_t i = 0; i < study->constraints.count; i++) {
        const OptimizeConstraint *constraint = &study->constraints.at[i];
        const JsonPointer own = json_pointer_at("/study/constraints", i);
        status = study_first_failure(
            status, optimize_check_metric(simulation, constraint->metric, own.at, problem));
        if (isnan(constraint->min) && isnan(constraint->max))
            status = problem_add(problem, STATUS_INVALID, own.at, "needs min, max or both");
        if (constraint->min > constraint->max)
            status = json_pointer_fault_real(
                problem, own.at, "min", constraint->min, study_metric_unit(constraint->metric),
                "must be at most max, which is %s", real_text(constraint->max).at);
    }
    return status;
}

static Status optimize_check_statistic(const OptimizeStudy *study, Problem *problem) {
    static const char place[] = "/study/statistic";
    const OptimizeStatistic *statistic = &study->statistic;
    const bool has_quantile = !isnan(statistic->quantile);
    if (statistic->of == CHOICE_ABSENT && !has_quantile)
        return STATUS_OK;
    if (statistic->of == OPTIMIZE_QUANTILE && !has_quantile)
        return problem_add(problem, STATUS_INVALID, place,
                           "must be \"mean\", \"max\" or {\"quantile\": q}");
    if (has_quantile && (statistic->of == OPTIMIZE_MEAN || statistic->of == OPTIMIZE_MAX))
        return problem_add(problem, STATUS_INVALID, place,
                           "is both %s and a quantile: leave one of them out",
                           optimize_statistic_names[statistic->of]);
    if (statistic->quantile == 0 || statistic->quantile == 1)
        return problem_add(problem, STATUS_INVALID, "/study/statistic/quantile",
                           "must be above 0 and below 1; \"max\" is the largest");
    if (optimize_runs(study) == 1 && !optimize_has_seeds(study) && study->over.records.count == 0)
        return problem_add(problem, STATUS_INVALID, place,
                           "needs the runs or records of /study/over: without them there is one "
                           "run of each candidate");
    return STATUS_OK;
}

// Whether a record that replaces another one leaves this member of the excitation.
static bool optimize_record_keeps(const char *pointer) {
    static const char *const kept[] = {"/excitation/scale", "/excitation/displacement",
                                       "/excitation/velocity"};
    bool is_kept = false;
    for (size_t i = 0; i < COUNT(kept); i++)
        is_kept = is_kept || json_pointer_overlaps(kept[i], pointer);
    return is_kept;
}

// Variables that the seeds or the records of the runs overwrite.
static Status optimize_check_overwritten(const OptimizeStudy *study, bool is_record,
                                         Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < study->variables.count; i++)
        for (size_t k = 0; k < study_axis_pointer_count(&study->variables.at[i]); k++) {
            const char *pointer = study_axis_pointer(&study->variables.at[i], k);
            const bool is_kept = optimize_has_seeds(study)
                                     ? !json_pointer_overlaps(pointer, "/excitation/seed") &&
                                           !json_pointer_overlaps(pointer, "/excitation/kind")
                                     : study->over.records.count == 0 ||
                                           !json_pointer_overlaps(pointer, "/excitation") ||
                                           (is_record && optimize_record_keeps(pointer));
            if (!is_kept)
                status =
                    problem_add(problem, STATUS_INVALID, json_pointer_at("/study/variables", i).at,
                                "%.100s is replaced in each run by /study/over: leave one of "
                                "them out",
                                pointer);
        }
    return status;
}

static Status optimize_complete_over(OptimizeStudy *study, const Simulation *simulation,
                                     Problem *problem) {
    static const char place[] = "/study/over";
    const Excitation *excitation = scene_excitation(&simulation->scene);
    OptimizeOver *over = &study->over;
    const bool has_seeds = optimize_has_seeds(study), has_records = over->records.count > 0;
    if (over->runs == COUNT_ABSENT && over->first_seed == COUNT_ABSENT && !has_records)
        return STATUS_OK;
    if (has_seeds == has_records)
        return problem_add(problem, STATUS_INVALID, place,
                           has_seeds ? "has runs and records: leave one of them out"
                                     : "needs runs, or records");
    if (!has_seeds && over->first_seed != COUNT_ABSENT)
        return problem_add(problem, STATUS_INVALID, place, "needs runs with first_seed");
    if (has_seeds && excitation_kind(excitation) != &excitation_random)
        return problem_add(problem, STATUS_INVALID, "/study/over/runs",
                           "are seeds of a random base: /excitation/kind must be random, is %s",
                           excitation_kind(excitation)->kind.name);
    if (has_seeds && over->first_seed == COUNT_ABSENT)
        over->first_seed = ((const ExcitationRandom *)(const void *)excitation)->seed;
    if (has_seeds && (double)over->first_seed + (double)(over->runs - 1) > 0x1p53 - 1)
        return problem_add(problem, STATUS_INVALID, "/study/over/first_seed",
                           "is too large for %llu runs: seeds end at 2^53 - 1",
                           (unsigned long long)over->runs);
    Status status =
        study_first_failure(study_suite_check(&over->records, "/study/over/records", problem),
                            optimize_check_overwritten(
                                study, excitation_kind(excitation) == &excitation_record, problem));
    for (size_t i = 0; i < over->records.count; i++)
        if (over->records.at[i].named == NULL)
            status =
                problem_add(problem, STATUS_INVALID, json_pointer_at("/study/over/records", i).at,
                            "is a record that is not loaded");
    return status;
}

// That each end or value of one variable alone, in the given scene, makes a valid scene.
static Status optimize_check_values(const OptimizeStudy *study, const Simulation *simulation,
                                    const SimulationLimits *limits, Problem *problem) {
    Problem *scratch = malloc(sizeof *scratch);
    Status status = status_made(scratch != NULL);
    for (size_t i = 0; i < study->variables.count; i++) {
        const StudyAxis *axis = &study->variables.at[i];
        const size_t values =
            axis->values.count < VALUES_CHECKED ? axis->values.count : VALUES_CHECKED;
        const size_t count = study_axis_is_range(axis) ? 2 : values;
        for (size_t k = 0; k < count && (status == STATUS_OK || status == STATUS_INVALID); k++)
            status = study_first_failure(
                status, study_axes_check_value(&study->variables, i, k, simulation, &study->names,
                                               limits, "/study/variables", scratch, problem));
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
    if (study->objectives.count == 0)
        return problem_add(problem, STATUS_INVALID, "/study/objectives",
                           "must have one objective, or two for a front");
    const Status all[] = {
        study_axes_check(&study->variables, false, place, problem),
        optimize_check_metrics(study, simulation, problem),
        optimize_check_statistic(study, problem),
        optimize_complete_over(study, simulation, problem),
        optimize_check_runs(study, problem),
    };
    TRY(all[0]);
    TRY(study_axes_find(&study->variables, simulation, place, NULL, NULL, problem));
    TRY(optimize_check_values(study, simulation, limits, problem));
    TRY(status_first(all, COUNT(all)));
    const OptimizeWork work = {.study = study,
                               .work = {.simulation = simulation, .limits = limits},
                               .runs = optimize_runs(study)};
    for (size_t i = 0; i < study->over.records.count; i++) {
        Simulation scene;
        const Status status = optimize_scene(&work, i, &scene, NULL, problem);
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

// Proposes candidates as long as no more than `pending` of the model are without results.
static Status optimize_propose(OptimizeWork *work) {
    Search *search = work->search;
    const size_t until = search->added + work->pending > search->sample
                             ? search->added + work->pending
                             : search->sample;
    while (search->proposed < until && search->proposed < search->space.candidates)
        TRY(search_propose(search));
    work->work.wanted = (GROUPS_BEFORE + search->proposed) * work->runs;
    return STATUS_OK;
}

static void optimize_results(const OptimizeWork *work, const StudyMetrics *metrics,
                             double results[SEARCH_RESULTS]) {
    for (size_t i = 0; i < work->results; i++) {
        const OptimizeResult *own = &work->result[i];
        results[i] = own->sign * (metrics->of[own->metric] - own->bound) / own->scale;
    }
}

// An objective of the runs of a candidate.
static double *optimize_objectives(const OptimizeWork *work, size_t candidate, size_t objective) {
    return work->objectives + (candidate * work->study->objectives.count + objective) * work->runs;
}

static Status optimize_close_candidate(OptimizeWork *work, size_t candidate,
                                       const StudyMetrics *metrics) {
    const OptimizeStudy *study = work->study;
    double results[SEARCH_RESULTS];
    work->metrics[candidate] = *metrics;
    for (size_t i = 0; i < study->objectives.count; i++)
        for (size_t run = 0; run < work->runs; run++)
            optimize_objectives(work, candidate, i)[run] =
                work->collected[run].of[study->objectives.at[i].metric];
    optimize_results(work, metrics, results);
    search_add(work->search, results);
    work->answer->candidates++;
    return optimize_propose(work);
}

// The statistics over the runs of a group whose last one is there.
static Status optimize_close(OptimizeWork *work, size_t group) {
    StudyMetrics metrics;
    for (int i = 0; i < STUDY_METRIC_COUNT; i++) {
        for (size_t run = 0; run < work->runs; run++)
            work->column[run] = work->collected[run].of[i];
        metrics.of[i] = work->is_failed ? (double)NAN
                                        : run_aggregate(&work->aggregate, work->column, work->runs);
    }
    if (group >= GROUPS_BEFORE)
        return optimize_close_candidate(work, group - GROUPS_BEFORE, &metrics);
    *(group == UNDAMPED ? &work->answer->undamped : &work->answer->given) = (OptimumScene){metrics};
    return STATUS_OK;
}

static Status optimize_fold(void *of, size_t member, StudyPart *part) {
    OptimizeWork *work = of;
    const size_t run = member % work->runs;
    TRY(study_runs_add(&work->answer->made, &part->run, member));
    work->is_failed = (work->is_failed && run > 0) || part->run.status != STATUS_OK;
    work->collected[run] = study_metrics_of(&part->run);
    return run + 1 == work->runs ? optimize_close(work, member / work->runs) : STATUS_OK;
}

static void optimize_free(void *of) {
    OptimizeWork *work = of;
    search_free(work->search);
    free(work->collected);
    free(work->column);
    free(work->metrics);
    free(work->objectives);
}

static Status optimize_begin(void *of, const StudyTools *tools, Problem *problem) {
    OptimizeWork *work = of;
    const OptimizeStudy *study = work->study = work->work.study;
    (void)tools;
    work->answer = work->work.answer;
    for (size_t i = 0; i < study->objectives.count; i++) {
        OptimizeObjective *objective = list_append(&work->answer->objectives, sizeof *objective);
        TRY(status_made(objective != NULL));
        *objective = study->objectives.at[i];
    }
    work->runs = optimize_runs(study);
    work->aggregate =
        (RunAggregate){study->statistic.of == OPTIMIZE_MAX, study->statistic.quantile};
    TRY(optimize_search_new(work, problem));
    const size_t candidates = work->search->space.candidates,
                 pending = 1 + (PENDING_RUNS - 1) / work->runs,
                 few = 1 + candidates / PENDING_SHARE,
                 objectives = candidates * work->runs * study->objectives.count;
    work->pending = pending < few ? pending : few;
    work->collected = calloc(work->runs, sizeof *work->collected);
    work->column = calloc(work->runs, sizeof *work->column);
    work->metrics = calloc(candidates, sizeof *work->metrics);
    work->objectives = calloc(objectives, sizeof *work->objectives);
    TRY(status_made(work->collected != NULL && work->column != NULL && work->metrics != NULL &&
                    work->objectives != NULL));
    work->work.members = (GROUPS_BEFORE + candidates) * work->runs;
    work->work.part_bytes = sizeof(StudyPart);
    return optimize_propose(work);
}

// --- The answer ---

static Status optimum_put_values(const OptimizeWork *work, size_t candidate,
                                 OptimumValues *target) {
    StudyValue values[SEARCH_VARIABLES];
    optimize_values(work, GROUPS_BEFORE + candidate, values);
    for (size_t j = 0; j < work->study->variables.count; j++) {
        OptimumValue *value = list_append(target, sizeof *value);
        TRY(status_made(value != NULL));
        TRY(study_axis_member(&work->study->variables.at[j], &value->member));
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

// Of an aggregate over `column`; none where it is unknown.
static Status optimum_put_interval(const OptimizeWork *work, Reals *target) {
    double interval[2];
    run_aggregate_interval(&work->aggregate, work->column, work->runs, interval);
    return isnan(interval[0]) ? STATUS_OK : study_copy_reals(interval, 2, target);
}

static Status optimum_put_best(const OptimizeWork *work, size_t candidate) {
    OptimumBest *best = &work->answer->best;
    best->feasible = true;
    best->metrics = work->metrics[candidate];
    for (size_t i = 0; i < work->study->objectives.count; i++) {
        OptimumObjective *objective = list_append(&best->objectives, sizeof *objective);
        TRY(status_made(objective != NULL));
        objective->metric = work->study->objectives.at[i].metric;
        objective->value = best->metrics.of[objective->metric];
        memcpy(work->column, optimize_objectives(work, candidate, i),
               work->runs * sizeof *work->column);
        TRY(optimum_put_interval(work, &objective->interval_95));
    }
    return optimum_put_values(work, candidate, &best->values);
}

static bool optimum_is_good(const Search *search, size_t best, size_t candidate) {
    const double value = search_results(search, best)[0];
    return search_violation(search, candidate) == 0 &&
           search_results(search, candidate)[0] <= value + region_tolerance * fabs(value);
}

// Enlarges the box by a good candidate, unless it would then contain one that is not good, or
// several values of a choice without order.
static void optimum_enlarge(const Search *search, size_t best, size_t candidate, double *low,
                            double *high) {
    const size_t n = search->space.variables;
    double lower[SEARCH_VARIABLES], upper[SEARCH_VARIABLES];
    for (size_t j = 0; j < n; j++) {
        const SearchVariable *variable = &search->space.variable[j];
        lower[j] = fmin(low[j], search_point(search, candidate)[j]);
        upper[j] = fmax(high[j], search_point(search, candidate)[j]);
        if (variable->values > 0 && !variable->is_ordered && lower[j] != upper[j])
            return;
    }
    for (size_t i = 0; i < search->added; i++) {
        const double *point = search_point(search, i);
        size_t inside = 0;
        while (inside < n && point[inside] >= lower[inside] && point[inside] <= upper[inside])
            inside++;
        if (inside == n && !optimum_is_good(search, best, i))
            return;
    }
    memcpy(low, lower, n * sizeof *low);
    memcpy(high, upper, n * sizeof *high);
}

static Status optimum_put_region(const OptimizeWork *work, size_t best, const StudyTools *tools,
                                 Problem *problem) {
    const Search *search = work->search;
    double ends[2][SEARCH_VARIABLES];
    for (size_t k = 0; k < 2; k++)
        memcpy(ends[k], search_point(search, best), search->space.variables * sizeof(double));
    for (size_t i = 0; i < search->added; i++) {
        TRY(study_advance(tools->progress, 1, problem));
        if (optimum_is_good(search, best, i))
            optimum_enlarge(search, best, i, ends[0], ends[1]);
    }
    for (size_t j = 0; j < search->space.variables; j++) {
        OptimumInterval *interval = list_append(&work->answer->region, sizeof *interval);
        const SearchVariable *variable = &search->space.variable[j];
        double values[2] = {(double)NAN, (double)NAN};
        TRY(status_made(interval != NULL));
        TRY(study_axis_member(&work->study->variables.at[j], &interval->member));
        for (size_t k = 0; k < 2 && (variable->values == 0 || variable->is_ordered); k++) {
            const StudyValue value = optimize_value(work, j, ends[k][j]);
            values[k] = value.json != NULL ? strtod(value.json, NULL) : value.number;
        }
        interval->low = fmin(values[0], values[1]);
        interval->high = fmax(values[0], values[1]);
    }
    return STATUS_OK;
}

static Status optimum_put_rival(const OptimizeWork *work, size_t best, size_t candidate) {
    OptimumRival *rival = list_append(&work->answer->rivals, sizeof *rival);
    const int metric = work->study->objectives.at[0].metric;
    TRY(status_made(rival != NULL));
    TRY(optimum_put_values(work, candidate, &rival->values));
    rival->difference = work->metrics[candidate].of[metric] - work->metrics[best].of[metric];
    if (work->aggregate.is_max || !isnan(work->aggregate.quantile))
        return STATUS_OK; // that of a difference is not the difference of two
    for (size_t run = 0; run < work->runs; run++)
        work->column[run] =
            optimize_objectives(work, candidate, 0)[run] - optimize_objectives(work, best, 0)[run];
    return optimum_put_interval(work, &rival->interval_95);
}

// The best candidates in turn whose distance from the best and from each other is large enough.
static Status optimum_put_rivals(const OptimizeWork *work, size_t best) {
    const Search *search = work->search;
    size_t taken[1 + RIVALS] = {best};
    for (size_t count = 1; count <= RIVALS; count++) {
        size_t next = SIZE_MAX;
        for (size_t i = 0; i < search->added; i++) {
            bool is_near = search_violation(search, i) > 0;
            for (size_t k = 0; k < count && !is_near; k++)
                is_near = search_distance(search, search_point(search, i),
                                          search_point(search, taken[k])) < rival_distance;
            if (!is_near && (next == SIZE_MAX ||
                             search_results(search, i)[0] < search_results(search, next)[0]))
                next = i;
        }
        if (next == SIZE_MAX)
            break;
        taken[count] = next;
        TRY(optimum_put_rival(work, best, next));
    }
    return STATUS_OK;
}

// The front, by the first objective: the next one is the best by it of those that are better by the
// second than the last.
static Status optimum_put_front(const OptimizeWork *work, const StudyTools *tools,
                                Problem *problem) {
    const Search *search = work->search;
    double bound = INFINITY;
    for (;;) {
        size_t next = SIZE_MAX;
        TRY(study_advance(tools->progress, 1, problem));
        for (size_t i = 0; i < search->added; i++) {
            const double *own = search_results(search, i);
            const double *least = next != SIZE_MAX ? search_results(search, next) : NULL;
            if (search_violation(search, i) == 0 && own[1] < bound &&
                (least == NULL || own[0] < least[0] || (own[0] == least[0] && own[1] < least[1])))
                next = i;
        }
        if (next == SIZE_MAX)
            return STATUS_OK;
        bound = search_results(search, next)[1];
        TRY(optimum_put_candidate(work, next, &work->answer->front));
    }
}

// The candidate of the front nearest to the best values of both objectives.
static size_t optimum_compromise(const OptimizeWork *work) {
    const OptimumCandidates *front = &work->answer->front;
    size_t best = SIZE_MAX;
    double nearest = INFINITY;
    for (size_t i = 0; i < front->count; i++) {
        double distance = 0;
        for (size_t k = 0; k < 2; k++) {
            const double *ends[] = {front->at[0].objectives.at,
                                    front->at[front->count - 1].objectives.at};
            const double range = ends[1 - k][k] - ends[k][k];
            if (range != 0)
                distance = fmax(distance, (front->at[i].objectives.at[k] - ends[k][k]) / range);
        }
        if (distance < nearest) {
            nearest = distance;
            best = (size_t)front->at[i].index;
        }
    }
    return best;
}

// Names the constraint that the least infeasible candidate violates most.
static Status optimum_warn_infeasible(const OptimizeWork *work) {
    const Search *search = work->search;
    Warnings *warnings = &work->answer->made.warnings;
    size_t least = 0, worst = search->space.objectives;
    for (size_t i = 1; i < search->added; i++)
        if (search_violation(search, i) < search_violation(search, least))
            least = i;
    if (search_violation(search, least) == (double)INFINITY)
        return warnings_add(warnings, "/study/variables",
                            "no candidate has all its metrics: see the failures");
    const double *results = search_results(search, least);
    for (size_t i = worst; i < work->results; i++)
        worst = results[i] > results[worst] ? i : worst;
    const OptimizeResult *own = &work->result[worst];
    return warnings_add(
        warnings, json_pointer_at("/study/constraints", own->constraint).at,
        "no candidate keeps all constraints: the nearest one, relative to the bounds, is candidate "
        "%zu with %s %s, which must be at %s %s",
        least, study_metric_names[own->metric], real_text(work->metrics[least].of[own->metric]).at,
        own->sign < 0 ? "least" : "most", real_text(own->bound).at);
}

static Status optimum_warn_best(const OptimizeWork *work, size_t best) {
    const OptimizeStudy *study = work->study;
    const Search *search = work->search;
    Warnings *warnings = &work->answer->made.warnings;
    const double *point = search_point(search, best), *results = search_results(search, best);
    for (size_t j = 0; j < study->variables.count; j++)
        if (search->space.variable[j].values == 0 && (point[j] < 0.01 || point[j] > 0.99))
            TRY(warnings_add(warnings, json_pointer_at("/study/variables", j).at,
                             "the best value is at the end of the range: a wider one may have a "
                             "better value"));
    double given[SEARCH_RESULTS];
    optimize_results(work, &work->answer->given.metrics, given);
    if (study->objectives.count == 1 && search_excess(&search->space, given) == 0 &&
        given[0] < results[0])
        TRY(warnings_add(warnings, "/study/max_candidates",
                         "the given scene is better than every candidate: allow more of them, or "
                         "ranges that contain its values"));
    bool is_same = search->added > 1;
    for (size_t i = 0; i < search->added; i++)
        for (size_t k = 0; k < study->objectives.count; k++)
            is_same = is_same && search_results(search, i)[k] == results[k];
    return is_same ? warnings_add(warnings, "/study/variables",
                                  "all candidates have the same objective: nothing that is varied "
                                  "changes it")
                   : STATUS_OK;
}

static Status optimize_end(void *of, const StudyTools *tools, Problem *problem) {
    OptimizeWork *work = of;
    const bool has_front = work->study->objectives.count > 1;
    for (size_t i = 0; i < work->search->added; i++) {
        TRY(study_advance(tools->progress, 1, problem));
        TRY(optimum_put_candidate(work, i, &work->answer->history));
    }
    TRY(study_runs_warn(&work->answer->made));
    if (has_front)
        TRY(optimum_put_front(work, tools, problem));
    const size_t best = has_front ? optimum_compromise(work) : search_best(work->search, 0);
    if (best == SIZE_MAX)
        return optimum_warn_infeasible(work);
    TRY(optimum_put_best(work, best));
    if (!has_front) {
        TRY(optimum_put_region(work, best, tools, problem));
        TRY(optimum_put_rivals(work, best));
    }
    return optimum_warn_best(work, best);
}

static Status optimize_sample_scene(const void *of, size_t candidate,
                                    const SimulationLimits *limits, Simulation *scene) {
    (void)limits; // the work has them
    return optimize_scene(of, GROUPS_BEFORE + candidate, scene, NULL, NULL);
}

static Status optimize_cost(const void *request, const Simulation *simulation,
                            const SimulationLimits *limits, double *steps) {
    OptimizeWork work = {
        .study = request, .work = {.simulation = simulation, .limits = limits}, .runs = 1};
    *steps = 0;
    TRY(optimize_search_new(&work, NULL));
    Search *search = work.search;
    const double candidates = (double)search->space.candidates;
    Status status = STATUS_OK;
    while (search->proposed < search->sample && status == STATUS_OK)
        status = search_propose(search);
    if (status == STATUS_OK)
        status = study_sample_cost(optimize_sample_scene, &work, search->sample, COST_SAMPLES,
                                   limits, steps);
    *steps *=
        (candidates + GROUPS_BEFORE) / (double)search->sample * (double)optimize_runs(work.study);
    // The search itself, measured: 10 ms for a candidate with 8 variables.
    if (search->space.candidates > search->sample)
        *steps += candidates * 1e-3 * (double)(2 + search->space.variables) / SOLVER_STEP;
    search_free(search);
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
