// The steps of a study: begin, make and fold each member, end. study_run takes them all on one
// thread; an executor with many threads calls them one by one.
#include "core/study/study.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/solver.h"

Status study_advance(const Progress *progress, double fraction, Problem *problem) {
    return progress_advance(progress, fraction)
               ? STATUS_OK
               : problem_set(problem, STATUS_CANCELLED, "the study was stopped");
}

Status study_copy_reals(const double *values, size_t count, Reals *target) {
    if (!reals_allocate(target, count))
        return STATUS_NO_MEMORY;
    memcpy(target->at, values, count * sizeof *values);
    return STATUS_OK;
}

Status study_add_real(double value, Reals *reals) {
    double *added = list_grow(reals, sizeof *added);
    TRY(status_made(added != NULL));
    *added = value;
    return STATUS_OK;
}

Status run_table_add(RunTable *table, RunRecord *run, uint64_t number) {
    RunRecord *added = list_grow(table, sizeof *added);
    TRY(status_made(added != NULL));
    *added = *run;
    added->number = number;
    run->why = NULL;
    run->restitution = run->contact_time = run->inputs = (Reals){NULL, 0};
    return STATUS_OK;
}

Status study_failures_add(StudyFailures *failures, int status, const char *reason, uint64_t number,
                          const char *why) {
    for (size_t i = 0; i < failures->count; i++)
        if (failures->at[i].status == status) {
            failures->at[i].count++;
            return STATUS_OK;
        }
    StudyFailure *failure = list_append(failures, sizeof *failure);
    TRY(status_made(failure != NULL));
    *failure = (StudyFailure){.status = status, .count = 1, .first = number};
    TRY(text_copy(reason, &failure->reason));
    return text_copy(why, &failure->detail);
}

const Field study_failure_fields[] = {STUDY_FAILURE_ROWS("first_run", "the first of them, from 0")};
const Field study_runs_fields[] = {STUDY_RUNS_ROWS(study_failure_fields)};

Status study_runs_add(StudyRuns *runs, const RunRecord *run, uint64_t number) {
    runs->runs++;
    if (run->status == STATUS_OK) {
        runs->steps += run->steps;
        return STATUS_OK;
    }
    runs->failed++;
    return study_failures_add(&runs->failures, (int)run->status, status_slug(run->status), number,
                              run->why);
}

Status study_runs_warn(StudyRuns *runs) {
    if (runs->failed == 0)
        return STATUS_OK;
    return warnings_add(&runs->warnings, "/study", "%llu of %llu runs failed%s; the first: %s",
                        (unsigned long long)runs->failed, (unsigned long long)runs->runs,
                        runs->failed == runs->runs ? ", so that nothing is known" : "",
                        runs->failures.at[0].detail);
}

Status study_sample_cost(StudySceneMaker make, const void *of, size_t count, size_t samples,
                         const SimulationLimits *limits, double *steps) {
    const size_t taken = count < samples ? count : samples;
    double sum = 0;
    size_t made = 0;
    for (size_t i = 0; i < taken; i++) {
        // Midpoints of equal parts, which do not follow the period of an axis.
        const size_t member = (size_t)((double)count * ((double)i + 0.5) / (double)taken);
        Simulation scene = {0};
        const Status status = make(of, member, limits, &scene);
        if (status == STATUS_OK)
            sum += simulation_cost(&scene).steps;
        made += status == STATUS_OK;
        simulation_clear(&scene);
        if (status == STATUS_NO_MEMORY)
            return status;
    }
    *steps = made > 0 ? sum / (double)made * (double)count : 0;
    return STATUS_OK;
}

double study_run_densities(const Simulation *simulation) {
    const SpectrumRequest *psd = &simulation->output.psd;
    return psd->channels.count == 0
               ? 0
               : (double)psd->channels.count * ((double)(psd->segment / 2) + 1);
}

Status study_run_check_densities(const Simulation *simulation, double densities, Problem *problem) {
    enum { DENSITIES_MAX = 1 << 18 };
    if (densities <= DENSITIES_MAX)
        return STATUS_OK;
    return problem_add_real(problem, STATUS_INVALID, "/output/psd/segment",
                            (double)simulation->output.psd.segment, "samples",
                            "gives %.0f densities in all spectra, at most %d are allowed: ask for "
                            "shorter segments, or for fewer channels or models",
                            densities, DENSITIES_MAX);
}

Status study_run_check_names(const Texts *given, const char *const *names, const char *member,
                             Problem *problem) {
    const Field rows[] = {
        {.name = member, .kind = FIELD_KIND_TEXTS, .presence = PRESENCE_OPTIONAL, .choices = names},
        FIELD_END};
    return fields_validate(rows, given, "/study", problem);
}

void study_run_fix_solver(Simulation *target) {
    AccuracyAuto *accuracy = (AccuracyAuto *)(void *)target->accuracy;
    if (!simulation_has_target(target))
        return;
    accuracy->target = (double)NAN;
    accuracy->metric = CHOICE_ABSENT; // as in a completed scene
}

Status study_run_copy(const Simulation *simulation, Simulation *target) {
    TRY(fields_copy(simulation_fields, simulation, target));
    study_run_fix_solver(target);
    texts_clear(&target->output.channels);
    target->output.reduction = false;
    return STATUS_OK;
}

