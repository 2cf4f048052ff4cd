// The commands on jobs and results of a server: submit, watch, get, cancel, compare.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/cli/client.h"
#include "server/cli/command.h"
#include "server/cli/output.h"
#include "server/cli/scene_file.h"
#include "server/json/document.h"
#include "server/json/parse.h"
#include "server/json/table.h"
#include "server/util/clock.h"

static const double bar_period = 0.5, lines_period = 2; // [s] between two requests for a job
static const int64_t restart_ns = (int64_t)10000000000; // time that a server may take to restart

// A job as the server sends it. Unknown members are skipped, missing ones are empty: the server may
// be newer, older or no impactd.
typedef struct JobReply {
    char *id, *status, *result;
    double progress;      // [%]; NAN: unknown
    ProblemReply problem; // of a failed job
} JobReply;

// clang-format off
static const Field job_fields[] = {
    FIELD_TEXT(JobReply, id, 0, PRESENCE_OPTIONAL, 0, "id"),
    FIELD_TEXT(JobReply, status, 0, PRESENCE_OPTIONAL, 0, "state"),
    FIELD_TEXT(JobReply, result, 0, PRESENCE_OPTIONAL, 0, "result"),
    FIELD_REAL(JobReply, progress, "%", ANY, OPTIONAL, "progress"),
    FIELD_ITEM_OR_NULL(JobReply, problem, problem_reply_fields, PRESENCE_OPTIONAL, "cause"),
    FIELD_END,
};
// clang-format on

// A request for a job: the answer as it came, and what is read of it.
typedef struct JobAnswer {
    HttpAnswer http;
    JobReply job;
} JobAnswer;

static void job_clear(JobAnswer *answer) {
    fields_clear(job_fields, &answer->job);
    http_answer_clear(&answer->http);
}

static Status job_read(JobAnswer *answer, Problem *problem) {
    JobReply *job = &answer->job;
    (void)json_parse(answer->http.body.at, answer->http.body.count, job_fields, job, NULL);
    if (job->id == NULL || job->status == NULL || strlen(job->status) > 40 ||
        !api_client_is_id(job->id))
        return api_client_unexpected("a job", problem);
    text_make_printable(job->status);
    return STATUS_OK;
}

static bool job_is_final(const JobReply *job) {
    return strcmp(job->status, "accepted") != 0 && strcmp(job->status, "running") != 0;
}

// Requests a job; the server answers after `wait` seconds at the latest, or when the job ends.
static Status job_get(ApiClient *client, const char *id, double wait, JobAnswer *answer,
                      Problem *problem) {
    char path[160];
    job_clear(answer);
    snprintf(path, sizeof path, "/v1/jobs/%s?wait=%.3f", id, fmin(wait, api_client_left(client)));
    const HttpAsk ask = {.method = "GET", .path = path};
    TRY(api_client_ask(client, &ask, &answer->http, problem));
    return job_read(answer, problem);
}

// STATUS_OK if the job was successful; otherwise the cause is in `problem`.
static Status job_verdict(const JobReply *job, Problem *problem) {
    if (strcmp(job->status, "successful") == 0)
        return STATUS_OK;
    if (strcmp(job->status, "failed") == 0)
        problem_reply_put(&job->problem, STATUS_INTERNAL, problem);
    else
        (void)problem_set(problem, STATUS_INTERNAL, "was %s", job->status);
    return STATUS_INTERNAL;
}

// The result of `id`: itself, or that of a job that finishes while the wait lasts. STATUS_TIMEOUT:
// the job continues.
static Status result_of(ApiClient *client, const char *id, char result[96], Problem *problem) {
    JobAnswer answer = {0};
    const JobReply *job = &answer.job;
    snprintf(result, 96, "%s", id);
    if (strncmp(id, "j-", 2) != 0)
        return STATUS_OK;
    Status status;
    do
        status = job_get(client, id, 20, &answer, problem);
    while (status == STATUS_OK && !job_is_final(job) && api_client_left(client) > 0);
    if (status == STATUS_OK && !job_is_final(job))
        status = problem_set(problem, STATUS_TIMEOUT,
                             "is still %s; \"impactd watch %s\" follows it, --wait S waits",
                             job->status, id);
    if (status == STATUS_OK)
        status = job->result == NULL ? job_verdict(job, problem) : STATUS_OK;
    if (status == STATUS_OK && (job->result == NULL || !api_client_is_id(job->result)))
        status = api_client_unexpected("a job with a result", problem);
    if (status == STATUS_OK)
        snprintf(result, 96, "%s", job->result);
    job_clear(&answer);
    return status;
}

