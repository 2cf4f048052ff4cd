// Jobs: submit, look, list, dismiss. Waiting works the same for POST and GET: the job is watched,
// the request put to sleep, and when it is woken or its time is up the same handler goes on where
// it stood.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/api/job_document.h"
#include "server/base/clock.h"
#include "server/http/body.h"
#include "server/http/header.h"
#include "server/http/reply.h"

static const double wait_initial = 2, wait_most = 30; // [s]

enum { LIST_INITIAL = 20, LIST_MOST = 100 };

// Drops the hold on `job`. `code` 0: 200 if it is finished, else 202 and where to look.
static Status reply_job(App *app, Reply *reply, Job *job, int code, Problem *problem) {
    JobShow show = {0};
    const Status status = job_show(job, &show);
    job_drop(job);
    if (status != STATUS_OK) {
        job_show_clear(&show);
        return problem_set(problem, status, "the job cannot be shown");
    }
    const bool is_finished = job_state_is_final((int)show.state);
    if (code == 0)
        code = is_finished ? 200 : 202;
    if (code == 202)
        snprintf(reply->location, sizeof reply->location, "/v1/jobs/%s", show.id);
    if (!is_finished)
        reply->retry_after = 1;
    Bytes bytes = {.most = app->reply_most};
    job_put(&bytes, &show, JOB_PUT_WHOLE | JOB_PUT_LINKS);
    bytes_text(&bytes, "\n");
    job_show_clear(&show);
    return reply_bytes(reply, code, type_json, &bytes, problem);
}

// What a sleeping request holds on to.
typedef struct Pause {
    Job *job;
    const Waker *waker;
} Pause;

static Job *pause_end(Pause *pause) {
    Job *job = pause->job;
    job_unwatch(job, pause->waker);
    free(pause);
    return job;
}

static void pause_forget(void *kept) {
    job_drop(pause_end(kept));
}

// Puts the request to sleep until the job is finished, `wait` seconds after the request came at
// most. False if there is nothing to wait for; the hold stays with the caller then.
static bool pause_begin(const Request *request, Reply *reply, Job *job, double wait) {
    const double left = wait - 1e-9 * (double)(clock_monotonic_ns() - request->started_ns);
    if (request->is_expired || left <= 0 || job_is_finished(job))
        return false;
    Pause *pause = malloc(sizeof *pause);
    if (pause == NULL)
        return false;
    *pause = (Pause){job, request->waker};
    if (!job_watch(job, request->waker)) {
        free(pause);
        return false;
    }
    reply_wait(reply, (int)(1000 * left) + 1, pause, pause_forget);
    return true;
}

