// The commands on jobs and results of a server: submit, jobs, watch, get, cancel, compare, open.
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/base/rfc3339.h"
#include "core/base/spelling.h"
#include "server/cli/client.h"
#include "server/cli/files.h"
#include "server/cli/report.h"
#include "server/http/reply.h"
#include "server/jobs/job.h"
#include "server/json/document.h"
#include "server/util/clock.h"

static const double poll_period = 0.5;                  // [s] between two requests for a job
static const int64_t restart_ns = (int64_t)10000000000; // time that a server may take to restart

static const char *job_text(const ApiCall *call, const char *name) {
    return json_get_text(call->reply, name);
}

// Reads the answer, which must be a job.
static Status job_read(ApiCall *call, Problem *problem) {
    (void)api_reply(call);
    const char *id = job_text(call, "id"), *status = job_text(call, "status");
    return id != NULL && api_is_id(id) && status != NULL && strlen(status) <= 40
               ? STATUS_OK
               : api_unexpected(call, "a job", problem);
}

static bool job_is_final(const ApiCall *call) {
    const char *status = job_text(call, "status");
    return strcmp(status, "accepted") != 0 && strcmp(status, "running") != 0;
}

// Requests a job; the server answers after `wait` seconds at the latest, or when the job ends.
static Status job_get(ApiCall *call, const char *id, double wait, Problem *problem) {
    const int64_t began_ns = clock_monotonic_ns();
    const double longest = fmin(wait, api_left(call));
    TRY(api_get(call, api_path("/v1/jobs/%s?wait=%.3f", id, longest), problem));
    TRY(job_read(call, problem));
    // Something between us and the server may not pass the wait on.
    if (!job_is_final(call) && longest > 0.1 && clock_monotonic_ns() - began_ns < 100000000)
        (void)poll(NULL, 0, 200);
    return STATUS_OK;
}

// STATUS_OK if the job was successful; otherwise the cause is in `problem`.
static Status job_verdict(const ApiCall *call, Problem *problem) {
    const char *status = job_text(call, "status");
    if (strcmp(status, "successful") == 0)
        return STATUS_OK;
    if (strcmp(status, "failed") != 0)
        return problem_set(problem, STATUS_INTERNAL, "was %s", status);
    api_add_faults(json_get_object(call->reply, "problem"), STATUS_INTERNAL, problem);
    return STATUS_INTERNAL;
}

// The result of `id`: itself, or that of a job that finishes while the wait lasts. STATUS_TIMEOUT:
// the job continues.
static Status job_result(ApiCall *call, const char *id, char result[96], Problem *problem) {
    snprintf(result, 96, "%s", id);
    if (strncmp(id, "j-", 2) != 0)
        return STATUS_OK;
    do
        TRY(job_get(call, id, 20, problem));
    while (!job_is_final(call) && api_left(call) > 0);
    if (!job_is_final(call))
        return problem_set(problem, STATUS_TIMEOUT,
                           "is still %s; \"impactd watch %s\" follows it, --wait S waits",
                           job_text(call, "status"), id);
    const char *made = job_text(call, "result");
    if (made == NULL)
        TRY(job_verdict(call, problem));
    if (made == NULL || !api_is_id(made))
        return api_unexpected(call, "a job with a result", problem);
    snprintf(result, 96, "%s", made);
    return STATUS_OK;
}

// The progress of a job: a bar on a terminal, else a line when its state changes or it has advanced
// by ten percent.
typedef struct JobProgress {
    ProgressBar bar;
    FILE *lines; // NULL: none
    char status[48];
    char reason[80]; // why a cluster does not make it, as it was printed last
    double progress;
} JobProgress;

static void job_reason_show(JobProgress *show, const char *id, const ApiCall *call) {
    const char *reason = json_get_text(json_get_object(call->reply, "cluster"), "reason");
    if (reason != NULL && strncmp(show->reason, reason, sizeof show->reason - 1) != 0)
        command_print_line(stderr, "%s waits for the cluster: %s", id, reason);
    snprintf(show->reason, sizeof show->reason, "%s", reason != NULL ? reason : "");
}