// The progress of a job: a bar on a terminal, else a line when its state changes or it has advanced
// by ten percent.
typedef struct JobProgress {
    ProgressBar bar;
    FILE *lines; // NULL: none
    char status[48];
    double progress;
} JobProgress;

static void job_progress_show(JobProgress *show, const char *id, const JobReply *job) {
    const double progress = job->progress >= 0 && job->progress <= 100 ? job->progress : 0;
    if (show->bar.is_terminal) {
        const Progress watch = progress_bar_watch(&show->bar);
        (void)progress_advance(&watch, progress / 100);
        return;
    }
    if (show->lines == NULL ||
        (strcmp(show->status, job->status) == 0 && progress < show->progress + 10))
        return;
    snprintf(show->status, sizeof show->status, "%s", job->status);
    show->progress = progress;
    fprintf(show->lines, "%s %s %.0f %%\n", id, job->status, progress);
    fflush(show->lines);
}

// A stream of server-sent events as it arrives. Lines that are too long for an event "progress" are
// skipped.
typedef struct EventStream {
    JobProgress *show;
    const char *id;
    const HttpAnswer *answer;
    bool is_progress; // the event that lines of data belong to
    size_t length;    // of the line, also beyond its size
    char line[1024];
} EventStream;

static void event_line_read(EventStream *events) {
    static const char name[] = "event: ", data[] = "data: ";
    JobReply job = {0};
    const size_t size = events->length;
    events->length = 0;
    if (size >= sizeof events->line)
        return;
    events->line[size] = '\0';
    if (strncmp(events->line, name, sizeof name - 1) == 0)
        events->is_progress = strcmp(events->line + sizeof name - 1, "progress") == 0;
    if (!events->is_progress || strncmp(events->line, data, sizeof data - 1) != 0)
        return;
    (void)json_parse(events->line + sizeof data - 1, size - (sizeof data - 1), job_fields, &job,
                     NULL);
    text_make_printable(job.status);
    if (job.status != NULL && strlen(job.status) <= 40)
        job_progress_show(events->show, events->id, &job);
    fields_clear(job_fields, &job);
}

static bool is_event_stream(const HttpAnswer *answer) {
    return strcmp(answer->content_type, "text/event-stream") == 0;
}

static Status events_take(void *context, const void *bytes, size_t size, Problem *problem) {
    EventStream *events = context;
    const char *text = bytes;
    if (!is_event_stream(events->answer))
        return problem_set(problem, STATUS_UNSUPPORTED_TYPE, "the answer is no stream of events");
    for (size_t i = 0; i < size; i++) {
        if (text[i] == '\n') {
            event_line_read(events);
        } else {
            if (events->length < sizeof events->line)
                events->line[events->length] = text[i];
            events->length++;
        }
    }
    return STATUS_OK;
}

// Shows the events of the job until the stream ends. False if the server has no such stream.
static bool events_follow(ApiClient *client, const char *id, JobProgress *show) {
    enum { EVENTS_MAX = 256 << 20 }; // [B]
    char path[160];
    HttpAnswer answer;
    EventStream events = {.show = show, .id = id, .answer = &answer};
    snprintf(path, sizeof path, "/v1/jobs/%s/events", id);
    const HttpAsk ask = {.method = "GET",
                         .path = path,
                         .take = events_take,
                         .context = &events,
                         .most = EVENTS_MAX,
                         .within = api_client_left(client)};
    // The request for the job that follows reports what is wrong.
    (void)http_ask(client, &ask, &answer, NULL);
    const bool is_stream = is_event_stream(&answer);
    http_answer_clear(&answer);
    return is_stream;
}

// Requests a job that was there before: repeated while the server restarts.
static Status job_get_again(ApiClient *client, const char *id, double wait, JobAnswer *answer,
                            Problem *problem) {
    const int64_t until_ns = clock_monotonic_ns() + restart_ns;
    for (;;) {
        const Status status = job_get(client, id, wait, answer, problem);
        if (status != STATUS_UNREACHABLE || clock_monotonic_ns() > until_ns ||
            api_client_left(client) < 1)
            return status;
        problem_clear(problem);
        sleep(1);
    }
}

