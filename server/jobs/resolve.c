// A scene's text made ready: read, its names of materials and records resolved, validated and
// completed, and its id; and the same for a dry run.
//
// A material's name becomes that of a revision, with its values; a record's name stays, with the
// digest of its samples beside it, so that the same scene always means the same samples, also when
// a record of that name was deleted and another one uploaded. A study keeps the values of every
// material and the samples of every record that it names: its runs are made without a database.
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "core/study/axis.h"
#include "server/db/materials.h"
#include "server/db/records.h"
#include "server/jobs/jobs_private.h"
#include "server/json/parse.h"
#include "server/util/sha256.h"

enum {
    // Planning takes storeys^3 operations and more, and nothing stops it: from LARGE_STOREYS on
    // (some milliseconds) a request needs a place, so that others are answered meanwhile.
    LARGE_STOREYS = 40,
    LARGE_PLACES = 4,
    SUGGESTED = 10,         // faults that list the names there are
    RECORDS_LISTED = 1000,  // names among which the nearest one is searched
    STUDY_SAMPLES = 1 << 24 // of all records that one study names, in memory as long as it runs
};

// Keeps the first fault of the scene; false for what ends the walk.
static bool resolve_continues(Status one, Status *status) {
    const bool continues = one == STATUS_OK || one == STATUS_INVALID;
    if (*status == STATUS_OK || !continues)
        *status = one;
    return continues;
}

static Fault resolve_fault(const char *pointer, const char *value) {
    Fault fault = {.detail = ""};
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_quote(fault.value, sizeof fault.value, value);
    return fault;
}

// Lists the names there are, one in each element of `at`, and suggests the nearest one to `name`.
static void resolve_suggest(Fault *fault, const char *name, const void *at, size_t count,
                            size_t element_size, size_t name_offset, char *list, size_t size) {
    const char **names = calloc(count + 1, sizeof *names); // NULL behind the last one
    for (size_t i = 0; names != NULL && i < count; i++) {
        const char *place = (const char *)at + i * element_size + name_offset;
        names[i] = *(const char *const *)(const void *)place;
        text_list(list, size, names[i]);
    }
    const char *nearest = names == NULL ? NULL : spelling_nearest(names, name);
    if (nearest != NULL)
        text_fit(fault->did_you_mean, sizeof fault->did_you_mean, nearest);
    free(names);
}

static Status material_refuse_unknown(Db *db, const char *name, const char *slug,
                                      const char *pointer, Problem *problem) {
    Fault fault = resolve_fault(pointer, name);
    Texts slugs;
    char short_name[80], list[160] = "";
    text_fit(short_name, sizeof short_name, name);
    if (problem->count < SUGGESTED && db_material_slugs(db, &slugs, NULL) == STATUS_OK) {
        resolve_suggest(&fault, slug, slugs.at, slugs.count, sizeof *slugs.at, 0, list,
                        sizeof list);
        material_slugs_clear(&slugs);
    }
    snprintf(fault.detail, sizeof fault.detail, "no material is called \"%s\"%s%s%s", short_name,
             list[0] != '\0' ? "; there are " : "", list,
             db_is_private(db) ? "; a name with its numbers may be any" : "");
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

// Why a name stands for no revision: it is no material's, or the material has none of that number,
// or, where the name has none, all of them are deprecated.
static Status material_refuse(Db *db, const char *name, const char *slug, uint64_t revision,
                              const char *pointer, Problem *problem) {
    MaterialRevision found = {0};
    if (problem->count >= PROBLEM_FAULTS) // is counted alone
        return problem_add(problem, STATUS_INVALID, pointer, "is not there");
    Status status = db_material(db, slug, 0, &found, NULL);
    const bool has_head = status == STATUS_OK;
    if (status == STATUS_NOT_FOUND)
        status = db_material(db, slug, 1, &found, NULL);
    if (status == STATUS_OK) {
        Fault fault = resolve_fault(pointer, name);
        snprintf(fault.did_you_mean, sizeof fault.did_you_mean, "%.40s@%llu", found.slug,
                 (unsigned long long)(has_head ? found.revision : found.latest));
        if (has_head || revision > 0)
            snprintf(fault.detail, sizeof fault.detail,
                     "the material %.64s has no such revision; its %s is %s", found.slug,
                     has_head ? "head" : "newest revision", fault.did_you_mean);
        else
            snprintf(fault.detail, sizeof fault.detail,
                     "every revision of the material %.64s is deprecated: name one, %s, to use it "
                     "all the same",
                     found.slug, fault.did_you_mean);
        status = problem_add_fault(problem, STATUS_INVALID, &fault);
    } else if (status == STATUS_NOT_FOUND) {
        status = material_refuse_unknown(db, name, slug, pointer, problem);
    }
    material_revision_clear(&found);
    return status;
}

static Status material_add_fault(const char *pointer, const char *member, const char *detail,
                                 const char *name, Problem *problem) {
    char place[sizeof((Fault){0}.pointer)];
    json_pointer_join(place, sizeof place, pointer, member);
    return problem_add(problem, STATUS_INVALID, place, detail, name);
}

// A value that came beside the name, and the revision's.
typedef struct MaterialValue {
    const char *member, *unit;
    double *given, stored;
} MaterialValue;

// They must be the same; one that was not given becomes the revision's.
static Status material_match(const MaterialValue *values, size_t count, const char *pointer,
                             const char *name, Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < count; i++) {
        const MaterialValue *value = &values[i];
        char place[sizeof((Fault){0}.pointer)];
        if (isnan(*value->given) || *value->given == value->stored) {
            *value->given = value->stored;
            continue;
        }
        json_pointer_join(place, sizeof place, pointer, value->member);
        status = problem_add_real(problem, STATUS_INVALID, place, *value->given, value->unit,
                                  "is %s, but %s has %s: leave one of them out",
                                  real_text(*value->given).at, name,
                                  isnan(value->stored) ? "none" : real_text(value->stored).at);
    }
    return status;
}

