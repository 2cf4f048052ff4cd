// Material by material, in the order of slugs: its measurements, for revisions name them, then its
// revisions with their reviews. A number that is there must say what is there; one that is not must
// be the next. What is written before a fault is met goes with the transaction.
#include "server/db/material_import.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "server/db/db_private.h"
#include "server/db/material_import_context.h"

enum { POINTER_SIZE = sizeof((Fault){0}.pointer) };

static Status load_revision(Sqlite *database, const char *slug, uint64_t number,
                            MaterialRevision *revision, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, r.* FROM materials m JOIN material_revisions r ON r.material = m.number "
        "WHERE m.slug = :slug AND r.revision = :number";
    return import_load(database, sql, slug, number, material_revision_columns, revision, problem);
}

static void compare_revision(const ImportContext *context, const ImportRevision *ours,
                             const MaterialRevision *there, MaterialGroup *group) {
    const RowInfo *mark = &ours->mark;
    const size_t faults = context->faults->count;
    if (!context->import->is_partial)
        (void)context->import->says_same(&ours->said, there, mark->place, context->faults);
    const ImportOrigin is = {ours->said.author, ours->said.comment, ours->said.created_unix_ms},
                       was = {there->author, there->comment, there->created_unix_ms};
    import_compare_origin(context, mark, "revision", &is, &was);
    if (ours->said.reverts != there->reverts && !(ours->said.reverts == 0 && mark->is_faulty))
        (void)import_fault(context, mark->place, "reverts",
                           "is not that of the revision that is there, and those never change");
    group->revisions_done.same += context->faults->count == faults;
}

// A revision that says again what another one says.
static Status judge_reverts(const ImportContext *context, Sqlite *database,
                            const ImportRevision *ours, uint64_t number, const MaterialGroup *group,
                            Problem *problem) {
    const uint64_t again = ours->said.reverts;
    MaterialRevision there = {0};
    if (again == 0)
        return STATUS_OK;
    if (again >= number) {
        (void)import_fault(context, ours->mark.place, "reverts",
                           "must be a revision before %llu, is %llu", (unsigned long long)number,
                           (unsigned long long)again);
        return STATUS_OK;
    }
    if (again <= group->key.latest)
        TRY(load_revision(database, group->slug, again, &there, problem));
    const MaterialRevision *said = there.revision > 0 ? &there : NULL;
    for (size_t i = 0; said == NULL && i < group->revision_count; i++)
        if (group->revisions[i].said.revision == again && !group->revisions[i].mark.is_faulty)
            said = &group->revisions[i].said;
    if (said != NULL && !ours->mark.is_faulty &&
        !context->import->says_same(&ours->said, said, "", NULL))
        (void)import_fault(
            context, ours->mark.place, "reverts",
            "revision %llu says something else; a revision that reverts says the same",
            (unsigned long long)again);
    material_revision_clear(&there);
    return STATUS_OK;
}

static void judge_measurements(const ImportContext *context, const ImportRevision *ours,
                               const MaterialGroup *group) {
    const Reals *named = &ours->said.material.measurements;
    char list[POINTER_SIZE], place[POINTER_SIZE];
    json_pointer_join(list, sizeof list, ours->mark.place, "measurements");
    for (size_t i = 0; i < named->count && !group->measurements_drift; i++) {
        if (named->at[i] <= (double)group->last_measurement)
            continue;
        json_pointer_index(place, sizeof place, list, i);
        (void)import_fault(context, place, "",
                           "there is no measurement %.0f of \"%.64s\"; it has %llu", named->at[i],
                           group->slug, (unsigned long long)group->last_measurement);
    }
}