// Follows a job to its end, by its events if the server has them, else by repeated requests.
// STATUS_TIMEOUT when the wait is over: the job continues. The answer has the last state.
static Status job_follow(ApiClient *client, const char *id, FILE *lines, JobAnswer *answer,
                         Problem *problem) {
    char farewell[256];
    JobProgress show = {.lines = lines};
    const JobReply *job = &answer->job;
    client->about = id;
    snprintf(farewell, sizeof farewell,
             "%s goes on; \"impactd cancel %s\" stops it, \"impactd watch %s\" follows it\n", id,
             id, id);
    output_farewell(farewell);
    progress_bar_start(&show.bar);
    const double period = show.bar.is_terminal ? bar_period : lines_period;
    bool has_events = true;
    Status status = job_get(client, id, period, answer, problem);
    while (status == STATUS_OK) {
        job_progress_show(&show, id, job);
        if (job_is_final(job))
            break;
        if (api_client_left(client) <= 0) {
            status = problem_set(problem, STATUS_TIMEOUT, "is still %s after the time given; %.*s",
                                 job->status, (int)strlen(farewell) - 1, farewell);
            break;
        }
        has_events = has_events && events_follow(client, id, &show);
        status = job_get_again(client, id, period, answer, problem);
    }
    progress_bar_stop(&show.bar);
    output_farewell(NULL);
    if (status == STATUS_OK && show.bar.is_terminal && lines != NULL)
        fprintf(lines, "%s %s\n", id, job->status);
    return status;
}

// Options and operands of all five commands; each has rows for those that it takes.
typedef struct JobsSettings {
    ClientSettings client;
    bool json, dry_run;
    char *title, *idempotency_key;
    Texts label;
    char *output, *channels;
    double from, to;
    uint64_t points, max_bytes;
    const char *operands[2];
    Bytes scene;
    char what[112];
} JobsSettings;

static int usage_error(const Command *self, const char *sentence, Problem *problem) {
    (void)problem_set(problem, STATUS_USAGE, "%s", sentence);
    return command_error(self->name, problem);
}

// Whether `count` operands were given, all of them ids; stores them.
static bool operands_are_ids(JobsSettings *settings, const Options *options, size_t count) {
    bool are_ids = options->operand_count == count;
    for (size_t i = 0; i < count && are_ids; i++) {
        settings->operands[i] = options->operands[i];
        are_ids = api_client_is_id(options->operands[i]);
    }
    return are_ids;
}

static Status submit_act(ApiClient *client, void *context, Problem *problem) {
    const JobsSettings *settings = context;
    JobAnswer answer = {0};
    const double wait = settings->client.wait;
    char prefer[48], id[96];
    snprintf(prefer, sizeof prefer, "wait=%.0f", ceil(fmin(wait, 2)));
    const HttpAsk ask = {.method = "POST",
                         .path = settings->dry_run ? "/v1/jobs?dry_run=1" : "/v1/jobs",
                         .body = &settings->scene,
                         .prefer = wait > 0 ? prefer : "respond-async",
                         .idempotency_key = settings->idempotency_key};
    Status status = api_client_ask(client, &ask, &answer.http, problem);
    if (status == STATUS_OK && !settings->dry_run)
        status = job_read(&answer, problem);
    const bool is_accepted = status == STATUS_OK;
    if (is_accepted && !settings->dry_run) {
        snprintf(id, sizeof id, "%s", answer.job.id);
        client->about = id;
        if (!settings->json) {
            printf("%s\n", id);
            fflush(stdout);
        }
        if (wait > 0 && !job_is_final(&answer.job))
            status = job_follow(client, id, stderr, &answer, problem);
    }
    if (is_accepted && (settings->json || settings->dry_run) &&
        (status == STATUS_OK || status == STATUS_TIMEOUT))
        api_client_print(&answer.http);
    // A job that has ended is reported also if the end was not waited for.
    if (status == STATUS_OK && !settings->dry_run && job_is_final(&answer.job))
        status = job_verdict(&answer.job, problem);
    job_clear(&answer);
    return status;
}

