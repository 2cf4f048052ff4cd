// A scene's text made ready: read, its materials' names turned into numbers, judged and completed,
// and its id; the same for who only asks what it would be.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/base/pointer.h"
#include "core/study/sweep.h"
#include "server/base/bytes.h"
#include "server/base/digest.h"
#include "server/codec/read.h"
#include "server/jobs/intake_state.h"
#include "server/jobs/prepare_record.h"
#include "server/store/material_rows.h"

// "slug" or "slug@revision"; false if what stands behind @ is no revision.
static bool split_name(const char *name, char slug[128], uint64_t *revision) {
    const char *at = strchr(name, '@');
    const size_t length = at == NULL ? strlen(name) : (size_t)(at - name);
    *revision = 0;
    if (length == 0 || length >= 128)
        return false;
    memcpy(slug, name, length);
    slug[length] = '\0';
    if (at == NULL)
        return true;
    if (at[1] < '1' || at[1] > '9' || strlen(at + 1) > 9)
        return false;
    char *end;
    *revision = strtoull(at + 1, &end, 10);
    return *end == '\0';
}

// "no material is called ..., there are: ...", with the nearest one suggested.
static Status refuse_unknown(Store *store, const char *name, const char *slug, const char *pointer,
                             Problem *problem) {
    Fault fault = {.detail = ""};
    MaterialRevisions known = {NULL, 0};
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_quote(fault.value, sizeof fault.value, name);
    char short_name[80], list[200] = "";
    text_fit(short_name, sizeof short_name, name);
    if (store_materials(store, &known, NULL) == STATUS_OK && known.count > 0) {
        const char **slugs = calloc(known.count + 1, sizeof *slugs);
        size_t used = 0;
        for (size_t i = 0; i < known.count; i++) {
            if (slugs != NULL)
                slugs[i] = known.at[i].slug;
            if (used < sizeof list)
                used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", i > 0 ? ", " : "",
                                         known.at[i].slug);
        }
        const char *nearest = slugs == NULL ? NULL : texts_nearest(slugs, slug);
        if (nearest != NULL)
            text_fit(fault.did_you_mean, sizeof fault.did_you_mean, nearest);
        free(slugs);
    }
    material_revisions_clear(&known);
    snprintf(fault.detail, sizeof fault.detail, "no material is called \"%s\"%s%s", short_name,
             list[0] != '\0' ? "; there are " : "", list);
    return problem_put(problem, STATUS_INVALID, &fault);
}

// The slug is known, the revision is not.
static Status refuse_revision(const MaterialRevision *head, const char *name, const char *pointer,
                              Problem *problem) {
    Fault fault = {.detail = ""};
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_quote(fault.value, sizeof fault.value, name);
    snprintf(fault.did_you_mean, sizeof fault.did_you_mean, "%.40s@%llu", head->slug,
             (unsigned long long)head->revision);
    snprintf(fault.detail, sizeof fault.detail,
             "the material %.64s has no such revision; its head is %s", head->slug,
             fault.did_you_mean);
    return problem_put(problem, STATUS_INVALID, &fault);
}

// A number that came beside the name must be the revision's.
static Status match(double *given, double known, const char *pointer, const char *member,
                    const char *unit, const char *name, Problem *problem) {
    if (isnan(*given) || *given == known) {
        *given = known;
        return STATUS_OK;
    }
    char place[sizeof((Fault){0}.pointer)], is[32], is_known[32];
    pointer_join(place, sizeof place, pointer, member);
    text_real(is, *given);
    if (isnan(known))
        text_fit(is_known, sizeof is_known, "none");
    else
        text_real(is_known, known);
    return problem_add_real(problem, STATUS_INVALID, place, *given, unit,
                            "is %s, but %s has %s: leave one of them out", is, name, is_known);
}