// A table that came beside the name: row by row the revision's.
static Status material_match_table(ContactRows *given, const MaterialRows *stored,
                                   const char *pointer, const char *name, Problem *problem) {
    char table[sizeof((Fault){0}.pointer)], place[sizeof table];
    Status status = STATUS_OK;
    if (given->count != stored->count)
        return material_add_fault(pointer, "table",
                                  "is not that of %s, which has another number of rows: leave one "
                                  "of them out",
                                  name, problem);
    json_pointer_join(table, sizeof table, pointer, "table");
    for (size_t i = 0; i < stored->count; i++) {
        ContactRow *row = &given->at[i];
        const MaterialRow *wanted = &stored->at[i];
        json_pointer_index(place, sizeof place, table, i);
        const MaterialValue values[] = {
            {"approach_speed", "m/s", &row->approach_speed, wanted->approach_speed},
            {"restitution", NULL, &row->restitution, wanted->restitution},
            {"contact_time", "s", &row->contact_time, wanted->contact_time}};
        (void)resolve_continues(material_match(values, COUNT(values), place, name, problem),
                                &status);
    }
    return status;
}

static Status material_copy_table(const MaterialRows *stored, ContactRows *rows) {
    rows->at = calloc(stored->count, sizeof *rows->at);
    if (rows->at == NULL)
        return STATUS_NO_MEMORY;
    for (; rows->count < stored->count; rows->count++) {
        const MaterialRow *row = &stored->at[rows->count];
        rows->at[rows->count] =
            (ContactRow){row->approach_speed, row->restitution, row->contact_time};
    }
    return STATUS_OK;
}

// Numbers, or a table in their place. Under impulse a canonical scene has no contact time:
// completion leaves it out again.
static Status material_fill_values(Buffer *buffer, const Material *material, const char *pointer,
                                   const char *name, Problem *problem) {
    const MaterialValue values[] = {
        {"restitution", NULL, &buffer->restitution, material->restitution},
        {"contact_time", "s", &buffer->contact_time, material->contact_time}};
    TRY(material_match(values, COUNT(values), pointer, name, problem));
    if (material->table.count == 0 && buffer->table.count > 0)
        return material_add_fault(pointer, "table",
                                  "must be left out: %s has no table, its restitution and contact "
                                  "time hold for every approach speed",
                                  name, problem);
    if (material->table.count == 0)
        return STATUS_OK;
    return buffer->table.count == 0
               ? material_copy_table(&material->table, &buffer->table)
               : material_match_table(&buffer->table, &material->table, pointer, name, problem);
}

// Relative; NAN: unknown.
static double material_deviation(double deviation, double value) {
    return value > 0 ? deviation / value : (double)NAN;
}

// The same of a table: the root mean square of the rows where it is known.
static double material_table_deviation(const MaterialRows *rows, bool is_contact_time) {
    double sum = 0;
    size_t count = 0;
    for (size_t i = 0; i < rows->count; i++) {
        const MaterialRow *row = &rows->at[i];
        const double part = is_contact_time
                                ? material_deviation(row->contact_time_deviation, row->contact_time)
                                : material_deviation(row->restitution_deviation, row->restitution);
        sum += isnan(part) ? 0 : part * part;
        count += isnan(part) ? 0 : 1;
    }
    return count > 0 ? sqrt(sum / (double)count) : (double)NAN;
}

