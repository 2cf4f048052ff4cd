#include "server/cli/command.h"

#include "server/cli/client.h"
#include "server/json/table.h"

typedef struct CompareSettings {
    char *server, *token_file, *ca_file;
    double wait;
    bool json;
} CompareSettings;

// clang-format off
static const Field compare_fields[] = {
    DAEMON_ROWS(CompareSettings),
    FIELD_REAL(CompareSettings, wait, "s", AT_MIN(0), 60, "wait so long for a busy daemon"),
    FIELD_FLAG(CompareSettings, json, false, "print what the daemon answers, as JSON"),
    FIELD_END,
};
// clang-format on

static const PrintTableColumns columns[] = {
    {"inputs", {"pointer", "a", "b", "detail"}},
    {"metrics", {"name", "unit", "a", "b", "difference", "relative"}},
    {"channels",
     {"channel", "unit", "rms", "other_rms", "difference_rms", "relative", "correlation"}},
    {"psd", {"channel", "unit", "from", "to", "level", "difference", "power"}},
    {NULL, {NULL}},
};

static Status compare_ask(const CompareSettings *settings, ApiClient *daemon, const char *a,
                          const char *b, Problem *problem) {
    static const char *const skipped[] = {"links", NULL};
    static const PrintTableView view = {skipped, columns, NULL};
    HttpAnswer answer;
    Bytes path = {.most = 1000};
    size_t longest;
    bytes_text(&path, "/v1/compare");
    http_query(&path, "a", a);
    http_query(&path, "b", b);
    Status status = api_client_request(daemon, (HttpAsk){.method = "GET"}, &path, &answer, problem);
    if (status == STATUS_OK && settings->json)
        api_client_print(&answer);
    else if (status == STATUS_OK)
        status = print_table_print_json(answer.body.at, answer.body.count, &view, stdout, &longest,
                                        problem);
    http_answer_clear(&answer);
    return status;
}

static int compare(const Command *self, void *of, const Options *options, Problem *problem) {
    const CompareSettings *settings = of;
    if (options->operand_count != 2 || !api_client_is_id(options->operands[0]) ||
        !api_client_is_id(options->operands[1])) {
        (void)problem_set(problem, STATUS_USAGE,
                          "takes the ids of two results or jobs, like r-91c0");
        return command_error(self->name, problem);
    }
    const char *ids[2] = {options->operands[0], options->operands[1]};
    char results[2][96];
    const char *about = ids[0];
    ApiClient daemon;
    Status status = api_client_open(settings->server, settings->token_file, settings->ca_file,
                                    settings->wait, &daemon, problem);
    for (int i = 0; i < 2 && status == STATUS_OK; i++) {
        about = ids[i];
        status = api_client_result(&daemon, ids[i], results[i], problem);
    }
    if (status == STATUS_OK)
        status = compare_ask(settings, &daemon, results[0], results[1], problem);
    api_client_close(&daemon);
    return status == STATUS_OK ? COMMAND_OK : api_client_refuse(self->name, about, status, problem);
}

const Command command_compare = {
    .name = "compare",
    .operands = "A B",
    .summary = "set two results of a daemon side by side",
    .help =
        "  impactd compare r-91c0 r-02ab           metrics of both, and the inputs that differ\n"
        "  impactd compare j-7f3a j-81dd --json    by their jobs; as the daemon answers\n"
        "\n"
        "Exit code 4 if one of them is not there.\n",
    .options = compare_fields,
    .size = sizeof(CompareSettings),
    .run = compare,
};
