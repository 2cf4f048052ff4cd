// impactd submit SCENE.json: the job's id on standard output, so that a shell can go on with it;
// all else on stderr.
#include "server/cli/command.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "server/cli/client.h"
#include "server/cli/scene_file.h"
#include "server/json/json_edit.h"

typedef struct SubmitSettings {
    char *server, *token_file, *ca_file, *title, *idempotency_key;
    Texts label;
    double wait;
    bool dry_run, json;
} SubmitSettings;

enum { LABELS = 64 };

// clang-format off
static const Field submit_fields[] = {
    DAEMON_ROWS(SubmitSettings),
    FIELD_REAL(SubmitSettings, wait, "s", AT_MIN(0), 0, "wait so long for the job's end, and for a daemon that is busy (0)"),
    FIELD_TEXT(SubmitSettings, title, 0, PRESENCE_OPTIONAL, 0, "the job's title, in place of the scene's"),
    FIELD_TEXTS(SubmitSettings, label, NULL, NULL, LABELS, PRESENCE_OPTIONAL, 0, "KEY=VALUE, a label on top of the scene's; may be given again"),
    FIELD_FLAG(SubmitSettings, dry_run, false, "print the plan and the predicted cost, as JSON; run nothing"),
    FIELD_TEXT(SubmitSettings, idempotency_key, 255, PRESENCE_OPTIONAL, 0, "the same key with the same scene is the same job, however often it is sent"),
    FIELD_FLAG(SubmitSettings, json, false, "print the job as JSON in place of its id"),
    FIELD_END,
};
// clang-format on

// The job is there: its id, and with patience its end. Takes nothing.
static int job_follow(const SubmitSettings *settings, ApiClient *daemon, HttpAnswer *answer,
                      JobReply *job, Problem *problem) {
    int code = COMMAND_OK;
    if (!settings->json) {
        printf("%s\n", job->id);
        fflush(stdout);
    }
    if (settings->wait > 0 && !job_reply_is_final(job)) {
        char id[96];
        snprintf(id, sizeof id, "%s", job->id);
        job_reply_clear(job);
        http_answer_clear(answer);
        const Status status = api_client_follow(daemon, id, stderr, answer, job, problem);
        if (status != STATUS_OK)
            code = api_client_refuse("submit", id, status, problem);
        if (status != STATUS_OK && status != STATUS_TIMEOUT)
            return code;
    }
    if (settings->json)
        api_client_print(answer);
    // Without patience the job's end is nobody's question, but if it is there it is told.
    return code == COMMAND_OK && job_reply_is_final(job) ? api_client_verdict(job, problem) : code;
}

static int scene_submit(const SubmitSettings *settings, const char *path, const Bytes *text,
                        Problem *problem) {
    ApiClient daemon;
    HttpAnswer answer = {0};
    JobReply job = {0};
    char prefer[48];
    snprintf(prefer, sizeof prefer, "wait=%.0f", ceil(fmin(settings->wait, 2)));
    const HttpAsk ask = {.method = "POST",
                         .path = settings->dry_run ? "/v1/jobs?dry_run=1" : "/v1/jobs",
                         .body = text,
                         .prefer = settings->wait > 0 ? prefer : "respond-async",
                         .idempotency_key = settings->idempotency_key};
    Status status = api_client_open(settings->server, settings->token_file, settings->ca_file,
                                    settings->wait, &daemon, problem);
    int code = COMMAND_OK;
    if (status == STATUS_OK)
        status = api_client_ask(&daemon, &ask, &answer, problem);
    if (status == STATUS_OK && settings->dry_run) {
        api_client_print(&answer);
    } else if (status == STATUS_OK) {
        status = job_reply_read(&answer, &job, problem);
        if (status == STATUS_OK && !api_client_is_id(job.id))
            status = problem_set(problem, STATUS_UNREACHABLE, "the answer holds no job's id");
        if (status == STATUS_OK)
            code = job_follow(settings, &daemon, &answer, &job, problem);
    }
    if (status != STATUS_OK)
        code = api_client_refuse("submit", path, status, problem);
    job_reply_clear(&job);
    http_answer_clear(&answer);
    api_client_close(&daemon);
    return code;
}

static bool is_printable(const char *text) {
    for (const char *c = text; *c != '\0'; c++)
        if (*c < ' ' || *c > '~')
            return false;
    return true;
}

static int submit(const Command *self, void *of, const Options *options, Problem *problem) {
    const SubmitSettings *settings = of;
    Status status = STATUS_OK;
    if (options->operand_count != 1)
        status = problem_set(problem, STATUS_USAGE, "takes one scene, is given %zu",
                             options->operand_count);
    if (settings->idempotency_key != NULL && !is_printable(settings->idempotency_key))
        status = problem_add(problem, STATUS_USAGE, "--idempotency-key",
                             "must be of printable ASCII characters");
    if (status != STATUS_OK)
        return command_error(self->name, problem);
    const char *path = options->operands[0];
    Bytes text;
    status = scene_file_read(path, &text, problem);
    if (status == STATUS_OK && settings->title != NULL)
        status = json_edit_set(&text, "title", settings->title, problem);
    for (size_t i = 0; i < settings->label.count && status == STATUS_OK; i++)
        status = json_edit_label(&text, settings->label.at[i], problem);
    const int code = status == STATUS_OK ? scene_submit(settings, path, &text, problem)
                                         : api_client_refuse(self->name, path, status, problem);
    bytes_clear(&text);
    return code;
}

const Command command_submit = {
    .name = "submit",
    .operands = "SCENE.json",
    .summary = "send a scene to a daemon",
    .help =
        "  impactd submit scene.json                       print the job's id and go on\n"
        "  impactd submit scene.json --wait 60             the same, and wait for its end\n"
        "  impactd submit scene.json --wait 60 --json      print the finished job\n"
        "  impactd submit scene.json --dry-run             what it would do and cost; runs "
        "nothing\n"
        "  impactd submit scene.json --title 'sponge, 15 mm' --label batch=7\n"
        "  impactd submit - --server https://sim.example < scene.json\n"
        "\n"
        "A scene whose answer was lost can be sent again with the same --idempotency-key: it is "
        "one job.\n"
        "A daemon that is busy is asked again as it says, until --wait is over. Ctrl-C ends the\n"
        "waiting alone: the job goes on, \"impactd cancel\" stops it. Exit code 3 if the scene "
        "has\n"
        "faults, 1 if the job failed, 7 if no daemon answers or it is too busy, 8 if the job goes "
        "on\n"
        "after --wait.\n",
    .options = submit_fields,
    .size = sizeof(SubmitSettings),
    .run = submit,
};
