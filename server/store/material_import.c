// Material by material, in the order of slugs: its measurements, for revisions name them, then its
// revisions with their reviews. A number that is there must say what is there; one that is not must
// be the next. What is written before a fault is met goes with the transaction.
#include "server/store/material_import.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/store/access.h"
#include "server/store/material_columns.h"

enum { POINTER_SIZE = sizeof((Fault){0}.pointer) };

typedef struct Walk {
    const MaterialImport *import;
    bool writes;
    ImportTally *tally;
    Problem *faults;
    size_t denied;                   // rows that the importer may not bring
    char denied_place[POINTER_SIZE]; // the first of them
    const char *denied_why;
} Walk;

// One material of the file, and how far it is.
typedef struct Group {
    const char *slug;
    MaterialKey key;
    const ImportRevision *revisions;
    size_t revision_count;
    const ImportMeasurement *measurements;
    size_t measurement_count;
    uint64_t last_measurement; // there, or in the file before
    bool is_adrift;            // a measurement has a number that could not be read
    ImportCount revisions_done, measurements_done, reviews_done;
} Group;

typedef struct Numbered {
    char *slug;
    uint64_t number;
} Numbered;
static const RowColumn numbered_columns[] = {ROW_COLUMN(Numbered, slug, COLUMN_TEXT),
                                             ROW_COLUMN(Numbered, number, COLUMN_COUNT), ROW_END};

