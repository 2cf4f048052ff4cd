// Measurements: those that are there say the same, the others continue. One without a number is
// there where its test is, to the byte.
#include "server/db/material_import_context.h"

#include <stdlib.h>
#include <string.h>

// Those of a group without a number, by document.
typedef struct Unnumbered {
    const char **documents;
    bool *are_there;
    size_t count;
} Unnumbered;

static Status compare_measurement(const ImportContext *context, Sqlite *database,
                                  const ImportMeasurement *ours, MaterialGroup *group,
                                  Problem *problem) {
    static const char sql[] =
        "SELECT t.* FROM materials m JOIN material_measurements t ON t.material = m.number "
        "WHERE m.slug = :slug AND t.measurement = :number";
    const RowInfo *mark = &ours->mark;
    MaterialMeasurement there = {0};
    TRY(import_load(database, sql, group->slug, ours->made.measurement,
                    material_measurement_columns, &there, problem));
    const size_t faults = context->faults->count;
    const ImportOrigin is = {ours->made.author, ours->made.comment, ours->made.created_unix_ms},
                       was = {there.author, there.comment, there.created_unix_ms};
    import_compare_origin(context, mark, "measurement", &is, &was);
    if (ours->made.document != NULL && !text_same(ours->made.document, there.document))
        (void)import_fault(context, mark->place, "test",
                           "is not the measurement %llu that is there, and those never change",
                           (unsigned long long)ours->made.measurement);
    material_measurement_clear(&there);
    group->measurements_done.same += context->faults->count == faults;
    return STATUS_OK;
}

static Status add_measurement(ImportContext *context, Sqlite *database,
                              const ImportMeasurement *ours, MaterialGroup *group,
                              Problem *problem) {
    const RowInfo *mark = &ours->mark;
    import_validate_origin(context, mark, ours->made.author, ours->made.created_unix_ms);
    group->measurements_done.added++;
    if (!context->writes || context->faults->count > 0)
        return STATUS_OK;
    MaterialMeasurement made = ours->made;
    made.measurement = group->last_measurement;
    made.author = (char *)import_author(context, mark, made.author);
    made.comment = mark->has_comment ? made.comment : (char *)"imported";
    made.created_unix_ms = mark->has_created ? made.created_unix_ms : context->import->now_unix_ms;
    return material_measurement_add(database, &made, problem);
}

static int order_documents(const void *a, const void *b) {
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

static bool *find_unnumbered(const Unnumbered *unnumbered, const char *document) {
    if (unnumbered->count == 0 || document == NULL)
        return NULL;
    const char *const *found = bsearch(&document, unnumbered->documents, unnumbered->count,
                                       sizeof *unnumbered->documents, order_documents);
    return found != NULL ? &unnumbered->are_there[found - unnumbered->documents] : NULL;
}

// Reads the material's measurements once, however many the file has.
static Status match_unnumbered(Sqlite *database, const MaterialGroup *group, Unnumbered *unnumbered,
                               Problem *problem) {
    static const char sql[] =
        "SELECT t.* FROM materials m JOIN material_measurements t ON t.material = m.number "
        "WHERE m.slug = :slug AND t.measurement > :number ORDER BY t.measurement";
    const ImportKey key = {(char *)group->slug, 0};
    Statement *statement;
    bool has_row = true;
    Status status = statement_begin(database, sql, import_key_columns, &key, &statement, problem);
    while (status == STATUS_OK && has_row) {
        MaterialMeasurement there = {0};
        status = statement_step(statement, &has_row, problem);
        if (status == STATUS_OK && has_row)
            status = row_read(statement, material_measurement_columns, &there, problem);
        bool *is_there = find_unnumbered(unnumbered, there.document);
        if (is_there != NULL)
            *is_there = true;
        material_measurement_clear(&there);
    }
    statement_end(statement);
    return status;
}

// What is faulty has no document and counts as new.
static Status load_unnumbered(Sqlite *database, const MaterialGroup *group, Unnumbered *unnumbered,
                              Problem *problem) {
    const size_t most = group->measurement_count + 1;
    unnumbered->documents = calloc(most, sizeof *unnumbered->documents);
    unnumbered->are_there = calloc(most, sizeof *unnumbered->are_there);
    if (unnumbered->documents == NULL || unnumbered->are_there == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurements");
    for (size_t i = 0; i < group->measurement_count; i++) {
        const MaterialMeasurement *made = &group->measurements[i].made;
        if (made->measurement == 0 && made->document != NULL)
            unnumbered->documents[unnumbered->count++] = made->document;
    }
    qsort(unnumbered->documents, unnumbered->count, sizeof *unnumbered->documents, order_documents);
    return unnumbered->count > 0 && group->key.measurements > 0
               ? match_unnumbered(database, group, unnumbered, problem)
               : STATUS_OK;
}

static void unnumbered_clear(Unnumbered *unnumbered) {
    free(unnumbered->documents);
    free(unnumbered->are_there);
}

static Status import_all(ImportContext *context, Sqlite *database, const Unnumbered *unnumbered,
                         MaterialGroup *group, Problem *problem) {
    const char *name = context->import->measurement_name;
    uint64_t before = 0;
    group->last_measurement = group->key.measurements;
    for (size_t i = 0; i < group->measurement_count; i++)
        group->measurements_drift =
            group->measurements_drift || group->measurements[i].mark.is_adrift;
    for (size_t i = 0; i < group->measurement_count; i++) {
        const ImportMeasurement *ours = &group->measurements[i];
        const uint64_t number = ours->made.measurement;
        if (ours->mark.is_adrift)
            continue;
        const bool *is_there =
            number == 0 ? find_unnumbered(unnumbered, ours->made.document) : NULL;
        if (is_there != NULL && *is_there) {
            group->measurements_done.same++;
            continue;
        }
        if (number == 0)
            group->last_measurement++;
        else if (import_validate_number(context, &ours->mark, name, number, before,
                                        group->measurements_drift,
                                        &group->last_measurement) != STATUS_OK)
            continue;
        before = number;
        if (number > 0 && number <= group->key.measurements)
            TRY(compare_measurement(context, database, ours, group, problem));
        else
            TRY(add_measurement(context, database, ours, group, problem));
    }
    return STATUS_OK;
}

Status import_measurements(ImportContext *context, Sqlite *database, MaterialGroup *group,
                           Problem *problem) {
    Unnumbered unnumbered = {.count = 0};
    Status status = load_unnumbered(database, group, &unnumbered, problem);
    if (status == STATUS_OK)
        status = import_all(context, database, &unnumbered, group, problem);
    unnumbered_clear(&unnumbered);
    return status;
}