static void job_progress_show(JobProgress *show, const char *id, const ApiCall *call) {
    const double percent = json_get_number(call->reply, "progress");
    const double progress = percent >= 0 && percent <= 100 ? percent : 0;
    const char *status = job_text(call, "status");
    job_reason_show(show, id, call);
    if (show->bar.is_terminal) {
        const Progress watch = progress_bar_watch(&show->bar);
        (void)progress_advance(&watch, progress / 100);
        return;
    }
    if (show->lines == NULL ||
        (strcmp(show->status, status) == 0 && progress < show->progress + 10))
        return;
    snprintf(show->status, sizeof show->status, "%s", status);
    show->progress = progress;
    fprintf(show->lines, "%s %s %.0f %%\n", id, status, progress);
    fflush(show->lines);
}

// Follows a job to its end. STATUS_TIMEOUT when the wait is over: the job continues. The call's
// answer and reply have the last state. A server that has answered once may be restarted meanwhile.
static Status job_follow(ApiCall *call, const char *id, FILE *lines, Problem *problem) {
    char farewell[256];
    JobProgress show = {.lines = lines};
    int64_t answered_ns = INT64_MIN;
    Status status;
    snprintf(farewell, sizeof farewell,
             "%s continues; \"impactd cancel %s\" stops it, \"impactd watch %s\" follows it\n", id,
             id, id);
    output_farewell(farewell);
    progress_bar_start(&show.bar);
    for (;;) {
        status = job_get(call, id, poll_period, problem);
        const double left = api_left(call);
        const int64_t now_ns = clock_monotonic_ns();
        if (status == STATUS_UNREACHABLE && now_ns - restart_ns < answered_ns && left >= 1) {
            problem_clear(problem);
            sleep(1);
            continue;
        }
        if (status != STATUS_OK)
            break;
        answered_ns = now_ns;
        job_progress_show(&show, id, call);
        if (job_is_final(call))
            break;
        if (left <= 0) {
            status = problem_set(problem, STATUS_TIMEOUT, "is still %s after the time given; %.*s",
                                 job_text(call, "status"), (int)strlen(farewell) - 1, farewell);
            break;
        }
    }
    progress_bar_stop(&show.bar);
    output_farewell(NULL);
    if (status == STATUS_OK && show.bar.is_terminal && lines != NULL)
        fprintf(lines, "%s %s\n", id, job_text(call, "status"));
    return status;
}

// Options of all these commands; each has rows for those that it takes.
typedef struct JobsSettings {
    ClientSettings client;
    bool dry_run;
    char *title, *idempotency_key;
    Texts label, set, vary;
    char *output, *channels;
    double from, to;
    uint64_t points, max_bytes;
    char *q;
    int status; // CHOICE_ABSENT: any
    uint64_t limit;
    bool all;
} JobsSettings;

static bool text_is_printable(const char *text) {
    for (const char *c = text; c != NULL && *c != '\0'; c++)
        if (*c < ' ' || *c > '~')
            return false;
    return true;
}

// Prints the numbers of a finished job or a result on the terminal.
static void summary_print(const JsonDocument *of, const char *result, const Terminal *terminal) {
    static const char *const names[][2] = {
        {"peak_displacement", "m"},    {"rms_displacement", "m"},   {"peak_acceleration", "m/s^2"},
        {"rms_acceleration", "m/s^2"}, {"peak_contact_force", "N"}, {"impacts", NULL}};
    Report report = {.is_page = false};
    const JsonDocument *summary = json_get_object(of, "summary");
    const char *title = json_get_text(of, "title"), *study = json_get_text(of, "study");
    if (title == NULL)
        title = json_get_text(json_get_object(of, "scene"), "title");
    report_title(&report, title);
    report_sentence(&report, "Result %s", result);
    if (study != NULL)
        report_sentence(&report, "The study is %s. The scene itself:", study);
    PrintTable *table = report_table(&report, NULL, "response|value|change by dampers [%]");
    for (size_t i = 0; i < COUNT(names); i++) {
        char reduction[80];
        const double value = json_get_number(summary, names[i][0]);
        snprintf(reduction, sizeof reduction, "%s_reduction", names[i][0]);
        const double part = json_get_number(summary, reduction);
        if (isnan(value))
            continue;
        report_quantity(table, names[i][0], names[i][1]);
        report_real(table, value);
        report_real(table, part == 0 ? 0 : -100 * part);
    }
    const JsonDocument *warning;
    Warnings notes = {.count = 0};
    for (size_t i = 0; (warning = json_get_item(of, "warnings", i)) != NULL; i++) {
        const char *pointer = json_get_text(warning, "pointer");
        const char *detail = json_get_text(warning, "detail");
        (void)warnings_add(&notes, pointer != NULL ? pointer : "", "%s",
                           detail != NULL ? detail : "");
    }
    report_notes(&report, &notes);
    warnings_clear(&notes);
    if (study != NULL)
        report_next(&report, "impactd open %.14s", result);
    else
        report_next(&report, "impactd get %.14s series -o motion.csv", result);
    report_print(&report, terminal, &(Texts){.count = 0});
    report_clear(&report);
}

