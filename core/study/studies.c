// The table of studies and of their answers, and the request that may hold one of them.
#include "core/study/study.h"

const StudyKind *const studies[] = {
    &study_tradeoff, &study_ensemble, &study_compare, &study_sensitivity, &study_sweep, NULL,
};

static const Kind *study_at(size_t index) {
    return index + 1 < COUNT(studies) ? &studies[index]->kind : NULL;
}

static const Kind *answer_at(size_t index) {
    return index + 1 < COUNT(studies) ? studies[index]->answer : NULL;
}

const KindTable study_kinds = {"kind", study_at, true};
const KindTable study_answer_kinds = {"kind", answer_at, false};

const Field study_answer_fields[] = {
    FIELD_VARIANT(StudyAnswer, study, &study_answer_kinds, PRESENCE_REQUIRED, "what it came to"),
    FIELD_END,
};

const Field study_request_fields[] = {
    FIELD_BASE(StudyRequest, simulation, simulation_fields),
    FIELD_VARIANT(StudyRequest, study, &study_kinds, PRESENCE_OPTIONAL,
                  "what is to be found out about the scene beside its run"),
    FIELD_END,
};

void study_request_clear(StudyRequest *request) {
    fields_clear(study_request_fields, request);
}

static const double study_runs = 10; // a study may take as long as so many runs

static Status study_request_check_steps(const StudyRequest *request, const SimulationLimits *limits,
                                        Problem *problem) {
    if (limits == NULL || !(limits->steps > 0))
        return STATUS_OK;
    Cost cost;
    const double own = study_kind(request->study)->most_runs;
    const double most = (own > 0 ? own : study_runs) * limits->steps;
    TRY(study_request_cost(request, limits, &cost, problem));
    if (cost.steps <= most)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/study",
                       "would take about %.2g s of CPU in all, at most %.4g s are allowed: %s",
                       cost.cpu_seconds, most * SOLVER_STEP, study_kind(request->study)->lessen);
}

Status study_request_complete(StudyRequest *request, const SimulationLimits *limits,
                              Warnings *warnings, Problem *problem) {
    Status status = simulation_complete(&request->simulation, limits, warnings, problem);
    if (request->study == NULL || (status != STATUS_OK && status != STATUS_INVALID))
        return status;
    const Field *row = &study_request_fields[1];
    const Field rows[] = {*row, FIELD_END};
    const Status own = fields_check(rows, request, "", problem);
    if (status == STATUS_OK)
        status = own;
    // The rest can only be judged beside a sound scene.
    if (status == STATUS_OK)
        status =
            study_kind(request->study)
                ->complete((Study *)(void *)request->study, &request->simulation, limits, problem);
    return status == STATUS_OK ? study_request_check_steps(request, limits, problem) : status;
}

Status study_request_cost(const StudyRequest *request, const SimulationLimits *limits, Cost *cost,
                          Problem *problem) {
    *cost = simulation_cost(&request->simulation);
    if (request->study == NULL)
        return STATUS_OK;
    double steps;
    TRY(study_kind(request->study)
            ->cost((const Study *)(const void *)request->study, &request->simulation, limits,
                   &steps, problem));
    cost->steps += steps;
    cost->cpu_seconds = cost->steps * SOLVER_STEP;
    return STATUS_OK;
}
