// A record is two rows that are written and deleted together; triggers keep them from being
// changed.
#include "server/db/records.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/db_private.h"
#include "server/db/record_memory.h"
#include "server/util/sha256.h"

// clang-format off
static const RowColumn record_columns[] = {
    ROW_COLUMN(RecordRow, number, COLUMN_INTEGER),
    ROW_COLUMN(RecordRow, name, COLUMN_TEXT),
    ROW_COLUMN(RecordRow, source, COLUMN_TEXT),
    ROW_COLUMN(RecordRow, processing, COLUMN_TEXT),
    ROW_COLUMN(RecordRow, earthquake, COLUMN_TEXT),
    ROW_COLUMN(RecordRow, station, COLUMN_TEXT),
    ROW_COLUMN(RecordRow, notes, COLUMN_TEXT),
    ROW_COLUMN(RecordRow, layout, COLUMN_TEXT),
    ROW_COLUMN(RecordRow, header, COLUMN_TEXT),
    ROW_COLUMN(RecordRow, unit, COLUMN_TEXT),
    ROW_COLUMN(RecordRow, stated_unit, COLUMN_TEXT),
    ROW_COLUMN(RecordRow, interval, COLUMN_REAL),
    ROW_COLUMN(RecordRow, count, COLUMN_COUNT),
    ROW_COLUMN(RecordRow, peak, COLUMN_REAL),
    ROW_COLUMN(RecordRow, peak_time, COLUMN_REAL),
    ROW_COLUMN(RecordRow, peak_velocity, COLUMN_REAL),
    ROW_COLUMN(RecordRow, end_velocity, COLUMN_REAL),
    ROW_COLUMN(RecordRow, digest, COLUMN_TEXT),
    ROW_COLUMN(RecordRow, author, COLUMN_TEXT),
    ROW_COLUMN(RecordRow, created_unix_ms, COLUMN_INTEGER),
    ROW_END
};
// clang-format on

// What is asked for, and numbers that come back.
typedef struct Key {
    char *name, *words, *digest, *use;
    StoredBytes samples;
    double interval;
    uint64_t most, count, results, jobs;
} Key;
static const RowColumn key_columns[] = {ROW_COLUMN(Key, name, COLUMN_TEXT),
                                        ROW_COLUMN(Key, words, COLUMN_TEXT),
                                        ROW_COLUMN(Key, digest, COLUMN_TEXT),
                                        ROW_COLUMN(Key, use, COLUMN_TEXT),
                                        ROW_COLUMN(Key, samples, COLUMN_BYTES),
                                        ROW_COLUMN(Key, interval, COLUMN_REAL),
                                        ROW_COLUMN(Key, most, COLUMN_COUNT),
                                        ROW_COLUMN(Key, count, COLUMN_COUNT),
                                        ROW_COLUMN(Key, results, COLUMN_COUNT),
                                        ROW_COLUMN(Key, jobs, COLUMN_COUNT),
                                        ROW_END};

static const char one_sql[] = "SELECT * FROM records WHERE name = :name";

void record_row_clear(RecordRow *row) {
    row_clear(record_columns, row, sizeof *row);
}