static bool is_printable(const char *text) {
    for (const char *c = text; *c != '\0'; c++)
        if (*c < ' ' || *c > '~')
            return false;
    return true;
}

static int submit_run(const Command *self, void *of, const Options *options, Problem *problem) {
    JobsSettings *settings = of;
    if (options->operand_count != 1)
        (void)problem_set(problem, STATUS_USAGE, "takes one scene, is given %zu",
                          options->operand_count);
    if (settings->idempotency_key != NULL && !is_printable(settings->idempotency_key))
        (void)problem_add(problem, STATUS_USAGE, "--idempotency-key",
                          "must be of printable ASCII characters");
    if (problem->status != STATUS_OK)
        return command_error(self->name, problem);
    const char *path = options->operands[0];
    Status status = scene_file_read(path, &settings->scene, problem);
    if (status == STATUS_OK && settings->title != NULL)
        status = json_edit_set(&settings->scene, "title", settings->title, problem);
    for (size_t i = 0; i < settings->label.count && status == STATUS_OK; i++)
        status = json_edit_label(&settings->scene, settings->label.at[i], problem);
    const int code = status == STATUS_OK ? api_client_run(self, &settings->client, path, submit_act,
                                                          settings, problem)
                                         : api_client_refuse(self->name, path, status, problem);
    bytes_clear(&settings->scene);
    return code;
}

static Status watch_act(ApiClient *client, void *context, Problem *problem) {
    const JobsSettings *settings = context;
    JobAnswer answer = {0};
    Status status =
        job_follow(client, settings->operands[0], settings->json ? NULL : stdout, &answer, problem);
    if (status == STATUS_OK && settings->json)
        api_client_print(&answer.http);
    if (status == STATUS_OK)
        status = job_verdict(&answer.job, problem);
    job_clear(&answer);
    return status;
}

static int watch_run(const Command *self, void *of, const Options *options, Problem *problem) {
    JobsSettings *settings = of;
    return operands_are_ids(settings, options, 1)
               ? api_client_run(self, &settings->client, settings->operands[0], watch_act, settings,
                                problem)
               : usage_error(self, "takes one job's id, like j-7f3a", problem);
}

static Status cancel_act(ApiClient *client, void *context, Problem *problem) {
    const JobsSettings *settings = context;
    JobAnswer answer = {0};
    char path[128];
    snprintf(path, sizeof path, "/v1/jobs/%s", settings->operands[0]);
    const HttpAsk ask = {.method = "DELETE", .path = path};
    Status status = api_client_ask(client, &ask, &answer.http, problem);
    if (status == STATUS_OK)
        status = job_read(&answer, problem);
    if (status == STATUS_OK)
        printf("%s %s\n", answer.job.id, answer.job.status);
    job_clear(&answer);
    return status;
}

static int cancel_run(const Command *self, void *of, const Options *options, Problem *problem) {
    JobsSettings *settings = of;
    return operands_are_ids(settings, options, 1)
               ? api_client_run(self, &settings->client, settings->operands[0], cancel_act,
                                settings, problem)
               : usage_error(self, "takes one job's id, like j-7f3a", problem);
}

static Status compare_act(ApiClient *client, void *context, Problem *problem) {
    static const PrintTableColumns columns[] = {
        {"inputs", {"pointer", "a", "b", "detail"}},
        {"metrics", {"name", "unit", "a", "b", "difference", "relative"}},
        {"channels",
         {"channel", "unit", "rms", "other_rms", "difference_rms", "relative", "correlation"}},
        {"psd", {"channel", "unit", "from", "to", "level", "difference", "power"}},
        {NULL, {NULL}},
    };
    static const char *const skipped[] = {"links", NULL}, *const sides[] = {"a", "b"};
    static const PrintTableView view = {skipped, columns, NULL};
    const JobsSettings *settings = context;
    HttpAnswer answer;
    Bytes path = {.most = 1000};
    size_t longest;
    bytes_text(&path, "/v1/compare");
    for (int i = 0; i < 2; i++) {
        char result[96];
        client->about = settings->operands[i];
        TRY(result_of(client, settings->operands[i], result, problem));
        http_query(&path, sides[i], result);
    }
    Status status = api_client_request(client, (HttpAsk){.method = "GET"}, &path, &answer, problem);
    if (status == STATUS_OK && settings->json)
        api_client_print(&answer);
    else if (status == STATUS_OK)
        status = print_table_print_json(answer.body.at, answer.body.count, &view, stdout, &longest,
                                        problem);
    http_answer_clear(&answer);
    return status;
}

