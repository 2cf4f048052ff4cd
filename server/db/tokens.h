// Access tokens as they are stored: names, digests, scopes, times.
#ifndef SERVER_DB_TOKENS_H
#define SERVER_DB_TOKENS_H

#include "server/db/db.h"

enum { TOKEN_NAME_SIZE = 65, TOKENS_MAX = 1000 };

// Times in milliseconds since 1970; 0: never.
typedef struct TokenRow {
    char name[TOKEN_NAME_SIZE]; // [A-Za-z0-9._-]{1,64}
    char digest[65];            // SHA-256, in hexadecimal digits
    char scopes[64];            // "read,submit"
    int64_t created_unix_ms, used_unix_ms, expires_unix_ms, revoked_unix_ms;
} TokenRow;
typedef struct TokenRows {
    TokenRow *at; // freed by free
    size_t count;
} TokenRows;

// STATUS_CONFLICT where the name is taken, STATUS_LIMIT where there are TOKENS_MAX.
Status db_token_add(Db *db, const TokenRow *row, Problem *problem);
// All, by name.
Status db_tokens(Db *db, TokenRows *rows, Problem *problem);
// Revokes at row->revoked_unix_ms; STATUS_NOT_FOUND, STATUS_CONFLICT if it is revoked already.
Status db_token_revoke(Db *db, const TokenRow *row, Problem *problem);
// Deletes it; STATUS_NOT_FOUND, STATUS_CONFLICT unless it is revoked.
Status db_token_forget(Db *db, const TokenRow *row, Problem *problem);
// Stores row->used_unix_ms.
Status db_token_used(Db *db, const TokenRow *row, Problem *problem);

#endif
