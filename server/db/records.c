// Ground-motion records: two rows each, which are added and deleted together; triggers prevent
// changes.
#include "server/db/records.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/recorded_motion.h"
#include "core/formats/ground_motion_text.h"
#include "server/db/db_private.h"
#include "server/util/sha256.h"

// clang-format off
static const SqlColumn record_columns[] = {
    COLUMN_READ(RecordRow, number, "number"),
    COLUMN_WITH(RecordRow, name, COLUMN_CHECKED | COLUMN_ID),
    COLUMN_WITH(RecordRow, source, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, processing, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, earthquake, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, station, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, notes, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, layout, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, header, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, unit, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, stated_unit, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, interval, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, count, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, peak, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, peak_time, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, peak_velocity, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, end_velocity, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, digest, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, author, COLUMN_CHECKED),
    COLUMN_WITH(RecordRow, created_unix_ms, COLUMN_CHECKED),
    COLUMN_END
};
// clang-format on
const CheckedTable records_table = CHECKED_TABLE("records", record_columns, RecordRow);

typedef struct Samples {
    char *name;
    StoredBytes samples;
} Samples;
static const SqlColumn samples_columns[] = {
    COLUMN_OF(Samples, name, "name", COLUMN_ID | COLUMN_BOUND, "name"),
    COLUMN_WITH(Samples, samples, COLUMN_CHECKED), COLUMN_END};
const CheckedTable samples_table = CHECKED_TABLE_WITH(
    "record_samples", samples_columns, Samples,
    ", (SELECT name FROM records r WHERE r.number = record_samples.number) AS name");

static const char one_sql[] = "SELECT {columns} FROM records WHERE name = :name";

void record_row_clear(RecordRow *row) {
    row_clear(record_columns, row, sizeof *row);
}

void record_rows_clear(RecordRows *rows) {
    rows_clear(record_columns, sizeof *rows->at, rows);
}