static int compare_run(const Command *self, void *of, const Options *options, Problem *problem) {
    JobsSettings *settings = of;
    return operands_are_ids(settings, options, 2)
               ? api_client_run(self, &settings->client, settings->operands[0], compare_act,
                                settings, problem)
               : usage_error(self, "takes the ids of two results or jobs, like r-91c0", problem);
}

static const char *const formats[] = {"json", "csv", "npy", "npz", "mat", "zip", "svg", NULL};
static const char *const binary_formats[] = {"npy", "npz", "mat", "zip", NULL};
// Parts of a result that have one format, and no extension in their path.
static const char *const plain_parts[] = {"result", "job", "manifest", NULL};

static bool is_among(const char *const *texts, const char *text) {
    for (size_t i = 0; text != NULL && texts[i] != NULL; i++)
        if (strcmp(texts[i], text) == 0)
            return true;
    return false;
}

// The extension of a path's last part; NULL if there is none.
static const char *extension_of(const char *path) {
    const char *slash = strrchr(path, '/'), *name = slash != NULL ? slash + 1 : path;
    const char *point = strrchr(name, '.');
    return point != NULL && point > name ? point + 1 : NULL;
}

static bool is_part(const char *what) {
    const size_t length = strlen(what);
    return length > 0 && length < 100 && what[0] != '/' && strstr(what, "..") == NULL &&
           strstr(what, "//") == NULL &&
           strspn(what, "abcdefghijklmnopqrstuvwxyz0123456789_-./") == length;
}

// Sets `what` to the path of a part, as "series.csv", from the operand and the output's extension.
// Without an operand it is the result itself or, for an output that is a table, the series.
static Status part_choose(JobsSettings *settings, const Options *options, Problem *problem) {
    const char *output = settings->output;
    const char *extension = output != NULL ? extension_of(output) : NULL;
    if (output != NULL && !is_among(formats, extension))
        return problem_add(
            problem, STATUS_USAGE, "--output",
            "must end in one of .json, .csv, .npy, .npz, .mat, .zip, .svg, is %.200s", output);
    const bool is_table = extension != NULL && strcmp(extension, "json") != 0;
    const char *typed = options->operand_count > 1      ? options->operands[1]
                        : !is_table                     ? "result"
                        : strcmp(extension, "zip") == 0 ? "bundle"
                                                        : "series";
    if (!is_part(typed))
        return problem_set(problem, STATUS_USAGE,
                           "a result has no %.100s; it has series, psd, impacts, energy, manifest, "
                           "bundle and others",
                           typed);
    const bool is_plain = is_among(plain_parts, typed);
    if (is_plain && is_table)
        return problem_add(problem, STATUS_USAGE, "--output", "must end in .json for the %s",
                           typed);
    if (extension == NULL)
        extension = strcmp(typed, "bundle") == 0 ? "zip" : "json";
    const bool is_complete = is_plain || extension_of(typed) != NULL;
    snprintf(settings->what, sizeof settings->what, "%s%s%s", typed, is_complete ? "" : ".",
             is_complete ? "" : extension);
    if (is_among(binary_formats, extension_of(settings->what)) && output == NULL &&
        isatty(STDOUT_FILENO))
        return problem_set(problem, STATUS_USAGE,
                           "does not print binary data on a terminal; use -o FILE.%s",
                           extension_of(settings->what));
    return STATUS_OK;
}

static Status stdout_take(void *context, const void *bytes, size_t size, Problem *problem) {
    (void)context;
    return fwrite(bytes, 1, size, stdout) == size
               ? STATUS_OK
               : problem_set(problem, STATUS_IO, "standard output cannot be written");
}

