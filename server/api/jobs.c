// Jobs: submit, look, dismiss. Waiting works the same for POST and GET: the job is watched,
// the request put to sleep, and when it is woken or its time is up the same handler goes on where
// it stood.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/api/job_json.h"
#include "server/http/access.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/util/clock.h"

static const double wait_initial = 2, wait_most = 30; // [s]

enum { KEEP_WAIT_MS = 10000 }; // then it is looked at again

// Drops the hold on `job`. `code` 0: to its sender, 200 if it is finished, else 202 and where to
// look.
static Status reply_job(App *app, Reply *reply, Job *job, int code, Problem *problem) {
    JobView show = {0};
    const Status status = job_view(job, &show);
    job_unref(job);
    if (status != STATUS_OK) {
        job_view_clear(&show);
        return problem_set(problem, status, "the job cannot be shown");
    }
    const bool is_finished = job_state_is_final((int)show.state);
    const int parts = JOB_PUT_WHOLE | JOB_PUT_LINKS | (code == 200 ? JOB_PUT_SENDER : 0);
    if (code == 0)
        code = is_finished ? 200 : 202;
    if (code == 202)
        snprintf(reply->location, sizeof reply->location, "/v1/jobs/%s", show.id);
    if (!is_finished)
        reply->retry_after = 1;
    Bytes bytes = {.most = app->reply_most};
    job_json_put(&bytes, &show, parts);
    bytes_text(&bytes, "\n");
    job_view_clear(&show);
    return reply_bytes(reply, code, type_json, &bytes, problem);
}

// What a sleeping request holds on to.
typedef struct Pause {
    Job *job;
    const Callback *callback;
    bool is_replayed; // what the reply had said so far
} Pause;

// `reply` NULL: there will be none.
static Job *pause_end(Pause *pause, Reply *reply) {
    Job *job = pause->job;
    if (reply != NULL)
        reply->is_replayed = pause->is_replayed;
    job_unsubscribe(job, pause->callback);
    free(pause);
    return job;
}

static void pause_forget(void *kept) {
    job_unref(pause_end(kept, NULL));
}

// Puts the request to sleep until the waker that `watch` leaves with the job is called. False where
// there is no memory; the hold stays with the caller then.
static bool sleep_until(const Request *request, Reply *reply, Job *job,
                        bool (*watch)(Job *job, const Callback *callback), int wait_ms) {
    Pause *pause = malloc(sizeof *pause);
    if (pause == NULL)
        return false;
    *pause = (Pause){job, request->callback, reply->is_replayed};
    if (!watch(job, request->callback)) {
        free(pause);
        return false;
    }
    reply_wait(reply, wait_ms, pause, pause_forget);
    return true;
}

// Puts the request to sleep until the job is finished, `wait` seconds after the request came at
// most. False if there is nothing to wait for; the hold stays with the caller then.
static bool pause_begin(const Request *request, Reply *reply, Job *job, double wait) {
    const double left = wait - 1e-9 * (double)(clock_monotonic_ns() - request->started_ns);
    if (request->is_expired || left <= 0 || job_is_finished(job))
        return false;
    return sleep_until(request, reply, job, job_subscribe, (int)(1000 * left) + 1);
}

// The same until the store has the job: nobody is told of it before. Where that fails, the hold is
// dropped.
static Status pause_until_kept(const Request *request, Reply *reply, Job *job, bool *is_paused,
                               Problem *problem) {
    bool is_kept;
    *is_paused = false;
    Status status = job_is_durable(job, &is_kept, problem);
    if (status == STATUS_OK && !is_kept) {
        *is_paused = sleep_until(request, reply, job, job_subscribe_durable, KEEP_WAIT_MS);
        if (!*is_paused)
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory to wait for the job");
    }
    if (status != STATUS_OK)
        job_unref(job);
    return status;
}

Status jobs_refused(App *app, const Request *request, Reply *reply, Status status) {
    if (status == STATUS_BUSY || status == STATUS_QUOTA)
        reply->retry_after = jobs_retry_after(app->manager, request->client, status);
    return status;
}

