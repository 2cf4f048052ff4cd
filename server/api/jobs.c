// Jobs: submit, show, dismiss, retry. A handler that has to wait subscribes to the job and returns;
// when it is called again it continues with the same job.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/api/job_json.h"
#include "server/http/access.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/json/parse.h"
#include "server/util/clock.h"

static const double wait_initial = 2, wait_most = 30; // [s]

enum {
    SAVE_WAIT_MS = 10000, // then it is checked again
    UNLISTED_MS = 250,    // after which an unfinished job is saved, so that lists have it
};

// Takes the reference to `job`. `code` 0: to its sender, 200 if it is finished, else 202 and its
// location.
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

// What a waiting request keeps.
typedef struct JobWait {
    Job *job;
    const Callback *callback;
    bool is_replayed; // of the reply
} JobWait;

// `reply` NULL: there will be none.
static Job *wait_end(JobWait *wait, Reply *reply) {
    Job *job = wait->job;
    if (reply != NULL)
        reply->is_replayed = wait->is_replayed;
    job_unsubscribe(job, wait->callback);
    free(wait);
    return job;
}

// The client has left; its job continues, and lists have it.
static void wait_forget(void *kept) {
    Job *job = wait_end(kept, NULL);
    job_save(job);
    job_unref(job);
}

static Status wait_begin(const Request *request, Reply *reply, Job *job, JobEvent event,
                         int wait_ms, Problem *problem) {
    JobWait *wait = malloc(sizeof *wait);
    if (wait == NULL || !job_subscribe(job, event, request->callback)) {
        free(wait);
        job_unref(job);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory to wait for the job");
    }
    *wait = (JobWait){job, request->callback, reply->is_replayed};
    reply_wait(reply, wait_ms, wait, wait_forget);
    return STATUS_OK;
}

// Takes the reference to `job`. Waits for it to finish, until `seconds` after the request came, and
// in any case until it is durable: no client is given its id before.
static Status answer_job(App *app, const Request *request, Reply *reply, Job *job, double seconds,
                         int code, Problem *problem) {
    const double passed = 1e-9 * (double)(clock_monotonic_ns() - request->started_ns);
    bool is_durable;
    const Status status = job_is_durable(job, &is_durable, problem);
    if (status != STATUS_OK) {
        job_unref(job);
        return status;
    }
    double left = atomic_load(&app->is_stopping) ? 0 : seconds - passed;
    if (left > 0 && !job_is_finished(job)) {
        if (!is_durable && passed < 1e-3 * UNLISTED_MS)
            left = fmin(left, 1e-3 * UNLISTED_MS - passed);
        else
            job_save(job);
        return wait_begin(request, reply, job, JOB_IS_FINISHED, (int)(1000 * left) + 1, problem);
    }
    if (is_durable)
        return reply_job(app, reply, job, code, problem);
    job_save(job);
    return wait_begin(request, reply, job, JOB_IS_DURABLE, SAVE_WAIT_MS, problem);
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

Status jobs_create(App *app, const Request *request, Reply *reply, Problem *problem) {
    if (request->kept != NULL)
        return answer_job(app, request, reply, wait_end(request->kept, reply),
                          read_wait(request, reply), 0, problem);
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
    return answer_job(app, request, reply, job, read_wait(request, reply), 0, problem);
}

// The scene of a result, once more: what another engine's version made is made by this one.
Status results_again(App *app, const Request *request, Reply *reply, Problem *problem) {
    Job *job = NULL;
    ResultRow row = {0};
    if (request->kept != NULL)
        return answer_job(app, request, reply, wait_end(request->kept, reply),
                          read_wait(request, reply), 0, problem);
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
    return answer_job(app, request, reply, job, read_wait(request, reply), 0, problem);
}

// Whether the scene is decoded, validated and planned in some ten microseconds without waiting for
// the database: one structure of one mass and nothing that asks for many runs. Nothing is escaped,
// so that the words are found.
bool jobs_are_light(const Request *request) {
    static const char *const heavy[] = {"\\",         "\"study\"",     "\"frame\"", "\"matrices\"",
                                        "\"target\"", "\"reduction\"", "\"record\""};
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
        job = wait_end(request->kept, reply);
    else
        TRY(job_find_visible(app, request, &job, problem));
    return answer_job(app, request, reply, job, wait, 200, problem);
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

// The body has two members of a scene, by the same rows; null removes the title.
Status jobs_change(App *app, const Request *request, Reply *reply, Problem *problem) {
    Field rows[] = {*fields_find(simulation_fields, "title", NULL),
                    *fields_find(simulation_fields, "labels", NULL), FIELD_END};
    Simulation change = {.title = NULL};
    Job *job = NULL;
    const char *id = request->parameters[0];
    rows[0].flags |= FIELD_NULL_IS_EMPTY;
    problem->whose = "change";
    TRY(request_require_json(request, problem));
    TRY(require_own(app, request, id, problem));
    Status status = json_parse(request->body, request->body_size, rows, &change, problem);
    if (status == STATUS_OK)
        status = fields_validate(rows, &change, "", problem);
    if (status == STATUS_OK)
        status = jobs_annotate(app->manager, id, change.title,
                               change.labels.at != NULL ? &change.labels : NULL, problem);
    fields_clear(rows, &change);
    TRY(status);
    TRY(jobs_find(app->manager, id, &job, problem));
    return reply_job(app, reply, job, 200, problem);
}

Status jobs_dismiss(App *app, const Request *request, Reply *reply, Problem *problem) {
    Job *job = NULL;
    bool is_purge;
    TRY(request_flag(request, "purge", &is_purge, problem));
    if (is_purge) {
        TRY(require_own(app, request, request->parameters[0], problem));
        TRY(jobs_remove(app->manager, request->parameters[0], problem));
        reply_borrow(reply, 204, NULL, NULL, 0);
        return STATUS_OK;
    }
    if (request->kept != NULL) {
        job = wait_end(request->kept, reply);
    } else {
        TRY(require_own(app, request, request->parameters[0], problem));
        TRY(jobs_cancel(app->manager, request->parameters[0], &job, problem));
    }
    return answer_job(app, request, reply, job, 0, 200, problem);
}

Status jobs_retry(App *app, const Request *request, Reply *reply, Problem *problem) {
    Job *job = NULL;
    if (request->kept != NULL) {
        job = wait_end(request->kept, reply);
    } else {
        const Submission submission = {.retry_of = request->parameters[0],
                                       .client = request->client,
                                       .idempotency_key = request->idempotency_key,
                                       .is_replayed = &reply->is_replayed};
        TRY(refuse_stopping(app, problem));
        TRY(require_own(app, request, request->parameters[0], problem));
        TRY(submit(app, request, &submission, reply, &job, problem));
    }
    return answer_job(app, request, reply, job, 0, 202, problem);
}
