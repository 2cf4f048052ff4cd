// A token is looked up by the first eight bytes of its digest and then compared whole, in constant
// time. The order of digests tells nothing about tokens, so the look-up needs no such care.
//
// The thread reads the table twice a second, which finds what other processes did, and writes back
// when tokens were last used, each at most once a minute.
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

enum {
    FOLLOW_MS = 500,
    UNKNOWN_MAX = 16, // looks in that time for tokens that are not in the table
    USED_MS = 60000,
};

const char *const scope_names[] = {"read", "submit", "materials", "admin", NULL};

typedef struct Entry {
    uint64_t head; // the digest's first bytes
    unsigned char digest[DIGEST_BYTES];
    unsigned scopes; // bit i is scope_names[i]
    int64_t expires_unix_ms, used_unix_ms, revoked_unix_ms;
    int64_t seen_unix_ms; // last use, not all of it written back
    char name[TOKEN_NAME_SIZE];
} Entry;

struct Tokens {
    Db *db;
    bool are_required;
    pthread_mutex_t lock; // of entries and count, held for a look-up
    Entry *entries;
    size_t count;
    int64_t now_unix_ms;     // as of the last look; under the lock
    atomic_int looks_left;   // until the thread looks next
    pthread_mutex_t looking; // one at a time
    pthread_mutex_t ending;
    pthread_cond_t end;
    pthread_t follower;
    bool is_following, is_ending;
};