void record_rows_clear(RecordRows *rows) {
    for (size_t i = 0; i < rows->count; i++)
        record_row_clear(&rows->at[i]);
    free(rows->at);
    *rows = (RecordRows){NULL, 0};
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

static Status not_found(const char *name, Problem *problem) {
    return problem_set(problem, STATUS_NOT_FOUND, "there is no record \"%.64s\"", name);
}

// Within the writer's transaction.
static Status first(Sqlite *database, const char *sql, const Key *key, const RowColumn *columns,
                    void *target, bool *is_found, Problem *problem) {
    Statement *statement;
    *is_found = false;
    TRY(statement_begin(database, sql, key_columns, key, &statement, problem));
    Status status = statement_step(statement, is_found, problem);
    if (status == STATUS_OK && *is_found)
        status = row_read(statement, columns, target, problem);
    statement_end(statement);
    return status;
}

// In what a record that is there differs from one that is to be; NULL: in nothing.
static const char *difference(const RecordRow *there, const RecordRow *row) {
    if (!text_same(there->digest, row->digest))
        return "samples or another interval";
    const struct {
        const char *what, *there, *given;
    } words[] = {
        {"source", there->source, row->source},
        {"processing", there->processing, row->processing},
        {"earthquake", there->earthquake, row->earthquake},
        {"station", there->station, row->station},
        {"notes", there->notes, row->notes},
        {"layout", there->layout, row->layout},
        {"header", there->header, row->header},
        {"unit", there->unit, row->unit},
        {"stated unit", there->stated_unit, row->stated_unit},
    };
    for (size_t i = 0; i < COUNT(words); i++)
        if (!text_same(words[i].there, words[i].given))
            return words[i].what;
    return NULL;
}

typedef struct Adding {
    const RecordRow *row;
    const Reals *samples;
    bool *is_there;
} Adding;

static Status add(Sqlite *database, const void *work, Problem *problem) {
    static const char count_sql[] =
        "SELECT count(*) AS count, coalesce(sum(count), 0) AS most FROM records";
    static const char head_sql[] =
        "INSERT INTO records (name, source, processing, earthquake, station, notes, layout, "
        "header, unit, stated_unit, interval, count, peak, peak_time, peak_velocity, end_velocity, "
        "digest, author, created_unix_ms) VALUES (:name, :source, :processing, :earthquake, "
        ":station, :notes, :layout, :header, :unit, :stated_unit, :interval, :count, :peak, "
        ":peak_time, :peak_velocity, :end_velocity, :digest, :author, :created_unix_ms)";
    static const char body_sql[] = "INSERT INTO record_samples (number, samples) "
                                   "SELECT number, :samples FROM records WHERE name = :name";
    const Adding *adding = work;
    const RecordRow *row = adding->row;
    Key key = {.name = row->name}, counted = {.count = 0};
    RecordRow there = {0};
    bool is_found;
    TRY(first(database, one_sql, &key, record_columns, &there, adding->is_there, problem));
    if (*adding->is_there) {
        const char *other = difference(&there, row);
        record_row_clear(&there);
        return other == NULL ? STATUS_OK
                             : problem_set(problem, STATUS_CONFLICT,
                                           "there is a record \"%.64s\" already, of another %s: "
                                           "records never change; choose another name",
                                           row->name, other);
    }
    TRY(first(database, count_sql, &key, key_columns, &counted, &is_found, problem));
    if (counted.count >= RECORDS_MAX)
        return problem_set(problem, STATUS_LIMIT,
                           "%d records are kept, no more; delete some that nothing uses",
                           RECORDS_MAX);
    if (counted.most + row->count > RECORDS_SAMPLES)
        return problem_set(problem, STATUS_LIMIT,
                           "the records have %llu samples, with this one more than the %llu that "
                           "are kept; delete some that nothing uses",
                           (unsigned long long)counted.most, (unsigned long long)RECORDS_SAMPLES);
    TRY(sqlite_change(database, head_sql, record_columns, row, NULL, problem));
    key.samples = (StoredBytes){adding->samples->at, adding->samples->count * sizeof(double)};
    return sqlite_change(database, body_sql, key_columns, &key, NULL, problem);
}

Status db_record_add(Db *db, const RecordRow *row, const Reals *samples, bool *is_there,
                     Problem *problem) {
    TRY(db_write(db, add, &(Adding){row, samples, is_there}, problem));
    if (!*is_there)
        db_catalog_changed(db);
    return STATUS_OK;
}

Status db_record(Db *db, const char *name, RecordRow *row, Problem *problem) {
    const Key key = {.name = (char *)name};
    bool is_found;
    memset(row, 0, sizeof *row);
    TRY(db_first(db, one_sql, key_columns, &key, record_columns, row, &is_found, problem));
    return is_found ? STATUS_OK : not_found(name, problem);
}

static Status list(Db *db, const char *sql, const Key *key, RecordRows *rows, Problem *problem) {
    void *at;
    const Status status = db_all(db, sql, key_columns, key, record_columns, sizeof *rows->at, &at,
                                 &rows->count, problem);
    rows->at = at;
    if (status != STATUS_OK)
        record_rows_clear(rows);
    return status;
}

Status db_records(Db *db, const char *words, const char *after, size_t most, RecordRows *rows,
                  Problem *problem) {
    static const char sql[] =
        "SELECT * FROM records WHERE name > :name AND (:words IS NULL OR instr(lower(name || "
        "char(10) || coalesce(earthquake, '') || char(10) || coalesce(station, '') || char(10) || "
        "coalesce(source, '') || char(10) || coalesce(processing, '') || char(10) || "
        "coalesce(notes, '')), lower(:words)) > 0) ORDER BY name LIMIT :most";
    const Key key = {.name = (char *)after, .words = (char *)words, .most = most};
    return list(db, sql, &key, rows, problem);
}

Status db_record_twins(Db *db, const RecordRow *row, RecordRows *rows, Problem *problem) {
    static const char sql[] = "SELECT * FROM records WHERE digest = :digest AND name <> :name "
                              "ORDER BY number LIMIT :most";
    const Key key = {.name = row->name, .digest = row->digest, .most = RECORD_TWINS};
    return list(db, sql, &key, rows, problem);
}

// A copy of its own, of whole numbers.
static Status read_samples(Db *db, const RecordRow *row, Reals *samples, Problem *problem) {
    static const char sql[] = "SELECT s.samples FROM record_samples s JOIN records r USING "
                              "(number) WHERE r.name = :name AND r.digest = :digest";
    const Key key = {.name = row->name, .digest = row->digest};
    Key found = {.name = NULL};
    bool is_found;
    TRY(db_first(db, sql, key_columns, &key, key_columns, &found, &is_found, problem));
    if (!is_found)
        return not_found(row->name, problem);
    if (found.samples.size != row->count * sizeof(double)) {
        row_clear(key_columns, &found, sizeof found);
        return problem_set(problem, STATUS_INTERNAL, "the record \"%.64s\" is not whole",
                           row->name);
    }
    *samples = (Reals){found.samples.at, row->count};
    return STATUS_OK;
}

Status db_record_named(Db *db, const char *name, NamedRecord **named, Problem *problem) {
    RecordMemory *memory = db_record_memory(db);
    const uint64_t catalog_version = db_catalog_version(db);
    RecordRow row;
    Reals samples;
    *named = record_memory_find(memory, catalog_version, name, NULL);
    if (*named != NULL)
        return STATUS_OK;
    Status status = db_record(db, name, &row, problem);
    if (status == STATUS_OK)
        *named = record_memory_find(memory, catalog_version, name, row.digest);
    if (status == STATUS_OK && *named == NULL) {
        status = read_samples(db, &row, &samples, problem);
        if (status == STATUS_OK)
            *named = named_record_new(row.name, row.digest, row.interval, &samples);
        if (*named != NULL)
            *named = record_memory_put(memory, catalog_version, *named);
        else if (status == STATUS_OK)
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a record");
    }
    record_row_clear(&row);
    return status;
}

void record_use_name(const char *name, char target[RECORD_NAME_SIZE + 8]) {
    snprintf(target, RECORD_NAME_SIZE + 8, "record:%.64s", name);
}

static const char uses_sql[] =
    "SELECT (SELECT count(*) FROM result_uses WHERE name = :use) AS results, "
    "(SELECT count(*) FROM job_uses WHERE name = :use) AS jobs";

Status db_record_uses(Db *db, const char *name, RecordUses *uses, Problem *problem) {
    char use[RECORD_NAME_SIZE + 8];
    record_use_name(name, use);
    const Key key = {.use = use};
    Key found = {.results = 0};
    bool is_found;
    TRY(db_first(db, uses_sql, key_columns, &key, key_columns, &found, &is_found, problem));
    *uses = (RecordUses){found.results, found.jobs};
    return STATUS_OK;
}

typedef struct Deleting {
    Key key;
    RecordUses *uses;
} Deleting;

static Status delete (Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "DELETE FROM records WHERE name = :name";
    const Deleting *deleting = work;
    Key found = {.results = 0};
    bool is_found;
    int changes;
    TRY(first(database, uses_sql, &deleting->key, key_columns, &found, &is_found, problem));
    *deleting->uses = (RecordUses){found.results, found.jobs};
    if (found.results + found.jobs > 0)
        return problem_set(problem, STATUS_CONFLICT,
                           "the record \"%.64s\" is used by %llu result%s and %llu unfinished "
                           "job%s: it can be deleted when none is left",
                           deleting->key.name, (unsigned long long)found.results,
                           found.results == 1 ? "" : "s", (unsigned long long)found.jobs,
                           found.jobs == 1 ? "" : "s");
    TRY(sqlite_change(database, sql, key_columns, &deleting->key, &changes, problem));
    return changes > 0 ? STATUS_OK : not_found(deleting->key.name, problem);
}

Status db_record_delete(Db *db, const char *name, RecordUses *uses, Problem *problem) {
    char use[RECORD_NAME_SIZE + 8];
    record_use_name(name, use);
    const Deleting deleting = {{.name = (char *)name, .use = use}, uses};
    *uses = (RecordUses){0, 0};
    TRY(db_write(db, delete, &deleting, problem));
    db_catalog_changed(db);
    return STATUS_OK;
}