static Status fill(Buffer *buffer, const MaterialRevision *material, const char *pointer,
                   Warnings *warnings, Problem *problem) {
    char name[160];
    snprintf(name, sizeof name, "%s@%llu", material->slug, (unsigned long long)material->revision);
    // Under impulse a canonical scene has no contact time: completion leaves it out again.
    Status status = match(&buffer->restitution, material->material.restitution, pointer, "restitution", NULL,
                          name, problem);
    const Status second = match(&buffer->contact_time, material->material.contact_time, pointer,
                                "contact_time", "s", name, problem);
    if (status != STATUS_OK || second != STATUS_OK)
        return STATUS_INVALID;
    if (strcmp(material->status, "draft") == 0)
        TRY(warnings_add(warnings, pointer, "%s is a draft that nobody has approved", name));
    if (strcmp(material->status, "deprecated") == 0)
        TRY(warnings_add(warnings, pointer, "%s is deprecated", name));
    char *text = strdup(name);
    if (text == NULL)
        return STATUS_NO_MEMORY;
    free(buffer->material);
    buffer->material = text;
    return STATUS_OK;
}

static Status resolve(Store *store, Buffer *buffer, const char *pointer, Warnings *warnings,
                      Problem *problem) {
    char slug[128];
    uint64_t revision;
    MaterialRevision material = {0};
    if (buffer->material == NULL)
        return STATUS_OK;
    if (!split_name(buffer->material, slug, &revision))
        return refuse_unknown(store, buffer->material, buffer->material, pointer, problem);
    Status status = store_material(store, slug, revision, &material, NULL);
    if (status == STATUS_NOT_FOUND && revision > 0 &&
        store_material(store, slug, 0, &material, NULL) == STATUS_OK)
        status = refuse_revision(&material, buffer->material, pointer, problem);
    else if (status == STATUS_NOT_FOUND)
        status = refuse_unknown(store, buffer->material, slug, pointer, problem);
    else if (status == STATUS_OK)
        status = fill(buffer, &material, pointer, warnings, problem);
    else
        status =
            problem_set(problem, status, "the material \"%.80s\" could not be looked up", slug);
    material_revision_clear(&material);
    return status;
}

