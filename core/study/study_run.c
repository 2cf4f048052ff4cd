#include "core/study/study_run.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "core/solve/solvers.h"

Status study_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

Status study_copy_text(const char *text, char **target, Problem *problem) {
    *target = text != NULL ? strdup(text) : NULL;
    return *target != NULL || text == NULL ? STATUS_OK : study_no_memory(problem);
}

Status study_add_text(const char *text, Texts *texts, Problem *problem) {
    char **at = realloc(texts->at, (texts->count + 1) * sizeof *at);
    if (at == NULL)
        return study_no_memory(problem);
    texts->at = at;
    TRY(study_copy_text(text, &at[texts->count], problem));
    texts->count++;
    return STATUS_OK;
}

Status study_failures_add(StudyFailures *failures, int status, const char *reason, uint64_t number,
                          const char *why, Problem *problem) {
    for (size_t i = 0; i < failures->count; i++)
        if (failures->at[i].status == status) {
            failures->at[i].count++;
            return STATUS_OK;
        }
    StudyFailure *at = realloc(failures->at, (failures->count + 1) * sizeof *at);
    if (at == NULL)
        return study_no_memory(problem);
    failures->at = at;
    StudyFailure *failure = &at[failures->count++];
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

Status run_spectra_make(const Spectrum *like, Reals *frequency, RunSpectra *spectra,
                        Problem *problem) {
    const Columns *densities = &like->densities;
    spectra->at = calloc(densities->count, sizeof *spectra->at);
    if (spectra->at == NULL || !reals_allocate(frequency, densities->rows))
        return study_no_memory(problem);
    memcpy(frequency->at, like->frequency, densities->rows * sizeof *like->frequency);
    spectra->count = densities->count;
    for (size_t c = 0; c < densities->count; c++) {
        TRY(study_copy_text(densities->at[c].name, &spectra->at[c].channel, problem));
        TRY(study_copy_text(densities->at[c].unit, &spectra->at[c].unit, problem));
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
    Texts *sampled = &target->output.channels;
    for (size_t i = 0; i < sampled->count; i++)
        free(sampled->at[i]);
    free(sampled->at);
    *sampled = (Texts){NULL, 0};
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
