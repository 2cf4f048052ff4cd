// A scene's text made ready: read, its materials' names turned into numbers, judged and completed,
// and its id; the same for who only asks what it would be.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/simulation/simulation.h"
#include "core/study/sweep.h"
#include "server/base/digest.h"
#include "server/codec/read.h"
#include "server/jobs/intake_state.h"
#include "server/jobs/prepare_material.h"
#include "server/jobs/prepare_record.h"
#include "server/jobs/prepare_sweep.h"

Status intake_prepare(Store *store, const char *text, size_t size, const SimulationLimits *limits,
                      StudyRequest *inquiry, Warnings *warnings, Problem *problem) {
    // All three add to one problem: what could not be read is judged no further, the rest is.
    Problem *own = NULL;
    if (problem == NULL && (problem = own = calloc(1, sizeof *own)) == NULL)
        return STATUS_NO_MEMORY;
    Status status = read_json(text, size, study_request_fields, inquiry, problem);
    const bool is_object = problem->count == 0 || problem->faults[0].pointer[0] != '\0';
    if (is_object && (status == STATUS_OK || status == STATUS_INVALID)) {
        Status resolved = prepare_materials(store, &inquiry->simulation, warnings, problem);
        const Status record = prepare_record(store, &inquiry->simulation, problem);
        if (resolved == STATUS_OK || (record != STATUS_OK && record != STATUS_INVALID))
            resolved = record;
        if (resolved != STATUS_OK && resolved != STATUS_INVALID)
            status = resolved;
        else if (inquiry->study != NULL && study_kind(inquiry->study) == &study_sweep)
            status = prepare_sweep(store, inquiry, limits, warnings, problem);
        else
            status = study_request_complete(inquiry, limits, warnings, problem);
        if (status == STATUS_OK)
            status = resolved;
    }
    free(own);
    return status;
}

void intake_result_id(const StudyRequest *inquiry, char target[72]) {
    char hex[65];
    Digest *digest = digest_new();
    target[0] = '\0';
    if (digest == NULL)
        return;
    digest_take(digest, engine_version, strlen(engine_version) + 1);
    canonical_write(study_request_fields, inquiry, digest_take, digest);
    digest_end(digest, hex);
    snprintf(target, 72, "r-%s", hex);
}

void dry_run_clear(DryRun *dry_run) {
    study_request_clear(&dry_run->inquiry);
    warnings_clear(&dry_run->warnings);
    fields_clear(plan_report_fields, &dry_run->plan);
}

Status intake_dry_run(Intake *intake, const char *text, size_t size, DryRun *dry_run,
                      Problem *problem) {
    memset(dry_run, 0, sizeof *dry_run);
    TRY(intake_prepare(intake->store, text, size, &intake->settings.limits, &dry_run->inquiry,
                       &dry_run->warnings, problem));
    intake_result_id(&dry_run->inquiry, dry_run->result);
    TRY(simulation_plan(&dry_run->inquiry.simulation, &dry_run->plan, problem));
    if (scene_warnings_of_pairs(&dry_run->inquiry.simulation.scene, &dry_run->plan.derived,
                                &dry_run->warnings) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a warning");
    TRY(study_request_cost(&dry_run->inquiry, &intake->settings.limits, &dry_run->cost, problem));
    dry_run->is_cached = store_result_exists(intake->store, dry_run->result);
    return STATUS_OK;
}