static bool scopes_read(const char *text, unsigned *scopes) {
    *scopes = 0;
    while (*text != '\0') {
        const size_t size = strcspn(text, ",");
        size_t i = 0;
        while (scope_names[i] != NULL &&
               (strlen(scope_names[i]) != size || strncmp(scope_names[i], text, size) != 0))
            i++;
        if (scope_names[i] == NULL)
            return false;
        *scopes |= 1u << i;
        text += size;
        text += *text == ',' && text[1] != '\0' ? 1 : 0;
        if (*text == ',')
            return false;
    }
    return *scopes != 0;
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

static unsigned scope_bit(const char *scope) {
    unsigned i = 0;
    while (scope_names[i] != NULL && strcmp(scope_names[i], scope) != 0)
        i++;
    return 1u << i;
}

static bool digest_read(const char *digits, unsigned char digest[DIGEST_BYTES]) {
    if (strlen(digits) != 2 * (size_t)DIGEST_BYTES ||
        strspn(digits, "0123456789abcdef") != 2 * (size_t)DIGEST_BYTES)
        return false;
    for (size_t i = 0; i < DIGEST_BYTES; i++) {
        const char pair[3] = {digits[2 * i], digits[2 * i + 1], '\0'};
        digest[i] = (unsigned char)strtoul(pair, NULL, 16);
    }
    return true;
}

static uint64_t head_of(const unsigned char digest[DIGEST_BYTES]) {
    uint64_t head;
    memcpy(&head, digest, sizeof head);
    return head;
}

static bool is_same(const unsigned char *a, const unsigned char *b) {
    unsigned char difference = 0;
    for (size_t i = 0; i < DIGEST_BYTES; i++)
        difference |= (unsigned char)(a[i] ^ b[i]);
    return difference == 0;
}

static Entry *find(const Tokens *tokens, const unsigned char digest[DIGEST_BYTES]) {
    const uint64_t head = head_of(digest);
    for (size_t i = 0; i < tokens->count; i++)
        if (tokens->entries[i].head == head && is_same(tokens->entries[i].digest, digest))
            return &tokens->entries[i];
    return NULL;
}

static bool is_usable(const Entry *entry, int64_t now_unix_ms) {
    return entry->revoked_unix_ms == 0 &&
           (entry->expires_unix_ms == 0 || now_unix_ms < entry->expires_unix_ms);
}

static void entry_fill(const Tokens *tokens, Entry *entry, const TokenRow *row) {
    // A row that is not as we write them lets nobody in, but stands for "there are tokens".
    if (!digest_read(row->digest, entry->digest) || !scopes_read(row->scopes, &entry->scopes))
        entry->revoked_unix_ms = 1;
    else
        entry->revoked_unix_ms = row->revoked_unix_ms;
    entry->head = head_of(entry->digest);
    entry->expires_unix_ms = row->expires_unix_ms;
    entry->used_unix_ms = row->used_unix_ms;
    text_fit(entry->name, sizeof entry->name, row->name);
    const Entry *before = find(tokens, entry->digest);
    entry->seen_unix_ms = before != NULL ? before->seen_unix_ms : 0;
}

// With `looking` held. What is there stays where the database cannot be read.
static Status look(Tokens *tokens, Problem *problem) {
    TokenRows rows = {0};
    TRY(db_tokens(tokens->db, &rows, problem));
    Entry *entries = calloc(rows.count + 1, sizeof *entries);
    if (entries == NULL) {
        free(rows.at);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the tokens");
    }
    pthread_mutex_lock(&tokens->lock);
    tokens->now_unix_ms = clock_unix_ms();
    for (size_t i = 0; i < rows.count; i++)
        entry_fill(tokens, &entries[i], &rows.at[i]);
    Entry *old = tokens->entries;
    tokens->entries = entries;
    tokens->count = rows.count;
    pthread_mutex_unlock(&tokens->lock);
    free(old);
    free(rows.at);
    return STATUS_OK;
}

// The next that was used and is worth a note; false if there is none.
static bool next_used(Tokens *tokens, int64_t apart_ms, TokenRow *row) {
    bool is_found = false;
    pthread_mutex_lock(&tokens->lock);
    for (size_t i = 0; i < tokens->count && !is_found; i++) {
        Entry *entry = &tokens->entries[i];
        const int64_t seen = entry->seen_unix_ms;
        if (seen <= entry->used_unix_ms || seen - entry->used_unix_ms < apart_ms)
            continue;
        is_found = true;
        // Also where it cannot be written: it is not tried again and again.
        row->used_unix_ms = entry->used_unix_ms = seen;
        text_fit(row->name, sizeof row->name, entry->name);
    }
    pthread_mutex_unlock(&tokens->lock);
    return is_found;
}

static void note_used(Tokens *tokens, int64_t apart_ms) {
    TokenRow row = {0};
    while (next_used(tokens, apart_ms, &row))
        (void)db_token_used(tokens->db, &row, NULL);
}

static void *follow(void *context) {
    Tokens *tokens = context;
    pthread_mutex_lock(&tokens->ending);
    while (!tokens->is_ending) {
        const int64_t until_ns = clock_monotonic_ns() + (int64_t)FOLLOW_MS * 1000000;
        const struct timespec until = {.tv_sec = (time_t)(until_ns / 1000000000),
                                       .tv_nsec = (long)(until_ns % 1000000000)};
        while (!tokens->is_ending &&
               pthread_cond_timedwait(&tokens->end, &tokens->ending, &until) == 0)
            continue;
        pthread_mutex_unlock(&tokens->ending);
        note_used(tokens, USED_MS);
        pthread_mutex_lock(&tokens->looking);
        (void)look(tokens, NULL);
        pthread_mutex_unlock(&tokens->looking);
        atomic_store(&tokens->looks_left, UNKNOWN_MAX);
        pthread_mutex_lock(&tokens->ending);
    }
    pthread_mutex_unlock(&tokens->ending);
    return NULL;
}

Status tokens_open(Db *db, bool are_required, Tokens **tokens, Problem *problem) {
    *tokens = NULL;
    Tokens *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the tokens");
    made->db = db;
    made->are_required = are_required;
    atomic_init(&made->looks_left, UNKNOWN_MAX);
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_mutex_init(&made->lock, NULL);
    pthread_mutex_init(&made->looking, NULL);
    pthread_mutex_init(&made->ending, NULL);
    pthread_cond_init(&made->end, &attributes);
    pthread_condattr_destroy(&attributes);
    Status status = look(made, problem);
    if (status == STATUS_OK) {
        made->is_following = pthread_create(&made->follower, NULL, follow, made) == 0;
        if (!made->is_following)
            status = problem_set(problem, STATUS_INTERNAL,
                                 "the thread that follows the tokens cannot be started");
    }
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
        pthread_mutex_lock(&tokens->ending);
        tokens->is_ending = true;
        pthread_cond_signal(&tokens->end);
        pthread_mutex_unlock(&tokens->ending);
        pthread_join(tokens->follower, NULL);
        note_used(tokens, 0);
    }
    pthread_mutex_destroy(&tokens->lock);
    pthread_mutex_destroy(&tokens->looking);
    pthread_mutex_destroy(&tokens->ending);
    pthread_cond_destroy(&tokens->end);
    free(tokens->entries);
    free(tokens);
}

