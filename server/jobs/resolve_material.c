// A name is looked up once for each buffer that has it; the database caches recent ones.
#include "server/jobs/resolve_material.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "server/db/materials.h"

// The first of the faults alone tell what names there are.
enum { NAME = 160, SUGGESTED = 10 };

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
static Status refuse_unknown(Db *db, const char *name, const char *slug, const char *pointer,
                             Problem *problem) {
    Fault fault = {.detail = ""};
    Texts known;
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_quote(fault.value, sizeof fault.value, name);
    char short_name[80], list[200] = "";
    text_fit(short_name, sizeof short_name, name);
    if (problem->count < SUGGESTED && db_material_slugs(db, &known, NULL) == STATUS_OK) {
        // One more, for the NULL behind the last one.
        const char **slugs = calloc(known.count + 1, sizeof *slugs);
        for (size_t i = 0; i < known.count; i++) {
            if (slugs != NULL)
                slugs[i] = known.at[i];
            text_list(list, sizeof list, known.at[i]);
        }
        const char *nearest = slugs == NULL ? NULL : spelling_nearest(slugs, slug);
        if (nearest != NULL)
            text_fit(fault.did_you_mean, sizeof fault.did_you_mean, nearest);
        free(slugs);
        material_slugs_clear(&known);
    }
    snprintf(fault.detail, sizeof fault.detail, "no material is called \"%s\"%s%s", short_name,
             list[0] != '\0' ? "; there are " : "", list);
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

// The slug is known, the revision is not.
static Status refuse_revision(const MaterialRevision *known, const char *what, const char *name,
                              const char *pointer, Problem *problem) {
    Fault fault = {.detail = ""};
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_quote(fault.value, sizeof fault.value, name);
    snprintf(fault.did_you_mean, sizeof fault.did_you_mean, "%.40s@%llu", known->slug,
             (unsigned long long)known->revision);
    snprintf(fault.detail, sizeof fault.detail,
             "the material %.64s has no such revision; its %s is %s", known->slug, what,
             fault.did_you_mean);
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

// All that there is of it is deprecated, so that its name alone stands for nothing.
static Status refuse_deprecated(const MaterialRevision *newest, const char *pointer,
                                Problem *problem) {
    Fault fault = {.detail = ""};
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_quote(fault.value, sizeof fault.value, newest->slug);
    snprintf(fault.did_you_mean, sizeof fault.did_you_mean, "%.40s@%llu", newest->slug,
             (unsigned long long)newest->revision);
    snprintf(fault.detail, sizeof fault.detail,
             "every revision of the material %.64s is deprecated: name one, %s, to use it all the "
             "same",
             newest->slug, fault.did_you_mean);
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

// What passes, or is no fault of the scene's.
static Status refuse_for_now(const char *slug, Status status, Problem *problem) {
    return problem_set(problem, status, "the material \"%.80s\" could not be looked up", slug);
}

// Why a name stands for no revision: it is no material's, or the material has none of that number,
// or, where it names none, all of them are deprecated.
static Status refuse(Db *db, const char *name, const char *slug, uint64_t revision,
                     const char *pointer, Problem *problem) {
    MaterialRevision known = {0};
    if (problem->count >= PROBLEM_FAULTS) // is counted alone
        return problem_add(problem, STATUS_INVALID, pointer, "is not there");
    Status status = db_material(db, slug, 0, &known, NULL);
    const bool has_head = status == STATUS_OK;
    if (status == STATUS_NOT_FOUND)
        status = db_material(db, slug, 1, &known, NULL);
    if (has_head) {
        status = refuse_revision(&known, "head", name, pointer, problem);
    } else if (status == STATUS_OK) {
        known.revision = known.latest;
        status = revision > 0 ? refuse_revision(&known, "newest revision", name, pointer, problem)
                              : refuse_deprecated(&known, pointer, problem);
    } else if (status == STATUS_NOT_FOUND) {
        status = refuse_unknown(db, name, slug, pointer, problem);
    } else {
        status = refuse_for_now(slug, status, problem);
    }
    material_revision_clear(&known);
    return status;
}

// A number that came beside the name must be the revision's.
static Status match(double *given, double known, const char *pointer, const char *member,
                    const char *unit, const char *name, Problem *problem) {
    if (isnan(*given) || *given == known) {
        *given = known;
        return STATUS_OK;
    }
    char place[sizeof((Fault){0}.pointer)], is[32], is_known[32];
    json_pointer_join(place, sizeof place, pointer, member);
    text_real(is, *given);
    if (isnan(known))
        text_fit(is_known, sizeof is_known, "none");
    else
        text_real(is_known, known);
    return problem_add_real(problem, STATUS_INVALID, place, *given, unit,
                            "is %s, but %s has %s: leave one of them out", is, name, is_known);
}

static Status refuse_way(const char *pointer, const char *member, const char *detail,
                         const char *name, Problem *problem) {
    char place[sizeof((Fault){0}.pointer)];
    json_pointer_join(place, sizeof place, pointer, member);
    return problem_add(problem, STATUS_INVALID, place, detail, name);
}

// The table of a scene that is read again, or of somebody who copied it: row by row the revision's.
static Status match_table(ContactRows *given, const MaterialRows *known, const char *pointer,
                          const char *name, Problem *problem) {
    char table[sizeof((Fault){0}.pointer)];
    Status status = STATUS_OK;
    if (given->count != known->count)
        return refuse_way(pointer, "table",
                          "is not that of %s, which has another number of rows: "
                          "leave one of them out",
                          name, problem);
    json_pointer_join(table, sizeof table, pointer, "table");
    for (size_t i = 0; i < known->count; i++) {
        ContactRow *row = &given->at[i];
        const MaterialRow *wanted = &known->at[i];
        char place[sizeof((Fault){0}.pointer)];
        json_pointer_index(place, sizeof place, table, i);
        const Status faults[] = {
            match(&row->approach_speed, wanted->approach_speed, place, "approach_speed", "m/s",
                  name, problem),
            match(&row->restitution, wanted->restitution, place, "restitution", NULL, name,
                  problem),
            match(&row->contact_time, wanted->contact_time, place, "contact_time", "s", name,
                  problem),
        };
        for (size_t k = 0; k < COUNT(faults); k++)
            status = faults[k] != STATUS_OK ? faults[k] : status;
    }
    return status;
}

static Status copy_table(const MaterialRows *known, ContactRows *rows) {
    rows->at = calloc(known->count, sizeof *rows->at);
    if (rows->at == NULL)
        return STATUS_NO_MEMORY;
    for (rows->count = 0; rows->count < known->count; rows->count++) {
        const MaterialRow *row = &known->at[rows->count];
        rows->at[rows->count] =
            (ContactRow){row->approach_speed, row->restitution, row->contact_time};
    }
    return STATUS_OK;
}

// Numbers, or a table in their place. Under impulse a canonical scene has no contact time:
// completion leaves it out again.
static Status fill_numbers(Buffer *buffer, const Material *material, const char *pointer,
                           const char *name, Problem *problem) {
    const bool has_table = material->table.count > 0;
    const Status first = match(&buffer->restitution, material->restitution, pointer, "restitution",
                               NULL, name, problem);
    const Status second = match(&buffer->contact_time, material->contact_time, pointer,
                                "contact_time", "s", name, problem);
    if (first != STATUS_OK || second != STATUS_OK)
        return STATUS_INVALID;
    if (!has_table && buffer->table.count > 0)
        return refuse_way(pointer, "table",
                          "must be left out: %s has no table, its restitution "
                          "and contact time hold for every approach speed",
                          name, problem);
    if (!has_table)
        return STATUS_OK;
    return buffer->table.count == 0
               ? copy_table(&material->table, &buffer->table)
               : match_table(&buffer->table, &material->table, pointer, name, problem);
}

static double part_of(double deviation, double value) {
    return value > 0 ? deviation / value : (double)NAN;
}

// Relative, of all rows that know it together; NAN: none does.
static double mean_square(const MaterialRows *rows, bool is_contact_time) {
    double sum = 0;
    size_t count = 0;
    for (size_t i = 0; i < rows->count; i++) {
        const MaterialRow *row = &rows->at[i];
        const double part = is_contact_time
                                ? part_of(row->contact_time_deviation, row->contact_time)
                                : part_of(row->restitution_deviation, row->restitution);
        if (isnan(part))
            continue;
        sum += part * part;
        count++;
    }
    return count > 0 ? sqrt(sum / (double)count) : (double)NAN;
}

static void fill_test(BufferTest *test, const Material *material) {
    const bool has_table = material->table.count > 0;
    material_speed_range(material, &test->least_speed, &test->most_speed);
    test->impactor_mass = material->impactor_mass;
    test->base_mass = material->base == MATERIAL_BASE_FIXED  ? (double)INFINITY
                      : material->base == MATERIAL_BASE_FREE ? material->base_mass
                                                             : (double)NAN;
    test->restitution_deviation =
        has_table ? mean_square(&material->table, false)
                  : part_of(material->restitution_deviation, material->restitution);
    test->contact_time_deviation =
        has_table ? mean_square(&material->table, true)
                  : part_of(material->contact_time_deviation, material->contact_time);
}

// What others think of it, in the reviewer's words.
static Status warn_of_status(const MaterialRevision *found, const char *name, const char *pointer,
                             Warnings *warnings) {
    if (strcmp(found->status, "draft") == 0)
        return warnings_add(warnings, pointer, "%s is a draft that nobody has approved", name);
    if (strcmp(found->status, "deprecated") != 0)
        return STATUS_OK;
    char reason[200] = "";
    if (found->reason != NULL)
        text_fit(reason, sizeof reason, found->reason);
    return warnings_add(warnings, pointer, "%s is deprecated%s%s", name,
                        reason[0] != '\0' ? ": " : "", reason);
}

static Status fill(Buffer *buffer, MaterialRevision *found, const char *pointer, Warnings *warnings,
                   Problem *problem) {
    char name[NAME];
    snprintf(name, sizeof name, "%s@%llu", found->slug, (unsigned long long)found->revision);
    TRY(fill_numbers(buffer, &found->material, pointer, name, problem));
    fill_test(&buffer->test, &found->material);
    TRY(warn_of_status(found, name, pointer, warnings));
    char *text = strdup(name);
    if (text == NULL)
        return STATUS_NO_MEMORY;
    free(buffer->material);
    buffer->material = text;
    return STATUS_OK;
}

Status resolve_buffer(Db *db, Buffer *buffer, const char *pointer, Warnings *warnings,
                      Problem *problem) {
    char slug[128];
    uint64_t revision;
    MaterialRevision found = {0};
    if (buffer->material == NULL)
        return STATUS_OK;
    if (!split_name(buffer->material, slug, &revision))
        return refuse_unknown(db, buffer->material, buffer->material, pointer, problem);
    Status status = db_material(db, slug, revision, &found, NULL);
    if (status == STATUS_OK)
        status = fill(buffer, &found, pointer, warnings, problem);
    else if (status == STATUS_NOT_FOUND)
        status = refuse(db, buffer->material, slug, revision, pointer, problem);
    else
        status = refuse_for_now(slug, status, problem);
    material_revision_clear(&found);
    return status;
}

Status resolve_materials(Db *db, Simulation *simulation, Warnings *warnings, Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < simulation->scene.dampers.count; i++) {
        Damper *damper = &simulation->scene.dampers.at[i];
        Buffer *const buffers[] = {&damper->buffer, &damper->left_buffer, &damper->right_buffer};
        static const char *const names[] = {"buffer", "left_buffer", "right_buffer"};
        for (size_t j = 0; j < COUNT(buffers); j++) {
            char pointer[64];
            snprintf(pointer, sizeof pointer, "/dampers/%zu/%s", i, names[j]);
            const Status one = resolve_buffer(db, buffers[j], pointer, warnings, problem);
            if (one != STATUS_OK && one != STATUS_INVALID)
                return one;
            if (one != STATUS_OK)
                status = one;
        }
    }
    return status;
}
