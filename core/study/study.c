// A study's whole way on one thread. Who shares members out goes the same way: begin, make each,
// fold each in turn, end.
#include "core/study/study.h"

Status study_begin(const Variant *study, const Simulation *simulation, const StudyTools *tools,
                   Variant **answer, StudyWork **work, Problem *problem) {
    const StudyKind *kind = study_kind(study);
    ProgressRange range = progress_range(tools->progress, 0, STUDY_BEGUN);
    const Progress progress = progress_range_view(&range);
    StudyTools own = *tools;
    own.progress = &progress;
    *work = NULL;
    *answer = variant_new(kind->answer);
    if (*answer == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's answer");
    const Status status = kind->members->begin((const Study *)(const void *)study, simulation, &own,
                                               *answer, work, problem);
    if (status != STATUS_OK) {
        variant_free(*answer);
        *answer = NULL;
    }
    return status;
}

Status study_end(StudyWork *work, const StudyTools *tools, Problem *problem) {
    const StudyMembers *members = work->kind->members;
    return members->end != NULL ? members->end(work, tools, problem) : STATUS_OK;
}

void study_free(StudyWork *work) {
    if (work != NULL)
        work->kind->members->free(work);
}

static Status study_make_member(StudyWork *work, size_t member, const StudyTools *tools,
                                const Progress *whole, Problem *problem) {
    const StudyMembers *members = work->kind->members;
    const double share = 1 / (double)work->expected;
    ProgressRange range = progress_range(whole, (double)member * share, share);
    const Progress progress = progress_range_view(&range);
    StudyTools own = *tools;
    void *part = NULL;
    own.progress = &progress;
    if (!progress_advance(&progress, 0))
        return problem_set(problem, STATUS_CANCELLED, "the study was stopped");
    Status status = members->make(work, member, &own, &part, problem);
    if (status == STATUS_OK)
        status = members->fold(work, member, part, problem);
    members->drop(part);
    return status;
}

static Status study_make_all(const Variant *study, const Simulation *simulation,
                             const StudyTools *tools, Variant **answer, Problem *problem) {
    StudyWork *work;
    ProgressRange range = progress_range(tools->progress, STUDY_BEGUN, 1 - STUDY_BEGUN);
    const Progress whole = progress_range_view(&range);
    Status status = study_begin(study, simulation, tools, answer, &work, problem);
    for (size_t i = 0; status == STATUS_OK && i < work->wanted; i++)
        status = study_make_member(work, i, tools, &whole, problem);
    if (status == STATUS_OK)
        status = study_end(work, tools, problem);
    study_free(work);
    return status;
}

Status study_run(const Variant *study, const Simulation *simulation, const StudyTools *tools,
                 Variant **answer, Problem *problem) {
    const StudyKind *kind = study_kind(study);
    Status status;
    if (kind->members != NULL) {
        status = study_make_all(study, simulation, tools, answer, problem);
    } else {
        *answer = variant_new(kind->answer);
        status = *answer == NULL
                     ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's answer")
                     : kind->run((const Study *)(const void *)study, simulation, tools, *answer,
                                 problem);
    }
    if (status != STATUS_OK) {
        variant_free(*answer);
        *answer = NULL;
    }
    return status;
}
