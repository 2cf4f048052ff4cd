// The list is sorted by slug, then kind, then number. Measurements of a material are imported
// before its revisions, which refer to them. A number that is stored must have the same contents;
// any other must be the next one. Rows written before a fault is found are rolled back with the
// transaction.
#include "server/db/material_import.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "server/db/db_private.h"
#include "server/json/schema.h"

enum { POINTER_SIZE = sizeof((Fault){0}.pointer) };

// Clocks differ, and a date alone is midnight UTC wherever it was written.
static const int64_t time_slack_ms = 24 * 3600 * (int64_t)1000;

// An import in progress, and the material that it is at.
typedef struct ImportContext {
    const MaterialImport *import;
    Sqlite *database;
    bool writes;
    ImportTally *tally;
    Problem *faults;
    size_t denied; // rows that need may_all; the first of them, its member and what it is:
    const ImportRow *denied_row;
    const char *denied_name, *denied_why;

    const char *slug;
    MaterialKey key;
    const ImportRow *revisions; // of the file
    size_t revision_count;
    uint64_t last_measurement;                // stored, or earlier in the file
    bool numbers_unknown[IMPORT_UNKNOWN + 1]; // by kind: one could not be read, so gaps are allowed
} ImportContext;

static const char never_changes[] = "differs from the stored row, which never changes";

// Adds a fault at `name` below `place`; "": at `place` itself.
__attribute__((format(printf, 4, 5))) static Status import_fault(const ImportContext *context,
                                                                 const char *place,
                                                                 const char *name,
                                                                 const char *format, ...) {
    char pointer[POINTER_SIZE], text[sizeof((Fault){0}.detail)];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (name[0] != '\0')
        json_pointer_join(pointer, sizeof pointer, place, name);
    else
        text_fit(pointer, sizeof pointer, place);
    return problem_add(context->faults, STATUS_INVALID, pointer, "%s", text);
}

static void import_deny(ImportContext *context, const ImportRow *row, const char *name,
                        const char *why) {
    if (context->denied++ > 0)
        return;
    context->denied_row = row;
    context->denied_name = name;
    context->denied_why = why;
}

// Whether what is new is written, not only validated.
static bool import_writes(const ImportContext *context) {
    return context->writes && context->faults->count == 0;
}

// A name as the database has it: unknown is NULL.
static char *import_name(char *name) {
    return name != NULL && name[0] != '\0' ? name : NULL;
}

static char *import_author(const ImportContext *context, const ImportRow *row) {
    return row->author != NULL && context->import->may_all ? import_name(row->author)
                                                           : (char *)context->import->who;
}

static char *import_comment(const ImportRow *row) {
    return row->comment != NULL ? row->comment : (char *)"imported";
}

static int64_t import_created(const ImportContext *context, int64_t unix_ms) {
    return unix_ms > 0 ? unix_ms : context->import->now_unix_ms;
}

// `revised_unix_ms`: when the revision of a review was written; 0: no review, or unknown.
static void import_validate_time(const ImportContext *context, const char *place, int64_t unix_ms,
                                 int64_t revised_unix_ms) {
    if (unix_ms > context->import->now_unix_ms + time_slack_ms)
        (void)import_fault(context, place, "created", "is in the future");
    else if (unix_ms < revised_unix_ms - time_slack_ms)
        (void)import_fault(context, place, "created",
                           "is before the revision was written: give the revision its \"created\"");
}

// Author and time of a row that is not stored yet.
static void import_validate_origin(ImportContext *context, const ImportRow *row) {
    const MaterialImport *import = context->import;
    const char *author = import_name(row->author);
    if (!import->may_all && author != NULL && !text_same(author, import->who))
        import_deny(context, row, "author", "is another user");
    if (!import->may_all && row->created_unix_ms > 0)
        import_deny(context, row, "created", "is set by the file");
    if (row->created_unix_ms > 0)
        import_validate_time(context, row->place, row->created_unix_ms, 0);
}

// Author, comment and time of a row that is stored already, as far as the file has them.
static void import_compare_origin(const ImportContext *context, const ImportRow *row,
                                  const char *author, const char *comment,
                                  int64_t created_unix_ms) {
    if (row->author != NULL && !text_same(import_name(row->author), author))
        (void)import_fault(context, row->place, "author", never_changes);
    if (row->comment != NULL && !text_same(row->comment, comment))
        (void)import_fault(context, row->place, "comment", never_changes);
    if (row->created_unix_ms > 0 && row->created_unix_ms != created_unix_ms)
        (void)import_fault(context, row->place, "created", never_changes);
}