// Sends the scene of the body.
static Status submit_send(ApiCall *call, Problem *problem) {
    const JobsSettings *settings = call->settings;
    const bool is_json = settings->client.json;
    const double wait = settings->client.wait;
    char prefer[48];
    snprintf(prefer, sizeof prefer, "wait=%.0f", ceil(fmin(wait, 2)));
    ApiRequest request = {.method = "POST",
                          .path = api_path("/v1/jobs%s", settings->dry_run ? "?dry_run=1" : ""),
                          .prefer = wait > 0 ? prefer : "respond-async",
                          .idempotency_key = settings->idempotency_key};
    TRY(api_ask(call, &request, problem));
    if (settings->dry_run) {
        return api_print(call, problem);
    }
    TRY(job_read(call, problem));
    snprintf(call->id, sizeof call->id, "%s", job_text(call, "id"));
    call->about = call->id;
    if (!is_json) {
        printf("%s\n", call->id);
        fflush(stdout);
    }
    Status status = STATUS_OK;
    if (wait > 0 && !job_is_final(call))
        status = job_follow(call, call->id, stderr, problem);
    if (is_json && (status == STATUS_OK || status == STATUS_TIMEOUT))
        TRY(api_print(call, problem));
    // A job that has ended is reported also if the end was not waited for.
    if (status == STATUS_OK && job_is_final(call))
        status = job_verdict(call, problem);
    const char *result = job_text(call, "result");
    Terminal terminal;
    if (status == STATUS_OK && !is_json && wait > 0 && result != NULL && terminal_find(&terminal))
        summary_print(call->reply, result, &terminal);
    return status;
}

static Status submit_act(ApiCall *call, Problem *problem) {
    const JobsSettings *settings = call->settings;
    if (!text_is_printable(settings->idempotency_key))
        return problem_add(problem, STATUS_USAGE, "--idempotency-key",
                           "must be of printable ASCII characters");
    TRY(input_read(call->operands[0], &call->body, problem));
    TRY(scene_edit(call->command, settings, &call->body, problem));
    if (settings->title != NULL)
        TRY(json_edit_set(&call->body, "title", settings->title, problem));
    for (size_t i = 0; i < settings->label.count; i++)
        TRY(json_edit_label(&call->body, settings->label.at[i], problem));
    return submit_send(call, problem);
}

static Status watch_act(ApiCall *call, Problem *problem) {
    const bool is_json = ((const ClientSettings *)call->settings)->json;
    TRY(job_follow(call, call->operands[0], is_json ? NULL : stdout, problem));
    if (is_json)
        TRY(api_print(call, problem));
    return job_verdict(call, problem);
}

static Status cancel_act(ApiCall *call, Problem *problem) {
    TRY(api_send(call, problem));
    TRY(job_read(call, problem));
    printf("%s %s\n", job_text(call, "id"), job_text(call, "status"));
    return STATUS_OK;
}

enum { PAGE_JOBS = 100 }; // of one answer, at most

