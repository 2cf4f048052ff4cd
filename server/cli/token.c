// The token itself goes to standard output and nothing else does, so that a script can take it.
#include "server/cli/files.h"
#include "server/cli/report.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/auth/tokens.h"
#include "server/json/table.h"
#include "server/util/clock.h"

typedef struct TokenSettings {
    char *data, *name, *scopes;
    double expires;
    bool json;
} TokenSettings;

// clang-format off
static const Field token_fields[] = {
    FIELD_TEXT(TokenSettings, name, 64, PRESENCE_OPTIONAL, 0, "name: letters, digits, dot, underscore and dash; its jobs are counted under this name"),
    FIELD_TEXT(TokenSettings, scopes, 60, PRESENCE_OPTIONAL, 0, "scopes, separated by commas: read, submit, materials, admin, which includes all (read,submit)"),
    FIELD_REAL(TokenSettings, expires, "days", ABOVE(0), OPTIONAL, "time until it expires (never)"),
    FIELD_FLAG(TokenSettings, json, false, "list: print it as JSON"),
    FIELD_TEXT(TokenSettings, data, 4000, PRESENCE_OPTIONAL, 0, "directory of the server's database ($IMPACTD_DATA, else that of impactd serve)"),
    FIELD_END,
};
// clang-format on

static Status token_create(Db *db, const TokenSettings *settings, TokenRow *row, Problem *problem) {
    static const double day_ms = 24 * 3600 * 1000.0;
    static const double days_most = 36500;
    char made[TOKEN_SIZE];
    int64_t expires_unix_ms = 0;
    // Who reviewed what the program came with.
    if (strcmp(row->name, "impactd") == 0)
        return problem_set(problem, STATUS_USAGE, "impactd is the program's own name");
    if (isfinite(settings->expires)) {
        const double days = settings->expires < days_most ? settings->expires : days_most;
        expires_unix_ms = clock_unix_ms() + (int64_t)(days * day_ms);
    }
    TRY(token_make(settings->scopes != NULL ? settings->scopes : "read,submit", expires_unix_ms,
                   row, made, problem));
    TRY(db_token_add(db, row, problem));
    // A token that was not shown must not exist: it would make every request need one.
    (void)signal(SIGPIPE, SIG_IGN);
    if (printf("%s\n", made) < 0 || fflush(stdout) != 0) {
        const int code = errno;
        row->revoked_unix_ms = clock_unix_ms();
        TRY(db_token_revoke(db, row, problem));
        TRY(db_token_forget(db, row, problem));
        return problem_set(problem, STATUS_IO,
                           "the token cannot be written to standard output: %s; there is no token "
                           "\"%s\"",
                           strerror(code), row->name);
    }
    fprintf(stderr,
            "The token \"%s\" (%s). It is shown this once; only its digest is kept. Use it as\n"
            "  curl -H \"Authorization: Bearer $TOKEN\" ...\n",
            row->name, row->scopes);
    return STATUS_OK;
}

static Status token_list(Db *db, const TokenSettings *settings, TokenRow *row, Problem *problem) {
    static const PrintTableView view = {NULL, NULL, NULL};
    const bool is_json = settings->json;
    const char *never = is_json ? NULL : "never"; // NULL is null
    TokenRows rows = {0};
    Bytes json = {0};
    (void)row;
    TRY(db_tokens(db, &rows, problem));
    const int64_t now = clock_unix_ms();
    bytes_text(&json, "{\"tokens\": [");
    for (size_t i = 0; i < rows.count; i++) {
        const TokenRow *one = &rows.at[i];
        const bool has_ended = one->expires_unix_ms > 0 && one->expires_unix_ms <= now;
        bytes_text(&json, i > 0 ? ", " : "");
        bytes_json(&json,
                   "{\"name\": %s, \"scopes\": %s, \"created\": %s, \"used\": %s, \"expires\": %s, "
                   "\"state\": %s}",
                   one->name, one->scopes,
                   one->created_unix_ms > 0 ? clock_rfc3339(one->created_unix_ms).at : never,
                   one->used_unix_ms > 0 ? clock_rfc3339(one->used_unix_ms).at : never,
                   one->expires_unix_ms > 0 ? clock_rfc3339(one->expires_unix_ms).at : never,
                   one->is_damaged            ? "damaged"
                   : one->revoked_unix_ms > 0 ? "revoked"
                   : has_ended                ? "expired"
                                              : "good");
    }
    bytes_text(&json, "]}\n");
    free(rows.at);
    if (is_json && json.is_failed)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the list");
    const Status status = is_json ? output_put(NULL, &json, problem)
                                  : print_table_print_json(&json, &view, terminal_table_form(),
                                                           stdout, NULL, problem);
    bytes_clear(&json);
    return status;
}

