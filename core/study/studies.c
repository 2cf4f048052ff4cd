// The table of studies and of their answers, and the request that may hold one of them.
#include "core/study/study.h"

const StudyKind *const studies[] = {
    &study_tradeoff, &study_ensemble, &study_compare,   &study_sensitivity, &study_sweep,
    &study_response, &study_optimize, &study_fragility, &study_calibrate,   NULL,
};

const StudyKind *study_of_answer(const Kind *answer) {
    size_t i = 0;
    while (studies[i]->answer != answer)
        i++;
    return studies[i];
}

static const Kind *studies_kind(size_t index) {
    return index + 1 < COUNT(studies) ? &studies[index]->kind : NULL;
}

static const Kind *studies_answer(size_t index) {
    return index + 1 < COUNT(studies) ? studies[index]->answer : NULL;
}

const KindTable study_kinds = {"kind", studies_kind, true};
const KindTable study_answer_kinds = {"kind", studies_answer, false};

const Field study_answer_fields[] = {
    FIELD_VARIANT(StudyAnswer, study, &study_answer_kinds, PRESENCE_REQUIRED, "the answer"),
    FIELD_END,
};

const Field study_request_fields[] = {
    FIELD_BASE(StudyRequest, simulation, simulation_fields),
    FIELD_VARIANT(StudyRequest, study, &study_kinds, PRESENCE_OPTIONAL,
                  "a study of the scene, in addition to its run"),
    FIELD_END,
};

void study_request_clear(StudyRequest *request) {
    fields_clear(study_request_fields, request);
}

static const double studies_max_runs = 10; // cost limit of a study, in runs at their limit

double study_max_steps(const Variant *study, const SimulationLimits *limits) {
    const double runs = study_kind(study)->max_runs;
    return (runs > 0 ? runs : studies_max_runs) * limits->steps;
}

static Status studies_check_cost(const StudyRequest *request, const SimulationLimits *limits,
                                 Problem *problem) {
    if (limits == NULL || !(limits->steps > 0))
        return STATUS_OK;
    Cost cost;
    const double max = study_max_steps(request->study, limits);
    TRY(study_request_cost(request, limits, &cost, problem));
    if (limits->bytes > 0 && cost.bytes > limits->bytes)
        return problem_add(
            problem, STATUS_INVALID, "/study",
            "would take about %.3g MB of memory, at most %.4g MB are allowed: take a "
            "shorter duration or a lower sample_rate",
            1e-6 * cost.bytes, 1e-6 * limits->bytes);
    if (cost.steps <= max)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/study",
                       "would take about %.2g s of CPU in all, at most %.4g s are allowed: %s",
                       cost.cpu_seconds, max * SOLVER_STEP, study_kind(request->study)->shorten);
}

Status study_request_complete(StudyRequest *request, const SimulationLimits *limits,
                              Warnings *warnings, Problem *problem) {
    Status status = STATUS_OK;
    if (request->study != NULL && study_kind(request->study)->prepare != NULL)
        status = study_kind(request->study)->prepare(request->study, &request->simulation, problem);
    status = study_first_failure(
        status, simulation_complete(&request->simulation, limits, warnings, problem));
    if (request->study == NULL || (status != STATUS_OK && status != STATUS_INVALID))
        return status;
    const Field rows[] = {study_request_fields[1], FIELD_END};
    const Status own = fields_validate(rows, request, "", problem);
    // The rest needs a valid scene.
    TRY(status);
    TRY(own);
    TRY(study_result(
        study_kind(request->study)->complete(request->study, &request->simulation, limits, problem),
        problem));
    return studies_check_cost(request, limits, problem);
}

Status study_request_cost(const StudyRequest *request, const SimulationLimits *limits, Cost *cost,
                          Problem *problem) {
    *cost = simulation_cost(&request->simulation);
    if (request->study == NULL)
        return STATUS_OK;
    const StudyKind *kind = study_kind(request->study);
    double steps;
    TRY(study_result(kind->cost(request->study, &request->simulation, limits, &steps), problem));
    cost->bytes += kind->bytes != NULL ? kind->bytes(&request->simulation) : 0;
    cost->steps += steps;
    cost->cpu_seconds = cost->steps * SOLVER_STEP;
    return STATUS_OK;
}