// Adds a time in words: "5 s", "3 min", "2 h", "4 d".
static void age_add(PrintTable *table, double seconds) {
    static const struct {
        double size;
        const char *name;
    } units[] = {{86400, "d"}, {3600, "h"}, {60, "min"}, {1, "s"}};
    size_t i = 0;
    while (i + 1 < COUNT(units) && seconds < units[i].size)
        i++;
    print_table_add(table, "%.0f %s", floor(fmax(seconds, 0) / units[i].size), units[i].name);
}

// Adds a row. The time is that of the run or, of a running job, how much of it is done.
static void jobs_add(PrintTable *table, const JsonDocument *job) {
    const char *id = json_get_text(job, "id"), *title = json_get_text(job, "title");
    const char *status = json_get_text(job, "status"), *created = json_get_text(job, "created");
    const double run = json_get_number(json_get_object(job, "timing"), "run");
    int64_t created_ms = clock_unix_ms();
    (void)(created != NULL && rfc3339_read(created, &created_ms));
    print_table_add(table, "%s", id != NULL ? id : "");
    print_table_add(table, "%s", status != NULL ? status : "");
    age_add(table, 1e-3 * (double)(clock_unix_ms() - created_ms));
    if (status != NULL && strcmp(status, "running") == 0)
        print_table_add(table, "%.0f %%", fmin(fmax(json_get_number(job, "progress"), 0), 100));
    else if (isnan(run))
        print_table_add(table, "%s", "");
    else
        print_table_add(table, "%.3g %s", run < 1 ? 1e3 * run : run, run < 1 ? "ms" : "s");
    print_table_add(table, "%s", title != NULL ? title : "");
}

static Status jobs_act(ApiCall *call, Problem *problem) {
    static const char *const heads[] = {"id", "status", "age", "time", "title"};
    const JobsSettings *settings = call->settings;
    const size_t limit = settings->all ? SIZE_MAX : settings->limit;
    char path[40];
    ApiAction action = *call->action;
    PrintTable table = {.columns = COUNT(heads), .has_heads = true};
    const PrintTableForm form = terminal_table_form();
    const JsonDocument *job;
    size_t count = 0;
    snprintf(path, sizeof path, "/v1/jobs?limit=%zu", limit < PAGE_JOBS ? limit : PAGE_JOBS);
    action.path = path;
    call->action = &action;
    TRY(api_send_pages(call, (limit - 1) / PAGE_JOBS, problem));
    if (settings->client.json) {
        return api_print(call, problem);
    }
    (void)api_reply(call);
    for (size_t i = 0; i < COUNT(heads); i++)
        print_table_add(&table, "%s", heads[i]);
    for (; count < limit && (job = json_get_item(call->reply, "jobs", count)) != NULL; count++)
        jobs_add(&table, job);
    if (count > 0)
        print_table_print(&table, &form, stdout);
    print_table_clear(&table);
    if (count == 0)
        command_print_line(stderr, "impactd jobs: none found");
    else if (call->answer.next[0] != '\0' || json_get_item(call->reply, "jobs", count) != NULL)
        command_print_line(
            stderr, "impactd jobs: these are the newest %zu; --limit N or --all shows more", count);
    return STATUS_OK;
}

// Opens an address in the browser of the desktop, if there is one, and does not wait for it.
static void browser_open(const char *url) {
    extern char **environ;
    const char *const arguments[] = {"xdg-open", url, NULL};
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    pid_t child;
    if ((getenv("DISPLAY") == NULL && getenv("WAYLAND_DISPLAY") == NULL) ||
        posix_spawn_file_actions_init(&actions) != 0)
        return;
    // What a browser prints does not belong on this terminal, nor does its Ctrl-C reach a browser.
    for (int number = STDIN_FILENO; number <= STDERR_FILENO; number++)
        (void)posix_spawn_file_actions_addopen(&actions, number, "/dev/null", O_RDWR, 0);
    if (posix_spawnattr_init(&attributes) == 0) {
        (void)posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
        (void)posix_spawnp(&child, arguments[0], &actions, &attributes,
                           (char *const *)(uintptr_t)arguments, environ);
        (void)posix_spawnattr_destroy(&attributes);
    }
    (void)posix_spawn_file_actions_destroy(&actions);
}

