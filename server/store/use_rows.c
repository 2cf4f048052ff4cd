// Which results were made with what of the catalogue.
#include <stdio.h>
#include <stdlib.h>

#include "server/store/access.h"
#include "server/store/material_rows.h"

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

Status store_result_uses(Store *store, const char *name, size_t most, int64_t before,
                         ResultUses *uses, uint64_t *total, Problem *problem) {
    static const char count_sql[] = "SELECT count(*) AS total FROM result_uses WHERE name = :name";
    static const char sql[] =
        "SELECT r.number, r.id, r.created_unix_ms FROM result_uses u JOIN results r ON r.number = "
        "u.result WHERE u.name = :name AND u.result < :before ORDER BY u.result DESC LIMIT :most";
    const UseKey key = {(char *)name, most, 0, before == 0 ? INT64_MAX : before};
    UseKey counted = {0};
    bool is_found;
    void *at;
    *uses = (ResultUses){NULL, 0};
    store_settle(store); // results whose rows wait count
    TRY(store_first(store, count_sql, key_columns, &key, key_columns, &counted, &is_found,
                    problem));
    *total = counted.total;
    const Status status = store_all(store, sql, key_columns, &key, use_columns, sizeof *uses->at,
                                    &at, &uses->count, problem);
    uses->at = at;
    if (status != STATUS_OK) {
        free(at);
        *uses = (ResultUses){NULL, 0};
    }
    return status;
}

// The names of a material's revisions begin alike: "sponge@" up to "spongeA", the next byte.
typedef struct UseSpan {
    char first[72], beyond[72];
} UseSpan;
static const RowColumn span_columns[] = {ROW_COLUMN(UseSpan, first, COLUMN_NAME),
                                         ROW_COLUMN(UseSpan, beyond, COLUMN_NAME), ROW_END};
typedef struct MaterialUse MaterialUse;
static const RowColumn material_use_columns[] = {ROW_COLUMN(MaterialUse, revision, COLUMN_COUNT),
                                                 ROW_COLUMN(MaterialUse, results, COLUMN_COUNT),
                                                 ROW_END};

Status store_material_uses(Store *store, const char *slug, MaterialUses *uses, Problem *problem) {
    static const char sql[] =
        "SELECT CAST(substr(name, instr(name, '@') + 1) AS INTEGER) AS revision, count(*) AS "
        "results FROM result_uses WHERE name >= :first AND name < :beyond GROUP BY name ORDER BY "
        "revision";
    UseSpan span;
    void *at;
    *uses = (MaterialUses){NULL, 0};
    if (!material_slug_is_good(slug))
        return STATUS_OK;
    snprintf(span.first, sizeof span.first, "%s@", slug);
    snprintf(span.beyond, sizeof span.beyond, "%sA", slug);
    store_settle(store);
    const Status status = store_all(store, sql, span_columns, &span, material_use_columns,
                                    sizeof *uses->at, &at, &uses->count, problem);
    uses->at = at;
    if (status != STATUS_OK) {
        free(at);
        *uses = (MaterialUses){NULL, 0};
    }
    return status;
}