static Status dry_run(App *app, const Request *request, Reply *reply, Problem *problem) {
    DryRun run = {0};
    const Status status =
        intake_dry_run(app->intake, request->body, request->body_size, &run, problem);
    if (status != STATUS_OK) {
        dry_run_clear(&run);
        return status;
    }
    Bytes bytes = {.most = app->reply_most};
    job_put_dry_run(&bytes, &run);
    bytes_text(&bytes, "\n");
    dry_run_clear(&run);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

static Status read_flag(const Request *request, const char *name, bool *flag, Problem *problem) {
    const char *text = request_query(request, name);
    *flag = text != NULL && (strcmp(text, "1") == 0 || strcmp(text, "true") == 0);
    if (text == NULL || *flag || strcmp(text, "0") == 0 || strcmp(text, "false") == 0)
        return STATUS_OK;
    return problem_set(problem, STATUS_USAGE,
                       "the query parameter \"%s\" must be 1 or 0, is \"%.40s\"", name, text);
}

Status jobs_create(App *app, const Request *request, Reply *reply, Problem *problem) {
    Job *job = NULL;
    if (request->kept != NULL) {
        job = pause_end(request->kept);
    } else {
        bool is_dry = false;
        TRY(read_flag(request, "dry_run", &is_dry, problem));
        TRY(body_require_json(request, problem));
        if (is_dry)
            return dry_run(app, request, reply, problem);
        if (atomic_load(&app->is_stopping))
            return problem_set(problem, STATUS_BUSY,
                               "the daemon is stopping and takes no new jobs; try again when it "
                               "is back");
        const Submission submission = {
            .text = request->body, .size = request->body_size, .client = request->client};
        TRY(intake_submit(app->intake, &submission, &job, problem));
    }

    const Prefer prefer = header_prefer(request->prefer);
    double wait = prefer.responds_async ? 0 : wait_initial;
    if (prefer.has_wait)
        wait = prefer.wait < wait_most ? prefer.wait : wait_most;
    if (pause_begin(request, reply, job, wait))
        return STATUS_OK;
    char applied[24] = "";
    if (prefer.has_wait)
        snprintf(applied, sizeof applied, "wait=%.4g", wait);
    snprintf(reply->preference_applied, sizeof reply->preference_applied, "%s%s%s",
             prefer.responds_async ? "respond-async" : "",
             prefer.responds_async && prefer.has_wait ? ", " : "", applied);
    return reply_job(app, reply, job, 0, problem);
}

Status jobs_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    Job *job = NULL;
    double wait;
    TRY(request_number(request, "wait", 0, wait_most, 0, &wait, problem));
    if (request->kept != NULL)
        job = pause_end(request->kept);
    else
        TRY(intake_find(app->intake, request->parameters[0], &job, problem));
    if (pause_begin(request, reply, job, wait))
        return STATUS_OK;
    return reply_job(app, reply, job, 200, problem);
}

Status jobs_dismiss(App *app, const Request *request, Reply *reply, Problem *problem) {
    Job *job = NULL;
    TRY(intake_dismiss(app->intake, request->parameters[0], &job, problem));
    return reply_job(app, reply, job, 200, problem);
}

// A row knows no progress: of an unfinished job the queue is asked.
static void list_row(App *app, Bytes *bytes, const JobRow *row) {
    JobShow show = {0};
    Job *job = NULL;
    const bool is_unfinished = !job_state_is_final(row->state);
    if (is_unfinished && intake_find(app->intake, row->id, &job, NULL) == STATUS_OK) {
        const Status status = job_show(job, &show);
        job_drop(job);
        if (status == STATUS_OK)
            job_put(bytes, &show, JOB_PUT_LINKS);
        job_show_clear(&show);
        if (status == STATUS_OK)
            return;
    }
    show = (JobShow){.state = (JobState)row->state,
                     .progress = row->state == JOB_SUCCESSFUL ? 100 : 0,
                     .is_cached = row->is_cached,
                     .created_unix_ms = row->created_unix_ms,
                     .started_unix_ms = row->started_unix_ms,
                     .finished_unix_ms = row->finished_unix_ms,
                     .queued = row->queued,
                     .run = row->run,
                     .total = row->total,
                     .problem = row->problem,
                     .title = row->title};
    text_fit(show.id, sizeof show.id, row->id);
    text_fit(show.result, sizeof show.result, row->result);
    job_put(bytes, &show, JOB_PUT_LINKS); // borrows the row's texts
}

Status jobs_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    double limit;
    TRY(request_number(request, "limit", 1, LIST_MOST, LIST_INITIAL, &limit, problem));
    const size_t most = (size_t)limit;
    JobRows rows = {0};
    // One more than asked for tells whether there is a next page.
    const Status status =
        store_job_list(app->store, request_query(request, "before"), most + 1, &rows, problem);
    if (status != STATUS_OK) {
        job_rows_clear(&rows);
        return status;
    }
    const size_t count = rows.count < most ? rows.count : most;
    if (rows.count > most)
        snprintf(reply->link, sizeof reply->link, "</v1/jobs?limit=%zu&before=%s>; rel=\"next\"",
                 most, rows.at[count - 1].id);
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, "{\"jobs\": [");
    for (size_t i = 0; i < count; i++) {
        bytes_text(&bytes, i > 0 ? ",\n " : "");
        list_row(app, &bytes, &rows.at[i]);
    }
    bytes_text(&bytes, "]}\n");
    job_rows_clear(&rows);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}
