#include "core/study/study_request.h"

const Field study_request_fields[] = {
    FIELD_BASE(StudyRequest, simulation, simulation_fields),
    FIELD_VARIANT(StudyRequest, study, &study_kinds, PRESENCE_OPTIONAL,
                  "what is to be found out about the scene beside its run"),
    FIELD_END,
};

void study_request_clear(StudyRequest *inquiry) {
    fields_clear(study_request_fields, inquiry);
}

static const double study_runs = 10; // a study may take as long as so many runs

static Status check_steps(const StudyRequest *inquiry, const SimulationLimits *limits,
                          Problem *problem) {
    if (limits == NULL || !(limits->steps > 0))
        return STATUS_OK;
    Cost cost;
    const double own = study_kind(inquiry->study)->most_runs;
    const double most = (own > 0 ? own : study_runs) * limits->steps;
    TRY(study_request_cost(inquiry, limits, &cost, problem));
    if (cost.steps <= most)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/study",
                       "would take about %.2g s of CPU in all, at most %.4g s are allowed: %s",
                       cost.cpu_seconds, most * SOLVER_STEP, study_kind(inquiry->study)->lessen);
}

Status study_request_complete(StudyRequest *inquiry, const SimulationLimits *limits,
                              Warnings *warnings, Problem *problem) {
    Status status = simulation_complete(&inquiry->simulation, limits, warnings, problem);
    if (inquiry->study == NULL || (status != STATUS_OK && status != STATUS_INVALID))
        return status;
    const Field *row = &study_request_fields[1];
    const Field rows[] = {*row, FIELD_END};
    const Status own = fields_check(rows, inquiry, "", problem);
    if (status == STATUS_OK)
        status = own;
    // The rest can only be judged beside a sound scene.
    if (status == STATUS_OK)
        status =
            study_kind(inquiry->study)
                ->complete((Study *)(void *)inquiry->study, &inquiry->simulation, limits, problem);
    return status == STATUS_OK ? check_steps(inquiry, limits, problem) : status;
}

Status study_request_cost(const StudyRequest *inquiry, const SimulationLimits *limits, Cost *cost,
                          Problem *problem) {
    *cost = simulation_cost(&inquiry->simulation);
    if (inquiry->study == NULL)
        return STATUS_OK;
    double steps;
    TRY(study_kind(inquiry->study)
            ->cost((const Study *)(const void *)inquiry->study, &inquiry->simulation, limits,
                   &steps, problem));
    cost->steps += steps;
    cost->cpu_seconds = cost->steps * SOLVER_STEP;
    return STATUS_OK;
}
