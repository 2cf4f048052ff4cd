// Tokens over a database in memory and one in a folder: who comes in, who does not, what another
// process changed.
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "server/auth/tokens.h"
#include "server/util/clock.h"
#include "tests/support/test.h"

static Status add(Db *db, const char *name, const char *scopes, int64_t expires_unix_ms,
                  char header[128]) {
    TokenRow row = {0};
    char token[TOKEN_SIZE];
    TRY(token_make(scopes, expires_unix_ms, &row, token, NULL));
    snprintf(row.name, sizeof row.name, "%s", name);
    snprintf(header, 128, "Bearer %s", token);
    return db_token_add(db, &row, NULL);
}

static Status check(Tokens *tokens, const char *authorization, const char *scope,
                    char client[TOKEN_NAME_SIZE]) {
    Holder holder;
    const Status status = tokens_check(tokens, authorization, scope, &holder, NULL);
    memcpy(client, holder.name, sizeof holder.name);
    return status;
}

static void pause_ms(long ms) {
    const struct timespec pause = {.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000};
    nanosleep(&pause, NULL);
}

// What a look will find sooner or later; a loaded machine takes longer.
static void until(Tokens *tokens, const char *authorization, Status wanted) {
    char client[TOKEN_NAME_SIZE];
    for (int i = 0; i < 1000; i++) {
        if (check(tokens, authorization, "read", client) == wanted)
            return;
        pause_ms(10);
    }
    fail_msg("it never becomes %s", status_title(wanted));
}

TEST(without_tokens_the_door_is_open) {
    Db *db;
    Tokens *tokens;
    char client[TOKEN_NAME_SIZE] = "x";
    assert_int_equal(db_open(NULL, &db, NULL), STATUS_OK);
    assert_int_equal(tokens_open(db, false, &tokens, NULL), STATUS_OK);
    assert_int_equal(check(tokens, NULL, "admin", client), STATUS_OK);
    assert_string_equal(client, "");
    assert_int_equal(check(tokens, "Bearer anything", "read", client), STATUS_OK);
    assert_string_equal(client, "");
    assert_int_equal(tokens_usable(tokens), 0);
    tokens_close(tokens);
    assert_int_equal(tokens_open(db, true, &tokens, NULL), STATUS_OK);
    assert_int_equal(check(tokens, NULL, "read", client), STATUS_UNAUTHORIZED);
    tokens_close(tokens);
    db_close(db);
}

TEST(tokens_made_and_revoked_elsewhere_are_followed) {
    char folder[] = "/tmp/impactd-tokens-XXXXXX", first[128], second[128], client[TOKEN_NAME_SIZE];
    assert_non_null(mkdtemp(folder));
    Db *daemon, *beside;
    Tokens *tokens;
    assert_int_equal(db_open(folder, &daemon, NULL), STATUS_OK);
    assert_int_equal(db_open(folder, &beside, NULL), STATUS_CONFLICT);
    assert_int_equal(db_open_beside(folder, &beside, NULL), STATUS_OK);
    assert_int_equal(tokens_open(daemon, false, &tokens, NULL), STATUS_OK);
    assert_int_equal(add(beside, "first", "read", 0, first), STATUS_OK);
    until(tokens, NULL, STATUS_UNAUTHORIZED);
    assert_int_equal(check(tokens, first, "read", client), STATUS_OK);
    assert_int_equal(add(beside, "second", "read", 0, second), STATUS_OK);
    until(tokens, second, STATUS_OK);
    TokenRow row = {.name = "first", .revoked_unix_ms = clock_unix_ms()};
    assert_int_equal(db_token_forget(beside, &row, NULL), STATUS_CONFLICT);
    assert_int_equal(db_token_revoke(beside, &row, NULL), STATUS_OK);
    assert_int_equal(db_token_revoke(beside, &row, NULL), STATUS_CONFLICT);
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(db_token_add(beside, &row, &problem), STATUS_CONFLICT);
    assert_non_null(strstr(problem.detail, "\"first\" already, revoked; choose another name"));
    until(tokens, first, STATUS_UNAUTHORIZED);
    assert_int_equal(check(tokens, second, "read", client), STATUS_OK);
    assert_int_equal(db_token_forget(beside, &row, NULL), STATUS_OK);
    assert_int_equal(db_token_forget(beside, &row, NULL), STATUS_NOT_FOUND);

    // The last use is written at the latest when the daemon ends.
    tokens_close(tokens);
    TokenRows rows;
    assert_int_equal(db_tokens(beside, &rows, NULL), STATUS_OK);
    assert_int_equal(rows.count, 1);
    assert_string_equal(rows.at[0].name, "second");
    assert_true(rows.at[0].used_unix_ms > 0);
    // Nothing of the token itself is kept.
    assert_null(strstr(second, rows.at[0].digest));
    free(rows.at);
    db_close(beside);
    db_close(daemon);
    char command[64];
    static const char *const files[] = {"impactd.db", "impactd.lock", "impactd.db-wal",
                                        "impactd.db-shm"};
    for (size_t i = 0; i < COUNT(files); i++) {
        snprintf(command, sizeof command, "%s/%s", folder, files[i]);
        (void)unlink(command);
    }
    assert_int_equal(rmdir(folder), 0);
}

