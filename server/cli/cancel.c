#include "server/cli/command.h"

#include "server/cli/client.h"

typedef struct CancelSettings {
    char *server, *token_file, *ca_file;
} CancelSettings;

static const Field cancel_fields[] = {
    DAEMON_ROWS(CancelSettings),
    FIELD_END,
};

static int cancel(const Command *self, void *of, const Options *options, Problem *problem) {
    const CancelSettings *settings = of;
    const char *id = options->operands[0];
    if (options->operand_count != 1 || !api_client_is_id(id)) {
        (void)problem_set(problem, STATUS_USAGE, "takes one job's id, like j-7f3a");
        return command_error(self->name, problem);
    }
    ApiClient daemon;
    HttpAnswer answer = {0};
    JobReply job = {0};
    char path[128];
    snprintf(path, sizeof path, "/v1/jobs/%s", id);
    const HttpAsk ask = {.method = "DELETE", .path = path};
    Status status = api_client_open(settings->server, settings->token_file, settings->ca_file, 0,
                                    &daemon, problem);
    if (status == STATUS_OK)
        status = api_client_ask(&daemon, &ask, &answer, problem);
    if (status == STATUS_OK)
        status = job_reply_read(&answer, &job, problem);
    int code = COMMAND_OK;
    if (status == STATUS_OK)
        printf("%s %s\n", job.id, job.status);
    else
        code = api_client_refuse(self->name, id, status, problem);
    job_reply_clear(&job);
    http_answer_clear(&answer);
    api_client_close(&daemon);
    return code;
}

const Command command_cancel = {
    .name = "cancel",
    .operands = "JOB",
    .summary = "stop a daemon's job",
    .help = "  impactd cancel j-7f3a\n"
            "\n"
            "Exit code 1 if the job was finished before, 4 if there is no such job.\n",
    .options = cancel_fields,
    .size = sizeof(CancelSettings),
    .run = cancel,
};
