// Tokens are few and change seldom: each read is of all of them.
#include "server/db/db_private.h"

// clang-format off
static const SqlColumn token_columns[] = {
    COLUMN_WITH(TokenRow, name, COLUMN_CHECKED | COLUMN_ID),
    COLUMN_WITH(TokenRow, digest, COLUMN_CHECKED),
    COLUMN_WITH(TokenRow, scopes, COLUMN_CHECKED),
    COLUMN_WITH(TokenRow, created_unix_ms, COLUMN_CHECKED),
    COLUMN(TokenRow, used_unix_ms),
    COLUMN_WITH(TokenRow, expires_unix_ms, COLUMN_CHECKED),
    COLUMN_WITH(TokenRow, revoked_unix_ms, COLUMN_CHECKED | COLUMN_MUTABLE),
    COLUMN_READ(TokenRow, is_damaged, "0"),
    COLUMN_END
};
const CheckedTable tokens_table = CHECKED_TABLE("tokens", token_columns, TokenRow);
// clang-format on

static Status token_find(Sqlite *database, const TokenRow *row, TokenRow *found, bool *is_found,
                         Problem *problem) {
    static const char sql[] = "SELECT {columns} FROM tokens WHERE name = :name";
    *found = (TokenRow){.name = ""};
    return sqlite_first(database, sql, token_columns, row, token_columns, found, is_found, problem);
}

static Status token_apply_add(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "INSERT INTO tokens {insert}";
    static const char count_sql[] = "SELECT count(*) AS count FROM tokens";
    const TokenRow *row = work;
    TokenRow found;
    QueryCounts counted = {0};
    bool is_found;
    TRY(token_find(database, row, &found, &is_found, problem));
    if (is_found)
        return problem_set(problem, STATUS_CONFLICT,
                           "there is a token \"%.64s\" already%s; choose another name", row->name,
                           found.revoked_unix_ms > 0 ? ", revoked" : "");
    TRY(sqlite_first(database, count_sql, NULL, NULL, query_counts_columns, &counted, NULL,
                     problem));
    if (counted.count >= TOKENS_MAX)
        return problem_set(problem, STATUS_LIMIT,
                           "%d tokens are kept, no more; forget those that are revoked",
                           TOKENS_MAX);
    return sqlite_change(database, sql, token_columns, row, NULL, problem);
}

Status db_token_add(Db *db, const TokenRow *row, Problem *problem) {
    return db_write(db, token_apply_add, row, problem);
}

Status db_tokens(Db *db, TokenRows *rows, Problem *problem) {
    static const char sql[] = "SELECT {columns} FROM tokens ORDER BY name";
    return db_list(db, sql, NULL, NULL, token_columns, sizeof *rows->at, rows, problem);
}

// A change of a token that must be revoked, or must not be.
typedef struct TokenChange {
    const TokenRow *row;
    const char *sql;
    bool is_revoked;
    const char *conflict; // what is wrong if it is not so
} TokenChange;

static Status token_apply_change(Sqlite *database, const void *work, Problem *problem) {
    const TokenChange *change = work;
    TokenRow found;
    bool is_found;
    TRY(token_find(database, change->row, &found, &is_found, problem));
    if (!is_found)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no token \"%.64s\"; `impactd token list` shows them",
                           change->row->name);
    if ((found.revoked_unix_ms > 0) != change->is_revoked)
        return problem_set(problem, STATUS_CONFLICT, "the token \"%.64s\" is %s", change->row->name,
                           change->conflict);
    return sqlite_change(database, change->sql, token_columns, change->row, NULL, problem);
}

Status db_token_revoke(Db *db, const TokenRow *row, Problem *problem) {
    static const char sql[] = "UPDATE tokens SET {set} WHERE name = :name";
    return db_write(db, token_apply_change, &(TokenChange){row, sql, false, "revoked already"},
                    problem);
}

Status db_token_forget(Db *db, const TokenRow *row, Problem *problem) {
    static const char sql[] = "DELETE FROM tokens WHERE name = :name";
    return db_write(db, token_apply_change,
                    &(TokenChange){row, sql, true, "in use; revoke it first"}, problem);
}

static Status token_apply_used(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "UPDATE tokens SET used_unix_ms = :used_unix_ms WHERE name = :name";
    return sqlite_change(database, sql, token_columns, work, NULL, problem);
}

Status db_token_used(Db *db, const TokenRow *row, Problem *problem) {
    return db_write(db, token_apply_used, row, problem);
}