static Status resolve_all(Store *store, Simulation *simulation, Warnings *warnings,
                          Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < simulation->scene.dampers.count; i++) {
        Damper *damper = &simulation->scene.dampers.at[i];
        Buffer *const buffers[] = {&damper->buffer, &damper->left_buffer, &damper->right_buffer};
        static const char *const names[] = {"buffer", "left_buffer", "right_buffer"};
        for (size_t j = 0; j < COUNT(buffers); j++) {
            char pointer[64];
            snprintf(pointer, sizeof pointer, "/dampers/%zu/%s", i, names[j]);
            const Status one = resolve(store, buffers[j], pointer, warnings, problem);
            if (one != STATUS_OK && one != STATUS_INVALID)
                return one;
            if (one != STATUS_OK)
                status = one;
        }
    }
    return status;
}

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
    if (fields_default(buffer_fields, pinned) != STATUS_OK)
        return STATUS_NO_MEMORY;
    materials->count++;
    pinned->restitution = buffer->restitution;
    pinned->contact_time = buffer->contact_time;
    pinned->material = strdup(buffer->material);
    return pinned->material != NULL ? STATUS_OK : STATUS_NO_MEMORY;
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
static Status resolve_value(Store *store, char **value, Buffers *materials, const char *place,
                            Warnings *warnings, Problem *problem) {
    Buffer buffer;
    Scalar scalar;
    char *room = malloc(strlen(*value) + 1);
    if (room == NULL || fields_default(buffer_fields, &buffer) != STATUS_OK) {
        free(room);
        return STATUS_NO_MEMORY;
    }
    Status status = STATUS_OK;
    if (scalar_read(*value, &scalar, room) && scalar.kind == SCALAR_TEXT) {
        buffer.material = room;
        room = NULL;
        status = resolve(store, &buffer, place, warnings, problem);
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

static Status resolve_axes(Store *store, SweepStudy *study, Warnings *warnings, Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < study->axes.count; i++) {
        const SweepAxis *axis = &study->axes.at[i];
        for (size_t k = 0; k < axis->values.count && takes_materials(axis->pointer); k++) {
            char place[96];
            snprintf(place, sizeof place, "/study/axes/%zu/values/%zu", i, k);
            const Status one = resolve_value(store, &axis->values.at[k], &study->materials, place,
                                             warnings, problem);
            if (one != STATUS_OK && one != STATUS_INVALID)
                return one;
            status = status == STATUS_OK ? one : status;
        }
    }
    return status;
}

// Behind resolve_all: materials that were pinned are what the store says, those of the scene are
// pinned, and those of the axes found and pinned.
static Status resolve_sweep(Store *store, Inquiry *inquiry, Warnings *warnings, Problem *problem) {
    SweepStudy *study = (SweepStudy *)(void *)inquiry->study;
    Status status = STATUS_OK;
    for (size_t i = 0; i < study->materials.count; i++) {
        char place[64];
        snprintf(place, sizeof place, "/study/materials/%zu", i);
        const Status one = resolve(store, &study->materials.at[i], place, warnings, problem);
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
    const Status axes = resolve_axes(store, study, warnings, problem);
    if (axes != STATUS_OK && axes != STATUS_INVALID)
        return axes;
    const Status records = prepare_sweep_records(store, inquiry, problem);
    if (records != STATUS_OK && records != STATUS_INVALID)
        return records;
    return status != STATUS_OK ? status : axes != STATUS_OK ? axes : records;
}

// An axis's unknown name is no reason to leave the other values unjudged: its fault is told beside
// theirs, and in place of what the same name leads to there.
static Status complete_sweep(Store *store, Inquiry *inquiry, const SimulationLimits *limits,
                             Warnings *warnings, Problem *problem) {
    Problem *names = calloc(1, sizeof *names), *rest = calloc(1, sizeof *rest);
    Status status = STATUS_NO_MEMORY;
    if (names != NULL && rest != NULL) {
        status = resolve_sweep(store, inquiry, warnings, names);
        // Where the scene has faults they are judged with it, as ever.
        const bool has_own = problem->count > 0;
        if (status == STATUS_OK || status == STATUS_INVALID) {
            const Status resolved = status;
            status = inquiry_complete(inquiry, limits, warnings, has_own ? problem : rest);
            status = resolved != STATUS_OK ? resolved : status;
        }
        for (size_t i = 0; i < names->count && i < PROBLEM_FAULTS; i++)
            problem_put(problem, STATUS_INVALID, &names->faults[i]);
        for (size_t i = 0; i < rest->count && i < PROBLEM_FAULTS; i++)
            problem_put(problem, rest->status, &rest->faults[i]);
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

Status intake_prepare(Store *store, const char *text, size_t size, const SimulationLimits *limits,
                      Inquiry *inquiry, Warnings *warnings, Problem *problem) {
    // All three add to one problem: what could not be read is judged no further, the rest is.
    Problem *own = NULL;
    if (problem == NULL && (problem = own = calloc(1, sizeof *own)) == NULL)
        return STATUS_NO_MEMORY;
    Status status = read_json(text, size, inquiry_fields, inquiry, problem);
    const bool is_object = problem->count == 0 || problem->faults[0].pointer[0] != '\0';
    if (is_object && (status == STATUS_OK || status == STATUS_INVALID)) {
        Status resolved = resolve_all(store, &inquiry->simulation, warnings, problem);
        const Status record = prepare_record(store, &inquiry->simulation, problem);
        if (resolved == STATUS_OK || (record != STATUS_OK && record != STATUS_INVALID))
            resolved = record;
        if (resolved != STATUS_OK && resolved != STATUS_INVALID)
            status = resolved;
        else if (inquiry->study != NULL && study_kind(inquiry->study) == &study_sweep)
            status = complete_sweep(store, inquiry, limits, warnings, problem);
        else
            status = inquiry_complete(inquiry, limits, warnings, problem);
        if (status == STATUS_OK)
            status = resolved;
    }
    free(own);
    return status;
}

void intake_result_id(const Inquiry *inquiry, char target[72]) {
    char hex[65];
    Digest *digest = digest_new();
    target[0] = '\0';
    if (digest == NULL)
        return;
    digest_take(digest, engine_version, strlen(engine_version) + 1);
    canonical_write(inquiry_fields, inquiry, digest_take, digest);
    digest_end(digest, hex);
    snprintf(target, 72, "r-%s", hex);
}

void dry_run_clear(DryRun *dry_run) {
    inquiry_clear(&dry_run->inquiry);
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
    TRY(inquiry_cost(&dry_run->inquiry, &intake->settings.limits, &dry_run->cost, problem));
    dry_run->is_cached = store_result_exists(intake->store, dry_run->result);
    return STATUS_OK;
}
