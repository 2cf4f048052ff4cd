// The points of a sweep are made without a store: every material and record that the scene or an
// axis names is resolved once and pinned in the study.
#include "server/jobs/resolve_sweep.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/study/sweep.h"
#include "server/jobs/resolve_material.h"
#include "server/jobs/resolve_record.h"
#include "server/util/bytes.h"

// What the daemon knows of a material, kept in the sweep: its points need no store.
static Status pin(Buffers *materials, const Buffer *buffer) {
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
    // What else the scene says of that buffer is not the material's.
    pinned->stiffness = pinned->damping = pinned->exponent = (double)NAN;
    return STATUS_OK;
}

static bool takes_materials(const char *pointer) {
    static const char *const names[] = {"buffer", "left_buffer", "right_buffer", "material"};
    const char *last = pointer == NULL ? NULL : strrchr(pointer, '/');
    for (size_t i = 0; last != NULL && i < COUNT(names); i++)
        if (strcmp(last + 1, names[i]) == 0)
            return true;
    return false;
}

// One name of an axis: it becomes that of a revision. What is no text is for the axis to refuse.
static Status resolve_value(Db *db, char **value, Buffers *materials, const char *place,
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
            status = pin(materials, &buffer);
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

static Status resolve_axes(Db *db, SweepStudy *study, Warnings *warnings, Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < study->axes.count; i++) {
        const SweepAxis *axis = &study->axes.at[i];
        for (size_t k = 0; k < axis->values.count && takes_materials(axis->pointer); k++) {
            char place[96];
            if (problem->count >= PROBLEM_FAULTS) // no more can be told
                return STATUS_INVALID;
            snprintf(place, sizeof place, "/study/axes/%zu/values/%zu", i, k);
            const Status one =
                resolve_value(db, &axis->values.at[k], &study->materials, place, warnings, problem);
            if (one != STATUS_OK && one != STATUS_INVALID)
                return one;
            status = status == STATUS_OK ? one : status;
        }
    }
    return status;
}

// Materials that were pinned are what the store says, those of the scene are pinned, and those of
// the axes found and pinned.
static Status resolve_sweep(Db *db, StudyRequest *inquiry, Warnings *warnings, Problem *problem) {
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
            TRY(pin(&study->materials, sides[i % 3]));
    }
    const Status axes = resolve_axes(db, study, warnings, problem);
    if (axes != STATUS_OK && axes != STATUS_INVALID)
        return axes;
    const Status records = resolve_sweep_records(db, inquiry, problem);
    if (records != STATUS_OK && records != STATUS_INVALID)
        return records;
    return status != STATUS_OK ? status : axes != STATUS_OK ? axes : records;
}

// An axis's unknown name is no reason to leave the other values unjudged: its fault is told beside
// theirs, and in place of what the same name leads to there.
Status resolve_sweep_axes(Db *db, StudyRequest *inquiry, const SimulationLimits *limits,
                          Warnings *warnings, Problem *problem) {
    Problem *names = calloc(1, sizeof *names), *rest = calloc(1, sizeof *rest);
    Status status = STATUS_NO_MEMORY;
    if (names != NULL && rest != NULL) {
        status = resolve_sweep(db, inquiry, warnings, names);
        // Where the scene has faults they are judged with it, as ever.
        const bool has_own = problem->count > 0;
        if (status == STATUS_LIMIT || names->count >= PROBLEM_FAULTS) {
            status = STATUS_INVALID; // told; names that were not looked up are judged no further
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
