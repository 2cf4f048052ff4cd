#include "core/study/study_run.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "core/solve/solver.h"

Status study_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

Status study_advance(const Progress *progress, double fraction, Problem *problem) {
    return progress_advance(progress, fraction)
               ? STATUS_OK
               : problem_set(problem, STATUS_CANCELLED, "the study was stopped");
}

Status study_copy_text(const char *text, char **target, Problem *problem) {
    *target = text != NULL ? strdup(text) : NULL;
    return *target != NULL || text == NULL ? STATUS_OK : study_no_memory(problem);
}

Status study_copy_reals(const double *values, size_t count, Reals *target, Problem *problem) {
    if (!reals_allocate(target, count))
        return study_no_memory(problem);
    memcpy(target->at, values, count * sizeof *values);
    return STATUS_OK;
}

// There is room for as many elements as the next power of two.
void *study_list_add(void *list, size_t size, Problem *problem) {
    List grown;
    memcpy(&grown, list, sizeof grown);
    const size_t count = grown.count;
    if ((count & (count - 1)) == 0)
        grown.at = realloc(grown.at, (count == 0 ? 1 : 2 * count) * size);
    if (grown.at == NULL) {
        (void)study_no_memory(problem);
        return NULL;
    }
    grown.count++;
    memcpy(list, &grown, sizeof grown);
    return memset((char *)grown.at + size * count, 0, size);
}

Status study_add_text(const char *text, Texts *texts, Problem *problem) {
    return texts_append(texts, text) == STATUS_OK ? STATUS_OK : study_no_memory(problem);
}

Status study_add_real(double value, Reals *reals, Problem *problem) {
    double *added = study_list_add(reals, sizeof *added, problem);
    if (added == NULL)
        return STATUS_NO_MEMORY;
    *added = value;
    return STATUS_OK;
}

Status run_table_add(RunTable *table, RunRecord *run, uint64_t number, Problem *problem) {
    RunRecord *added = study_list_add(table, sizeof *added, problem);
    if (added == NULL)
        return STATUS_NO_MEMORY;
    *added = *run;
    added->number = number;
    run->why = NULL;
    run->restitution = run->contact_time = (Reals){NULL, 0};
    return STATUS_OK;
}

Status study_failures_add(StudyFailures *failures, int status, const char *reason, uint64_t number,
                          const char *why, Problem *problem) {
    for (size_t i = 0; i < failures->count; i++)
        if (failures->at[i].status == status) {
            failures->at[i].count++;
            return STATUS_OK;
        }
    StudyFailure *failure = study_list_add(failures, sizeof *failure, problem);
    if (failure == NULL)
        return STATUS_NO_MEMORY;
    *failure = (StudyFailure){.status = status, .count = 1, .first = number};
    TRY(study_copy_text(reason, &failure->reason, problem));
    return study_copy_text(why, &failure->detail, problem);
}

Status study_failures_fill(const RunTable *table, StudyFailures *failures, Problem *problem) {
    for (size_t i = 0; i < table->count; i++) {
        const RunRecord *run = &table->at[i];
        if (run->why != NULL)
            TRY(study_failures_add(failures, (int)run->status, status_slug(run->status),
                                   run->number, run->why, problem));
    }
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

bool study_run_has_force(const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    return scene->dampers.count > 0 &&
           dampers_contact_law(&scene->dampers, scene_contact(scene))->form != CONTACT_IMPULSIVE;
}

Status study_run_check_metric(const Simulation *simulation, const char *metric, Problem *problem) {
    static const char pointer[] = "/study/metric";
    const bool has_damper = simulation->scene.dampers.count > 0;
    if (strcmp(metric, "psd") == 0 && simulation->output.psd.channels.count == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "psd needs spectra: ask for some in /output/psd");
    if (strstr(metric, "force") != NULL && !study_run_has_force(simulation))
        return problem_add(problem, STATUS_INVALID, pointer, "%s needs contacts with a force: %s",
                           metric,
                           has_damper ? "impulses have none, choose another contact model"
                                      : "the scene has no damper");
    if (strcmp(metric, "impacts") == 0 && !has_damper)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "impacts needs a damper: the scene has none");
    return STATUS_OK;
}

Status study_run_check_names(const Texts *given, const char *const *names, const char *pointer,
                             Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < given->count; i++) {
        size_t at = 0;
        while (names[at] != NULL && strcmp(names[at], given->at[i]) != 0)
            at++;
        if (names[at] != NULL)
            continue;
        char place[sizeof((Fault){0}.pointer)];
        json_pointer_index(place, sizeof place, pointer, i);
        status = spelling_reject(names, given->at[i], place, problem);
    }
    return status;
}

Status study_run_copy(const Simulation *simulation, Simulation *target, Problem *problem) {
    if (fields_copy(simulation_fields, simulation, target) != STATUS_OK)
        return study_no_memory(problem);
    texts_clear(&target->output.channels);
    return STATUS_OK;
}

Status study_run_fix_solver(Simulation *target, Problem *problem) {
    if (!simulation_has_target(target))
        return STATUS_OK;
    Variant *accuracy = variant_new(solver_kinds.at(0));
    if (accuracy == NULL)
        return study_no_memory(problem);
    variant_free(target->accuracy);
    target->accuracy = accuracy;
    ((AccuracyAuto *)(void *)accuracy)->metric = CHOICE_ABSENT; // as in a completed scene
    return STATUS_OK;
}