static Status dry_run(App *app, const Request *request, Reply *reply, Problem *problem) {
    DryRun run = {0};
    Status status = jobs_charge(app->manager, request->client, problem);
    if (status == STATUS_OK)
        status = jobs_dry_run(app->manager, request->body, request->body_size, &run, problem);
    if (status != STATUS_OK) {
        dry_run_clear(&run);
        return jobs_refused(app, request, reply, status);
    }
    Bytes bytes = {.most = app->reply_most};
    job_json_put_dry_run(&bytes, &run);
    bytes_text(&bytes, "\n");
    dry_run_clear(&run);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

// How long the client would wait, told in the reply.
static double read_wait(const Request *request, Reply *reply) {
    if (request->prefer == NULL)
        return wait_initial;
    const Prefer prefer = header_prefer(request->prefer);
    double wait = prefer.responds_async ? 0 : wait_initial;
    char applied[24] = "";
    if (prefer.has_wait) {
        wait = prefer.wait < wait_most ? prefer.wait : wait_most;
        snprintf(applied, sizeof applied, "wait=%.4g", wait);
    }
    snprintf(reply->preference_applied, sizeof reply->preference_applied, "%s%s%s",
             prefer.responds_async ? "respond-async" : "",
             prefer.responds_async && prefer.has_wait ? ", " : "", applied);
    return wait;
}

static Status refuse_stopping(App *app, Problem *problem) {
    if (!atomic_load(&app->is_stopping))
        return STATUS_OK;
    return problem_set(problem, STATUS_BUSY,
                       "the daemon is stopping and takes no new jobs; try again when it is back");
}

static Status submit(App *app, const Request *request, const Submission *submission, Reply *reply,
                     Job **job, Problem *problem) {
    return jobs_refused(app, request, reply, jobs_submit(app->manager, submission, job, problem));
}

// Waits as long as the client likes, and at least until nobody can lose the job. Drops the hold.
static Status answer_job(App *app, const Request *request, Reply *reply, Job *job,
                         Problem *problem) {
    if (pause_begin(request, reply, job, read_wait(request, reply)))
        return STATUS_OK;
    bool is_paused;
    TRY(pause_until_kept(request, reply, job, &is_paused, problem));
    if (is_paused)
        return STATUS_OK;
    return reply_job(app, reply, job, 0, problem);
}

Status jobs_create(App *app, const Request *request, Reply *reply, Problem *problem) {
    if (request->kept != NULL)
        return answer_job(app, request, reply, pause_end(request->kept, reply), problem);
    bool is_dry = false;
    TRY(request_flag(request, "dry_run", &is_dry, problem));
    TRY(request_require_json(request, problem));
    if (is_dry)
        return dry_run(app, request, reply, problem);
    TRY(refuse_stopping(app, problem));
    const Submission submission = {.text = request->body,
                                   .size = request->body_size,
                                   .client = request->client,
                                   .idempotency_key = request->idempotency_key,
                                   .is_replayed = &reply->is_replayed};
    Job *job = NULL;
    TRY(submit(app, request, &submission, reply, &job, problem));
    return answer_job(app, request, reply, job, problem);
}

// The scene of a result, once more: what another engine's version made is made by this one.
Status results_again(App *app, const Request *request, Reply *reply, Problem *problem) {
    Job *job = NULL;
    ResultRow row = {0};
    if (request->kept != NULL)
        return answer_job(app, request, reply, pause_end(request->kept, reply), problem);
    TRY(refuse_stopping(app, problem));
    Status status = db_result_scene(app->db, request->parameters[0], &row, problem);
    if (status == STATUS_OK) {
        const Submission submission = {.text = row.scene,
                                       .size = strlen(row.scene),
                                       .client = request->client,
                                       .is_replayed = &reply->is_replayed};
        status = submit(app, request, &submission, reply, &job, problem);
    }
    result_row_clear(&row);
    TRY(status);
    return answer_job(app, request, reply, job, problem);
}

// Whether the scene is read, validated and planned in some ten microseconds: one structure of one
// mass and nothing that asks for many runs. Nothing escaped, so that the words are seen.
bool jobs_are_light(const Request *request) {
    static const char *const heavy[] = {"\\",           "\"study\"",  "\"frame\"",
                                        "\"matrices\"", "\"target\"", "\"reduction\""};
    enum { LIGHT_BYTES = 8192 };
    if (request->body == NULL || request->body_size > LIGHT_BYTES || request->query_count > 0 ||
        request->idempotency_key != NULL)
        return false;
    for (size_t i = 0; i < COUNT(heavy); i++)
        if (strstr(request->body, heavy[i]) != NULL)
            return false;
    return true;
}

Status job_find_visible(App *app, const Request *request, Job **job, Problem *problem) {
    Problem *reported = request->is_sender_only ? NULL : problem;
    const Status status = jobs_find(app->manager, request->parameters[0], job, reported);
    if (!request->is_sender_only)
        return status;
    if (status == STATUS_OK && text_same(job_client(*job), request->client))
        return STATUS_OK;
    if (status == STATUS_OK)
        job_unref(*job);
    return problem_set(problem, STATUS_FORBIDDEN,
                       "this needs the scope \"read\"; the token \"%s\" may read its own jobs only",
                       request->client);
}

Status jobs_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    Job *job = NULL;
    double wait;
    TRY(request_number(request, "wait", 0, 1e9, 0, &wait, problem));
    wait = wait < wait_most ? wait : wait_most; // as that of Prefer
    if (request->kept != NULL)
        job = pause_end(request->kept, reply);
    else
        TRY(job_find_visible(app, request, &job, problem));
    if (pause_begin(request, reply, job, wait))
        return STATUS_OK;
    return reply_job(app, reply, job, 200, problem);
}

