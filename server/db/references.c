// Which results were made, and which jobs accepted, with what of the catalogue.
#include <stdlib.h>
#include <string.h>

#include "server/db/db_private.h"
#include "server/db/materials.h"

typedef struct UseLine {
    char name[160];
} UseLine;
static const RowColumn line_columns[] = {ROW_COLUMN(UseLine, name, COLUMN_NAME), ROW_END};

Status use_lines_add(Sqlite *database, const char *sql, const char *lines, Problem *problem) {
    while (lines != NULL && *lines != '\0') {
        const size_t size = strcspn(lines, "\n");
        UseLine line = {""};
        if (size > 0 && size < sizeof line.name) {
            memcpy(line.name, lines, size);
            TRY(sqlite_change(database, sql, line_columns, &line, NULL, problem));
        }
        lines += size + (lines[size] == '\n');
    }
    return STATUS_OK;
}

typedef struct UseKey {
    char *name;
    uint64_t most, total;
    int64_t before;
} UseKey;
static const RowColumn key_columns[] = {
    ROW_COLUMN(UseKey, name, COLUMN_TEXT), ROW_COLUMN(UseKey, most, COLUMN_COUNT),
    ROW_COLUMN(UseKey, total, COLUMN_COUNT), ROW_COLUMN(UseKey, before, COLUMN_INTEGER), ROW_END};
static const RowColumn use_columns[] = {
    ROW_COLUMN(ResultUse, number, COLUMN_INTEGER), ROW_COLUMN(ResultUse, id, COLUMN_NAME),
    ROW_COLUMN(ResultUse, created_unix_ms, COLUMN_INTEGER), ROW_END};

Status db_result_uses(Db *db, const char *name, size_t most, int64_t before, ResultUses *uses,
                      uint64_t *total, Problem *problem) {
    static const char count_sql[] = "SELECT count(*) AS total FROM result_uses WHERE name = :name";
    static const char sql[] =
        "SELECT r.number, r.id, r.created_unix_ms FROM result_uses u JOIN results r ON r.number = "
        "u.result WHERE u.name = :name AND u.result < :before ORDER BY u.result DESC LIMIT :most";
    const UseKey key = {(char *)name, most, 0, before == 0 ? INT64_MAX : before};
    UseKey counted = {0};
    bool is_found;
    void *at;
    *uses = (ResultUses){NULL, 0};
    db_flush(db); // results whose rows wait count
    TRY(db_first(db, count_sql, key_columns, &key, key_columns, &counted, &is_found, problem));
    *total = counted.total;
    const Status status = db_all(db, sql, key_columns, &key, use_columns, sizeof *uses->at, &at,
                                 &uses->count, problem);
    uses->at = at;
    if (status != STATUS_OK) {
        free(at);
        *uses = (ResultUses){NULL, 0};
    }
    return status;
}

static const RowColumn material_use_columns[] = {
    ROW_COLUMN(MaterialReference, revision, COLUMN_COUNT),
    ROW_COLUMN(MaterialReference, results, COLUMN_COUNT),
    ROW_COLUMN(MaterialReference, status, COLUMN_NAME), ROW_END};

Status db_material_uses(Db *db, const char *slug, MaterialReferences *uses, Problem *problem) {
    static const char sql[] =
        "SELECT revision, status, (SELECT count(*) FROM result_uses u WHERE u.name = slug || '@' "
        "|| revision) AS results FROM material_states WHERE slug = :name ORDER BY revision DESC";
    const UseKey key = {.name = (char *)slug};
    void *at;
    db_flush(db);
    const Status status = db_all(db, sql, key_columns, &key, material_use_columns, sizeof *uses->at,
                                 &at, &uses->count, problem);
    uses->at = at;
    if (status != STATUS_OK) {
        free(at);
        *uses = (MaterialReferences){NULL, 0};
    }
    return status;
}