static Status fault(const Walk *walk, const char *place, const char *name, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
static Status fault(const Walk *walk, const char *place, const char *name, const char *format,
                    ...) {
    char pointer[POINTER_SIZE], text[sizeof((Fault){0}.detail)];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (name[0] != '\0')
        pointer_join(pointer, sizeof pointer, place, name);
    else
        text_fit(pointer, sizeof pointer, place);
    return problem_add(walk->faults, STATUS_INVALID, pointer, "%s", text);
}

static void deny(Walk *walk, const char *place, const char *name, const char *why) {
    if (walk->denied++ > 0)
        return;
    pointer_join(walk->denied_place, sizeof walk->denied_place, place, name);
    walk->denied_why = why;
}

static bool is_same(const char *a, const char *b) {
    return a == NULL || b == NULL ? a == b : strcmp(a, b) == 0;
}

// The row of that number; `item` is all zero where there is none.
static Status load(Database *database, const char *sql, const char *slug, uint64_t number,
                   const RowColumn *columns, void *item, Problem *problem) {
    const Numbered key = {(char *)slug, number};
    Statement *statement;
    bool has_row = false;
    TRY(statement_begin(database, sql, numbered_columns, &key, &statement, problem));
    Status status = statement_step(statement, &has_row, problem);
    if (status == STATUS_OK && has_row)
        status = row_read(statement, columns, item, problem);
    statement_end(statement);
    return status;
}

static Status load_revision(Database *database, const char *slug, uint64_t number,
                            MaterialRevision *revision, Problem *problem) {
    static const char sql[] =
        "SELECT r.* FROM materials m JOIN material_revisions r ON r.material = m.number "
        "WHERE m.slug = :slug AND r.revision = :number";
    return load(database, sql, slug, number, material_revision_columns, revision, problem);
}

// Who, when and why, as far as the file tells it.
static void compare_marks(const Walk *walk, const ImportMark *mark, const char *what,
                          const char *const ours[2], int64_t our_ms, const char *const there[2],
                          int64_t there_ms) {
    static const char never[] = "is not that of the %s that is there, and those never change";
    if (mark->has_author && !is_same(ours[0], there[0]))
        (void)fault(walk, mark->place, "author", never, what);
    if (mark->has_comment && !is_same(ours[1], there[1]))
        (void)fault(walk, mark->place, "comment", never, what);
    if (mark->has_created && our_ms != there_ms)
        (void)fault(walk, mark->place, "created", never, what);
}

// A number that is not there must be the one behind `last`, which it becomes.
static Status judge_number(const Walk *walk, const ImportMark *mark, const char *name,
                           uint64_t number, uint64_t before, uint64_t *last) {
    if (number == before)
        return fault(walk, mark->place, name, "stands in the file twice, %llu",
                     (unsigned long long)number);
    if (number <= *last)
        return STATUS_OK;
    const uint64_t next = *last + 1;
    *last = number;
    if (number == next)
        return STATUS_OK;
    return fault(walk, mark->place, name,
                 "must be %llu, the next, is %llu: numbers continue without a gap",
                 (unsigned long long)next, (unsigned long long)number);
}

static const char *author_of(const Walk *walk, const ImportMark *mark, const char *author) {
    return mark->has_author && walk->import->may_all ? author : walk->import->who;
}

static void judge_author(Walk *walk, const ImportMark *mark, const char *author) {
    if (!walk->import->may_all && mark->has_author && author != NULL &&
        !is_same(author, walk->import->who))
        deny(walk, mark->place, "author", "is somebody else");
}

// Measurements.

static Status compare_measurement(const Walk *walk, Database *database,
                                  const ImportMeasurement *ours, Group *group, Problem *problem) {
    static const char sql[] =
        "SELECT t.* FROM materials m JOIN material_measurements t ON t.material = m.number "
        "WHERE m.slug = :slug AND t.measurement = :number";
    const ImportMark *mark = &ours->mark;
    MaterialMeasurement there = {0};
    TRY(load(database, sql, group->slug, ours->made.measurement, material_measurement_columns,
             &there, problem));
    const size_t faults = walk->faults->count;
    compare_marks(walk, mark, "measurement",
                  (const char *const[]){ours->made.author, ours->made.comment},
                  ours->made.created_unix_ms, (const char *const[]){there.author, there.comment},
                  there.created_unix_ms);
    if (ours->made.document != NULL && !is_same(ours->made.document, there.document))
        (void)fault(walk, mark->place, "test",
                    "is not the measurement %llu that is there, and those never change",
                    (unsigned long long)ours->made.measurement);
    material_measurement_clear(&there);
    group->measurements_done.same += walk->faults->count == faults;
    return STATUS_OK;
}

static Status add_measurement(Walk *walk, Database *database, const ImportMeasurement *ours,
                              Group *group, Problem *problem) {
    const ImportMark *mark = &ours->mark;
    judge_author(walk, mark, ours->made.author);
    group->measurements_done.added++;
    if (!walk->writes || walk->faults->count > 0)
        return STATUS_OK;
    MaterialMeasurement made = ours->made;
    made.measurement = group->last_measurement;
    made.author = (char *)author_of(walk, mark, made.author);
    made.comment = mark->has_comment ? made.comment : (char *)"imported";
    made.created_unix_ms = mark->has_created ? made.created_unix_ms : walk->import->now_unix_ms;
    return material_measurement_add(database, &made, problem);
}

static Status import_measurements(Walk *walk, Database *database, Group *group, Problem *problem) {
    const char *name = walk->import->measurement_name;
    uint64_t before = 0;
    group->last_measurement = group->key.measurements;
    for (size_t i = 0; i < group->measurement_count; i++) {
        const ImportMeasurement *ours = &group->measurements[i];
        const uint64_t number = ours->made.measurement;
        group->is_adrift = group->is_adrift || ours->mark.is_adrift;
        if (group->is_adrift)
            continue;
        if (number == 0)
            group->last_measurement++;
        else if (judge_number(walk, &ours->mark, name, number, before, &group->last_measurement) !=
                 STATUS_OK)
            continue;
        before = number;
        if (number > 0 && number <= group->key.measurements)
            TRY(compare_measurement(walk, database, ours, group, problem));
        else if (!ours->mark.is_faulty)
            TRY(add_measurement(walk, database, ours, group, problem));
    }
    return STATUS_OK;
}

// Reviews.

typedef struct Reviews {
    MaterialReview *at;
    size_t count, room;
} Reviews;

static void reviews_clear(Reviews *reviews) {
    for (size_t i = 0; i < reviews->count; i++)
        row_clear(material_review_columns, &reviews->at[i], sizeof *reviews->at);
    free(reviews->at);
    *reviews = (Reviews){0};
}

static Status load_reviews(Database *database, const char *slug, uint64_t revision,
                           Reviews *reviews, Problem *problem) {
    static const char sql[] =
        "SELECT v.* FROM materials m JOIN material_reviews v ON v.material = m.number "
        "WHERE m.slug = :slug AND v.revision = :number ORDER BY v.number";
    const Numbered key = {(char *)slug, revision};
    Statement *statement;
    bool has_row = true;
    Status status = statement_begin(database, sql, numbered_columns, &key, &statement, problem);
    while (status == STATUS_OK && has_row) {
        status = statement_step(statement, &has_row, problem);
        if (status != STATUS_OK || !has_row)
            break;
        if (reviews->count == reviews->room) {
            reviews->room = reviews->room > 0 ? 2 * reviews->room : 4;
            MaterialReview *grown = realloc(reviews->at, reviews->room * sizeof *grown);
            if (grown == NULL) {
                status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the reviews");
                break;
            }
            reviews->at = grown;
        }
        MaterialReview *review = &reviews->at[reviews->count];
        *review = (MaterialReview){0};
        status = row_read(statement, material_review_columns, review, problem);
        reviews->count += status == STATUS_OK;
    }
    statement_end(statement);
    return status;
}

static bool is_review(const ImportReview *ours, const MaterialReview *there) {
    const MaterialReview *review = &ours->review;
    return is_same(review->status, there->status) && is_same(review->reason, there->reason) &&
           (!ours->has_reviewer || is_same(review->reviewer, there->reviewer)) &&
           (!ours->has_created || review->created_unix_ms == there->created_unix_ms);
}

// What a review that is not there yet must not be.
static Status judge_review(const Walk *walk, const char *place, const ImportReview *ours,
                           const char *before, const char *author) {
    const MaterialReview *review = &ours->review;
    const char *reviewer = ours->has_reviewer ? review->reviewer : walk->import->who;
    if (is_same(review->status, before))
        return fault(walk, place, "status", "is %s already", before);
    if (strcmp(review->status, "approved") == 0 && reviewer != NULL && is_same(reviewer, author))
        return fault(walk, place, "reviewer",
                     "is the revision's author, %.64s, and nobody approves their own", author);
    return STATUS_OK;
}

static Status add_review(const Walk *walk, Database *database, const char *slug, uint64_t revision,
                         const ImportReview *ours, Problem *problem) {
    MaterialReview review = ours->review;
    review.slug = (char *)slug;
    review.revision = revision;
    if (!ours->has_reviewer)
        review.reviewer = (char *)walk->import->who;
    if (!ours->has_created)
        review.created_unix_ms = walk->import->now_unix_ms;
    return material_review_add(database, &review, problem);
}

// Those that are there come first, and are the same.
static Status match_reviews(Walk *walk, Database *database, const ImportRevision *ours,
                            uint64_t number, const char *author, const Reviews *there, Group *group,
                            Problem *problem) {
    char list[POINTER_SIZE], place[POINTER_SIZE];
    const char *before = there->count > 0 ? there->at[there->count - 1].status : "draft";
    pointer_join(list, sizeof list, ours->mark.place, "reviews");
    for (size_t i = 0; i < ours->review_count; i++) {
        const ImportReview *review = &ours->reviews[i];
        pointer_index(place, sizeof place, list, i);
        if (i < there->count) {
            if (is_review(review, &there->at[i]))
                group->reviews_done.same++;
            else
                (void)fault(walk, place, "",
                            "is not the review of %.64s@%llu that is there, and those never change",
                            group->slug, (unsigned long long)number);
            continue;
        }
        const Status judged = judge_review(walk, place, review, before, author);
        before = review->review.status;
        if (judged != STATUS_OK)
            continue;
        if (!walk->import->may_all)
            deny(walk, ours->mark.place, "reviews", "brings reviews");
        group->reviews_done.added++;
        if (walk->writes && walk->faults->count == 0)
            TRY(add_review(walk, database, group->slug, number, review, problem));
    }
    return STATUS_OK;
}

static Status import_reviews(Walk *walk, Database *database, const ImportRevision *ours,
                             uint64_t number, const char *author, Group *group, Problem *problem) {
    Reviews there = {0};
    if (ours->review_count == 0 || ours->mark.is_faulty)
        return STATUS_OK;
    Status status = STATUS_OK;
    if (number <= group->key.latest)
        status = load_reviews(database, group->slug, number, &there, problem);
    if (status == STATUS_OK)
        status = match_reviews(walk, database, ours, number, author, &there, group, problem);
    reviews_clear(&there);
    return status;
}

// Revisions.

static void compare_revision(const Walk *walk, const ImportRevision *ours,
                             const MaterialRevision *there, Group *group) {
    const ImportMark *mark = &ours->mark;
    const size_t faults = walk->faults->count;
    (void)walk->import->says_same(&ours->said, there, mark->place, walk->faults);
    compare_marks(walk, mark, "revision",
                  (const char *const[]){ours->said.author, ours->said.comment},
                  ours->said.created_unix_ms, (const char *const[]){there->author, there->comment},
                  there->created_unix_ms);
    if (ours->said.reverts != there->reverts && !(ours->said.reverts == 0 && mark->is_faulty))
        (void)fault(walk, mark->place, "reverts",
                    "is not that of the revision that is there, and those never change");
    group->revisions_done.same += walk->faults->count == faults;
}

// A revision that says again what another one says.
static Status judge_reverts(const Walk *walk, Database *database, const ImportRevision *ours,
                            uint64_t number, const Group *group, Problem *problem) {
    const uint64_t again = ours->said.reverts;
    MaterialRevision there = {0};
    if (again == 0)
        return STATUS_OK;
    if (again >= number) {
        (void)fault(walk, ours->mark.place, "reverts", "must be a revision before %llu, is %llu",
                    (unsigned long long)number, (unsigned long long)again);
        return STATUS_OK;
    }
    if (again <= group->key.latest)
        TRY(load_revision(database, group->slug, again, &there, problem));
    const MaterialRevision *said = there.revision > 0 ? &there : NULL;
    for (size_t i = 0; said == NULL && i < group->revision_count; i++)
        if (group->revisions[i].said.revision == again && !group->revisions[i].mark.is_faulty)
            said = &group->revisions[i].said;
    if (said != NULL && !walk->import->says_same(&ours->said, said, "", NULL))
        (void)fault(walk, ours->mark.place, "reverts",
                    "revision %llu says something else; a revision that reverts says the same",
                    (unsigned long long)again);
    material_revision_clear(&there);
    return STATUS_OK;
}

static void judge_measurements(const Walk *walk, const ImportRevision *ours, const Group *group) {
    const Reals *named = &ours->said.material.measurements;
    char list[POINTER_SIZE], place[POINTER_SIZE];
    pointer_join(list, sizeof list, ours->mark.place, "measurements");
    for (size_t i = 0; i < named->count && !group->is_adrift; i++) {
        if (named->at[i] <= (double)group->last_measurement)
            continue;
        pointer_index(place, sizeof place, list, i);
        (void)fault(walk, place, "", "there is no measurement %.0f of \"%.64s\"; it has %llu",
                    named->at[i], group->slug, (unsigned long long)group->last_measurement);
    }
}

static Status add_revision(Walk *walk, Database *database, const ImportRevision *ours,
                           uint64_t number, Group *group, Problem *problem) {
    const ImportMark *mark = &ours->mark;
    judge_author(walk, mark, ours->said.author);
    judge_measurements(walk, ours, group);
    TRY(judge_reverts(walk, database, ours, number, group, problem));
    group->revisions_done.added++;
    MaterialRevision said = ours->said;
    said.revision = number;
    said.author = (char *)author_of(walk, mark, said.author);
    said.comment = mark->has_comment ? said.comment : (char *)"imported";
    said.created_unix_ms = mark->has_created ? said.created_unix_ms : walk->import->now_unix_ms;
    if (walk->writes && walk->faults->count == 0)
        TRY(material_revision_add(database, &said, problem));
    return import_reviews(walk, database, ours, number, said.author, group, problem);
}

// One without a number is the next, unless the newest says the same already.
static Status import_next(Walk *walk, Database *database, const ImportRevision *ours, Group *group,
                          Problem *problem) {
    MaterialRevision newest = {0};
    Status status = STATUS_OK;
    if (ours->mark.is_faulty)
        return STATUS_OK;
    if (group->key.latest > 0)
        status = load_revision(database, group->slug, group->key.latest, &newest, problem);
    if (status == STATUS_OK && newest.revision > 0 &&
        walk->import->says_same(&ours->said, &newest, "", NULL)) {
        group->revisions_done.same++;
        status =
            import_reviews(walk, database, ours, newest.revision, newest.author, group, problem);
    } else if (status == STATUS_OK) {
        status = add_revision(walk, database, ours, group->key.latest + 1, group, problem);
    }
    material_revision_clear(&newest);
    return status;
}

static Status import_known(Walk *walk, Database *database, const ImportRevision *ours, Group *group,
                           Problem *problem) {
    MaterialRevision there = {0};
    TRY(load_revision(database, group->slug, ours->said.revision, &there, problem));
    compare_revision(walk, ours, &there, group);
    const Status status =
        import_reviews(walk, database, ours, ours->said.revision, there.author, group, problem);
    material_revision_clear(&there);
    return status;
}

static Status import_revisions(Walk *walk, Database *database, Group *group, Problem *problem) {
    const char *name = walk->import->revision_name;
    uint64_t before = 0, last = group->key.latest;
    bool is_adrift = false;
    for (size_t i = 0; i < group->revision_count; i++) {
        const ImportRevision *ours = &group->revisions[i];
        const uint64_t number = ours->said.revision;
        is_adrift = is_adrift || ours->mark.is_adrift;
        if (is_adrift)
            continue;
        if (number == 0) {
            TRY(import_next(walk, database, ours, group, problem));
            continue;
        }
        if (judge_number(walk, &ours->mark, name, number, before, &last) != STATUS_OK)
            continue;
        before = number;
        if (number <= group->key.latest)
            TRY(import_known(walk, database, ours, group, problem));
        else if (!ours->mark.is_faulty)
            TRY(add_revision(walk, database, ours, number, group, problem));
    }
    return STATUS_OK;
}

static Status note(const Walk *walk, Database *database, const Group *group, Problem *problem) {
    char why[160];
    if (group->revisions_done.added + group->measurements_done.added + group->reviews_done.added ==
        0)
        return STATUS_OK;
    snprintf(why, sizeof why, "imported revisions: %zu, measurements: %zu, reviews: %zu",
             group->revisions_done.added, group->measurements_done.added,
             group->reviews_done.added);
    const MaterialDeed deed = {.action = (char *)"import",
                               .who = (char *)walk->import->who,
                               .why = why,
                               .created_unix_ms = walk->import->now_unix_ms};
    return material_deed_add(database, group->slug, &deed, problem);
}

static void count(ImportCount *all, const ImportCount *some) {
    all->added += some->added;
    all->same += some->same;
}

static Status import_group(Walk *walk, Database *database, Group *group, Problem *problem) {
    TRY(material_key_find(database, group->slug, 0, &group->key, problem));
    if (group->key.number == 0 && group->revision_count == 0) {
        (void)fault(walk, group->measurements[0].mark.place, "slug",
                    "there is no material \"%.64s\" to measure; bring a revision of it",
                    group->slug);
        return STATUS_OK;
    }
    if (group->key.number == 0 && walk->writes && walk->faults->count == 0)
        TRY(material_row_add(database, group->slug, problem));
    TRY(import_measurements(walk, database, group, problem));
    TRY(import_revisions(walk, database, group, problem));
    if (walk->writes && walk->faults->count == 0)
        TRY(note(walk, database, group, problem));
    count(&walk->tally->revisions, &group->revisions_done);
    count(&walk->tally->measurements, &group->measurements_done);
    count(&walk->tally->reviews, &group->reviews_done);
    return STATUS_OK;
}

static Status import_all(Walk *walk, Database *database, Problem *problem) {
    const MaterialImport *import = walk->import;
    size_t r = 0, m = 0;
    while (r < import->revision_count || m < import->measurement_count) {
        const char *a = r < import->revision_count ? import->revisions[r].said.slug : NULL;
        const char *b = m < import->measurement_count ? import->measurements[m].made.slug : NULL;
        Group group = {.slug = a == NULL || (b != NULL && strcmp(b, a) < 0) ? b : a,
                       .revisions = &import->revisions[r],
                       .measurements = &import->measurements[m]};
        for (; r < import->revision_count && is_same(import->revisions[r].said.slug, group.slug);
             r++)
            group.revision_count++;
        for (; m < import->measurement_count &&
               is_same(import->measurements[m].made.slug, group.slug);
             m++)
            group.measurement_count++;
        walk->tally->materials++;
        TRY(import_group(walk, database, &group, problem));
    }
    return STATUS_OK;
}

static Status refuse(const Walk *walk) {
    if (walk->faults->count > 0)
        return STATUS_INVALID;
    if (walk->denied == 0)
        return STATUS_OK;
    return problem_add(walk->faults, STATUS_FORBIDDEN, walk->denied_place,
                       "%s (%zu more rows are like it): what is by others, and reviews, may be "
                       "brought by who has the scope admin; nobody approves their own by way of a "
                       "file",
                       walk->denied_why, walk->denied - 1);
}

// May be done again from its beginning.
static Status write_all(Database *database, const void *work, Problem *problem) {
    Walk walk = *(const Walk *)work;
    problem_clear(walk.faults);
    *walk.tally = (ImportTally){0};
    TRY(import_all(&walk, database, problem));
    return refuse(&walk);
}

// Within one transaction of a reader, so that all of it is of one moment.
static Status judge_all(Store *store, Walk *walk, Problem *problem) {
    static const char begin[] = "BEGIN", end[] = "COMMIT";
    Database *database = store_take(store);
    Status status = database_change(database, begin, NULL, NULL, NULL, problem);
    if (status == STATUS_OK) {
        status = import_all(walk, database, problem);
        (void)database_change(database, end, NULL, NULL, NULL, NULL);
    }
    store_put(store, database);
    return status == STATUS_OK ? refuse(walk) : status;
}

Status store_material_import(Store *store, const MaterialImport *import, bool is_dry,
                             ImportTally *tally, Problem *problem) {
    *tally = (ImportTally){0};
    Walk walk = {.import = import, .tally = tally, .faults = problem};
    if (is_dry || problem->count > 0)
        return judge_all(store, &walk, problem);
    walk.writes = true;
    TRY(store_write(store, write_all, &walk, problem));
    store_catalogue_changed(store);
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
