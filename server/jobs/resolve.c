// A scene's text made ready: read, its names of materials and records resolved, validated and
// completed, and its id; and the same for a dry run.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/base/json_pointer.h"
#include "core/simulation/simulation.h"
#include "core/study/sweep.h"
#include "server/jobs/jobs_private.h"
#include "server/jobs/resolve_material.h"
#include "server/jobs/resolve_record.h"
#include "server/json/parse.h"
#include "server/util/bytes.h"
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

// Keeps the numbers of a material in the sweep: its points are made without a database.
static Status sweep_pin(Buffers *materials, const Buffer *buffer) {
    for (size_t i = 0; i < materials->count; i++)
        if (materials->at[i].material != NULL &&
            strcmp(materials->at[i].material, buffer->material) == 0)
            return STATUS_OK;
    Buffer *at = realloc(materials->at, (materials->count + 1) * sizeof *at);
    if (at == NULL)
        return STATUS_NO_MEMORY;
    materials->at = at;
    Buffer *pinned = &at[materials->count];
    if (fields_copy(buffer_fields, buffer, pinned) != STATUS_OK)
        return STATUS_NO_MEMORY;
    materials->count++;
    // Other members of the scene's buffer are not the material's.
    pinned->stiffness = pinned->damping = pinned->exponent = (double)NAN;
    return STATUS_OK;
}

static bool sweep_takes_materials(const char *pointer) {
    static const char *const names[] = {"buffer", "left_buffer", "right_buffer", "material"};
    const char *last = pointer == NULL ? NULL : strrchr(pointer, '/');
    for (size_t i = 0; last != NULL && i < COUNT(names); i++)
        if (strcmp(last + 1, names[i]) == 0)
            return true;
    return false;
}

// A name on an axis becomes that of a revision; the axis refuses what is no text.
static Status sweep_resolve_value(Db *db, char **value, Buffers *materials, const char *place,
                                  Warnings *warnings, Problem *problem) {
    Buffer buffer;
    JsonScalar scalar;
    char *room = malloc(strlen(*value) + 1);
    if (room == NULL || fields_default(buffer_fields, &buffer) != STATUS_OK) {
        free(room);
        return STATUS_NO_MEMORY;
    }
    Status status = STATUS_OK;
    if (json_scalar_read(*value, &scalar, room) && scalar.kind == JSON_SCALAR_TEXT) {
        buffer.material = room;
        room = NULL;
        status = resolve_buffer(db, &buffer, place, warnings, problem);
        if (status == STATUS_OK)
            status = sweep_pin(materials, &buffer);
        Bytes name = {0};
        if (status == STATUS_OK) {
            bytes_json_string(&name, buffer.material);
            free(*value);
            *value = bytes_take(&name, NULL);
            status = *value != NULL ? STATUS_OK : STATUS_NO_MEMORY;
        }
    }
    free(room);
    fields_clear(buffer_fields, &buffer);
    return status;
}

static Status sweep_resolve_axes(Db *db, SweepStudy *study, Warnings *warnings, Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < study->axes.count; i++) {
        const SweepAxis *axis = &study->axes.at[i];
        for (size_t k = 0; k < axis->values.count && sweep_takes_materials(axis->pointer); k++) {
            char place[96];
            if (problem->count >= PROBLEM_FAULTS) // no more are reported
                return STATUS_INVALID;
            snprintf(place, sizeof place, "/study/axes/%zu/values/%zu", i, k);
            const Status one = sweep_resolve_value(db, &axis->values.at[k], &study->materials,
                                                   place, warnings, problem);
            if (one != STATUS_OK && one != STATUS_INVALID)
                return one;
            status = status == STATUS_OK ? one : status;
        }
    }
    return status;
}

// The materials that came with the sweep are validated, those of the scene and of the axes are
// resolved once and kept; then the records.
static Status sweep_resolve_names(Db *db, StudyRequest *inquiry, Warnings *warnings,
                                  Problem *problem) {
    SweepStudy *study = (SweepStudy *)(void *)inquiry->study;
    Status status = STATUS_OK;
    for (size_t i = 0; i < study->materials.count && problem->count < PROBLEM_FAULTS; i++) {
        char place[64];
        snprintf(place, sizeof place, "/study/materials/%zu", i);
        const Status one = resolve_buffer(db, &study->materials.at[i], place, warnings, problem);
        if (one != STATUS_OK && one != STATUS_INVALID)
            return one;
        status = status == STATUS_OK ? one : status;
    }
    for (size_t i = 0; i < 3 * inquiry->simulation.scene.dampers.count; i++) {
        const Damper *damper = &inquiry->simulation.scene.dampers.at[i / 3];
        const Buffer *const sides[] = {&damper->buffer, &damper->left_buffer,
                                       &damper->right_buffer};
        if (sides[i % 3]->material != NULL)
            TRY(sweep_pin(&study->materials, sides[i % 3]));
    }
    const Status axes = sweep_resolve_axes(db, study, warnings, problem);
    if (axes != STATUS_OK && axes != STATUS_INVALID)
        return axes;
    const Status records = resolve_sweep_records(db, inquiry, problem);
    if (records != STATUS_OK && records != STATUS_INVALID)
        return records;
    return status != STATUS_OK ? status : axes != STATUS_OK ? axes : records;
}

// In place of study_request_complete for a sweep. The fault of an unknown name on an axis is
// reported beside those of the other values, and replaces what the same name leads to there.
static Status sweep_resolve(Db *db, StudyRequest *inquiry, const SimulationLimits *limits,
                            Warnings *warnings, Problem *problem) {
    Problem *names = calloc(1, sizeof *names), *rest = calloc(1, sizeof *rest);
    Status status = STATUS_NO_MEMORY;
    if (names != NULL && rest != NULL) {
        status = sweep_resolve_names(db, inquiry, warnings, names);
        // If the scene has faults of its own, the axes are validated with it.
        const bool has_own = problem->count > 0;
        if (status == STATUS_LIMIT || names->count >= PROBLEM_FAULTS) {
            status = STATUS_INVALID; // names that were not looked up are not validated further
        } else if (status == STATUS_OK || status == STATUS_INVALID) {
            const Status resolved = status;
            status = study_request_complete(inquiry, limits, warnings, has_own ? problem : rest);
            status = resolved != STATUS_OK ? resolved : status;
        }
        for (size_t i = 0; i < names->count && i < PROBLEM_FAULTS; i++)
            problem_add_fault(problem, STATUS_INVALID, &names->faults[i]);
        for (size_t i = 0; i < rest->count && i < PROBLEM_FAULTS; i++)
            problem_add_fault(problem, rest->status, &rest->faults[i]);
        if (status != STATUS_OK && problem->count == 0)
            problem_set(problem, status, "%s",
                        names->status != STATUS_OK ? names->detail : rest->detail);
        if (names->count + rest->count > problem->count && problem->count >= PROBLEM_FAULTS)
            problem->count = names->count + rest->count;
    }
    free(names);
    free(rest);
    return status;
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
            status = sweep_resolve(db, inquiry, limits, warnings, problem);
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