TEST(an_expired_token_says_so) {
    Db *db;
    Tokens *tokens;
    char old[128], fresh[128], client[TOKEN_NAME_SIZE];
    assert_int_equal(db_open(NULL, &db, NULL), STATUS_OK);
    assert_int_equal(add(db, "old", "read", clock_unix_ms() - 1, old), STATUS_OK);
    assert_int_equal(add(db, "fresh", "read", clock_unix_ms() + 3600000, fresh), STATUS_OK);
    assert_int_equal(tokens_open(db, false, &tokens, NULL), STATUS_OK);
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(tokens_check(tokens, old, "read", &(Holder){.name = ""}, &problem),
                     STATUS_UNAUTHORIZED);
    assert_non_null(strstr(problem.detail, "expired"));
    assert_int_equal(check(tokens, fresh, "read", client), STATUS_OK);
    assert_int_equal(tokens_usable(tokens), 1);
    tokens_close(tokens);
    db_close(db);
}

TEST(so_many_tokens_are_kept_and_no_more) {
    Db *db;
    static Problem problem;
    char name[TOKEN_NAME_SIZE], header[128];
    assert_int_equal(db_open(NULL, &db, NULL), STATUS_OK);
    for (int i = 0; i < TOKENS_MAX; i++) {
        snprintf(name, sizeof name, "t%d", i);
        assert_int_equal(add(db, name, "read", 0, header), STATUS_OK);
    }
    TokenRow row = {.name = "one-more"};
    char token[TOKEN_SIZE];
    assert_int_equal(token_make("read", 0, &row, token, NULL), STATUS_OK);
    assert_int_equal(db_token_add(db, &row, &problem), STATUS_LIMIT);
    assert_non_null(strstr(problem.detail, "forget those that are revoked"));
    db_close(db);
}

TEST(scopes_are_a_list_of_known_names) {
    static const char *const bad[] = {"",     ",",           "read,", ",read", "read,,submit",
                                      "Read", "read submit", "write"};
    TokenRow row;
    char token[TOKEN_SIZE], other[TOKEN_SIZE];
    for (size_t i = 0; i < COUNT(bad); i++)
        if (token_make(bad[i], 0, &row, token, NULL) != STATUS_USAGE)
            fail_msg("\"%s\" is taken", bad[i]);
    assert_int_equal(token_make("read,submit,materials,admin", 0, &row, token, NULL), STATUS_OK);
    assert_string_equal(row.scopes, "read,submit,materials,admin");
    assert_int_equal(token_make("submit,read,read,submit", 0, &row, other, NULL), STATUS_OK);
    assert_string_equal(row.scopes, "read,submit");
    assert_int_equal(token_make("read", 0, &row, other, NULL), STATUS_OK);
    assert_string_not_equal(token, other);
}

typedef struct Asker {
    Tokens *tokens;
    const char *header;
    size_t refused;
} Asker;

static void *ask(void *context) {
    Asker *asker = context;
    char client[TOKEN_NAME_SIZE];
    for (int i = 0; i < 20000; i++)
        asker->refused += check(asker->tokens, asker->header, "read", client) != STATUS_OK ||
                          strcmp(client, "a") != 0;
    return NULL;
}

TEST(many_threads_ask_while_the_table_changes) {
    Db *db;
    Tokens *tokens;
    char header[128], other[128], name[16], client[TOKEN_NAME_SIZE];
    assert_int_equal(db_open(NULL, &db, NULL), STATUS_OK);
    assert_int_equal(add(db, "a", "read", 0, header), STATUS_OK);
    assert_int_equal(tokens_open(db, false, &tokens, NULL), STATUS_OK);
    Asker askers[4];
    pthread_t threads[4];
    for (size_t i = 0; i < COUNT(askers); i++) {
        askers[i] = (Asker){tokens, header, 0};
        assert_int_equal(pthread_create(&threads[i], NULL, ask, &askers[i]), 0);
    }
    for (int i = 0; i < 20; i++) {
        snprintf(name, sizeof name, "b%d", i);
        assert_int_equal(add(db, name, "read", 0, other), STATUS_OK);
        (void)check(tokens, "Bearer nobody", "read", client);
        pause_ms(5);
    }
    for (size_t i = 0; i < COUNT(askers); i++) {
        pthread_join(threads[i], NULL);
        assert_int_equal(askers[i].refused, 0);
    }
    tokens_close(tokens);
    db_close(db);
}
