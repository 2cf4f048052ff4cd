// The tables of what is asked and answered, and what of it can be judged before anything runs.
#include "core/study/tradeoff.h"

#include <stdlib.h>
#include <string.h>

#include "core/solve/solvers.h"
#include "core/study/candidate_settings.h"
#include "core/study/tradeoff_budget.h"
#include "core/study/tradeoff_run.h"

enum { SOLVERS = 32, REPEATS = 1000 };

static const double usual_errors[METRICS] = {1e-3, 1e-2, 1e-2, 0, 0.1, 1e-3};
const char *const tradeoff_status_names[] = {"measured", "refused", "failed", NULL};

// clang-format off
static const Field study_fields[] = {
    FIELD_REAL(TradeoffStudy, error, NULL, AT_MIN(0), OPTIONAL, "error wanted, in the metric's unit; 1e-3 if absent, 1e-2 of mean_acceleration and peak_force, no impact, 0.1 dB"),
    FIELD_CHOICE(TradeoffStudy, metric, metric_names, METRIC_DISPLACEMENT, "what the error is of"),
    FIELD_COUNT(TradeoffStudy, repeats, NULL, WITHIN(1, REPEATS), 5, "timings of each point; the smallest and the median are told"),
    FIELD_TEXTS(TradeoffStudy, solvers, NULL, NULL, SOLVERS, PRESENCE_OPTIONAL, 0, "solvers that are tried; all if absent"),
    FIELD_REAL(TradeoffStudy, point_steps, NULL, WITHIN(1, 1e15), 5e7, "solver steps that a point may be foretold to take; it is refused beyond"),
    FIELD_COUNT(TradeoffStudy, trial, NULL, AT_MIN(1), 1, "another number measures the CPU times anew; the same one is answered from what was measured"),
    FIELD_END
};

const Field tradeoff_point_fields[] = {
    FIELD_TEXT(TradeoffPoint, name, 0, PRESENCE_OPTIONAL, 0, "for people"),
    FIELD_TEXT(TradeoffPoint, solver, 0, PRESENCE_OPTIONAL, 0, "solver"),
    FIELD_REAL(TradeoffPoint, step, "s", ANY, OPTIONAL, "its step"),
    FIELD_REAL(TradeoffPoint, tolerance, NULL, ANY, OPTIONAL, "its tolerance"),
    FIELD_TEXT(TradeoffPoint, contact_model, 0, PRESENCE_OPTIONAL, 0, "contact model in place of the scene's"),
    FIELD_REAL(TradeoffPoint, sample_rate, "Hz", ANY, OPTIONAL, "sample rate in place of the scene's; the base keeps its own"),
    FIELD_REAL(TradeoffPoint, duration, "s", ANY, OPTIONAL, "duration in place of the scene's"),
    FIELD_COUNT(TradeoffPoint, segment, "samples", AT_MIN(1), OPTIONAL, "segment of the spectra in place of the scene's"),
    FIELD_COUNT(TradeoffPoint, modes, NULL, AT_MIN(1), OPTIONAL, "modes that it keeps; all if absent"),
    FIELD_CHOICE(TradeoffPoint, status, tradeoff_status_names, TRADEOFF_MEASURED, "whether it was run"),
    FIELD_TEXT(TradeoffPoint, why, 0, PRESENCE_OPTIONAL, 0, "why it was not measured"),
    FIELD_REAL(TradeoffPoint, cpu_minimum, "s", ANY, OPTIONAL, "CPU time of a run with the scene's own output, the smallest timing; a measurement, another time will differ"),
    FIELD_REAL(TradeoffPoint, cpu_median, "s", ANY, OPTIONAL, "median of the timings; a measurement"),
    FIELD_COUNT(TradeoffPoint, runs, NULL, AT_MIN(0), 0, "runs that were timed: short ones are timed many at once"),
    FIELD_REAL(TradeoffPoint, steps, NULL, ANY, OPTIONAL, "solver steps, counted"),
    FIELD_ITEM(TradeoffPoint, errors, error_fields, NULL, PRESENCE_DEFAULT, "differences from the reference"),
    FIELD_FLAG(TradeoffPoint, is_best, false, "no other point is both cheaper and closer by the metric; follows from measured times"),
    FIELD_END
};

static const Field reference_fields[] = {
    FIELD_TEXT(TradeoffReference, solver, 0, PRESENCE_OPTIONAL, 0, "solver that the points are compared with"),
    FIELD_BASE(TradeoffReference, yardstick, yardstick_fields),
    FIELD_END
};

static const Field choice_fields[] = {
    FIELD_COUNT(TradeoffChoice, point, NULL, AT_MIN(1), OPTIONAL, "number of the point, from 1: the cheapest that keeps the error, or the closest that takes at most 1.25 times as long; unknown: none keeps it; follows from measured times"),
    FIELD_TEXT(TradeoffChoice, why, 0, PRESENCE_OPTIONAL, 0, "the reason"),
    FIELD_END
};

