// A scene's text made ready: read, its materials' names turned into numbers, judged and completed,
// and its id; the same for who only asks what it would be.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/simulation/simulation.h"
#include "core/study/sweep.h"
#include "server/jobs/jobs_private.h"
#include "server/jobs/resolve_material.h"
#include "server/jobs/resolve_record.h"
#include "server/jobs/resolve_sweep.h"
#include "server/json/parse.h"
#include "server/util/sha256.h"

// Planning takes storeys^3 operations and more, and nothing stops it: from LARGE_STOREYS on (some
// milliseconds) a request needs a place, so that others are answered meanwhile.
enum { LARGE_STOREYS = 40, LARGE_PLACES = 4 };

static Status resolve_place(JobManager *manager, const StudyRequest *inquiry, bool *has_place,
                            Problem *problem) {
    const Scene *scene = &inquiry->simulation.scene;
    if (scene->structure == NULL || structure_storeys(scene_structure(scene)) < LARGE_STOREYS)
        return STATUS_OK;
    *has_place = atomic_fetch_add(&manager->large_plans, 1) < LARGE_PLACES;
    if (*has_place)
        return STATUS_OK;
    atomic_fetch_sub(&manager->large_plans, 1);
    return problem_set(problem, STATUS_BUSY,
                       "%d scenes of %d storeys or more are being planned, which is the limit; "
                       "retry later",
                       LARGE_PLACES, LARGE_STOREYS);
}

void jobs_leave_place(JobManager *manager, bool has_place) {
    if (has_place)
        atomic_fetch_sub(&manager->large_plans, 1);
}

// `has_place` NULL: not for a request.
static Status prepare(Db *db, JobManager *manager, const char *text, size_t size,
                      const SimulationLimits *limits, bool *has_place, StudyRequest *inquiry,
                      Warnings *warnings, Problem *problem) {
    // All three add to one problem: what could not be read is judged no further, the rest is.
    Problem *own = NULL;
    if (problem == NULL && (problem = own = calloc(1, sizeof *own)) == NULL)
        return STATUS_NO_MEMORY;
    Status status = json_parse(text, size, study_request_fields, inquiry, problem);
    const bool is_object = problem->count == 0 || problem->faults[0].pointer[0] != '\0';
    const bool is_read = is_object && (status == STATUS_OK || status == STATUS_INVALID);
    const Status place = is_read && has_place != NULL
                             ? resolve_place(manager, inquiry, has_place, problem)
                             : STATUS_OK;
    if (place != STATUS_OK) {
        status = place;
    } else if (is_read) {
        Status resolved = resolve_materials(db, &inquiry->simulation, warnings, problem);
        const Status record = resolve_record_motion(db, &inquiry->simulation, problem);
        if (resolved == STATUS_OK || (record != STATUS_OK && record != STATUS_INVALID))
            resolved = record;
        if (resolved != STATUS_OK && resolved != STATUS_INVALID)
            status = resolved;
        else if (inquiry->study != NULL && study_kind(inquiry->study) == &study_sweep)
            status = resolve_sweep_axes(db, inquiry, limits, warnings, problem);
        else
            status = study_request_complete(inquiry, limits, warnings, problem);
        if (status == STATUS_OK)
            status = resolved;
    }
    free(own);
    return status;
}

Status jobs_prepare(Db *db, const char *text, size_t size, const SimulationLimits *limits,
                    StudyRequest *inquiry, Warnings *warnings, Problem *problem) {
    return prepare(db, NULL, text, size, limits, NULL, inquiry, warnings, problem);
}

static Status resolve_limit_study(const JobManager *manager, const StudyRequest *inquiry,
                                  Problem *problem) {
    const double most = manager->settings.study_seconds;
    Cost cost;
    if (inquiry->study == NULL || most == 0)
        return STATUS_OK;
    TRY(study_request_cost(inquiry, &manager->settings.limits, &cost, problem));
    if (cost.cpu_seconds <= most)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/study",
                       "would take about %.3g s of CPU, at most %g s are allowed: take fewer runs "
                       "or a shorter duration, or raise --max-study-seconds of the daemon",
                       cost.cpu_seconds, most);
}

Status jobs_prepare_request(JobManager *manager, const char *text, size_t size,
                            const SimulationLimits *limits, bool *has_place, StudyRequest *inquiry,
                            Warnings *warnings, Problem *problem) {
    *has_place = false;
    TRY(prepare(manager->db, manager, text, size, limits, has_place, inquiry, warnings, problem));
    return limits != NULL ? resolve_limit_study(manager, inquiry, problem) : STATUS_OK;
}

void jobs_result_id(const StudyRequest *inquiry, char target[72]) {
    char hex[65];
    Sha256 *digest = sha256_new();
    target[0] = '\0';
    if (digest == NULL)
        return;
    sha256_add(digest, engine_version, strlen(engine_version) + 1);
    canonical_write(study_request_fields, inquiry, sha256_add, digest);
    sha256_end(digest, hex);
    snprintf(target, 72, "r-%s", hex);
}

void dry_run_clear(DryRun *dry_run) {
    study_request_clear(&dry_run->inquiry);
    warnings_clear(&dry_run->warnings);
    fields_clear(plan_report_fields, &dry_run->plan);
}

static Status resolve_dry_run(JobManager *manager, const char *text, size_t size, bool *has_place,
                              DryRun *dry_run, Problem *problem) {
    TRY(jobs_prepare_request(manager, text, size, &manager->settings.limits, has_place,
                             &dry_run->inquiry, &dry_run->warnings, problem));
    jobs_result_id(&dry_run->inquiry, dry_run->result);
    TRY(simulation_plan(&dry_run->inquiry.simulation, &dry_run->plan, problem));
    if (scene_warnings_of_pairs(&dry_run->inquiry.simulation.scene, &dry_run->plan.derived,
                                &dry_run->warnings) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a warning");
    TRY(study_request_cost(&dry_run->inquiry, &manager->settings.limits, &dry_run->cost, problem));
    dry_run->is_cached = db_result_exists(manager->db, dry_run->result);
    return STATUS_OK;
}

Status jobs_dry_run(JobManager *manager, const char *text, size_t size, DryRun *dry_run,
                    Problem *problem) {
    memset(dry_run, 0, sizeof *dry_run);
    bool has_place;
    const Status status = resolve_dry_run(manager, text, size, &has_place, dry_run, problem);
    jobs_leave_place(manager, has_place);
    return status;
}