static Status add_revision(ImportContext *context, Sqlite *database, const ImportRevision *ours,
                           uint64_t number, MaterialGroup *group, Problem *problem) {
    const RowInfo *mark = &ours->mark;
    import_validate_origin(context, mark, ours->said.author, ours->said.created_unix_ms);
    judge_measurements(context, ours, group);
    TRY(judge_reverts(context, database, ours, number, group, problem));
    group->revisions_done.added++;
    MaterialRevision said = ours->said;
    said.revision = number;
    said.author = (char *)import_author(context, mark, said.author);
    said.comment = mark->has_comment ? said.comment : (char *)"imported";
    said.created_unix_ms = mark->has_created ? said.created_unix_ms : context->import->now_unix_ms;
    if (context->writes && context->faults->count == 0)
        TRY(material_revision_add(database, &said, problem));
    return import_reviews(context, database, ours, &said, group, problem);
}

// One without a number is the next, unless the newest says the same already.
static Status import_next(ImportContext *context, Sqlite *database, const ImportRevision *ours,
                          MaterialGroup *group, Problem *problem) {
    MaterialRevision newest = {0};
    Status status = STATUS_OK;
    if (group->key.latest > 0)
        status = load_revision(database, group->slug, group->key.latest, &newest, problem);
    if (status == STATUS_OK && newest.revision > 0 &&
        context->import->says_same(&ours->said, &newest, "", NULL)) {
        group->revisions_done.same++;
        status = import_reviews(context, database, ours, &newest, group, problem);
    } else if (status == STATUS_OK) {
        status = add_revision(context, database, ours, group->key.latest + 1, group, problem);
    }
    material_revision_clear(&newest);
    return status;
}

static Status import_known(ImportContext *context, Sqlite *database, const ImportRevision *ours,
                           MaterialGroup *group, Problem *problem) {
    MaterialRevision there = {0};
    TRY(load_revision(database, group->slug, ours->said.revision, &there, problem));
    compare_revision(context, ours, &there, group);
    const Status status = import_reviews(context, database, ours, &there, group, problem);
    material_revision_clear(&there);
    return status;
}

static Status import_revisions(ImportContext *context, Sqlite *database, MaterialGroup *group,
                               Problem *problem) {
    const char *name = context->import->revision_name;
    uint64_t before = 0, last = group->key.latest;
    for (size_t i = 0; i < group->revision_count; i++)
        group->revisions_drift = group->revisions_drift || group->revisions[i].mark.is_adrift;
    for (size_t i = 0; i < group->revision_count; i++) {
        const ImportRevision *ours = &group->revisions[i];
        const uint64_t number = ours->said.revision;
        if (ours->mark.is_adrift)
            continue;
        if (number == 0) {
            TRY(import_next(context, database, ours, group, problem));
            continue;
        }
        if (import_validate_number(context, &ours->mark, name, number, before,
                                   group->revisions_drift, &last) != STATUS_OK)
            continue;
        before = number;
        if (number <= group->key.latest)
            TRY(import_known(context, database, ours, group, problem));
        else
            TRY(add_revision(context, database, ours, number, group, problem));
    }
    return STATUS_OK;
}

static Status note(const ImportContext *context, Sqlite *database, const MaterialGroup *group,
                   Problem *problem) {
    char why[160];
    if (group->revisions_done.added + group->measurements_done.added + group->reviews_done.added ==
        0)
        return STATUS_OK;
    snprintf(why, sizeof why, "imported revisions: %zu, measurements: %zu, reviews: %zu",
             group->revisions_done.added, group->measurements_done.added,
             group->reviews_done.added);
    const AuditEntry deed = {.action = (char *)"import",
                             .who = (char *)context->import->who,
                             .why = why,
                             .created_unix_ms = context->import->now_unix_ms};
    return audit_entry_add(database, group->slug, &deed, problem);
}

static void count(ImportCount *all, const ImportCount *some) {
    all->added += some->added;
    all->same += some->same;
}