static Status token_revoke(Db *db, const TokenSettings *settings, TokenRow *row, Problem *problem) {
    (void)settings;
    row->revoked_unix_ms = clock_unix_ms();
    TRY(db_token_revoke(db, row, problem));
    fprintf(stderr, "The token \"%s\" is revoked; a running server follows within a second.\n",
            row->name);
    return STATUS_OK;
}

static Status token_forget(Db *db, const TokenSettings *settings, TokenRow *row, Problem *problem) {
    (void)settings;
    TRY(db_token_forget(db, row, problem));
    fprintf(stderr, "The token \"%s\" is forgotten.\n", row->name);
    return STATUS_OK;
}

static const struct Action {
    const char *name;
    bool needs_name;
    Status (*act)(Db *db, const TokenSettings *settings, TokenRow *row, Problem *problem);
} actions[] = {
    {"create", true, token_create}, {"list", false, token_list}, {"revoke", true, token_revoke},
    {"forget", true, token_forget}, {NULL, false, NULL},
};

static Status token_act(TokenSettings *settings, const Options *options, Problem *problem) {
    static const char allowed[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                  "0123456789._-";
    size_t index;
    TokenRow row = {0};
    Db *db = NULL;
    TRY(command_action(options, &actions->name, sizeof *actions, &index, problem));
    const struct Action *action = &actions[index];
    const bool is_operand = action->needs_name && settings->name == NULL;
    const size_t max = is_operand ? 2 : 1;
    if (options->operand_count > max)
        return problem_set(problem, STATUS_USAGE, "\"%.60s\" is one operand too many",
                           options->operands[max]);
    const char *name = !is_operand                  ? settings->name
                       : options->operand_count > 1 ? options->operands[1]
                                                    : NULL;
    const size_t size = name != NULL ? strlen(name) : 0;
    if (name == NULL && action->needs_name)
        return problem_set(problem, STATUS_USAGE, "needs the name of a token: --name NAME");
    if (name != NULL && (size == 0 || size >= sizeof row.name || strspn(name, allowed) != size))
        return problem_set(problem, STATUS_USAGE,
                           "a token's name must be 1 to 64 letters, digits, dots, underscores and "
                           "dashes, is \"%.80s\"",
                           name);
    text_fit(row.name, sizeof row.name, name != NULL ? name : "");
    TRY(command_data_folder(&settings->data, problem));
    if (action->act != token_create) // a wrong folder would get a database, and none of its tokens
        TRY(db_exists(settings->data, problem));
    TRY(db_open_beside(settings->data, &db, problem));
    const Status status = action->act(db, settings, &row, problem);
    db_close(db);
    return status;
}

static int token(const Command *self, void *settings, const Options *options, Problem *problem) {
    return command_end(self, token_act(settings, options, problem), problem);
}

const Command command_token = {
    .name = "token",
    .operands = "create|list|revoke|forget [NAME]",
    .summary = "create, list and revoke access tokens of a server",
    .help = "  TOKEN=$(impactd token create --name lab --scopes read,submit --expires 90)\n"
            "  curl -H \"Authorization: Bearer $TOKEN\" http://127.0.0.1:8080/v1/jobs\n"
            "  impactd token list\n"
            "  impactd token revoke lab\n"
            "  impactd token forget lab                    # remove a revoked token\n"
            "\n"
            "A running server applies a change within a second. While there is a token, also\n"
            "a revoked one, every request needs a valid token. When all tokens are forgotten,\n"
            "the server is open on loopback again.\n",
    .options = token_fields,
    .size = sizeof(TokenSettings),
    .run = token,
};