static const Field answer_fields[] = {
    FIELD_CHOICE(Tradeoff, metric, metric_names, OPTIONAL, "what the error wanted is of"),
    FIELD_REAL(Tradeoff, error, NULL, ANY, OPTIONAL, "error wanted"),
    FIELD_COUNT(Tradeoff, repeats, NULL, AT_MIN(1), OPTIONAL, "timings of each point"),
    FIELD_COUNT(Tradeoff, trial, NULL, AT_MIN(1), OPTIONAL, "number of the measurement"),
    FIELD_ITEM(Tradeoff, reference, reference_fields, NULL, PRESENCE_DEFAULT, "what the points are compared with"),
    FIELD_LIST(Tradeoff, points, tradeoff_point_fields, 0, PRESENCE_DEFAULT, "the ways tried"),
    FIELD_ITEM(Tradeoff, recommendation, choice_fields, NULL, PRESENCE_DEFAULT, "the point to take"),
    FIELD_END
};
// clang-format on

static Status check_metric(const TradeoffStudy *study, const Simulation *simulation,
                           Problem *problem) {
    static const char pointer[] = "/study/metric";
    if (study->metric == METRIC_PSD && simulation->output.psd.channels.count == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "psd needs spectra: ask for some in /output/psd");
    if (study->metric == METRIC_PEAK_FORCE && !ladder_has_force(simulation))
        return problem_add(
            problem, STATUS_INVALID, pointer, "peak_force needs contacts with a force: %s",
            simulation->scene.dampers.count > 0 ? "impulses have none, choose another contact model"
                                                : "the scene has no damper");
    if (study->metric == METRIC_IMPACTS && simulation->scene.dampers.count == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "impacts needs a damper: the scene has none");
    return STATUS_OK;
}

static Status check_solvers(const TradeoffStudy *study, Problem *problem) {
    const char *names[SOLVERS + 1] = {NULL};
    for (size_t i = 0, count = 0; solvers[i] != NULL && count < SOLVERS; i++)
        if (solvers[i]->run != NULL)
            names[count++] = solvers[i]->kind.name;
    Status status = STATUS_OK;
    for (size_t i = 0; i < study->solvers.count; i++) {
        size_t at = 0;
        while (names[at] != NULL && strcmp(names[at], study->solvers.at[i]) != 0)
            at++;
        if (names[at] != NULL)
            continue;
        char place[sizeof((Fault){0}.pointer)];
        pointer_index(place, sizeof place, "/study/solvers", i);
        status = texts_refuse(names, study->solvers.at[i], place, problem);
    }
    return status;
}

// All storeys are compared, whatever channels the scene asks for.
static Status check_values(const Simulation *simulation, const SimulationLimits *limits,
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

static Status study_complete(Study *asked, const Simulation *simulation,
                             const SimulationLimits *limits, Problem *problem) {
    TradeoffStudy *study = (TradeoffStudy *)(void *)asked;
    if (study->metric == CHOICE_ABSENT)
        study->metric = METRIC_DISPLACEMENT;
    if (isnan(study->error))
        study->error = usual_errors[study->metric];
    const Status metric = check_metric(study, simulation, problem);
    const Status names = check_solvers(study, problem);
    const Status values = check_values(simulation, limits, problem);
    return metric != STATUS_OK ? metric : names != STATUS_OK ? names : values;
}

static Status study_cost(const Study *asked, const Simulation *simulation,
                         const SimulationLimits *limits, double *steps, Problem *problem) {
    const TradeoffStudy *study = (const TradeoffStudy *)(const void *)asked;
    TradeoffPoints points;
    *steps = 0;
    Status status = ladder_make(study, simulation, &points, problem);
    double *each = calloc(points.count + 1, sizeof *each);
    if (status == STATUS_OK && each == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's points");
    if (status == STATUS_OK) {
        const double most = budget_point(study, limits).steps;
        budget_foretell(simulation, &points, each);
        for (size_t i = 0; i < points.count; i++)
            if (each[i] <= most)
                *steps += budget_timed(study, each[i]);
    }
    free(each);
    Tradeoff answer = {.points = points};
    fields_clear(answer_fields, &answer);
    return status;
}

static Status study_measure(const Study *asked, const Simulation *simulation,
                            const StudyTools *tools, Variant *answer, Problem *problem) {
    return tradeoff_measure((const TradeoffStudy *)(const void *)asked, simulation, tools,
                            (Tradeoff *)(void *)answer, problem);
}

static const Kind tradeoff_answer = {"tradeoff", "what speed costs in accuracy, measured",
                                     answer_fields, sizeof(Tradeoff)};

const StudyKind study_tradeoff = {
    .kind = {"tradeoff",
             "error against CPU time over solvers, steps and what else may be traded for speed",
             study_fields, sizeof(TradeoffStudy)},
    .answer = &tradeoff_answer,
    .lessen = "ask for fewer solvers or repeats, or lower point_steps",
    .is_measured = true,
    .complete = study_complete,
    .cost = study_cost,
    .run = study_measure,
};