// A number that is not stored must follow `last`, which it becomes. `before` is the number of the
// row before.
static Status import_validate_number(const ImportContext *context, const ImportRow *row,
                                     uint64_t before, uint64_t *last) {
    const char *name = context->import->number_names[row->kind];
    if (row->number == before)
        return import_fault(context, row->place, name, "is in the file twice: %llu",
                            (unsigned long long)row->number);
    if (row->number <= *last)
        return STATUS_OK;
    const uint64_t next = *last + 1;
    *last = row->number;
    if (row->number == next || context->numbers_unknown[row->kind])
        return STATUS_OK;
    return import_fault(context, row->place, name,
                        "must be %llu, the next number, is %llu: numbers have no gaps",
                        (unsigned long long)next, (unsigned long long)row->number);
}

// Measurements.

static Status measurement_load(const ImportContext *context, uint64_t number,
                               MaterialMeasurement *stored, Problem *problem) {
    static const char sql[] =
        "SELECT t.* FROM materials m JOIN material_measurements t ON t.material = m.number "
        "WHERE m.slug = :slug AND t.measurement = :number";
    const QueryKey key = {.slug = context->slug, .number = number};
    return sqlite_first(context->database, sql, query_key_columns, &key,
                        material_measurement_columns, stored, NULL, problem);
}