static Status get_act(ApiClient *client, void *context, Problem *problem) {
    const JobsSettings *settings = context;
    const char *what = settings->what;
    const bool is_job = strcmp(what, "job") == 0;
    char result[96];
    if (is_job)
        snprintf(result, sizeof result, "%s", settings->operands[0]);
    else
        TRY(result_of(client, settings->operands[0], result, problem));
    Bytes path = {.most = 16000};
    bytes_format(&path, "/v1/%s/%s", is_job ? "jobs" : "results", result);
    if (!is_job && strcmp(what, "result") != 0)
        bytes_format(&path, "/%s", what);
    http_query(&path, "channels", settings->channels);
    http_query_real(&path, "from", settings->from);
    http_query_real(&path, "to", settings->to);
    if (settings->points != COUNT_ABSENT)
        http_query_real(&path, "points", (double)settings->points);
    HttpAnswer answer = {0};
    const bool has_file = settings->output != NULL;
    Status status = has_file ? output_open(settings->output, problem) : STATUS_OK;
    const HttpAsk ask = {
        .method = "GET", .take = has_file ? output_take : stdout_take, .most = settings->max_bytes};
    if (status == STATUS_OK)
        status = api_client_request(client, ask, &path, &answer, problem);
    if (status == STATUS_OK && has_file)
        status = output_close(problem);
    output_drop();
    http_answer_clear(&answer);
    bytes_clear(&path);
    return status;
}

static int get_run(const Command *self, void *of, const Options *options, Problem *problem) {
    JobsSettings *settings = of;
    Options first = *options;
    first.operand_count = options->operand_count == 2 ? 1 : options->operand_count;
    if (!operands_are_ids(settings, &first, 1))
        return usage_error(self, "takes the id of a result or a job, like r-91c0, and a part of it",
                           problem);
    return part_choose(settings, options, problem) == STATUS_OK
               ? api_client_run(self, &settings->client, settings->operands[0], get_act, settings,
                                problem)
               : command_error(self->name, problem);
}

// clang-format off
static const Field submit_fields[] = {
    DAEMON_ROWS(ClientSettings),
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 0, "how long to wait for the job to finish and for a busy server (0)"),
    FIELD_TEXT(JobsSettings, title, 0, PRESENCE_OPTIONAL, 0, "title of the job; replaces that of the scene"),
    FIELD_TEXTS(JobsSettings, label, NULL, NULL, 64, PRESENCE_OPTIONAL, 0, "KEY=VALUE, added to the labels of the scene; repeatable"),
    FIELD_FLAG(JobsSettings, dry_run, false, "print the plan and the estimated cost as JSON; run nothing"),
    FIELD_TEXT(JobsSettings, idempotency_key, 255, PRESENCE_OPTIONAL, 0, "a scene that is sent again with this key is the same job"),
    FIELD_FLAG(JobsSettings, json, false, "print the job as JSON instead of its id"),
    FIELD_END,
};
static const Field watch_fields[] = {
    DAEMON_ROWS(ClientSettings),
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 1e9, "how long to wait for the job to finish (no limit)"),
    FIELD_FLAG(JobsSettings, json, false, "print the finished job as JSON instead of lines"),
    FIELD_END,
};
static const Field get_fields[] = {
    DAEMON_ROWS(ClientSettings),
    FIELD_TEXT(JobsSettings, output, 4000, PRESENCE_OPTIONAL, 0, "write to this file; its extension is the format (standard output)"),
    FIELD_TEXT(JobsSettings, channels, 4000, PRESENCE_OPTIONAL, 0, "channels of the series, separated by commas (all)"),
    FIELD_REAL(JobsSettings, from, "s", AT_MIN(0), OPTIONAL, "start of the series"),
    FIELD_REAL(JobsSettings, to, "s", AT_MIN(0), OPTIONAL, "end of the series, inclusive"),
    FIELD_COUNT(JobsSettings, points, NULL, AT_MIN(1), OPTIONAL, "reduce the series to this number of buckets, each with its minimum and maximum"),
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 0, "how long to wait for an unfinished job and a busy server (0)"),
    FIELD_COUNT(JobsSettings, max_bytes, "B", AT_MIN(1), 17179869184.0, "refuse a larger answer"),
    FIELD_END,
};
static const Field cancel_fields[] = {
    DAEMON_ROWS(ClientSettings),
    FIELD_END,
};
static const Field compare_fields[] = {
    DAEMON_ROWS(ClientSettings),
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 60, "how long to wait for an unfinished job and a busy server"),
    FIELD_FLAG(JobsSettings, json, false, "print the answer of the server as JSON"),
    FIELD_END,
};
// clang-format on