static void material_fill_test(BufferTest *test, const Material *material) {
    const bool has_table = material->table.count > 0;
    material_speed_range(material, &test->least_speed, &test->most_speed);
    test->impactor_mass = material->impactor_mass;
    test->base_mass = material->base == MATERIAL_BASE_FIXED  ? (double)INFINITY
                      : material->base == MATERIAL_BASE_FREE ? material->base_mass
                                                             : (double)NAN;
    test->restitution_deviation =
        has_table ? material_table_deviation(&material->table, false)
                  : material_deviation(material->restitution_deviation, material->restitution);
    test->contact_time_deviation =
        has_table ? material_table_deviation(&material->table, true)
                  : material_deviation(material->contact_time_deviation, material->contact_time);
}

static Status material_warn(const MaterialRevision *found, const char *name, const char *pointer,
                            Warnings *warnings) {
    if (strcmp(found->status, "draft") == 0)
        return warnings_add(warnings, pointer, "%s is a draft that has not been approved", name);
    if (strcmp(found->status, "deprecated") != 0)
        return STATUS_OK;
    char reason[200] = "";
    if (found->reason != NULL)
        text_fit(reason, sizeof reason, found->reason);
    return warnings_add(warnings, pointer, "%s is deprecated%s%s", name,
                        reason[0] != '\0' ? ": " : "", reason);
}

static Status material_fill(Buffer *buffer, const MaterialRevision *found, const char *pointer,
                            Warnings *warnings, Problem *problem) {
    char name[160];
    snprintf(name, sizeof name, "%s@%llu", found->slug, (unsigned long long)found->revision);
    TRY(material_fill_values(buffer, &found->material, pointer, name, problem));
    material_fill_test(&buffer->test, &found->material);
    TRY(material_warn(found, name, pointer, warnings));
    char *text = strdup(name);
    if (text == NULL)
        return STATUS_NO_MEMORY;
    free(buffer->material);
    buffer->material = text;
    return STATUS_OK;
}

