#include "server/cli/client.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/cli/command.h"
#include "server/cli/output.h"
#include "server/cli/progress_bar.h"
#include "server/cli/scene_file.h"
#include "server/util/clock.h"

static const char usual_server[] = "http://127.0.0.1:8080";
static const double forever = 1e9;                      // [s]
static const double bar_poll = 0.5, lines_poll = 2;     // [s] between two looks at a job
static const int64_t restart_ns = (int64_t)10000000000; // a daemon may take that long to start

static const char *setting(const char *given, const char *name, const char *usual) {
    const char *found = given != NULL ? given : getenv(name);
    return found != NULL && found[0] != '\0' ? found : usual;
}

enum { TOKEN_MAX = 512 };
static const char token_characters[] =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~+/=";

// Into `text`, whatever the file is; the file that is judged is the one that is read.
static Status token_file_read(const char *path, char *text, size_t size, Problem *problem) {
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0)
        return problem_add(problem, STATUS_USAGE, "--token-file", "%.200s cannot be read: %s", path,
                           strerror(errno));
    struct stat what;
    Status status = STATUS_OK;
    if (fstat(file, &what) != 0 || !S_ISREG(what.st_mode))
        status = problem_add(problem, STATUS_USAGE, "--token-file", "%.200s must be a regular file",
                             path);
    else if ((what.st_mode & 077) != 0)
        status = problem_add(problem, STATUS_USAGE, "--token-file",
                             "%.160s may be read or written by others (mode %03o); mend it by: "
                             "chmod 600 FILE",
                             path, (unsigned)(what.st_mode & 0777));
    ssize_t count = status == STATUS_OK ? read(file, text, size - 1) : 0;
    (void)close(file);
    text[count > 0 ? count : 0] = '\0';
    return status;
}

// The bearer token: the first line of `path`, or, where that is NULL, IMPACTD_TOKEN; "" if there is
// neither. Never an argument, which every user of a machine can see.
static Status token_read(const char *path, char token[TOKEN_MAX + 1], Problem *problem) {
    char text[TOKEN_MAX + 64] = "";
    const char *source = path != NULL ? "--token-file" : "IMPACTD_TOKEN";
    const char *given = getenv("IMPACTD_TOKEN");
    if (path != NULL)
        TRY(token_file_read(path, text, sizeof text, problem));
    else if (given != NULL)
        text_fit(text, sizeof text, given);
    text[strcspn(text, "\r\n")] = '\0';
    token[0] = '\0';
    const size_t length = strlen(text);
    // The token itself is not told.
    if (length > TOKEN_MAX || text[strspn(text, token_characters)] != '\0' ||
        (path != NULL && length == 0))
        return problem_add(problem, STATUS_USAGE, source,
                           "must hold a token: 1 to %d letters, digits and -._~+/= on its first "
                           "line",
                           TOKEN_MAX);
    memcpy(token, text, length + 1);
    return STATUS_OK;
}

Status api_client_open(const char *server, const char *token_file, const char *ca_file, double wait,
                       ApiClient *daemon, Problem *problem) {
    char token[TOKEN_MAX + 1];
    output_guard();
    *daemon = (ApiClient){.until_ns = clock_monotonic_ns() +
                                      (int64_t)(1e9 * (wait < forever ? wait : forever))};
    TRY(token_read(setting(token_file, "IMPACTD_TOKEN_FILE", NULL), token, problem));
    const HttpServer at = {.url = setting(server, "IMPACTD_SERVER", usual_server),
                           .token = token[0] != '\0' ? token : NULL,
                           .ca_file = setting(ca_file, "IMPACTD_CA_FILE", NULL)};
    TRY(http_open(&at, &daemon->http, problem));
    if (http_exposes_token(daemon->http))
        fprintf(stderr, "impactd: warning: the token travels unencrypted to %s\n", at.url);
    return STATUS_OK;
}

void api_client_close(ApiClient *daemon) {
    http_close(daemon->http);
    daemon->http = NULL;
}

double api_client_left(const ApiClient *daemon) {
    const double left = 1e-9 * (double)(daemon->until_ns - clock_monotonic_ns());
    return left > 0 ? left : 0;
}

static void pause_for(double seconds) {
    (void)poll(NULL, 0, (int)(1000 * seconds));
}