static Status open_act(ApiCall *call, Problem *problem) {
    const char *id = call->count > 0 ? call->operands[0] : "";
    const char *page = call->count == 0 ? "" : strncmp(id, "j-", 2) == 0 ? "#/jobs/" : "#/results/";
    char url[2200];
    (void)problem;
    snprintf(url, sizeof url, "%.2000s/%s%.100s", call->url, page, id);
    puts(url);
    (void)fflush(stdout);
    browser_open(url);
    return STATUS_OK;
}

static const PrintTableView compare_view = {
    .skipped = (const char *const[]){"links", NULL},
    .lists = (const PrintTableColumns[]){
        {"inputs", {"pointer", "a", "b", "detail"}},
        {"metrics", {"name", "unit", "a", "b", "difference", "relative"}},
        {"channels", {"channel", "unit", "rms", "other_rms", "difference_rms", "correlation"}},
        {"psd", {"channel", "unit", "from", "to", "level", "difference", "power"}},
        {NULL, {NULL}}}};

static Status compare_act(ApiCall *call, Problem *problem) {
    char results[2][96];
    for (int i = 0; i < 2; i++) {
        call->about = call->operands[i];
        TRY(job_result(call, call->operands[i], results[i], problem));
    }
    TRY(api_get(call, api_path("/v1/compare?a=%s&b=%s", results[0], results[1]), problem));
    return api_print_tables(call, problem);
}

static const char *const formats[] = {"json", "csv", "npy", "npz", "mat", "zip", "svg", NULL};
static const char *const format_types[] = {
    "application/json",          "text/csv",        "application/x-npy", "application/x-npz",
    "application/x-matlab-data", "application/zip", "image/svg+xml"};
static const char *const binary_formats[] = {"npy", "npz", "mat", "zip", NULL};
// Parts of a result that have one format, and no extension in their path.
static const char *const parts[] = {"series", "psd",    "impacts", "energy", "manifest",
                                    "job",    "result", "bundle",  NULL};
static const char *const plain_parts[] = {"result", "job", "manifest", NULL};

static bool is_among(const char *const *texts, const char *text) {
    for (size_t i = 0; text != NULL && texts[i] != NULL; i++)
        if (strcmp(texts[i], text) == 0)
            return true;
    return false;
}

static bool is_part(const char *what) {
    const size_t length = strlen(what);
    return length > 0 && length < 100 && what[0] != '/' && strstr(what, "..") == NULL &&
           strstr(what, "//") == NULL &&
           strspn(what, "abcdefghijklmnopqrstuvwxyz0123456789_-./") == length;
}

enum { PART_SIZE = 112 };
// Sets `what` to the path of a part, as "series.csv", from the operand and the output's extension.
// Without an operand it is the result itself or, for an output that is a table, the series.
static Status part_choose(const ApiCall *call, char what[PART_SIZE], Problem *problem) {
    const char *output = ((const JobsSettings *)call->settings)->output;
    const char *extension = output != NULL ? path_extension(output) : NULL;
    if (output != NULL && !output_is_standard(output) && !is_among(formats, extension))
        return problem_add(
            problem, STATUS_USAGE, "--output",
            "must end in one of .json, .csv, .npy, .npz, .mat, .zip, .svg, is %.200s", output);
    const bool is_table = extension != NULL && strcmp(extension, "json") != 0;
    const char *typed = call->count > 1                 ? call->operands[1]
                        : !is_table                     ? "result"
                        : strcmp(extension, "zip") == 0 ? "bundle"
                                                        : "series";
    // Names that are not here, as impacts/1/force, are the server's.
    const char *near = spelling_nearest(parts, typed);
    if (!is_part(typed) || (near != NULL && !is_among(parts, typed)))
        return problem_set(problem, STATUS_USAGE,
                           "a result has no %.100s%s%s%s; it has series, psd, impacts, "
                           "impacts/N/force, energy, manifest, job, result and bundle",
                           typed, near != NULL ? " (did you mean " : "", near != NULL ? near : "",
                           near != NULL ? "?)" : "");
    const bool is_plain = is_among(plain_parts, typed);
    if (is_plain && is_table)
        return problem_add(problem, STATUS_USAGE, "--output", "must end in .json for the %s",
                           typed);
    const char *typed_extension = path_extension(typed);
    if (typed_extension != NULL && extension != NULL && strcmp(typed_extension, extension) != 0)
        return problem_add(problem, STATUS_USAGE, "--output", "must end in .%s for %s, is %.200s",
                           typed_extension, typed, output);
    if (extension == NULL)
        extension = strcmp(typed, "bundle") == 0 ? "zip" : "json";
    const bool is_complete = is_plain || typed_extension != NULL;
    snprintf(what, PART_SIZE, "%s%s%s", typed, is_complete ? "" : ".",
             is_complete ? "" : extension);
    if (is_among(binary_formats, path_extension(what)) && output == NULL && isatty(STDOUT_FILENO))
        return problem_set(problem, STATUS_USAGE,
                           "does not print binary data on a terminal; use -o FILE.%s, or -o - to "
                           "print it all the same",
                           path_extension(what));
    return STATUS_OK;
}