// Finds rows without a number whose test is stored already, in one pass over the stored ones. The
// same test again in the file without a number was copied twice.
static Status measurements_index(const ImportContext *context, ImportRow *rows, size_t count,
                                 Problem *problem) {
    HashMap *map = hashmap_new();
    Status status = STATUS_OK;
    uint64_t stored_count = 0; // of those to look at
    if (map == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurements");
    for (size_t i = 0; i < count; i++) { // those with a number come first
        ImportRow *row = &rows[i];
        row->is_stored = false;
        if (row->document == NULL)
            continue;
        const ImportRow *before = hashmap_find(map, row->document);
        row->indexed.key = row->document;
        if (before == NULL)
            hashmap_add(map, &row->indexed);
        if (row->number != COUNT_ABSENT)
            continue;
        stored_count = context->key.measurements;
        if (before != NULL)
            (void)import_fault(context, row->place, "test",
                               "is in the file already, at %.64s: give each its number if it was "
                               "done twice",
                               before->place);
    }
    for (uint64_t number = 1; status == STATUS_OK && number <= stored_count; number++) {
        MaterialMeasurement stored = {0};
        status = measurement_load(context, number, &stored, problem);
        ImportRow *row = stored.document != NULL ? hashmap_find(map, stored.document) : NULL;
        if (row != NULL)
            row->is_stored = true;
        material_measurement_clear(&stored);
    }
    hashmap_free(map);
    return status;
}

static Status measurement_compare(ImportContext *context, const ImportRow *row, Problem *problem) {
    MaterialMeasurement stored = {0};
    const size_t faults = context->faults->count;
    TRY(measurement_load(context, row->number, &stored, problem));
    import_compare_origin(context, row, stored.author, stored.comment, stored.created_unix_ms);
    if (row->document != NULL && !text_same(row->document, stored.document))
        (void)import_fault(context, row->place, "test",
                           "differs from the stored measurement %llu, which never changes",
                           (unsigned long long)row->number);
    material_measurement_clear(&stored);
    context->tally->measurements.same += context->faults->count == faults;
    return STATUS_OK;
}

static Status measurement_add(ImportContext *context, const ImportRow *row, Problem *problem) {
    const MaterialMeasurement added = {.slug = row->slug,
                                       .measurement = context->last_measurement,
                                       .author = import_author(context, row),
                                       .comment = import_comment(row),
                                       .created_unix_ms =
                                           import_created(context, row->created_unix_ms),
                                       .document = row->document};
    import_validate_origin(context, row);
    context->tally->measurements.added++;
    return import_writes(context) ? material_measurement_add(context->database, &added, problem)
                                  : STATUS_OK;
}

static Status import_measurements(ImportContext *context, ImportRow *rows, size_t count,
                                  Problem *problem) {
    uint64_t before = 0;
    context->last_measurement = context->key.measurements;
    TRY(measurements_index(context, rows, count, problem));
    for (const ImportRow *row = rows; row < rows + count; row++) {
        const bool is_numbered = row->number != COUNT_ABSENT;
        if (row->number_unknown)
            continue;
        if (!is_numbered && row->is_stored) {
            context->tally->measurements.same++;
            continue;
        }
        if (!is_numbered)
            context->last_measurement++;
        else if (import_validate_number(context, row, before, &context->last_measurement) !=
                 STATUS_OK)
            continue;
        before = row->number;
        TRY(is_numbered && row->number <= context->key.measurements
                ? measurement_compare(context, row, problem)
                : measurement_add(context, row, problem));
    }
    return STATUS_OK;
}

// Reviews.

static const char *review_status(const ImportReview *review) {
    return review->status != CHOICE_ABSENT ? material_verdicts[review->status] : "";
}

static bool review_is_same(const ImportReview *review, const MaterialReview *stored) {
    return strcmp(review_status(review), stored->status) == 0 &&
           text_same(review->reason, stored->reason) &&
           (review->reviewer == NULL ||
            text_same(import_name(review->reviewer), stored->reviewer)) &&
           (review->created_unix_ms == 0 || review->created_unix_ms == stored->created_unix_ms);
}

// A review that is not stored yet. If its reviewer is unknown it may be the importer's own.
static Status review_validate(const ImportContext *context, const char *place,
                              const ImportReview *review, const char *status_before,
                              const MaterialRevision *revision, int64_t revised_unix_ms) {
    const char *status = review_status(review);
    const char *named = import_name(review->reviewer);
    const char *reviewer = named != NULL ? named : context->import->who;
    if (strcmp(status, status_before) == 0)
        return import_fault(context, place, "status", "the revision is %s already", status_before);
    if (strcmp(status, "approved") == 0 && reviewer != NULL &&
        text_same(reviewer, revision->author))
        return named != NULL
                   ? import_fault(context, place, "reviewer",
                                  "is the author, %.64s, who may not approve their own revision",
                                  named)
                   : import_fault(context, place, "reviewer",
                                  "is required: it defaults to the author, %.64s, who may not "
                                  "approve their own revision",
                                  reviewer);
    if (review->created_unix_ms > 0)
        import_validate_time(context, place, review->created_unix_ms, revised_unix_ms);
    return STATUS_OK;
}

static Status review_add(ImportContext *context, const ImportRow *row, const ImportReview *review,
                         uint64_t revision, Problem *problem) {
    const MaterialImport *import = context->import;
    const MaterialReview added = {
        .slug = row->slug,
        .revision = revision,
        .status = (char *)review_status(review),
        .reason = review->reason,
        .reviewer = review->reviewer != NULL ? import_name(review->reviewer) : (char *)import->who,
        .created_unix_ms = import_created(context, review->created_unix_ms)};
    if (!import->may_all)
        import_deny(context, row, "reviews", "has reviews");
    context->tally->reviews.added++;
    return import_writes(context) ? material_review_add(context->database, &added, problem)
                                  : STATUS_OK;
}

// Stored reviews come first and are the same; others follow.
static Status reviews_match(ImportContext *context, const ImportRow *row,
                            const MaterialRevision *revision, const MaterialReviews *stored,
                            Problem *problem) {
    char list[POINTER_SIZE], place[POINTER_SIZE];
    const char *before = stored->count > 0 ? stored->at[stored->count - 1].status : "draft";
    // Of a faulty row the time may be what could not be read.
    const int64_t revised_unix_ms =
        row->is_faulty && row->created_unix_ms == 0 ? 0 : revision->created_unix_ms;
    json_pointer_join(list, sizeof list, row->place, "reviews");
    for (size_t i = 0; i < row->reviews.count; i++) {
        const ImportReview *review = &row->reviews.at[i];
        json_pointer_index(place, sizeof place, list, i);
        if (problem_concerns(context->faults, place))
            continue; // it could not be read
        if (i < stored->count) {
            if (review_is_same(review, &stored->at[i]))
                context->tally->reviews.same++;
            else
                (void)import_fault(context, place, "",
                                   "differs from the stored review of %.64s@%llu, which never "
                                   "changes",
                                   context->slug, (unsigned long long)revision->revision);
            continue;
        }
        const Status status =
            review_validate(context, place, review, before, revision, revised_unix_ms);
        before = review_status(review);
        if (status == STATUS_OK)
            TRY(review_add(context, row, review, revision->revision, problem));
    }
    return STATUS_OK;
}

// The reviews of the revision, which is stored or has just been added.
static Status import_reviews(ImportContext *context, const ImportRow *row,
                             const MaterialRevision *revision, Problem *problem) {
    static const char sql[] =
        "SELECT v.* FROM materials m JOIN material_reviews v ON v.material = m.number "
        "WHERE m.slug = :slug AND v.revision = :number ORDER BY v.number";
    const QueryKey key = {.slug = context->slug, .number = revision->revision};
    MaterialReviews stored = {0};
    if (row->reviews.count == 0)
        return STATUS_OK;
    Status status = STATUS_OK;
    if (revision->revision <= context->key.latest)
        status = sqlite_list(context->database, sql, query_key_columns, &key,
                             material_review_columns, sizeof *stored.at, &stored, problem);
    if (status == STATUS_OK)
        status = reviews_match(context, row, revision, &stored, problem);
    material_reviews_clear(&stored);
    return status;
}

// Revisions.

static Status revision_load(const ImportContext *context, uint64_t number,
                            MaterialRevision *revision, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, r.* FROM materials m JOIN material_revisions r ON r.material = m.number "
        "WHERE m.slug = :slug AND r.revision = :number";
    const QueryKey key = {.slug = context->slug, .number = number};
    bool is_found;
    TRY(sqlite_first(context->database, sql, query_key_columns, &key, material_revision_columns(),
                     revision, &is_found, problem));
    return material_lists_read(revision, problem);
}

static void revision_report(const ImportContext *context, const ImportRow *row, const Field *field,
                            const char *ours, const char *stored) {
    Fault fault = {.row = 0};
    char detail[2 * sizeof fault.detail];
    const bool is_list = field->kind == FIELD_KIND_TEXTS || field->kind == FIELD_KIND_REALS ||
                         field->kind == FIELD_KIND_LIST;
    json_pointer_join(fault.pointer, sizeof fault.pointer, row->place, field->name);
    if (problem_concerns(context->faults, fault.pointer))
        return; // it could not be read, which is reported
    if (!is_list && strcmp(ours, "null") != 0 && strlen(ours) < sizeof fault.value)
        text_fit(fault.value, sizeof fault.value, ours);
    text_fit(fault.unit, sizeof fault.unit, field->unit != NULL ? field->unit : "");
    snprintf(detail, sizeof detail,
             "%.64s@%llu is stored with %.60s; revisions never change: give this one the next "
             "number",
             context->slug, (unsigned long long)row->number,
             strcmp(stored, "null") == 0 ? "no value"
             : is_list                   ? "another value"
                                         : stored);
    text_fit(fault.detail, sizeof fault.detail, detail);
    (void)problem_add_fault(context->faults, STATUS_INVALID, &fault);
}

// Whether the row has the contents of `other`, member by member as they are written. Differences
// are faults where `reports`.
static Status revision_compare(const ImportContext *context, const ImportRow *row,
                               const Material *other, bool reports, bool *is_same,
                               Problem *problem) {
    Bytes ours = {.most = 0}, theirs = {.most = 0};
    Status status = STATUS_OK;
    *is_same = true;
    for (const Field *field = material_fields; field->kind != FIELD_KIND_END; field++) {
        const char *a = material_member_json(&ours, field, &row->material);
        const char *b = material_member_json(&theirs, field, other);
        if (a == NULL || b == NULL) {
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the materials");
            break;
        }
        if (strcmp(a, b) == 0)
            continue;
        *is_same = false;
        if (!reports)
            break;
        revision_report(context, row, field, a, b);
    }
    bytes_clear(&ours);
    bytes_clear(&theirs);
    return status;
}

// A revision that reverts to another has its contents.
static Status revision_validate_reverts(const ImportContext *context, const ImportRow *row,
                                        uint64_t number, Problem *problem) {
    const uint64_t to = row->reverts;
    MaterialRevision stored = {0};
    bool is_same = true;
    if (to == COUNT_ABSENT)
        return STATUS_OK;
    if (to >= number) {
        (void)import_fault(context, row->place, "reverts",
                           "must be a revision before %llu, is %llu", (unsigned long long)number,
                           (unsigned long long)to);
        return STATUS_OK;
    }
    Status status = STATUS_OK;
    if (to <= context->key.latest)
        status = revision_load(context, to, &stored, problem);
    const Material *other = stored.revision > 0 ? &stored.material : NULL;
    for (size_t i = 0; other == NULL && i < context->revision_count; i++)
        if (context->revisions[i].number == to && !context->revisions[i].is_faulty)
            other = &context->revisions[i].material;
    if (status == STATUS_OK && other != NULL && !row->is_faulty)
        status = revision_compare(context, row, other, false, &is_same, problem);
    if (!is_same)
        (void)import_fault(context, row->place, "reverts",
                           "must have the contents of revision %llu, to which it reverts",
                           (unsigned long long)to);
    material_revision_clear(&stored);
    return status;
}

static void revision_validate_measurements(const ImportContext *context, const ImportRow *row) {
    const Reals *measurements = &row->material.measurements;
    char list[POINTER_SIZE], place[POINTER_SIZE];
    json_pointer_join(list, sizeof list, row->place, "measurements");
    for (size_t i = 0; i < measurements->count && !context->numbers_unknown[IMPORT_MEASUREMENT];
         i++) {
        if (measurements->at[i] <= (double)context->last_measurement)
            continue;
        json_pointer_index(place, sizeof place, list, i);
        (void)import_fault(context, place, "",
                           "\"%.64s\" has no measurement %.0f; its last one is %llu", context->slug,
                           measurements->at[i], (unsigned long long)context->last_measurement);
    }
}

static Status revision_add(ImportContext *context, const ImportRow *row, uint64_t number,
                           Problem *problem) {
    // Borrows from the row.
    const MaterialRevision revision = {.slug = row->slug,
                                       .revision = number,
                                       .material = row->material,
                                       .reverts = row->reverts == COUNT_ABSENT ? 0 : row->reverts,
                                       .author = import_author(context, row),
                                       .comment = import_comment(row),
                                       .created_unix_ms =
                                           import_created(context, row->created_unix_ms)};
    import_validate_origin(context, row);
    revision_validate_measurements(context, row);
    TRY(revision_validate_reverts(context, row, number, problem));
    context->tally->revisions.added++;
    if (import_writes(context))
        TRY(material_revision_add(context->database, &revision, problem));
    return import_reviews(context, row, &revision, problem);
}

// `stored` has the row's number; the newest revision if it has none, of which the row is a copy if
// it has the same contents. *is_new: the row is another revision.
static Status revision_compare_stored(ImportContext *context, const ImportRow *row,
                                      const MaterialRevision *stored, bool *is_new,
                                      Problem *problem) {
    const size_t faults = context->faults->count;
    const uint64_t reverts = row->reverts == COUNT_ABSENT ? 0 : row->reverts;
    const bool is_numbered = row->number != COUNT_ABSENT;
    bool is_same = true;
    if (!is_numbered || !context->import->is_partial)
        TRY(revision_compare(context, row, &stored->material, is_numbered, &is_same, problem));
    *is_new = !is_numbered && !is_same;
    if (is_numbered) {
        import_compare_origin(context, row, stored->author, stored->comment,
                              stored->created_unix_ms);
        if (reverts != stored->reverts && !(reverts == 0 && row->is_faulty))
            (void)import_fault(context, row->place, "reverts", never_changes);
    }
    context->tally->revisions.same += !*is_new && context->faults->count == faults;
    return *is_new ? STATUS_OK : import_reviews(context, row, stored, problem);
}

static Status import_revisions(ImportContext *context, Problem *problem) {
    const uint64_t latest = context->key.latest;
    uint64_t before = 0, last = latest;
    for (size_t i = 0; i < context->revision_count; i++) {
        const ImportRow *row = &context->revisions[i];
        const bool is_numbered = row->number != COUNT_ABSENT;
        MaterialRevision stored = {0};
        bool is_new = latest == 0 || (is_numbered && row->number > latest);
        if (row->number_unknown ||
            (is_numbered && import_validate_number(context, row, before, &last) != STATUS_OK))
            continue;
        before = row->number;
        Status status =
            is_new ? STATUS_OK
                   : revision_load(context, is_numbered ? row->number : latest, &stored, problem);
        if (status == STATUS_OK && !is_new)
            status = revision_compare_stored(context, row, &stored, &is_new, problem);
        if (status == STATUS_OK && is_new)
            status = revision_add(context, row, is_numbered ? row->number : latest + 1, problem);
        material_revision_clear(&stored);
        TRY(status);
    }
    return STATUS_OK;
}

// All of it.

// `before` is the tally before this material.
static Status import_audit(const ImportContext *context, const ImportTally *before,
                           Problem *problem) {
    const ImportTally *tally = context->tally;
    const size_t revisions = tally->revisions.added - before->revisions.added;
    const size_t measurements = tally->measurements.added - before->measurements.added;
    const size_t reviews = tally->reviews.added - before->reviews.added;
    char why[160];
    if (revisions + measurements + reviews == 0)
        return STATUS_OK;
    snprintf(why, sizeof why, "imported revisions: %zu, measurements: %zu, reviews: %zu", revisions,
             measurements, reviews);
    const AuditEntry entry = {.slug = (char *)context->slug,
                              .action = (char *)"import",
                              .who = (char *)context->import->who,
                              .why = why,
                              .created_unix_ms = context->import->now_unix_ms};
    return audit_entry_add(context->database, &entry, problem);
}

// The rows of one material.
static Status import_material(ImportContext *context, ImportRow *rows, size_t count,
                              Problem *problem) {
    const ImportTally before = *context->tally;
    size_t of_kind[IMPORT_UNKNOWN + 1] = {0};
    memset(context->numbers_unknown, 0, sizeof context->numbers_unknown);
    for (size_t i = 0; i < count; i++) {
        of_kind[rows[i].kind]++;
        context->numbers_unknown[rows[i].kind] |= rows[i].number_unknown;
    }
    const size_t unknown = of_kind[IMPORT_UNKNOWN], measured = of_kind[IMPORT_MEASUREMENT];
    if (unknown > 0)
        context->numbers_unknown[IMPORT_REVISION] = context->numbers_unknown[IMPORT_MEASUREMENT] =
            true;
    context->slug = rows->slug;
    context->revisions = rows + unknown + measured;
    context->revision_count = of_kind[IMPORT_REVISION];
    TRY(material_key_find(context->database, context->slug, 0, &context->key, problem));
    if (context->key.number == 0 && measured == count) {
        const Status status = measurements_index(context, rows, count, problem); // has faults too
        (void)import_fault(context, rows->place, "slug",
                           "there is no material \"%.64s\": add a revision of it", context->slug);
        return status;
    }
    if (context->key.number == 0 && import_writes(context))
        TRY(material_row_add(context->database, context->slug, problem));
    TRY(import_measurements(context, rows + unknown, measured, problem));
    TRY(import_revisions(context, problem));
    return import_writes(context) ? import_audit(context, &before, problem) : STATUS_OK;
}

static Status import_run(ImportContext *context, Problem *problem) {
    const MaterialImport *import = context->import;
    for (size_t i = 0, end; i < import->count; i = end) {
        for (end = i + 1; end < import->count; end++)
            if (strcmp(import->rows[end].slug, import->rows[i].slug) != 0)
                break;
        context->tally->materials++;
        TRY(import_material(context, &import->rows[i], end - i, problem));
    }
    if (context->faults->count > 0)
        return STATUS_INVALID;
    if (context->denied == 0)
        return STATUS_OK;
    char place[POINTER_SIZE];
    json_pointer_join(place, sizeof place, context->denied_row->place, context->denied_name);
    return problem_add(context->faults, STATUS_FORBIDDEN, place,
                       "%s (and %zu more rows): importing rows of other users, times or reviews "
                       "requires the scope admin",
                       context->denied_why, context->denied - 1);
}

static Status import_apply(Sqlite *database, const void *work, Problem *problem) {
    ImportContext context = *(const ImportContext *)work; // it may run again
    context.database = database;
    if (context.writes)
        problem_clear(context.faults);
    *context.tally = (ImportTally){0};
    return import_run(&context, problem);
}

static int import_order(const void *a, const void *b) {
    const ImportRow *one = a, *other = b;
    const int by_slug = strcmp(one->slug, other->slug);
    if (by_slug != 0)
        return by_slug;
    if (one->kind != other->kind) // unknown, measurements, revisions
        return one->kind > other->kind ? -1 : 1;
    if (one->number != other->number) // COUNT_ABSENT is the largest
        return one->number < other->number ? -1 : 1;
    return one->order < other->order ? -1 : one->order > other->order;
}

Status db_material_import(Db *db, MaterialImport *import, bool is_dry, ImportTally *tally,
                          Problem *problem) {
    *tally = (ImportTally){0};
    if (import->count > 0)
        qsort(import->rows, import->count, sizeof *import->rows, import_order);
    ImportContext context = {.import = import, .tally = tally, .faults = problem};
    if (is_dry || problem->count > 0)
        return db_read(db, import_apply, &context, problem);
    context.writes = true;
    const Status status = db_write(db, import_apply, &context, problem);
    shared_cache_clear(db_cache(db, CACHE_MATERIALS));
    return status;
}