Status study_run_scene(const Simulation *scene, const StudyTools *tools, Outcome **outcome,
                       Problem *problem) {
    TRY(simulation_run(scene, tools->limits, tools->progress, tools->workspace, outcome, problem));
    if (!simulation_has_force(scene))
        (*outcome)->summary.peak_contact_force = (double)NAN;
    return STATUS_OK;
}

Status study_begin(const Variant *study, const Simulation *simulation, const StudyTools *tools,
                   Variant **answer, StudyWork **work, Problem *problem) {
    const StudyKind *kind = study_kind(study);
    const Progress progress = progress_range_view(
        &(ProgressRange){tools->progress, 0, study_has_members(study) ? STUDY_BEGUN : 1, 0});
    StudyTools own = *tools;
    own.progress = &progress;
    *answer = variant_new(kind->answer);
    StudyWork *made = *work = calloc(1, kind->work_size);
    Status status = STATUS_NO_MEMORY;
    if (*answer != NULL && made != NULL) {
        made->kind = kind;
        made->study = study;
        made->simulation = simulation;
        made->limits = tools->limits;
        made->answer = *answer;
        status = kind->begin(made, &own, problem);
        if (made->wanted == 0)
            made->wanted = made->members;
        if (made->expected == 0)
            made->expected = made->members;
    }
    if (status != STATUS_OK) {
        study_free(made);
        variant_free(*answer);
        *work = NULL;
        *answer = NULL;
    }
    return study_result(status, problem);
}

Status study_part_make(const StudyWork *work, size_t member, const StudyTools *tools,
                       StudyPart **made, Problem *problem) {
    const StudyKind *kind = work->kind;
    StudyPart *part = *made = calloc(1, kind->part_size);
    Simulation scene = {0};
    Outcome *outcome = NULL;
    if (part == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    RunRecord *run = &part->run;
    run->steps = (double)NAN;
    (void)fields_default(summary_fields, &run->summary); // absent: nothing to allocate
    (void)fields_default(reduction_fields, &run->reduction);
    run->status = kind->scene(work, member, &scene, part, problem);
    part->is_refused = run->status != STATUS_OK;
    if (run->status == STATUS_OK)
        run->status = study_run_scene(&scene, tools, &outcome, problem);
    simulation_clear(&scene);
    if (study_run_ends_study(run->status))
        return study_result(run->status, problem);
    if (run->status != STATUS_OK) {
        const Status copied = text_copy(problem->detail, &run->why);
        problem_clear(problem);
        return study_result(copied, problem);
    }
    Status status = STATUS_OK;
    run->steps = outcome->steps;
    run->summary = outcome->summary;
    if (outcome->has_reduction)
        run->reduction = outcome->reduction;
    if (kind->keep != NULL)
        status = kind->keep(work, outcome, tools, part, problem);
    part->spectrum = outcome->spectrum;
    outcome->spectrum = (Spectrum){0};
    outcome_unref(outcome);
    return study_result(status, problem);
}

Status study_part_fold(StudyWork *work, size_t member, StudyPart *part, Problem *problem) {
    return study_result(work->kind->fold(work, member, part), problem);
}

Status study_end(StudyWork *work, const StudyTools *tools, Problem *problem) {
    return work->kind->end != NULL ? study_result(work->kind->end(work, tools, problem), problem)
                                   : STATUS_OK;
}

void study_part_free(const StudyWork *work, StudyPart *part) {
    if (part == NULL)
        return;
    if (work->kind->clear != NULL)
        work->kind->clear(part);
    free(part->run.why);
    free(part->run.restitution.at);
    free(part->run.contact_time.at);
    free(part->run.inputs.at);
    free(part->drawn_again.at);
    spectrum_clear(&part->spectrum);
    spectrum_clear(&part->history);
    free(part);
}

void study_free(StudyWork *work) {
    if (work != NULL && work->kind != NULL && work->kind->free != NULL)
        work->kind->free(work);
    free(work);
}

Status study_run(const Variant *study, const Simulation *simulation, const StudyTools *tools,
                 Variant **answer, Problem *problem) {
    StudyWork *work;
    Status status = study_begin(study, simulation, tools, answer, &work, problem);
    for (size_t i = 0; status == STATUS_OK && i < work->wanted; i++) {
        const double share = (1 - STUDY_BEGUN) / (double)work->expected;
        const Progress progress = progress_range_view(
            &(ProgressRange){tools->progress, STUDY_BEGUN + (double)i * share, share, 0});
        StudyTools own = *tools;
        StudyPart *part = NULL;
        own.progress = &progress;
        status = study_advance(&progress, 0, problem);
        if (status == STATUS_OK)
            status = study_part_make(work, i, &own, &part, problem);
        if (status == STATUS_OK)
            status = study_part_fold(work, i, part, problem);
        study_part_free(work, part);
    }
    if (status == STATUS_OK)
        status = study_end(work, tools, problem);
    study_free(work);
    if (status != STATUS_OK) {
        variant_free(*answer);
        *answer = NULL;
    }
    return status;
}