// clang-format off
static const Field get_fields[] = {
    CLIENT_ROWS,
    FIELD_TEXT(JobsSettings, output, 4000, PRESENCE_OPTIONAL, 0, "write to this file; its extension is the format; - is standard output (default)"),
    FIELD_TEXT(JobsSettings, channels, 4000, PRESENCE_OPTIONAL, 0, "channels of the series, separated by commas (all)"),
    FIELD_REAL(JobsSettings, from, "s", AT_MIN(0), OPTIONAL, "start of the series"),
    FIELD_REAL(JobsSettings, to, "s", AT_MIN(0), OPTIONAL, "end of the series, inclusive"),
    FIELD_COUNT(JobsSettings, points, NULL, AT_MIN(1), OPTIONAL, "reduce the series to this number of intervals, each with minimum and maximum"),
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 0, "how long to wait for an unfinished job and a busy server (0)"),
    FIELD_COUNT(JobsSettings, max_bytes, "B", AT_MIN(1), 17179869184.0, "refuse a larger answer"),
    FIELD_END,
};
// clang-format on

// The Content-Type of a part; NULL if its extension is unknown.
static const char *part_type(const char *what) {
    const char *extension = path_extension(what);
    if (extension == NULL)
        return type_json;
    for (size_t i = 0; formats[i] != NULL; i++)
        if (strcmp(formats[i], extension) == 0)
            return format_types[i];
    return NULL;
}

static Status get_act(ApiCall *call, Problem *problem) {
    const JobsSettings *settings = call->settings;
    char what[PART_SIZE], result[96];
    TRY(part_choose(call, what, problem));
    const bool is_job = strcmp(what, "job") == 0;
    if (is_job)
        snprintf(result, sizeof result, "%s", call->operands[0]);
    else
        TRY(job_result(call, call->operands[0], result, problem));
    const bool is_whole = is_job || strcmp(what, "result") == 0;
    ApiRequest request = {.path = api_path("/v1/%s/%s%s%s", is_job ? "jobs" : "results", result,
                                           is_whole ? "" : "/", is_whole ? "" : what),
                          .output_max = settings->max_bytes,
                          .type = part_type(what)};
    api_query_options(&request.path, call, "channels from to points");
    Terminal terminal;
    if (call->count == 1 && settings->output == NULL && terminal_find(&terminal)) {
        request.output_max = 0;
        TRY(api_ask(call, &request, problem));
        if (json_get_text(api_reply(call), "id") == NULL)
            return api_unexpected(call, "a result", problem);
        summary_print(call->reply, json_get_text(call->reply, "id"), &terminal);
        return STATUS_OK;
    }
    return api_download(call, &request, settings->output, problem);
}

