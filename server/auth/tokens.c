// The thread reads the table twice a second, which finds the changes of other processes, and writes
// back when tokens were last used, each at most once a minute.
#include "server/auth/tokens.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>
#include <time.h>

#include "server/util/clock.h"
#include "server/util/sha256.h"
#include "server/util/thread_pool.h"

enum {
    FOLLOW_MS = 500,
    UNKNOWN_MAX = 16, // reads of the table in that time for unknown tokens
    USED_MS = 60000,
};

const char *const scope_names[] = {"read", "submit", "materials", "admin", NULL};

typedef struct Entry {
    TokenRow row;
    unsigned scopes;      // bit i is scope_names[i]; 0: the row is damaged or another program's
    int64_t seen_unix_ms; // last use, written back now and then
} Entry;

struct Tokens {
    Db *db;
    bool are_required;
    pthread_mutex_t lock; // of all but reads_left
    Entry *entries;
    size_t count;
    int64_t now_unix_ms;     // of the last read
    atomic_int reads_left;   // until the thread reads next
    pthread_mutex_t reading; // one read at a time
    pthread_cond_t end;
    pthread_t follower;
    bool is_following, is_ending;
};

// The bit of the scope that is text[size]; 0: there is none.
static unsigned scope_bit(const char *text, size_t size) {
    for (size_t i = 0; scope_names[i] != NULL; i++)
        if (strlen(scope_names[i]) == size && strncmp(scope_names[i], text, size) == 0)
            return 1u << i;
    return 0;
}

// 0: it is not a list of scopes with commas between.
static unsigned scopes_read(const char *text) {
    for (unsigned scopes = 0;; text++) {
        const size_t size = strcspn(text, ",");
        const unsigned bit = scope_bit(text, size);
        scopes |= bit;
        text += size;
        if (bit == 0 || *text == '\0')
            return bit != 0 ? scopes : 0;
    }
}

// Each once, in the order of their names.
static void scopes_write(unsigned scopes, char *target, size_t size) {
    target[0] = '\0';
    for (size_t i = 0; scope_names[i] != NULL; i++)
        if ((scopes & 1u << i) != 0) {
            const size_t used = strlen(target);
            snprintf(target + used, size - used, "%s%s", used > 0 ? "," : "", scope_names[i]);
        }
}

// By SHA-256 digests: the time of a comparison reveals nothing about tokens.
static Entry *entry_find(const Tokens *tokens, const char *digest) {
    for (size_t i = 0; i < tokens->count; i++)
        if (strcmp(tokens->entries[i].row.digest, digest) == 0)
            return &tokens->entries[i];
    return NULL;
}

static bool entry_is_revoked(const Entry *entry) {
    return entry->row.revoked_unix_ms != 0 || entry->scopes == 0;
}

static bool entry_is_usable(const Entry *entry, int64_t now_unix_ms) {
    return !entry_is_revoked(entry) &&
           (entry->row.expires_unix_ms == 0 || now_unix_ms < entry->row.expires_unix_ms);
}

// The table in memory stays as it is where the database cannot be read.
static Status tokens_read(Tokens *tokens, Problem *problem) {
    TokenRows rows = {0};
    pthread_mutex_lock(&tokens->reading);
    Status status = db_tokens(tokens->db, &rows, problem);
    Entry *entries = status == STATUS_OK ? calloc(rows.count + 1, sizeof *entries) : NULL;
    if (entries != NULL) {
        pthread_mutex_lock(&tokens->lock);
        tokens->now_unix_ms = clock_unix_ms();
        for (size_t i = 0; i < rows.count; i++) {
            const Entry *before = entry_find(tokens, rows.at[i].digest);
            entries[i].row = rows.at[i];
            entries[i].seen_unix_ms = before != NULL ? before->seen_unix_ms : 0;
            entries[i].scopes = rows.at[i].is_damaged ? 0 : scopes_read(rows.at[i].scopes);
        }
        free(tokens->entries);
        tokens->entries = entries;
        tokens->count = rows.count;
        pthread_mutex_unlock(&tokens->lock);
    } else if (status == STATUS_OK) {
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the tokens");
    }
    free(rows.at);
    pthread_mutex_unlock(&tokens->reading);
    return status;
}

