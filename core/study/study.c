// The steps of a study: begin, make and fold each member, end. study_run takes them all on one
// thread; an executor with many threads calls them one by one.
#include "core/study/study.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

Status study_begin(const Variant *study, const Simulation *simulation, const StudyTools *tools,
                   Variant **answer, StudyWork **work, Problem *problem) {
    const StudyKind *kind = study_kind(study);
    ProgressRange range = progress_range(tools->progress, 0, STUDY_BEGUN);
    const Progress progress = progress_range_view(&range);
    StudyTools own = *tools;
    own.progress = &progress;
    *answer = variant_new(kind->answer);
    StudyWork *made = *work = calloc(1, kind->work_size);
    Status status = STATUS_NO_MEMORY;
    if (*answer == NULL || made == NULL) {
        (void)study_no_memory(problem);
    } else {
        made->kind = kind;
        made->study = study;
        made->simulation = simulation;
        made->limits = tools->limits;
        made->answer = *answer;
        status = kind->begin(made, &own, problem);
        if (made->wanted == 0)
            made->wanted = made->members;
        made->expected = made->members;
    }
    if (status != STATUS_OK) {
        study_free(made);
        variant_free(*answer);
        *work = NULL;
        *answer = NULL;
    }
    return status;
}

Status study_part_make(const StudyWork *work, size_t member, const StudyTools *tools,
                       StudyPart **made, Problem *problem) {
    const StudyKind *kind = work->kind;
    StudyPart *part = *made = calloc(1, kind->part_size);
    Simulation scene = {0};
    Outcome *outcome = NULL;
    if (part == NULL)
        return study_no_memory(problem);
    RunRecord *run = &part->run;
    run->steps = (double)NAN;
    (void)fields_default(summary_fields, &run->summary); // absent: nothing to allocate
    run->status = kind->scene(work, member, &scene, part, problem);
    part->is_refused = run->status != STATUS_OK;
    if (run->status == STATUS_OK)
        run->status = simulation_run(&scene, tools->limits, tools->progress, tools->workspace,
                                     &outcome, problem);
    simulation_clear(&scene);
    if (study_run_ends_study(run->status))
        return run->status;
    if (run->status != STATUS_OK) {
        const Status copied = study_copy_text(problem->detail, &run->why, NULL);
        problem_clear(problem);
        return copied == STATUS_OK ? copied : study_no_memory(problem);
    }
    Status status = STATUS_OK;
    run->steps = outcome->steps;
    run->summary = outcome->summary;
    if (kind->keep != NULL) {
        status = kind->keep(work, outcome, tools, part, problem);
    } else {
        part->spectrum = outcome->spectrum;
        outcome->spectrum = (Spectrum){0};
    }
    outcome_unref(outcome);
    return status;
}

Status study_part_fold(StudyWork *work, size_t member, StudyPart *part, Problem *problem) {
    return work->kind->fold(work, member, part, problem);
}

Status study_end(StudyWork *work, const StudyTools *tools, Problem *problem) {
    return work->kind->end != NULL ? work->kind->end(work, tools, problem) : STATUS_OK;
}

void study_part_free(const StudyWork *work, StudyPart *part) {
    if (part == NULL)
        return;
    if (work->kind->clear != NULL)
        work->kind->clear(part);
    free(part->run.why);
    free(part->run.restitution.at);
    free(part->run.contact_time.at);
    spectrum_clear(&part->spectrum);
    free(part);
}

void study_free(StudyWork *work) {
    if (work != NULL && work->kind != NULL && work->kind->free != NULL)
        work->kind->free(work);
    free(work);
}

static Status study_run_member(StudyWork *work, size_t member, const StudyTools *tools,
                               const Progress *whole, Problem *problem) {
    const double share = 1 / (double)work->expected;
    ProgressRange range = progress_range(whole, (double)member * share, share);
    const Progress progress = progress_range_view(&range);
    StudyTools own = *tools;
    StudyPart *part = NULL;
    own.progress = &progress;
    TRY(study_advance(&progress, 0, problem));
    Status status = study_part_make(work, member, &own, &part, problem);
    if (status == STATUS_OK)
        status = study_part_fold(work, member, part, problem);
    study_part_free(work, part);
    return status;
}

static Status study_run_members(const Variant *study, const Simulation *simulation,
                                const StudyTools *tools, Variant **answer, Problem *problem) {
    StudyWork *work;
    ProgressRange range = progress_range(tools->progress, STUDY_BEGUN, 1 - STUDY_BEGUN);
    const Progress whole = progress_range_view(&range);
    Status status = study_begin(study, simulation, tools, answer, &work, problem);
    for (size_t i = 0; status == STATUS_OK && i < work->wanted; i++)
        status = study_run_member(work, i, tools, &whole, problem);
    if (status == STATUS_OK)
        status = study_end(work, tools, problem);
    study_free(work);
    return status;
}

Status study_run(const Variant *study, const Simulation *simulation, const StudyTools *tools,
                 Variant **answer, Problem *problem) {
    const StudyKind *kind = study_kind(study);
    Status status;
    if (kind->run == NULL) {
        status = study_run_members(study, simulation, tools, answer, problem);
    } else {
        *answer = variant_new(kind->answer);
        status = *answer == NULL ? study_no_memory(problem)
                                 : kind->run(study, simulation, tools, *answer, problem);
    }
    if (status != STATUS_OK) {
        variant_free(*answer);
        *answer = NULL;
    }
    return status;
}