bool record_name_is_sound(const char *name) {
    static const char alone[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789";
    const size_t size = strlen(name);
    if (size == 0 || size >= RECORD_NAME_SIZE || strchr(alone, name[0]) == NULL)
        return false;
    for (size_t i = 1; i < size; i++)
        if (strchr(alone, name[i]) == NULL && strchr("._-", name[i]) == NULL)
            return false;
    return true;
}

void record_digest(double interval, const Reals *samples, char digest[RECORD_DIGEST_SIZE]) {
    Sha256 *taking = sha256_new();
    digest[0] = '\0';
    if (taking == NULL)
        return;
    sha256_add(taking, &interval, sizeof interval);
    sha256_add(taking, samples->at, samples->count * sizeof *samples->at);
    sha256_end(taking, digest);
}

Status record_row_measure(RecordRow *row, const Reals *samples, int unit) {
    const RecordLook look = record_look(samples, row->interval, 1);
    char digest[RECORD_DIGEST_SIZE];
    row->count = samples->count;
    row->peak = fmax(look.highest, -look.lowest);
    row->peak_time = (double)look.peak_at / (1 / row->interval);
    row->peak_velocity = look.peak_velocity;
    row->end_velocity = look.end_velocity;
    record_digest(row->interval, samples, digest);
    row->unit = strdup(acceleration_unit_names[unit]);
    row->digest = digest[0] != '\0' ? strdup(digest) : NULL;
    return status_made(row->unit != NULL && row->digest != NULL);
}

static const char no_record[] = "there is no record \"%.64s\"";

// What differs between a stored record and a new one; NULL: nothing.
static const char *record_difference(const RecordRow *stored, const RecordRow *row) {
    static const char own[] = " name author digest ";
    if (!text_same(stored->digest, row->digest))
        return "samples or another interval";
    for (const SqlColumn *column = record_columns; column->name != NULL; column++) {
        const char *a = (const char *)stored + column->offset,
                   *b = (const char *)row + column->offset;
        char word[32];
        snprintf(word, sizeof word, " %s ", column->name);
        if (column->kind == COLUMN_TEXT && strstr(own, word) == NULL &&
            !text_same(*(char *const *)(const void *)a, *(char *const *)(const void *)b))
            return strcmp(column->name, "stated_unit") == 0 ? "stated unit" : column->name;
    }
    return NULL;
}

typedef struct Adding {
    const RecordRow *row;
    const Reals *samples;
    bool *is_there;
} Adding;

static Status record_apply_add(Sqlite *database, const void *work, Problem *problem) {
    static const char count_sql[] =
        "SELECT count(*) AS count, coalesce(sum(count), 0) AS bytes FROM records";
    static const char head_sql[] = "INSERT INTO records {insert}";
    static const char body_sql[] =
        "INSERT INTO record_samples (number, samples, checks) "
        "SELECT number, :samples, :checks FROM records WHERE name = :name";
    const Adding *adding = work;
    const RecordRow *row = adding->row;
    const QueryKey key = {.name = row->name};
    QueryCounts counted = {0};
    RecordRow there = {0};
    TRY(sqlite_first(database, one_sql, query_key_columns, &key, record_columns, &there,
                     adding->is_there, problem));
    if (*adding->is_there) {
        const char *other = record_difference(&there, row);
        record_row_clear(&there);
        return other == NULL ? STATUS_OK
                             : problem_set(problem, STATUS_CONFLICT,
                                           "there is a record \"%.64s\" already, of another %s: "
                                           "records never change; choose another name",
                                           row->name, other);
    }
    TRY(sqlite_first(database, count_sql, NULL, NULL, query_counts_columns, &counted, NULL,
                     problem));
    if (counted.count >= RECORDS_MAX)
        return problem_set(problem, STATUS_LIMIT,
                           "%d records are kept, no more; delete some that nothing uses",
                           RECORDS_MAX);
    if (counted.bytes + row->count > RECORDS_SAMPLES)
        return problem_set(problem, STATUS_LIMIT,
                           "the records have %llu samples, with this one more than the %llu that "
                           "are kept; delete some that nothing uses",
                           (unsigned long long)counted.bytes, (unsigned long long)RECORDS_SAMPLES);
    TRY(sqlite_change(database, head_sql, record_columns, row, NULL, problem));
    const Samples body = {(char *)(uintptr_t)row->name,
                          {adding->samples->at, adding->samples->count * sizeof(double)}};
    return sqlite_change(database, body_sql, samples_columns, &body, NULL, problem);
}

Status db_record_add(Db *db, const RecordRow *row, const Reals *samples, bool *is_there,
                     Problem *problem) {
    return db_write(db, record_apply_add, &(Adding){row, samples, is_there}, problem);
}

Status db_record(Db *db, const char *name, RecordRow *row, Problem *problem) {
    return db_get(db, one_sql, &(QueryKey){.name = name}, record_columns, row, sizeof *row, problem,
                  no_record, name);
}

Status db_records(Db *db, const char *words, const char *after, size_t most, RecordRows *rows,
                  Problem *problem) {
    static const char sql[] =
        "SELECT {columns} FROM records WHERE name > :name AND (:words IS NULL OR instr(lower(name "
        "|| char(10) || coalesce(earthquake, '') || char(10) || coalesce(station, '') || char(10) "
        "|| coalesce(source, '') || char(10) || coalesce(processing, '') || char(10) || "
        "coalesce(notes, '')), lower(:words)) > 0) ORDER BY name LIMIT :max";
    const QueryKey key = {.name = after, .words = words, .max = most};
    return db_list(db, sql, query_key_columns, &key, record_columns, sizeof *rows->at, rows,
                   problem);
}

Status db_record_twins(Db *db, const RecordRow *row, RecordRows *rows, Problem *problem) {
    static const char sql[] = "SELECT {columns} FROM records WHERE digest = :digest AND name <> "
                              ":name ORDER BY number LIMIT :max";
    const QueryKey key = {.name = row->name, .digest = row->digest, .max = RECORD_TWINS};
    return db_list(db, sql, query_key_columns, &key, record_columns, sizeof *rows->at, rows,
                   problem);
}

// A copy owned by the caller, of exactly row->count numbers.
static Status record_read_samples(Db *db, const RecordRow *row, Reals *samples, Problem *problem) {
    static const char sql[] =
        "SELECT number, r.name, s.samples, s.checks FROM record_samples s JOIN records r USING "
        "(number) WHERE r.name = :name AND r.digest = :digest";
    const QueryKey key = {.name = row->name, .digest = row->digest};
    Samples found;
    TRY(db_get(db, sql, &key, samples_columns, &found, sizeof found, problem, no_record,
               row->name));
    free(found.name);
    *samples = (Reals){found.samples.at, row->count};
    char digest[RECORD_DIGEST_SIZE] = "of another number of samples";
    if (found.samples.size == row->count * sizeof(double))
        record_digest(row->interval, samples, digest);
    if (strcmp(digest, row->digest) == 0)
        return STATUS_OK;
    free(samples->at);
    *samples = (Reals){NULL, 0};
    if (digest[0] == '\0')
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a record");
    return problem_set(
        problem, STATUS_INTERNAL,
        "the record \"%.64s\" is damaged: its samples differ from their digest; put a "
        "backup in its place (impactd restore)",
        row->name);
}

Status db_record_named(Db *db, const char *name, NamedRecord **named, Problem *problem) {
    SharedCache *cache = db_cache(db, CACHE_RECORDS);
    char key[SHARED_KEY_SIZE];
    uint64_t generation;
    RecordRow row;
    Reals samples;
    *named = NULL;
    Status status = db_record(db, name, &row, problem);
    if (status == STATUS_OK) {
        snprintf(key, sizeof key, "%.64s %.64s", row.name, row.digest);
        *named = (NamedRecord *)(void *)shared_cache_find(cache, key, &generation);
    }
    if (status == STATUS_OK && *named == NULL) {
        status = record_read_samples(db, &row, &samples, problem);
        if (status == STATUS_OK)
            *named = named_record_new(row.name, row.digest, row.interval, &samples);
        if (*named != NULL)
            *named = (NamedRecord *)(void *)shared_cache_add(
                cache, key, generation, &(*named)->shared, row.count * sizeof(double));
        else if (status == STATUS_OK)
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a record");
    }
    record_row_clear(&row);
    return status;
}

void record_use_name(const char *name, char target[RECORD_NAME_SIZE + 8]) {
    snprintf(target, RECORD_NAME_SIZE + 8, "record:%.64s", name);
}

// Results made with it and unfinished jobs.
static const char uses_sql[] =
    "SELECT (SELECT count(*) FROM result_uses WHERE name = :name) AS results, "
    "(SELECT count(*) FROM job_uses WHERE name = :name) AS jobs";
static const SqlColumn uses_columns[] = {COLUMN(RecordUses, results), COLUMN(RecordUses, jobs),
                                         COLUMN_END};

Status db_record_uses(Db *db, const char *name, RecordUses *uses, Problem *problem) {
    char use[RECORD_NAME_SIZE + 8];
    record_use_name(name, use);
    return db_first(db, uses_sql, query_key_columns, &(QueryKey){.name = use}, uses_columns, uses,
                    NULL, problem);
}

typedef struct Deleting {
    const char *name;
    RecordUses *uses;
} Deleting;

static Status record_apply_delete(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "DELETE FROM records WHERE name = :name";
    const Deleting *deleting = work;
    RecordUses *uses = deleting->uses;
    char use[RECORD_NAME_SIZE + 8];
    int changes;
    record_use_name(deleting->name, use);
    TRY(sqlite_first(database, uses_sql, query_key_columns, &(QueryKey){.name = use}, uses_columns,
                     uses, NULL, problem));
    if (uses->results + uses->jobs > 0)
        return problem_set(problem, STATUS_CONFLICT,
                           "the record \"%.64s\" is used by %llu result%s and %llu unfinished "
                           "job%s: it can be deleted when none is left",
                           deleting->name, (unsigned long long)uses->results,
                           uses->results == 1 ? "" : "s", (unsigned long long)uses->jobs,
                           uses->jobs == 1 ? "" : "s");
    TRY(sqlite_change(database, sql, query_key_columns, &(QueryKey){.name = deleting->name},
                      &changes, problem));
    return changes > 0 ? STATUS_OK
                       : problem_set(problem, STATUS_NOT_FOUND, no_record, deleting->name);
}

Status db_record_delete(Db *db, const char *name, RecordUses *uses, Problem *problem) {
    *uses = (RecordUses){0, 0};
    return db_write(db, record_apply_delete, &(Deleting){name, uses}, problem);
}