// Writes back the last use of tokens that were used `apart_ms` after what is written.
static void tokens_write_used(Tokens *tokens, int64_t apart_ms) {
    for (size_t i = 0;; i++) {
        TokenRow row = {.name = ""};
        pthread_mutex_lock(&tokens->lock);
        const bool is_end = i >= tokens->count;
        Entry *entry = is_end ? NULL : &tokens->entries[i];
        const int64_t unwritten_ms = is_end ? 0 : entry->seen_unix_ms - entry->row.used_unix_ms;
        if (unwritten_ms > 0 && unwritten_ms >= apart_ms) {
            // Also where it then cannot be written: it is not tried again and again.
            entry->row.used_unix_ms = entry->seen_unix_ms;
            row = entry->row;
        }
        pthread_mutex_unlock(&tokens->lock);
        if (is_end)
            return;
        if (row.name[0] != '\0')
            (void)db_token_used(tokens->db, &row, NULL);
    }
}

static void *tokens_follow(void *context) {
    Tokens *tokens = context;
    for (;;) {
        const int64_t until_ns = clock_monotonic_ns() + (int64_t)FOLLOW_MS * 1000000;
        const struct timespec until = {.tv_sec = (time_t)(until_ns / 1000000000),
                                       .tv_nsec = (long)(until_ns % 1000000000)};
        pthread_mutex_lock(&tokens->lock);
        while (!tokens->is_ending &&
               pthread_cond_timedwait(&tokens->end, &tokens->lock, &until) == 0)
            continue;
        const bool is_ending = tokens->is_ending;
        pthread_mutex_unlock(&tokens->lock);
        tokens_write_used(tokens, is_ending ? 0 : USED_MS);
        if (is_ending)
            return NULL;
        (void)tokens_read(tokens, NULL);
        atomic_store(&tokens->reads_left, UNKNOWN_MAX);
    }
}

Status tokens_open(Db *db, bool are_required, Tokens **tokens, Problem *problem) {
    *tokens = NULL;
    Tokens *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the tokens");
    made->db = db;
    made->are_required = are_required;
    atomic_init(&made->reads_left, UNKNOWN_MAX);
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_mutex_init(&made->lock, NULL);
    pthread_mutex_init(&made->reading, NULL);
    pthread_cond_init(&made->end, &attributes);
    pthread_condattr_destroy(&attributes);
    Status status = tokens_read(made, problem);
    if (status == STATUS_OK)
        status = thread_start(&made->follower, tokens_follow, made,
                              "the thread that follows the tokens", problem);
    made->is_following = status == STATUS_OK;
    if (status != STATUS_OK) {
        tokens_close(made);
        return status;
    }
    *tokens = made;
    return STATUS_OK;
}

void tokens_close(Tokens *tokens) {
    if (tokens == NULL)
        return;
    if (tokens->is_following) {
        pthread_mutex_lock(&tokens->lock);
        tokens->is_ending = true;
        pthread_cond_signal(&tokens->end);
        pthread_mutex_unlock(&tokens->lock);
        pthread_join(tokens->follower, NULL);
    }
    pthread_mutex_destroy(&tokens->lock);
    pthread_mutex_destroy(&tokens->reading);
    pthread_cond_destroy(&tokens->end);
    free(tokens->entries);
    free(tokens);
}

size_t tokens_usable(Tokens *tokens) {
    size_t usable = 0;
    pthread_mutex_lock(&tokens->lock);
    const int64_t now = tokens->now_unix_ms;
    for (size_t i = 0; i < tokens->count; i++)
        usable += entry_is_usable(&tokens->entries[i], now);
    pthread_mutex_unlock(&tokens->lock);
    return usable;
}

// The token in "Bearer TOKEN"; NULL if the header is malformed.
static const char *bearer_token(const char *authorization, size_t *size) {
    static const char scheme[] = "Bearer ";
    if (strncasecmp(authorization, scheme, sizeof scheme - 1) != 0)
        return NULL;
    const char *token = authorization + sizeof scheme - 1;
    token += strspn(token, " ");
    *size = strcspn(token, " \t");
    return token[*size + strspn(token + *size, " \t")] == '\0' && *size > 0 ? token : NULL;
}

typedef enum TokenState {
    TOKEN_NOT_NEEDED,
    TOKEN_UNKNOWN,
    TOKEN_REVOKED,
    TOKEN_EXPIRED,
    TOKEN_GOOD,
} TokenState;