const Command command_submit = {
    .name = "submit",
    .operands = "SCENE.json",
    .summary = "send a scene to a server",
    .help =
        "  impactd submit scene.json                       print the id of the job\n"
        "  impactd submit scene.json --wait 60             wait until it has finished\n"
        "  impactd submit scene.json --wait 60 --json      print the finished job\n"
        "  impactd submit scene.json --dry-run             plan and estimated cost; runs nothing\n"
        "  impactd submit scene.json --title 'sponge, 15 mm' --label batch=7\n"
        "  impactd submit - --server https://sim.example < scene.json\n"
        "\n"
        "If an answer was lost, send the scene again with the same --idempotency-key: both are "
        "one\n"
        "job. A busy server is asked again, as its Retry-After says, while --wait lasts. Ctrl-C\n"
        "ends the waiting only: the job continues, \"impactd cancel\" stops it. Exit code 3 if "
        "the\n"
        "scene has faults, 1 if the job failed, 7 if the server does not answer or is busy, 8 if\n"
        "the job has not finished after --wait.\n",
    .options = submit_fields,
    .size = sizeof(JobsSettings),
    .run = submit_run,
};

const Command command_watch = {
    .name = "watch",
    .operands = "JOB",
    .summary = "follow a job of a server until it has finished",
    .help =
        "  impactd watch j-7f3a                            a bar on a terminal, else lines\n"
        "  impactd watch j-7f3a --json > job.json          the finished job\n"
        "  impactd watch $(impactd submit scene.json) && impactd get ...\n"
        "\n"
        "Exit code 0 if the job was successful, 1 if it failed or was dismissed, 4 if it does\n"
        "not exist, 8 if it has not finished after --wait. Ctrl-C ends the watching only (130).\n"
        "A restart of the server does not end it.\n",
    .options = watch_fields,
    .size = sizeof(JobsSettings),
    .run = watch_run,
};

const Command command_get = {
    .name = "get",
    .operands = "RESULT-or-JOB [WHAT]",
    .summary = "download a result, its series, spectra or impacts",
    .help =
        "  impactd get r-91c0                              summary, plan and units\n"
        "  impactd get r-91c0 series -o motion.npy         time series, for numpy.load\n"
        "  impactd get r-91c0 psd -o psd.svg               spectra as a chart\n"
        "  impactd get r-91c0 series -o motion.csv --channels displacement --from 1 --to 2\n"
        "  impactd get r-91c0 series --points 500          minimum and maximum of 500 buckets\n"
        "  impactd get r-91c0 psd -o psd.csv               spectra\n"
        "  impactd get r-91c0 impacts.csv                  all impacts, on standard output\n"
        "  impactd get r-91c0 impacts/3/force -o one.csv   contact force of one impact\n"
        "  impactd get j-7f3a --wait 60 -o motion.mat      of a job, when it has finished\n"
        "  impactd get r-91c0 bundle -o all.zip            everything in one archive\n"
        "\n"
        "WHAT: result (default), series, psd, impacts, energy, manifest, bundle, job; of studies\n"
        "tradeoff, ensemble, compare, sensitivity, table. Formats: json, csv, npy, npz, mat, zip,\n"
        "svg, as far as the server has them. A file is written completely or not at all. Exit "
        "code\n"
        "4 if there is no such part, 8 if the job has not finished after --wait.\n",
    .options = get_fields,
    .size = sizeof(JobsSettings),
    .run = get_run,
};

const Command command_cancel = {
    .name = "cancel",
    .operands = "JOB",
    .summary = "stop a job of a server",
    .help = "  impactd cancel j-7f3a\n"
            "\n"
            "Exit code 1 if the job had finished before, 4 if it does not exist.\n",
    .options = cancel_fields,
    .size = sizeof(JobsSettings),
    .run = cancel_run,
};

const Command command_compare = {
    .name = "compare",
    .operands = "A B",
    .summary = "compare two results of a server",
    .help = "  impactd compare r-91c0 r-02ab           metrics of both, and inputs that differ\n"
            "  impactd compare j-7f3a j-81dd --json    results of two jobs; as JSON\n"
            "\n"
            "Exit code 4 if one of them does not exist.\n",
    .options = compare_fields,
    .size = sizeof(JobsSettings),
    .run = compare_run,
};