// clang-format off
static const Field submit_fields[] = {
    CLIENT_ROWS,
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 0, "how long to wait for the job to finish and for a busy server (0)"),
    SET_ROW(JobsSettings),
    VARY_ROW(JobsSettings),
    FIELD_TEXT(JobsSettings, title, 0, PRESENCE_OPTIONAL, 0, "title of the job; replaces that of the scene"),
    FIELD_TEXTS(JobsSettings, label, NULL, NULL, 64, PRESENCE_OPTIONAL, 0, "add this to the labels of the scene; repeatable"),
    FIELD_FLAG(JobsSettings, dry_run, false, "print the plan and the estimated cost as JSON; run nothing"),
    FIELD_TEXT(JobsSettings, idempotency_key, 255, PRESENCE_OPTIONAL, 0, "a scene that is sent twice with this key is one job"),
    FIELD_FLAG(ClientSettings, json, false, "print the job as JSON instead of its id"),
    FIELD_END,
};
static const Field watch_fields[] = {
    CLIENT_ROWS,
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 1e9, "how long to wait for the job to finish (no limit)"),
    FIELD_FLAG(ClientSettings, json, false, "print the finished job as JSON instead of lines"),
    FIELD_END,
};
static const Field server_fields[] = {
    CLIENT_ROWS,
    FIELD_END,
};
static const Field jobs_fields[] = {
    CLIENT_ROWS,
    FIELD_CHOICE(JobsSettings, status, job_state_names, OPTIONAL, "only jobs of this status: accepted, running, successful, failed or dismissed"),
    FIELD_TEXT(JobsSettings, q, 200, PRESENCE_OPTIONAL, 0, "only jobs with these words in title, labels or id"),
    FIELD_COUNT(JobsSettings, limit, NULL, WITHIN(1, 1e6), 20, "how many, the newest first (20)"),
    FIELD_FLAG(JobsSettings, all, false, "all jobs"),
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 0, "how long to wait for a busy server (0)"),
    FIELD_FLAG(ClientSettings, json, false, "print the answer of the server as JSON"),
    FIELD_END,
};
static const Field compare_fields[] = {
    CLIENT_ROWS,
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 60, "how long to wait for an unfinished job and a busy server"),
    FIELD_FLAG(ClientSettings, json, false, "print the answer of the server as JSON"),
    FIELD_END,
};
// clang-format on

// The members of a command that all of these have alike.
#define JOBS_OPTIONS(fields) .options = fields, .size = sizeof(JobsSettings), .run = api_command

const Command command_submit = {
    .name = "submit",
    .operands = "SCENE.json",
    .summary = "send a scene to a server",
    .help = "  impactd submit scene.json                   # print the id of the job\n"
            "  impactd submit scene.json --wait 60         # wait, and print the numbers\n"
            "  impactd submit scene.json --wait 60 --json  # print the finished job\n"
            "  impactd submit scene.json --dry-run         # plan and cost; run nothing\n"
            "  impactd submit scene.json --title 'sponge, 15 mm' --label batch=7\n"
            "  impactd submit scene.json --vary dampers.0.clearance=5mm:30mm:26\n"
            "  impactd submit - --server https://sim.example < scene.json\n"
            "\n"
            "\"impactd help run\" explains --set, \"impactd help sweep\" explains --vary. If an\n"
            "answer was lost, send the scene again with the same --idempotency-key: both are\n"
            "one job. While --wait lasts, a busy server is asked again. Ctrl-C stops the\n"
            "waiting, not the job; \"impactd cancel\" stops the job. Exit code 3 if the scene\n"
            "has faults, 1 if the job failed, 7 if the server does not answer or is busy, 8\n"
            "if the job has not finished after --wait.\n",
    JOBS_OPTIONS(submit_fields),
    .actions = &(const ApiAction){.takes = "one scene", .operands = "f", .act = submit_act},
};

const Command command_jobs = {
    .name = "jobs",
    .summary = "list the jobs of a server",
    .help = "  impactd jobs                                # the 20 newest jobs\n"
            "  impactd jobs --status failed --all          # all jobs that failed\n"
            "  impactd jobs --q sponge --limit 100         # jobs with this word\n"
            "  impactd jobs --json\n"
            "\n"
            "The column \"time\" has the duration of the run, or the progress of a running job.\n",
    JOBS_OPTIONS(jobs_fields),
    .actions = &(const ApiAction){.takes = "no operands",
                                  .operands = "",
                                  .act = jobs_act,
                                  .query = "status q",
                                  .list = "jobs"},
};

