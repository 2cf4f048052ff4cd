// Tokens are few and change seldom: every look is at all of them.
#include "server/db/tokens.h"

#include <stdlib.h>
#include <string.h>

#include "server/db/db_private.h"

// clang-format off
static const RowColumn token_columns[] = {
    ROW_COLUMN(TokenRow, name, COLUMN_NAME),
    ROW_COLUMN(TokenRow, digest, COLUMN_NAME),
    ROW_COLUMN(TokenRow, scopes, COLUMN_NAME),
    ROW_COLUMN(TokenRow, created_unix_ms, COLUMN_INTEGER),
    ROW_COLUMN(TokenRow, used_unix_ms, COLUMN_INTEGER),
    ROW_COLUMN(TokenRow, expires_unix_ms, COLUMN_INTEGER),
    ROW_COLUMN(TokenRow, revoked_unix_ms, COLUMN_INTEGER),
    ROW_END
};
// clang-format on

// The row of that name and how many there are, within the writer's transaction.
typedef struct Found {
    int64_t count, revoked_unix_ms;
    bool is_there;
} Found;
static const RowColumn found_columns[] = {ROW_COLUMN(Found, count, COLUMN_INTEGER),
                                          ROW_COLUMN(Found, revoked_unix_ms, COLUMN_INTEGER),
                                          ROW_COLUMN(Found, is_there, COLUMN_FLAG), ROW_END};

static Status find(Sqlite *database, const TokenRow *row, Found *found, Problem *problem) {
    static const char sql[] =
        "SELECT count(*) AS count, coalesce(max(name = :name), 0) AS is_there, "
        "coalesce(max(revoked_unix_ms) FILTER (WHERE name = :name), 0) AS revoked_unix_ms "
        "FROM tokens";
    Statement *statement;
    bool has_row = false;
    *found = (Found){0};
    TRY(statement_begin(database, sql, token_columns, row, &statement, problem));
    Status status = statement_step(statement, &has_row, problem);
    if (status == STATUS_OK && has_row)
        status = row_read(statement, found_columns, found, problem);
    statement_end(statement);
    return status;
}

static Status require(Sqlite *database, const TokenRow *row, Found *found, Problem *problem) {
    TRY(find(database, row, found, problem));
    if (found->is_there)
        return STATUS_OK;
    return problem_set(problem, STATUS_NOT_FOUND,
                       "there is no token \"%.64s\"; `impactd token list` shows them", row->name);
}

static Status add(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] =
        "INSERT INTO tokens (name, digest, scopes, created_unix_ms, used_unix_ms, expires_unix_ms, "
        "revoked_unix_ms) VALUES (:name, :digest, :scopes, :created_unix_ms, :used_unix_ms, "
        ":expires_unix_ms, :revoked_unix_ms)";
    const TokenRow *row = work;
    Found found;
    TRY(find(database, row, &found, problem));
    if (found.is_there)
        return problem_set(problem, STATUS_CONFLICT,
                           "there is a token \"%.64s\" already%s; choose another name", row->name,
                           found.revoked_unix_ms > 0 ? ", revoked" : "");
    if (found.count >= TOKENS_MAX)
        return problem_set(problem, STATUS_LIMIT,
                           "%d tokens are kept, no more; forget those that are revoked",
                           TOKENS_MAX);
    return sqlite_change(database, sql, token_columns, row, NULL, problem);
}

Status db_token_add(Db *db, const TokenRow *row, Problem *problem) {
    return db_write(db, add, row, problem);
}

Status db_tokens(Db *db, TokenRows *rows, Problem *problem) {
    static const char sql[] = "SELECT * FROM tokens ORDER BY name";
    void *at;
    const Status status =
        db_all(db, sql, NULL, NULL, token_columns, sizeof *rows->at, &at, &rows->count, problem);
    rows->at = at;
    if (status != STATUS_OK) {
        free(at);
        *rows = (TokenRows){0};
    }
    return status;
}

static Status revoke(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] =
        "UPDATE tokens SET revoked_unix_ms = :revoked_unix_ms WHERE name = :name";
    const TokenRow *row = work;
    Found found;
    TRY(require(database, row, &found, problem));
    if (found.revoked_unix_ms > 0)
        return problem_set(problem, STATUS_CONFLICT, "the token \"%.64s\" is revoked already",
                           row->name);
    return sqlite_change(database, sql, token_columns, row, NULL, problem);
}

Status db_token_revoke(Db *db, const TokenRow *row, Problem *problem) {
    return db_write(db, revoke, row, problem);
}

static Status forget(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "DELETE FROM tokens WHERE name = :name";
    const TokenRow *row = work;
    Found found;
    TRY(require(database, row, &found, problem));
    if (found.revoked_unix_ms == 0)
        return problem_set(problem, STATUS_CONFLICT,
                           "the token \"%.64s\" is in use; revoke it first", row->name);
    return sqlite_change(database, sql, token_columns, row, NULL, problem);
}

Status db_token_forget(Db *db, const TokenRow *row, Problem *problem) {
    return db_write(db, forget, row, problem);
}

static Status used(Sqlite *database, const void *work, Problem *problem) {
    static const char sql[] = "UPDATE tokens SET used_unix_ms = :used_unix_ms WHERE name = :name";
    return sqlite_change(database, sql, token_columns, work, NULL, problem);
}

Status db_token_used(Db *db, const TokenRow *row, Problem *problem) {
    return db_write(db, used, row, problem);
}