// `digest` "": there is no token.
static TokenState tokens_find(Tokens *tokens, const char *digest, unsigned *scopes, char *name) {
    pthread_mutex_lock(&tokens->lock);
    const int64_t now = tokens->now_unix_ms;
    Entry *entry = digest[0] != '\0' ? entry_find(tokens, digest) : NULL;
    const TokenState state = !tokens->are_required && tokens->count == 0 ? TOKEN_NOT_NEEDED
                             : entry == NULL                             ? TOKEN_UNKNOWN
                             : entry_is_revoked(entry)                   ? TOKEN_REVOKED
                             : !entry_is_usable(entry, now)              ? TOKEN_EXPIRED
                                                                         : TOKEN_GOOD;
    if (state == TOKEN_GOOD) {
        entry->seen_unix_ms = now;
        *scopes = entry->scopes;
        memcpy(name, entry->row.name, TOKEN_NAME_SIZE);
    }
    pthread_mutex_unlock(&tokens->lock);
    return state;
}

// A token may have been made a moment ago; trying many must not cost a query each.
static bool tokens_may_read(Tokens *tokens) {
    return atomic_load(&tokens->reads_left) > 0 && atomic_fetch_sub(&tokens->reads_left, 1) > 0;
}

Status tokens_check(Tokens *tokens, const char *authorization, const char *scope, Holder *holder,
                    Problem *problem) {
    unsigned char bytes[DIGEST_BYTES];
    char digest[65] = "";
    size_t size = 0;
    unsigned scopes = 0;
    const char *token = authorization != NULL ? bearer_token(authorization, &size) : NULL;
    *holder = (Holder){.name = ""};
    if (token != NULL) {
        sha256_sum(token, size, bytes);
        sha256_hex(bytes, digest);
    }
    TokenState state = tokens_find(tokens, digest, &scopes, holder->name);
    if (state == TOKEN_UNKNOWN && token != NULL && tokens_may_read(tokens) &&
        tokens_read(tokens, NULL) == STATUS_OK)
        state = tokens_find(tokens, digest, &scopes, holder->name);
    if (state == TOKEN_NOT_NEEDED)
        return STATUS_OK;
    if (state != TOKEN_GOOD && authorization == NULL)
        return problem_set(
            problem, STATUS_UNAUTHORIZED,
            "a token is needed, in the header \"Authorization: Bearer TOKEN\" and nowhere else; "
            "`impactd token create` makes one");
    if (state != TOKEN_GOOD)
        return problem_set(problem, STATUS_UNAUTHORIZED, "%s",
                           state == TOKEN_REVOKED   ? "this token is revoked"
                           : state == TOKEN_EXPIRED ? "this token has expired"
                                                    : "this token is not known here; the header "
                                                      "must read \"Authorization: Bearer TOKEN\"");
    holder->is_admin = (scopes & scope_bit("admin", strlen("admin"))) != 0;
    return holder->is_admin || (scopes & scope_bit(scope, strlen(scope))) != 0
               ? STATUS_OK
               : problem_set(problem, STATUS_FORBIDDEN,
                             "this needs the scope \"%s\", which the token \"%s\" has not", scope,
                             holder->name);
}

Status token_make(const char *scopes, int64_t expires_unix_ms, TokenRow *row,
                  char token[TOKEN_SIZE], Problem *problem) {
    unsigned char secret[DIGEST_BYTES], digest[DIGEST_BYTES];
    const unsigned asked = scopes_read(scopes);
    if (asked == 0)
        return problem_set(problem, STATUS_USAGE,
                           "the scopes must be one or more of read, submit, materials and admin, "
                           "with commas between, are \"%.60s\"",
                           scopes);
    if (getrandom(secret, sizeof secret, 0) != (ssize_t)sizeof secret)
        return problem_set(problem, STATUS_INTERNAL, "no random numbers for a token");
    char digits[65];
    sha256_hex(secret, digits);
    snprintf(token, TOKEN_SIZE, "impactd_%s", digits);
    sha256_sum(token, strlen(token), digest);
    sha256_hex(digest, row->digest);
    scopes_write(asked, row->scopes, sizeof row->scopes);
    row->created_unix_ms = clock_unix_ms();
    row->expires_unix_ms = expires_unix_ms;
    row->used_unix_ms = row->revoked_unix_ms = 0;
    return STATUS_OK;
}