static Status import_group(ImportContext *context, Sqlite *database, MaterialGroup *group,
                           Problem *problem) {
    TRY(material_key_find(database, group->slug, 0, &group->key, problem));
    if (group->key.number == 0 && group->revision_count == 0) {
        (void)import_fault(context, group->measurements[0].mark.place, "slug",
                           "there is no material \"%.64s\" to measure; bring a revision of it",
                           group->slug);
        return STATUS_OK;
    }
    if (group->key.number == 0 && context->writes && context->faults->count == 0)
        TRY(material_row_add(database, group->slug, problem));
    TRY(import_measurements(context, database, group, problem));
    TRY(import_revisions(context, database, group, problem));
    if (context->writes && context->faults->count == 0)
        TRY(note(context, database, group, problem));
    count(&context->metrics->revisions, &group->revisions_done);
    count(&context->metrics->measurements, &group->measurements_done);
    count(&context->metrics->reviews, &group->reviews_done);
    return STATUS_OK;
}

static Status import_all(ImportContext *context, Sqlite *database, Problem *problem) {
    const MaterialImport *import = context->import;
    size_t r = 0, m = 0;
    while (r < import->revision_count || m < import->measurement_count) {
        const char *a = r < import->revision_count ? import->revisions[r].said.slug : NULL;
        const char *b = m < import->measurement_count ? import->measurements[m].made.slug : NULL;
        MaterialGroup group = {.slug = a == NULL || (b != NULL && strcmp(b, a) < 0) ? b : a,
                               .revisions = &import->revisions[r],
                               .measurements = &import->measurements[m]};
        for (; r < import->revision_count && text_same(import->revisions[r].said.slug, group.slug);
             r++)
            group.revision_count++;
        for (; m < import->measurement_count &&
               text_same(import->measurements[m].made.slug, group.slug);
             m++)
            group.measurement_count++;
        context->metrics->materials++;
        TRY(import_group(context, database, &group, problem));
    }
    return STATUS_OK;
}

static Status refuse(const ImportContext *context) {
    if (context->faults->count > 0)
        return STATUS_INVALID;
    if (context->denied == 0)
        return STATUS_OK;
    return problem_add(context->faults, STATUS_FORBIDDEN, context->denied_place,
                       "%s (%zu more rows are like it): what is by others, times, and reviews "
                       "may be brought by who has the scope admin; nobody approves their own by "
                       "way of a file",
                       context->denied_why, context->denied - 1);
}

// May be done again from its beginning.
static Status write_all(Sqlite *database, const void *work, Problem *problem) {
    ImportContext context = *(const ImportContext *)work;
    problem_clear(context.faults);
    *context.metrics = (ImportTally){0};
    TRY(import_all(&context, database, problem));
    return refuse(&context);
}

// Within one transaction of a reader, so that all of it is of one moment.
static Status judge_all(Db *db, ImportContext *context, Problem *problem) {
    static const char begin[] = "BEGIN", end[] = "COMMIT";
    Sqlite *database = db_take(db);
    Status status = sqlite_change(database, begin, NULL, NULL, NULL, problem);
    if (status == STATUS_OK) {
        status = import_all(context, database, problem);
        (void)sqlite_change(database, end, NULL, NULL, NULL, NULL);
    }
    db_put(db, database);
    return status == STATUS_OK ? refuse(context) : status;
}

Status db_material_import(Db *db, const MaterialImport *import, bool is_dry, ImportTally *metrics,
                          Problem *problem) {
    *metrics = (ImportTally){0};
    ImportContext context = {.import = import, .metrics = metrics, .faults = problem};
    if (is_dry || problem->count > 0)
        return judge_all(db, &context, problem);
    context.writes = true;
    TRY(db_write(db, write_all, &context, problem));
    if (metrics->revisions.added + metrics->reviews.added > 0)
        db_catalog_changed(db);
    else if (metrics->measurements.added > 0)
        db_material_measured(db);
    return STATUS_OK;
}

void import_revision_clear(ImportRevision *revision) {
    for (size_t i = 0; i < revision->review_count; i++)
        row_clear(material_review_columns, &revision->reviews[i].review,
                  sizeof revision->reviews[i].review);
    free(revision->reviews);
    material_revision_clear(&revision->said);
    *revision = (ImportRevision){.reviews = NULL};
}

void import_measurement_clear(ImportMeasurement *measurement) {
    material_measurement_clear(&measurement->made);
    *measurement = (ImportMeasurement){.made = {0}};
}