const Command command_open = {
    .name = "open",
    .operands = "[ID]",
    .summary = "open the dashboard, a job or a result in the browser",
    .help = "  impactd open                                # the dashboard\n"
            "  impactd open j-7f3a                         # a job\n"
            "  impactd open r-91c0                         # a result\n"
            "\n"
            "Prints the address. Without a graphical display nothing is opened.\n",
    JOBS_OPTIONS(server_fields),
    .actions = &(const ApiAction){.takes = "the id of a job or a result, like j-7f3a, or nothing",
                                  .operands = "?i",
                                  .act = open_act},
};

const Command command_watch = {
    .name = "watch",
    .operands = "JOB",
    .summary = "follow a job of a server until it has finished",
    .help = "  impactd watch j-7f3a                        # shows the progress\n"
            "  impactd watch j-7f3a --json > job.json      # the finished job\n"
            "  impactd watch $(impactd submit scene.json) && impactd get ...\n"
            "\n"
            "Exit code 0 if the job was successful, 1 if it failed or was dismissed, 4 if it\n"
            "does not exist, 8 if it has not finished after --wait. Ctrl-C stops the\n"
            "watching, not the job (130). A restart of the server does not end it.\n",
    JOBS_OPTIONS(watch_fields),
    .actions =
        &(const ApiAction){.takes = "one job's id, like j-7f3a", .operands = "i", .act = watch_act},
};

const Command command_get = {
    .name = "get",
    .operands = "RESULT-or-JOB [WHAT]",
    .summary = "download a result, its series, spectra or impacts",
    .help = "  impactd get r-91c0                              # numbers; in a pipe, JSON\n"
            "  impactd get r-91c0 result                       # summary, plan, units: JSON\n"
            "  impactd get r-91c0 series -o motion.npy         # time series\n"
            "  impactd get r-91c0 series -o motion.csv --channels displacement --to 2\n"
            "  impactd get r-91c0 series --points 500          # reduced to 500 points\n"
            "  impactd get r-91c0 psd -o psd.svg               # spectra as a chart\n"
            "  impactd get r-91c0 impacts.csv                  # on standard output\n"
            "  impactd get r-91c0 impacts/3/force -o one.csv   # force of one impact\n"
            "  impactd get r-91c0 bundle -o all.zip            # everything\n"
            "  impactd get j-7f3a --wait 60 -o motion.mat      # when the job has finished\n"
            "\n"
            "WHAT: result (default), series, psd, impacts, energy, manifest, bundle, job; of\n"
            "studies tradeoff, ensemble, compare, sensitivity, table, calibration, response,\n"
            "optimum, fragility. Formats: json, csv, npy, npz, mat, zip, svg; not every part\n"
            "has all of them. A file is written completely or not at all. Exit code 4 if\n"
            "there is no such part, 8 if the job has not finished after --wait.\n",
    JOBS_OPTIONS(get_fields),
    .actions =
        &(const ApiAction){.takes = "the id of a result or a job, like r-91c0, and a part of it",
                           .operands = "i?p",
                           .act = get_act},
};

const Command command_cancel = {
    .name = "cancel",
    .operands = "JOB",
    .summary = "stop a job of a server",
    .help = "  impactd cancel j-7f3a\n"
            "\n"
            "Exit code 1 if the job had finished before, 4 if it does not exist.\n",
    JOBS_OPTIONS(server_fields),
    .actions = &(const ApiAction){.takes = "one job's id, like j-7f3a",
                                  .operands = "i",
                                  .act = cancel_act,
                                  .method = "DELETE",
                                  .path = "/v1/jobs/{}"},
};

const Command command_compare = {
    .name = "compare",
    .operands = "A B",
    .summary = "compare two results of a server",
    .help = "  impactd compare r-91c0 r-02ab               # metrics, and inputs that differ\n"
            "  impactd compare j-7f3a j-81dd --json        # results of two jobs, as JSON\n"
            "\n"
            "Exit code 4 if one of them does not exist.\n",
    JOBS_OPTIONS(compare_fields),
    .actions = &(const ApiAction){.takes = "the ids of two results or jobs, like r-91c0",
                                  .operands = "ii",
                                  .act = compare_act},
    .view = &compare_view,
};