size_t tokens_usable(Tokens *tokens) {
    size_t usable = 0;
    pthread_mutex_lock(&tokens->lock);
    const int64_t now = tokens->now_unix_ms;
    for (size_t i = 0; i < tokens->count; i++)
        usable += is_usable(&tokens->entries[i], now);
    pthread_mutex_unlock(&tokens->lock);
    return usable;
}

// The token in "Bearer TOKEN"; NULL if the header is no such thing.
static const char *bearer(const char *authorization, size_t *size) {
    static const char scheme[] = "Bearer ";
    if (strncasecmp(authorization, scheme, sizeof scheme - 1) != 0)
        return NULL;
    const char *token = authorization + sizeof scheme - 1;
    token += strspn(token, " ");
    *size = strcspn(token, " \t");
    return token[*size + strspn(token + *size, " \t")] == '\0' && *size > 0 ? token : NULL;
}

// What the table says of a digest.
typedef struct Judgement {
    bool is_asked, is_known, is_expired, is_revoked;
    unsigned scopes;
} Judgement;

static Judgement judge(Tokens *tokens, const unsigned char *digest, Holder *holder) {
    Judgement found = {0};
    pthread_mutex_lock(&tokens->lock);
    const int64_t now = tokens->now_unix_ms;
    found.is_asked = tokens->are_required || tokens->count > 0;
    Entry *entry = digest != NULL ? find(tokens, digest) : NULL;
    if (entry != NULL) {
        found.is_known = true;
        found.is_revoked = entry->revoked_unix_ms != 0;
        found.is_expired = !found.is_revoked && !is_usable(entry, now);
        found.scopes = entry->scopes;
        memcpy(holder->name, entry->name, sizeof holder->name);
        holder->is_admin = (entry->scopes & scope_bit("admin")) != 0;
        if (is_usable(entry, now))
            entry->seen_unix_ms = now;
    }
    pthread_mutex_unlock(&tokens->lock);
    return found;
}

// A token may have been made a moment ago, but whoever tries many must not cost a query each.
static bool look_again(Tokens *tokens) {
    if (atomic_load(&tokens->looks_left) <= 0 || atomic_fetch_sub(&tokens->looks_left, 1) <= 0)
        return false;
    pthread_mutex_lock(&tokens->looking);
    const bool has_looked = look(tokens, NULL) == STATUS_OK;
    pthread_mutex_unlock(&tokens->looking);
    return has_looked;
}

static Status refuse(const Judgement *found, const char *authorization, Problem *problem) {
    if (authorization == NULL)
        return problem_set(
            problem, STATUS_UNAUTHORIZED,
            "a token is needed, in the header \"Authorization: Bearer TOKEN\" and nowhere else; "
            "`impactd token create` makes one");
    return problem_set(problem, STATUS_UNAUTHORIZED, "%s",
                       found->is_revoked   ? "this token is revoked"
                       : found->is_expired ? "this token has expired"
                                           : "this token is not known here; the header must read "
                                             "\"Authorization: Bearer TOKEN\"");
}

Status tokens_check(Tokens *tokens, const char *authorization, const char *scope, Holder *holder,
                    Problem *problem) {
    unsigned char digest[DIGEST_BYTES];
    size_t size = 0;
    const char *token = authorization != NULL ? bearer(authorization, &size) : NULL;
    *holder = (Holder){.name = ""};
    if (token != NULL)
        sha256_sum(token, size, digest);
    Judgement found = judge(tokens, token != NULL ? digest : NULL, holder);
    if (token != NULL && found.is_asked && !found.is_known && look_again(tokens))
        found = judge(tokens, digest, holder);
    if (!found.is_asked)
        return STATUS_OK;
    if (!found.is_known || found.is_revoked || found.is_expired) {
        *holder = (Holder){.name = ""};
        return refuse(&found, authorization, problem);
    }
    if ((found.scopes & scope_bit(scope)) != 0 || holder->is_admin)
        return STATUS_OK;
    return problem_set(problem, STATUS_FORBIDDEN,
                       "this needs the scope \"%s\", which the token \"%s\" has not", scope,
                       holder->name);
}

Status token_make(const char *scopes, int64_t expires_unix_ms, TokenRow *row,
                  char token[TOKEN_SIZE], Problem *problem) {
    unsigned char secret[DIGEST_BYTES], digest[DIGEST_BYTES];
    unsigned asked;
    if (!scopes_read(scopes, &asked))
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
