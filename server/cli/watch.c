#include "server/cli/command.h"

#include "server/cli/client.h"

typedef struct WatchSettings {
    char *server, *token_file, *ca_file;
    double wait;
    bool json;
} WatchSettings;

// clang-format off
static const Field watch_fields[] = {
    DAEMON_ROWS(WatchSettings),
    FIELD_REAL(WatchSettings, wait, "s", AT_MIN(0), 1e9, "watch so long at most (without end)"),
    FIELD_FLAG(WatchSettings, json, false, "print the finished job as JSON in place of lines"),
    FIELD_END,
};
// clang-format on

static int watch(const Command *self, void *of, const Options *options, Problem *problem) {
    const WatchSettings *settings = of;
    const char *id = options->operands[0];
    if (options->operand_count != 1 || !api_client_is_id(id)) {
        (void)problem_set(problem, STATUS_USAGE, "takes one job's id, like j-7f3a");
        return command_error(self->name, problem);
    }
    ApiClient daemon;
    HttpAnswer answer = {0};
    JobReply job = {0};
    Status status = api_client_open(settings->server, settings->token_file, settings->ca_file,
                                    settings->wait, &daemon, problem);
    if (status == STATUS_OK)
        status =
            api_client_follow(&daemon, id, settings->json ? NULL : stdout, &answer, &job, problem);
    int code = COMMAND_OK;
    if (status == STATUS_OK && settings->json)
        api_client_print(&answer);
    if (status == STATUS_OK)
        code = api_client_verdict(&job, problem);
    else
        code = api_client_refuse(self->name, id, status, problem);
    job_reply_clear(&job);
    http_answer_clear(&answer);
    api_client_close(&daemon);
    return code;
}

const Command command_watch = {
    .name = "watch",
    .operands = "JOB",
    .summary = "follow a daemon's job to its end",
    .help =
        "  impactd watch j-7f3a                            a bar on a terminal, lines elsewhere\n"
        "  impactd watch j-7f3a --json > job.json          the finished job\n"
        "  impactd watch $(impactd submit scene.json) && impactd get ...\n"
        "\n"
        "Exit code 0 if the job was successful, 1 if it failed or was dismissed, 4 if there is no\n"
        "such job, 8 if it goes on after --wait. Ctrl-C ends the watching alone (130). A daemon\n"
        "that is started anew meanwhile is found again.\n",
    .options = watch_fields,
    .size = sizeof(WatchSettings),
    .run = watch,
};
