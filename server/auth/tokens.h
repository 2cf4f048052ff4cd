// Bearer tokens and their scopes, checked against a table in memory that follows the database
// within a second.
#ifndef SERVER_AUTH_TOKENS_H
#define SERVER_AUTH_TOKENS_H

#include "server/db/db.h"

typedef struct Tokens Tokens;

extern const char *const scope_names[]; // "read", ..., NULL-terminated; "admin" includes the others

// Reads the table and starts the thread that follows it. With `are_required` every request needs a
// token; otherwise from the first token in the database on, also if it is revoked. Borrows `db`.
Status tokens_open(Db *db, bool are_required, Tokens **tokens, Problem *problem);
void tokens_close(Tokens *tokens);

// How many could be used now.
size_t tokens_usable(Tokens *tokens);

typedef struct Holder {
    char name[TOKEN_NAME_SIZE]; // the token's; "" where none is needed
    bool is_admin;
} Holder;

// Whether a request with this Authorization header (NULL: none) may use what needs `scope`, and
// whose token it has. STATUS_UNAUTHORIZED, STATUS_FORBIDDEN. From any thread; no SQL unless the
// token is unknown, and then rarely.
Status tokens_check(Tokens *tokens, const char *authorization, const char *scope, Holder *holder,
                    Problem *problem);

enum { TOKEN_SIZE = 73 }; // "impactd_", 64 digits and a NUL
// Makes a token of 256 random bits and fills the row but for its name. `scopes` is a list with
// commas; `expires_unix_ms` 0: never. Only the token's digest is stored.
Status token_make(const char *scopes, int64_t expires_unix_ms, TokenRow *row,
                  char token[TOKEN_SIZE], Problem *problem);

#endif