Status api_client_ask(ApiClient *daemon, const HttpAsk *ask, HttpAnswer *answer, Problem *problem) {
    for (;;) {
        TRY(http_ask(daemon->http, ask, answer, problem));
        if (answer->code == 200 || answer->code == 201 || answer->code == 202 ||
            answer->code == 204)
            return STATUS_OK;
        const double pause = answer->retry_after > 0 ? answer->retry_after : 1;
        const bool is_busy = answer->code == 503 || answer->code == 429;
        if (!is_busy || pause > api_client_left(daemon))
            return problem_reply_read(answer, problem);
        http_answer_clear(answer);
        pause_for(pause);
    }
}

Status api_client_request(ApiClient *daemon, HttpAsk ask, Bytes *path, HttpAnswer *answer,
                          Problem *problem) {
    ask.path = path->at;
    *answer = (HttpAnswer){0};
    const Status status = path->is_failed
                              ? problem_set(problem, STATUS_USAGE, "asks for too much at once")
                              : api_client_ask(daemon, &ask, answer, problem);
    bytes_clear(path);
    return status;
}

void api_client_print(const HttpAnswer *answer) {
    (void)fwrite(answer->body.at, 1, answer->body.count, stdout);
}

bool api_client_is_id(const char *text) {
    const size_t length = strlen(text);
    return length > 0 && length <= 80 &&
           strspn(text, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
               length;
}

Status api_client_job(ApiClient *daemon, const char *id, double wait, HttpAnswer *answer,
                      JobReply *job, Problem *problem) {
    char path[160];
    snprintf(path, sizeof path, "/v1/jobs/%s?wait=%.3f", id, wait);
    const HttpAsk ask = {.method = "GET", .path = path};
    TRY(api_client_ask(daemon, &ask, answer, problem));
    return job_reply_read(answer, job, problem);
}

Status api_client_result(ApiClient *daemon, const char *id, char result[96], Problem *problem) {
    snprintf(result, 96, "%s", id);
    if (strncmp(id, "j-", 2) != 0)
        return STATUS_OK;
    HttpAnswer answer = {0};
    JobReply job = {0};
    const double left = api_client_left(daemon);
    Status status = api_client_job(daemon, id, left < 20 ? left : 20, &answer, &job, problem);
    while (status == STATUS_OK && !job_reply_is_final(&job) && api_client_left(daemon) > 0) {
        job_reply_clear(&job);
        http_answer_clear(&answer);
        const double rest = api_client_left(daemon);
        status = api_client_job(daemon, id, rest < 20 ? rest : 20, &answer, &job, problem);
    }
    if (status == STATUS_OK && !job_reply_is_final(&job))
        status = problem_set(problem, STATUS_TIMEOUT,
                             "is still %s; \"impactd watch %s\" follows it, --wait S waits",
                             job.status, id);
    else if (status == STATUS_OK && strcmp(job.status, "failed") == 0) {
        problem_reply_put(&job.problem, STATUS_INTERNAL, problem);
        status = STATUS_INTERNAL;
    } else if (status == STATUS_OK && (job.result == NULL || !api_client_is_id(job.result)))
        status = problem_set(problem, STATUS_INTERNAL, "was %s and has no result", job.status);
    if (status == STATUS_OK)
        snprintf(result, 96, "%s", job.result);
    job_reply_clear(&job);
    http_answer_clear(&answer);
    return status;
}

// A bar, or a line whenever the state changes or ten more percent are done.
typedef struct Show {
    ProgressBar bar;
    FILE *lines;
    char status[48];
    double progress;
} Show;

static void show_job(Show *show, const JobReply *job) {
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
    fprintf(show->lines, "%s %s %.0f %%\n", job->id, job->status, progress);
    fflush(show->lines);
}

// One look. Where nothing answers any more, again each second until a new daemon had its time.
static Status look(ApiClient *daemon, const char *id, double wait, bool was_there,
                   HttpAnswer *answer, JobReply *job, Problem *problem) {
    const int64_t until_ns = clock_monotonic_ns() + restart_ns;
    for (;;) {
        const Status status = api_client_job(daemon, id, wait, answer, job, problem);
        if (status != STATUS_UNREACHABLE || !was_there || clock_monotonic_ns() > until_ns ||
            api_client_left(daemon) < 1)
            return status;
        job_reply_clear(job);
        http_answer_clear(answer);
        problem_clear(problem);
        pause_for(1);
    }
}

// A job's events as they come, line by line; longer lines than one of progress are passed over.
typedef struct Events {
    Show *show;
    const char *id;
    const HttpAnswer *answer;
    bool is_progress; // what the lines of data belong to
    size_t length;    // of the line so far, also beyond its room
    char line[1024];
} Events;

static void line_take(Events *events) {
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
    if (job_reply_event(events->line + sizeof data - 1, size - (sizeof data - 1), events->id, &job))
        show_job(events->show, &job);
    job_reply_clear(&job);
}

static bool are_events(const HttpAnswer *answer) {
    return strcmp(answer->content_type, "text/event-stream") == 0;
}

static Status events_take(void *context, const void *bytes, size_t size, Problem *problem) {
    Events *events = context;
    const char *text = bytes;
    if (!are_events(events->answer))
        return problem_set(problem, STATUS_UNSUPPORTED_TYPE, "the answer is no stream of events");
    for (size_t i = 0; i < size; i++) {
        if (text[i] == '\n') {
            line_take(events);
        } else {
            if (events->length < sizeof events->line)
                events->line[events->length] = text[i];
            events->length++;
        }
    }
    return STATUS_OK;
}

// Shows what the server tells of the job for as long as it does. False where it has no such stream:
// it is not asked for it again.
static bool events_follow(ApiClient *daemon, const char *id, Show *show) {
    enum { EVENTS_MAX = 256 << 20 }; // [B]
    char path[160];
    HttpAnswer answer;
    Problem *ignored = NULL; // the look that follows tells what is wrong
    Events events = {.show = show, .id = id, .answer = &answer};
    snprintf(path, sizeof path, "/v1/jobs/%s/events", id);
    const HttpAsk ask = {.method = "GET",
                         .path = path,
                         .take = events_take,
                         .context = &events,
                         .most = EVENTS_MAX,
                         .within = api_client_left(daemon)};
    (void)http_ask(daemon->http, &ask, &answer, ignored);
    const bool is_there = are_events(&answer);
    http_answer_clear(&answer);
    return is_there;
}

Status api_client_follow(ApiClient *daemon, const char *id, FILE *lines, HttpAnswer *answer,
                         JobReply *job, Problem *problem) {
    char farewell[256];
    Show show = {.lines = lines};
    snprintf(farewell, sizeof farewell,
             "%s goes on; \"impactd cancel %s\" stops it, \"impactd watch %s\" follows it\n", id,
             id, id);
    output_farewell(farewell);
    progress_bar_start(&show.bar);
    Status status = STATUS_OK;
    bool has_events = true;
    for (bool was_there = false;; was_there = true) {
        const double poll = show.bar.is_terminal ? bar_poll : lines_poll;
        const double left = api_client_left(daemon);
        status = look(daemon, id, left < poll ? left : poll, was_there, answer, job, problem);
        if (status != STATUS_OK)
            break;
        show_job(&show, job);
        if (job_reply_is_final(job))
            break;
        if (api_client_left(daemon) <= 0) {
            status = problem_set(problem, STATUS_TIMEOUT, "is still %s after the time given; %.*s",
                                 job->status, (int)strlen(farewell) - 1, farewell);
            break;
        }
        job_reply_clear(job);
        http_answer_clear(answer);
        has_events = has_events && events_follow(daemon, id, &show);
    }
    progress_bar_stop(&show.bar);
    output_farewell(NULL);
    if (status == STATUS_OK && show.bar.is_terminal && lines != NULL)
        fprintf(lines, "%s %s\n", job->id, job->status);
    return status;
}

int api_client_verdict(const JobReply *job, Problem *problem) {
    if (strcmp(job->status, "successful") == 0)
        return COMMAND_OK;
    if (strcmp(job->status, "failed") == 0) {
        problem_reply_put(&job->problem, STATUS_INTERNAL, problem);
        scene_file_refuse(job->id, problem);
    } else {
        fprintf(stderr, "%s: was %s\n", job->id, job->status);
    }
    return COMMAND_FAILED;
}

int api_client_refuse(const char *command, const char *name, Status status,
                      const Problem *problem) {
    // Faults of flags have them as their place.
    if (status == STATUS_USAGE && problem->count > 0 &&
        strchr("-I", problem->faults[0].pointer[0]) != NULL &&
        problem->faults[0].pointer[0] != '\0')
        return command_error(command, problem);
    scene_file_refuse(name, problem);
    return command_exit(status);
}