Status jobs_scene(App *app, const Request *request, Reply *reply, Problem *problem) {
    char *scene;
    TRY(db_job_scene(app->db, request->parameters[0], &scene, problem));
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, scene);
    bytes_text(&bytes, "\n");
    free(scene);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

// Whether the request may change what the job of that id came to.
static Status require_own(App *app, const Request *request, const char *id, Problem *problem) {
    Job *job = NULL;
    char what[64];
    TRY(jobs_find(app->manager, id, &job, problem));
    snprintf(what, sizeof what, "the job %.40s", id);
    const Status status = access_owns(request, job_client(job), what, problem);
    job_unref(job);
    return status;
}

Status jobs_dismiss(App *app, const Request *request, Reply *reply, Problem *problem) {
    Job *job = NULL;
    bool is_paused;
    if (request->kept != NULL) {
        job = pause_end(request->kept, reply);
    } else {
        TRY(require_own(app, request, request->parameters[0], problem));
        TRY(jobs_cancel(app->manager, request->parameters[0], &job, problem));
    }
    TRY(pause_until_kept(request, reply, job, &is_paused, problem));
    if (is_paused)
        return STATUS_OK;
    return reply_job(app, reply, job, 200, problem);
}

Status jobs_retry(App *app, const Request *request, Reply *reply, Problem *problem) {
    Job *job = NULL;
    bool is_paused;
    if (request->kept != NULL) {
        job = pause_end(request->kept, reply);
    } else {
        const Submission submission = {.retry_of = request->parameters[0],
                                       .client = request->client,
                                       .idempotency_key = request->idempotency_key,
                                       .is_replayed = &reply->is_replayed};
        TRY(refuse_stopping(app, problem));
        TRY(require_own(app, request, request->parameters[0], problem));
        TRY(submit(app, request, &submission, reply, &job, problem));
    }
    TRY(pause_until_kept(request, reply, job, &is_paused, problem));
    if (is_paused)
        return STATUS_OK;
    return reply_job(app, reply, job, 202, problem);
}