// "slug" or "slug@revision"; false if what stands behind @ is no revision.
static bool material_split_name(const char *name, char slug[128], uint64_t *revision) {
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

// A buffer that names a material gets "slug@revision", its values and the test they are from.
static Status resolve_buffer(Db *db, Buffer *buffer, const char *pointer, Warnings *warnings,
                             Problem *problem) {
    char slug[128];
    uint64_t revision;
    SharedRevision *found = NULL;
    if (buffer->material == NULL)
        return STATUS_OK;
    if (!material_split_name(buffer->material, slug, &revision))
        return material_refuse_unknown(db, buffer->material, buffer->material, pointer, problem);
    Status status = db_material_shared(db, slug, revision, &found, NULL);
    if (status == STATUS_OK)
        status = material_fill(buffer, &found->revision, pointer, warnings, problem);
    else if (status == STATUS_NOT_FOUND && db_is_private(db) &&
             (!isnan(buffer->restitution) || buffer->table.count > 0))
        status = warnings_add(warnings, pointer,
                              "%.80s is not a built-in material: the numbers given with the "
                              "name are used",
                              buffer->material);
    else if (status == STATUS_NOT_FOUND)
        status = material_refuse(db, buffer->material, slug, revision, pointer, problem);
    if (found != NULL)
        refcount_unref(&found->refcount);
    if (status != STATUS_OK && status != STATUS_INVALID)
        problem_set(problem, status, "the material \"%.80s\" could not be looked up: %s", slug,
                    status_title(status));
    return status;
}

// The buffers of a damper: of both stops, of the left one, of the right one.
static Buffer *dampers_buffer(const Dampers *dampers, size_t index) {
    Damper *damper = &dampers->at[index / 3];
    return index % 3 == 0   ? &damper->buffer
           : index % 3 == 1 ? &damper->left_buffer
                            : &damper->right_buffer;
}

static Status resolve_materials(Db *db, const Dampers *dampers, Warnings *warnings,
                                Problem *problem) {
    static const char *const names[] = {"buffer", "left_buffer", "right_buffer"};
    Status status = STATUS_OK;
    for (size_t i = 0; i < 3 * dampers->count; i++) {
        char pointer[64];
        snprintf(pointer, sizeof pointer, "/dampers/%zu/%s", i / 3, names[i % 3]);
        if (!resolve_continues(
                resolve_buffer(db, dampers_buffer(dampers, i), pointer, warnings, problem),
                &status))
            break;
    }
    return status;
}

static Status record_refuse_unknown(Db *db, const char *name, const char *pointer,
                                    Problem *problem) {
    Fault fault = resolve_fault(pointer, name);
    RecordRows records = {NULL, 0};
    char short_name[80], list[160] = "";
    text_fit(short_name, sizeof short_name, name);
    if (db_is_private(db)) {
        snprintf(fault.detail, sizeof fault.detail,
                 "\"%s\" is a record of a server, and there is none here: give its file (--record "
                 "FILE), or put the samples into the scene (impactd import FILE), or send it to a "
                 "server (impactd submit)",
                 short_name);
        return problem_add_fault(problem, STATUS_INVALID, &fault);
    }
    const bool is_listed = problem->count < SUGGESTED;
    if (is_listed && db_records(db, NULL, "", RECORDS_LISTED, &records, NULL) == STATUS_OK)
        resolve_suggest(&fault, name, records.at, records.count, sizeof *records.at,
                        offsetof(RecordRow, name), list, sizeof list);
    snprintf(fault.detail, sizeof fault.detail, "no record is called \"%s\"%s%s", short_name,
             !is_listed          ? ""
             : records.count > 0 ? "; there are "
                                 : "; there are none: POST one to /v1/records",
             list);
    record_rows_clear(&records);
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

// `pointer` is where the name stands, `place` where a digest would. *named is a reference.
static Status record_find(Db *db, const char *name, const char *digest, const char *pointer,
                          const char *place, NamedRecord **named, Problem *problem) {
    *named = NULL;
    const Status status =
        record_name_is_sound(name) ? db_record_named(db, name, named, NULL) : STATUS_NOT_FOUND;
    if (status == STATUS_NOT_FOUND)
        return record_refuse_unknown(db, name, pointer, problem);
    if (status != STATUS_OK)
        return problem_set(problem, status, "the record \"%.64s\" could not be looked up: %s", name,
                           status_title(status));
    if (digest == NULL || strcmp(digest, (*named)->digest) == 0)
        return STATUS_OK;
    Fault fault = resolve_fault(place, digest);
    snprintf(fault.detail, sizeof fault.detail,
             "is not that of the record \"%s\", which is %.16s...: the one that the scene was made "
             "with has been deleted; without a digest this one is taken",
             (*named)->name, (*named)->digest);
    refcount_unref(&(*named)->shared);
    *named = NULL;
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

static ExcitationRecord *request_record(const StudyRequest *request) {
    Excitation *excitation = (Excitation *)(void *)request->simulation.scene.excitation;
    if (excitation == NULL || excitation_kind(excitation) != &excitation_record)
        return NULL;
    ExcitationRecord *record = (ExcitationRecord *)(void *)excitation;
    return record->name != NULL ? record : NULL;
}

// All absent where the study has none.
static StudyReferences request_references(const StudyRequest *request) {
    StudyReferences references = {.axes = NULL};
    if (request->study != NULL && study_kind(request->study)->references != NULL)
        study_kind(request->study)->references(request->study, &references);
    return references;
}

// Record i of those that a study keeps, of its axes and then its suite, with its place; NULL: no
// more.
static PinnedRecord *references_record(const StudyReferences *references, size_t i,
                                       JsonPointer *place) {
    const PinnedRecords *suite = references->suite;
    const size_t own = references->names != NULL ? references->names->records.count : 0;
    if (i < own) {
        *place = json_pointer_at("/study/records", i);
        return &references->names->records.at[i];
    }
    if (suite == NULL || i - own >= suite->count)
        return NULL;
    *place = json_pointer_at(references->suite_place, i - own);
    return &suite->at[i - own];
}

// The scene's record, whose digest is set if it is not there.
static Status resolve_record(Db *db, const StudyRequest *request, Problem *problem) {
    ExcitationRecord *record = request_record(request);
    NamedRecord *named;
    if (record == NULL || record->named != NULL)
        return STATUS_OK;
    TRY(record_find(db, record->name, record->digest, "/excitation/name", "/excitation/digest",
                    &named, problem));
    const bool is_resolved = record_resolve(record, named);
    refcount_unref(&named->shared);
    return study_result(status_made(is_resolved), problem);
}

// A record that a study keeps, at `place`; likewise. Without a digest it may be a name alone.
static Status resolve_kept_record(Db *db, PinnedRecord *kept, const char *place, Problem *problem) {
    NamedRecord *named;
    if (kept->name == NULL || kept->named != NULL)
        return STATUS_OK; // a missing name is a fault already
    TRY(record_find(db, kept->name, kept->digest,
                    kept->digest == NULL ? place : json_pointer_of(place, "name").at,
                    json_pointer_of(place, "digest").at, &named, problem));
    kept->named = &named->shared;
    return status_made(kept->digest != NULL || (kept->digest = strdup(named->digest)) != NULL);
}

// The names in a study: of the materials and records that came with it, those of its scene, and
// those on its axes.
typedef struct NameResolver {
    Db *db;
    StudyReferences references;
    size_t samples; // of its records
    Warnings *warnings;
    Problem *problem;
} NameResolver;

// Keeps the values of a material.
static Status names_keep_material(NameResolver *names, const Buffer *buffer) {
    Buffers *materials = &names->references.names->materials;
    for (size_t i = 0; i < materials->count; i++)
        if (text_same(materials->at[i].material, buffer->material))
            return STATUS_OK;
    Buffer *at = realloc(materials->at, (materials->count + 1) * sizeof *at);
    if (at == NULL)
        return STATUS_NO_MEMORY;
    materials->at = at;
    Buffer *kept = &at[materials->count];
    TRY(fields_copy(buffer_fields, buffer, kept));
    materials->count++;
    // Other members of the scene's buffer are not the material's.
    kept->stiffness = kept->damping = kept->exponent = (double)NAN;
    return STATUS_OK;
}

// A name on an axis becomes that of a revision.
static Status names_resolve_material(NameResolver *names, const char *name, char **value,
                                     const char *place) {
    Buffer buffer;
    Bytes text = {0};
    TRY(fields_default(buffer_fields, &buffer));
    Status status = status_made((buffer.material = strdup(name)) != NULL);
    if (status == STATUS_OK)
        status = resolve_buffer(names->db, &buffer, place, names->warnings, names->problem);
    if (status == STATUS_OK)
        status = names_keep_material(names, &buffer);
    if (status == STATUS_OK) {
        bytes_json_string(&text, buffer.material);
        free(*value);
        status = status_made((*value = bytes_take(&text, NULL)) != NULL);
    }
    fields_clear(buffer_fields, &buffer);
    return status;
}

static Status names_add_samples(NameResolver *names, const Refcount *named, const char *place) {
    names->samples += ((const NamedRecord *)(const void *)named)->samples.count;
    if (names->samples <= STUDY_SAMPLES)
        return STATUS_OK;
    (void)problem_add(names->problem, STATUS_INVALID, place,
                      "names one more record than a study can hold: all of its records may have "
                      "%d samples, with this one they have %zu; take fewer at a time",
                      STUDY_SAMPLES, names->samples);
    return STATUS_LIMIT;
}

static Status names_resolve_record(NameResolver *names, const char *name, const char *place) {
    PinnedRecords *records = &names->references.names->records;
    NamedRecord *named;
    for (size_t i = 0; i < records->count; i++)
        if (text_same(records->at[i].name, name))
            return STATUS_OK;
    TRY(record_find(names->db, name, NULL, place, place, &named, names->problem));
    PinnedRecord *at = realloc(records->at, (records->count + 1) * sizeof *at);
    if (at == NULL) {
        refcount_unref(&named->shared);
        return STATUS_NO_MEMORY;
    }
    records->at = at;
    PinnedRecord *kept = &at[records->count++]; // cleared with the study, also after a failure
    *kept = (PinnedRecord){strdup(named->name), strdup(named->digest), &named->shared};
    if (kept->name == NULL || kept->digest == NULL)
        return STATUS_NO_MEMORY;
    return names_add_samples(names, kept->named, place);
}

static bool axis_names_materials(const char *pointer) {
    static const char *const materials[] = {"buffer", "left_buffer", "right_buffer", "material"};
    const char *last = strrchr(pointer, '/');
    bool names_materials = false;
    for (size_t i = 0; last != NULL && i < COUNT(materials); i++)
        names_materials = names_materials || strcmp(last + 1, materials[i]) == 0;
    return names_materials;
}

// The values of an axis that name materials or records. What is no text is for the axis to refuse.
static Status names_resolve_axis(NameResolver *names, size_t index) {
    const StudyAxis *axis = &names->references.axes->at[index];
    const char *pointer = study_axis_pointer_count(axis) > 0 ? study_axis_pointer(axis, 0) : NULL;
    const bool has_records = text_same(pointer, "/excitation/name");
    const bool has_materials = pointer != NULL && axis_names_materials(pointer);
    const JsonPointer own = json_pointer_at(names->references.axes_place, index),
                      values = json_pointer_of(own.at, "values");
    Status status = STATUS_OK, one;
    for (size_t k = 0; k < axis->values.count && (has_records || has_materials); k++) {
        char **value = &axis->values.at[k], *text = malloc(strlen(*value) + 1);
        const JsonPointer place = json_pointer_at(values.at, k);
        JsonScalar scalar;
        if (text == NULL)
            return STATUS_NO_MEMORY;
        if (names->problem->count >= PROBLEM_FAULTS) // no more are reported
            one = STATUS_LIMIT;
        else if (!json_scalar_read(*value, &scalar, text) || scalar.kind != JSON_SCALAR_TEXT)
            one = STATUS_OK;
        else
            one = has_records ? names_resolve_record(names, text, place.at)
                              : names_resolve_material(names, text, value, place.at);
        free(text);
        if (!resolve_continues(one, &status))
            break;
    }
    return status;
}

// A material that came with the study.
static Status names_resolve_kept_material(NameResolver *names, size_t index) {
    const Buffers *materials = &names->references.names->materials;
    Buffer *kept = &materials->at[index];
    const JsonPointer place = json_pointer_at("/study/materials", index);
    if (kept->material == NULL)
        return problem_add(names->problem, STATUS_INVALID, place.at, "must name a material");
    TRY(resolve_buffer(names->db, kept, place.at, names->warnings, names->problem));
    for (size_t i = 0; i < index; i++)
        if (text_same(materials->at[i].material, kept->material))
            return problem_add(names->problem, STATUS_INVALID, place.at,
                               "is listed twice, first at /study/materials/%zu", i);
    return STATUS_OK;
}

// The records that came with the study.
static Status names_resolve_records(NameResolver *names) {
    Status status = STATUS_OK;
    JsonPointer place;
    PinnedRecord *kept;
    for (size_t i = 0; (kept = references_record(&names->references, i, &place)) != NULL; i++) {
        Status one = resolve_kept_record(names->db, kept, place.at, names->problem);
        if (one == STATUS_OK && kept->named != NULL)
            one = names_add_samples(names, kept->named, place.at);
        if (!resolve_continues(one, &status))
            break;
    }
    return status;
}

// Adds all faults. STATUS_LIMIT, with a fault: not all names were looked up.
static Status names_resolve(NameResolver *names, const Dampers *dampers) {
    const StudyReferences *references = &names->references;
    const Buffers *materials = references->names != NULL ? &references->names->materials : NULL;
    Status status = STATUS_OK;
    for (size_t i = 0; materials != NULL && i < materials->count; i++)
        if (!resolve_continues(names_resolve_kept_material(names, i), &status))
            return status;
    for (size_t i = 0; materials != NULL && i < 3 * dampers->count; i++)
        if (dampers_buffer(dampers, i)->material != NULL)
            TRY(names_keep_material(names, dampers_buffer(dampers, i)));
    if (!resolve_continues(names_resolve_records(names), &status))
        return status;
    for (size_t i = 0; references->axes != NULL && i < references->axes->count; i++)
        if (!resolve_continues(names_resolve_axis(names, i), &status))
            return status;
    return status;
}

// Whether a fault lies outside of the study.
static bool problem_concerns_scene(const Problem *problem) {
    for (size_t i = 0; i < problem->count && i < PROBLEM_FAULTS; i++)
        if (strncmp(problem->faults[i].pointer, "/study/", 7) != 0)
            return true;
    return false;
}

// Resolves and completes a study with its scene. The fault of an unknown name on an axis is
// reported beside those of the other values, and replaces what the same name leads to there.
static Status study_resolve(Db *db, StudyRequest *request, const SimulationLimits *limits,
                            Warnings *warnings, Problem *problem) {
    NameResolver names = {db, request_references(request), 0, warnings, problem};
    // If the scene has faults of its own, the axes are validated with it.
    const bool has_own = problem_concerns_scene(problem);
    const Status resolved = names_resolve(&names, &request->simulation.scene.dampers);
    if (resolved == STATUS_LIMIT || problem->count >= PROBLEM_FAULTS)
        return STATUS_INVALID; // names that were not looked up are not validated further
    if (resolved != STATUS_OK && resolved != STATUS_INVALID)
        return problem_set(problem, resolved, "no memory for a scene");
    Problem *rest = calloc(1, sizeof *rest);
    if (rest == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a scene");
    const Status status =
        study_request_complete(request, limits, warnings, has_own ? problem : rest);
    for (size_t i = 0; i < rest->count && i < PROBLEM_FAULTS; i++)
        problem_add_fault(problem, rest->status, &rest->faults[i]);
    if (rest->count > PROBLEM_FAULTS) // those are counted only
        problem->count += rest->count - PROBLEM_FAULTS;
    if (status != STATUS_OK && problem->count == 0)
        problem_set(problem, status, "%s", rest->detail);
    free(rest);
    return resolved != STATUS_OK ? resolved : status;
}

void request_drop_records(StudyRequest *request) {
    ExcitationRecord *record = request_record(request);
    const StudyReferences references = request_references(request);
    JsonPointer place;
    PinnedRecord *kept;
    if (record != NULL) {
        refcount_unref(record->named);
        record->named = NULL;
    }
    for (size_t i = 0; (kept = references_record(&references, i, &place)) != NULL; i++) {
        refcount_unref(kept->named);
        kept->named = NULL;
    }
}

Status request_load_records(Db *db, StudyRequest *request, Problem *problem) {
    const StudyReferences references = request_references(request);
    JsonPointer place;
    PinnedRecord *kept;
    Status status = resolve_record(db, request, problem);
    for (size_t i = 0; (kept = references_record(&references, i, &place)) != NULL; i++)
        (void)resolve_continues(resolve_kept_record(db, kept, place.at, problem), &status);
    return status;
}

static void references_add(Bytes *lines, const char *name) {
    const size_t length = name == NULL ? 0 : strlen(name);
    for (size_t at = 0; at < lines->count;) {
        const char *line = lines->at + at;
        const size_t size = (size_t)((const char *)memchr(line, '\n', lines->count - at) - line);
        if (size == length && memcmp(line, name, length) == 0)
            return;
        at += size + 1;
    }
    if (length > 0)
        bytes_format(lines, "%s\n", name);
}

static void references_add_record(Bytes *lines, const char *name) {
    char use[RECORD_NAME_SIZE + 8];
    record_use_name(name, use);
    references_add(lines, use);
}

void references_write(Bytes *lines, const StudyRequest *request, bool has_materials) {
    const Dampers *dampers = &request->simulation.scene.dampers;
    const ExcitationRecord *record = request_record(request);
    const StudyReferences references = request_references(request);
    JsonPointer place;
    const PinnedRecord *kept;
    for (size_t i = 0; has_materials && i < 3 * dampers->count; i++)
        references_add(lines, dampers_buffer(dampers, i)->material);
    if (record != NULL)
        references_add_record(lines, record->name);
    for (size_t i = 0; (kept = references_record(&references, i, &place)) != NULL; i++)
        references_add_record(lines, kept->name);
    const Buffers *materials = references.names != NULL ? &references.names->materials : NULL;
    for (size_t i = 0; has_materials && materials != NULL && i < materials->count; i++)
        references_add(lines, materials->at[i].material);
}

bool references_next(const char **lines, ReferenceRow *row) {
    const size_t size = *lines == NULL ? 0 : strcspn(*lines, "\n");
    const size_t length = size == 0 ? 0 : strcspn(*lines, "@\n");
    *row = (ReferenceRow){.slug = ""};
    if (size == 0)
        return false;
    if (length < size && length < sizeof row->slug) {
        memcpy(row->slug, *lines, length);
        row->revision = strtoull(*lines + length + 1, NULL, 10);
    }
    *lines += size + ((*lines)[size] == '\n');
    return true;
}

// *has_place is given back by request_leave_place.
static Status request_enter_place(JobManager *manager, const StudyRequest *request, bool *has_place,
                                  Problem *problem) {
    const Scene *scene = &request->simulation.scene;
    *has_place = false;
    if (manager == NULL || scene->structure == NULL ||
        structure_storeys(scene_structure(scene)) < LARGE_STOREYS)
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

static void request_leave_place(JobManager *manager, bool has_place) {
    if (has_place)
        atomic_fetch_sub(&manager->large_plans, 1);
}

static Status request_resolve(Db *db, const SimulationLimits *limits, StudyRequest *request,
                              Warnings *warnings, Problem *problem) {
    Status status = resolve_materials(db, &request->simulation.scene.dampers, warnings, problem);
    if (status == STATUS_OK || status == STATUS_INVALID)
        (void)resolve_continues(resolve_record(db, request, problem), &status);
    if (status != STATUS_OK && status != STATUS_INVALID)
        return status;
    const Status completed =
        request->study != NULL && study_kind(request->study)->references != NULL
            ? study_resolve(db, request, limits, warnings, problem)
            : study_request_complete(request, limits, warnings, problem);
    return completed != STATUS_OK ? completed : status;
}

// `manager` NULL: not for a client.
static Status request_prepare(Db *db, JobManager *manager, const char *text, size_t size,
                              const SimulationLimits *limits, StudyRequest *request,
                              Warnings *warnings, Problem *problem) {
    // All add to one problem: what could not be read is not validated, the rest is.
    Status status = json_parse(text, size, study_request_fields, request, problem);
    const bool is_object = problem->count == 0 || problem->faults[0].pointer[0] != '\0';
    bool has_place;
    if (!is_object || (status != STATUS_OK && status != STATUS_INVALID))
        return status;
    TRY(request_enter_place(manager, request, &has_place, problem));
    const Status resolved = request_resolve(db, limits, request, warnings, problem);
    request_leave_place(manager, has_place);
    return resolved != STATUS_OK ? resolved : status;
}

Status jobs_prepare(Db *db, const char *text, size_t size, const SimulationLimits *limits,
                    StudyRequest *request, Warnings *warnings, Problem *problem) {
    return request_prepare(db, NULL, text, size, limits, request, warnings, problem);
}

Status jobs_limit_study(const StudyRequest *request, const SimulationLimits *limits, double max,
                        const char *option, Problem *problem) {
    Cost cost;
    if (request->study == NULL || !(max > 0))
        return STATUS_OK;
    TRY(study_request_cost(request, limits, &cost, problem));
    if (cost.cpu_seconds <= max)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/study",
                       "would take about %.3g s of CPU in all, at most %g s are allowed by %s: %s",
                       cost.cpu_seconds, max, option, study_kind(request->study)->shorten);
}

Status jobs_prepare_request(JobManager *manager, const char *text, size_t size,
                            const SimulationLimits *limits, StudyRequest *request,
                            Warnings *warnings, Problem *problem) {
    TRY(request_prepare(manager->db, manager, text, size, limits, request, warnings, problem));
    return limits == NULL ? STATUS_OK
                          : jobs_limit_study(request, &manager->settings.limits,
                                             manager->settings.study_seconds,
                                             "--max-study-seconds of the server", problem);
}

Status jobs_result_id(const StudyRequest *request, char target[72], Problem *problem) {
    char hex[65];
    Sha256 *digest = sha256_new();
    target[0] = '\0';
    if (digest == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a digest");
    sha256_add(digest, engine_version, strlen(engine_version) + 1);
    canonical_write(study_request_fields, request, sha256_add, digest);
    sha256_end(digest, hex);
    snprintf(target, 72, "r-%s", hex);
    return STATUS_OK;
}

Status jobs_prepare_stored(Db *db, const char *scene, const char *result, StudyRequest *request,
                           bool *is_same, Problem *problem) {
    Warnings warnings = {NULL, 0};
    char id[72] = "";
    Status status = jobs_prepare(db, scene, strlen(scene), NULL, request, &warnings, problem);
    if (status == STATUS_OK)
        status = jobs_result_id(request, id, problem);
    *is_same = strcmp(id, result) == 0;
    warnings_clear(&warnings);
    return status;
}

void dry_run_clear(DryRun *dry_run) {
    study_request_clear(&dry_run->inquiry);
    warnings_clear(&dry_run->warnings);
    fields_clear(plan_report_fields, &dry_run->plan);
}

Status jobs_dry_run(JobManager *manager, const char *text, size_t size, DryRun *dry_run,
                    Problem *problem) {
    StudyRequest *request = &dry_run->inquiry;
    bool has_place;
    memset(dry_run, 0, sizeof *dry_run);
    TRY(jobs_prepare_request(manager, text, size, &manager->settings.limits, request,
                             &dry_run->warnings, problem));
    TRY(jobs_result_id(request, dry_run->result, problem));
    TRY(request_enter_place(manager, request, &has_place, problem));
    const Status status = simulation_plan(&request->simulation, &dry_run->plan, problem);
    request_leave_place(manager, has_place);
    TRY(status);
    if (scene_warnings_of_pairs(&request->simulation.scene, &dry_run->plan.derived,
                                &dry_run->warnings) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a warning");
    TRY(study_request_cost(request, &manager->settings.limits, &dry_run->cost, problem));
    dry_run->is_cached = db_result_exists(manager->db, dry_run->result);
    return STATUS_OK;
}
