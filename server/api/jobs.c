// Jobs: submit, show, list, change, cancel, remove, retry. A handler that has to wait subscribes to
// the job and returns; when it is called again it continues with the same job.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/field.h"
#include "core/base/rfc3339.h"
#include "core/study/study.h"
#include "server/api/app.h"
#include "server/api/job_json.h"
#include "server/http/access.h"
#include "server/http/header.h"
#include "server/jobs/job.h"
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
    const bool is_finished = job_state_is_final(show.row.state);
    const int parts = JOB_PUT_WHOLE | JOB_PUT_LINKS | (code == 200 ? JOB_PUT_SENDER : 0);
    if (code == 0)
        code = is_finished ? 200 : 202;
    if (code == 202)
        snprintf(reply->location, sizeof reply->location, "/v1/jobs/%s", show.row.id);
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

// How long the client waits [s]; the reply states it.
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
                       "the server is stopping and takes no new jobs; try again when it is back");
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
                                       .idempotency_key = request->idempotency_key,
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

// Whether the request may change the job.
static Status require_own(App *app, const Request *request, const char *id, Problem *problem) {
    Job *job = NULL;
    char what[64];
    Status status = jobs_find(app->manager, id, &job, problem);
    if (status == STATUS_INTERNAL && (request->client == NULL || request->holder.is_admin)) {
        problem_clear(problem); // a damaged job can be removed
        return STATUS_OK;
    }
    TRY(status);
    snprintf(what, sizeof what, "the job %.40s", id);
    status = access_owns(request, job_client(job), what, problem);
    job_unref(job);
    return status;
}

// The body has two members of a scene, by the same rows; null removes either.
Status jobs_change(App *app, const Request *request, Reply *reply, Problem *problem) {
    Field rows[] = {*fields_find(simulation_fields, "title", NULL),
                    *fields_find(simulation_fields, "labels", NULL), FIELD_END};
    Simulation change = {.title = NULL};
    Job *job = NULL;
    const char *id = request->parameters[0];
    rows[0].flags |= FIELD_NULL_IS_EMPTY;
    rows[1].flags |= FIELD_NULL_IS_EMPTY;
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

enum { LIST_INITIAL = 20, LIST_MAX = 100 };

// Unfinished jobs whose state is asked for are looked at one by one, this many at a time.
enum { LOOKED_AT = 256 };

// Of a scene in a list: with those of a hundred jobs the list is still sent at once.
enum { LIST_SCENE_MAX = 65536 };

// Puts a job of the list. With `is_detailed` its scene and its summary, null where they are long,
// damaged or deleted.
static void jobs_list_put(App *app, Bytes *bytes, const JobView *show, bool is_detailed) {
    const int parts = JOB_PUT_LINKS | JOB_PUT_SENDER;
    if (!is_detailed) {
        job_json_put(bytes, show, parts);
        return;
    }
    JobView detailed = *show;
    char *scene = NULL;
    ResultRow result = {.id = ""};
    (void)db_job_scene_within(app->db, show->row.id, LIST_SCENE_MAX, &scene, NULL);
    if (show->row.state == JOB_SUCCESSFUL)
        (void)db_result_head(app->db, show->row.result, &result, NULL);
    detailed.row.scene = scene;
    detailed.summary = result.summary;
    job_json_put(bytes, &detailed, parts | JOB_PUT_DETAILS);
    free(scene);
    result_row_clear(&result);
}

// A row has no progress: an unfinished job is read from the manager. False where the job is not in
// the wanted state (-1: any).
static bool jobs_list_row(App *app, Bytes *bytes, const JobRow *row, int state, bool is_detailed,
                          const char *separator) {
    JobView show = {0};
    Job *job = NULL;
    const bool is_unfinished = !job_state_is_final(row->state);
    if (is_unfinished && jobs_find(app->manager, row->id, &job, NULL) == STATUS_OK) {
        const Status status = job_view(job, &show);
        const bool is_wanted = state < 0 || show.row.state == state;
        job_unref(job);
        if (status == STATUS_OK && is_wanted) {
            bytes_text(bytes, separator);
            jobs_list_put(app, bytes, &show, is_detailed);
        }
        job_view_clear(&show);
        if (status == STATUS_OK)
            return is_wanted;
    }
    if (state >= 0 && row->state != state)
        return false;
    show = (JobView){.row = *row, .progress = row->state == JOB_SUCCESSFUL ? 100 : 0};
    bytes_text(bytes, separator);
    jobs_list_put(app, bytes, &show, is_detailed); // borrows the row's texts
    return true;
}

static Status search_read_time(const Request *request, const char *name, bool is_end,
                               int64_t *unix_ms, Problem *problem) {
    const char *text;
    TRY(request_text(request, name, &text, problem));
    if (text == NULL)
        return STATUS_OK;
    if (!rfc3339_read(text, unix_ms))
        return problem_set(problem, STATUS_USAGE,
                           "the query parameter \"%s\" must be a day or a time as of RFC 3339, "
                           "2026-11-21T09:00:00Z, is \"%.40s\"",
                           name, text);
    if (is_end && strlen(text) == 10)
        *unix_ms += 86399999; // the whole of that day
    return STATUS_OK;
}

static Status search_read(const Request *request, JobSearch *search, int *state, Problem *problem) {
    const char *kinds[32] = {"none"};
    size_t count = 1;
    for (size_t i = 0; studies[i] != NULL && count + 1 < COUNT(kinds); i++)
        kinds[count++] = studies[i]->kind.name;
    size_t limit;
    int kind;
    TRY(request_count(request, "limit", 1, LIST_MAX, LIST_INITIAL, &limit, problem));
    *search = job_search_all(limit);
    TRY(request_choice(request, "status", job_state_names, -1, state, problem));
    TRY(request_choice(request, "kind", kinds, -1, &kind, problem));
    TRY(request_text(request, "before", &search->before, problem));
    if (search->before != NULL)
        search->before_unix_ms = job_id_unix_ms(search->before);
    TRY(request_text(request, "q", &search->words, problem));
    TRY(request_text(request, "label", &search->label, problem));
    TRY(request_text(request, "result", &search->result, problem));
    TRY(search_read_time(request, "since", false, &search->since_unix_ms, problem));
    TRY(search_read_time(request, "until", true, &search->until_unix_ms, problem));
    if (kind >= 0) // the names are the studies' own, and outlive this
        search->study = kinds[kind];
    // In the database an unfinished job is accepted, whether it runs or not.
    if (*state == JOB_ACCEPTED || *state == JOB_RUNNING)
        search->most_state = JOB_RUNNING;
    else if (*state >= 0)
        search->least_state = search->most_state = *state;
    return STATUS_OK;
}

// Up to `most` jobs into `bytes`. `last` gets the last one's id where more may follow, else "".
static Status jobs_list_page(App *app, JobSearch search, int state, bool is_detailed, Bytes *bytes,
                             char last[40], Problem *problem) {
    const size_t most = search.most;
    const bool is_live = state == JOB_ACCEPTED || state == JOB_RUNNING;
    char before[40];
    size_t count = 0;
    last[0] = '\0';
    // One more than the limit shows whether there is a next page.
    search.most = is_live ? LOOKED_AT : most + 1;
    for (;;) {
        JobRows rows = {0};
        TRY(db_job_search(app->db, &search, &rows, problem));
        bool is_full = false;
        for (size_t i = 0; i < rows.count && !is_full; i++) {
            is_full = count == most;
            if (!is_full && jobs_list_row(app, bytes, &rows.at[i], state, is_detailed,
                                          count > 0 ? ",\n " : "")) {
                count++;
                text_fit(last, 40, rows.at[i].id);
            }
        }
        const bool is_more = is_live && rows.count == search.most && !is_full;
        if (is_more)
            text_fit(before, sizeof before, rows.at[rows.count - 1].id);
        job_rows_clear(&rows);
        if (!is_more) {
            if (!is_full)
                last[0] = '\0';
            return STATUS_OK;
        }
        search.before = before;
        search.before_unix_ms = job_id_unix_ms(before);
    }
}

Status jobs_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    JobSearch search;
    int state;
    bool is_detailed = false;
    TRY(search_read(request, &search, &state, problem));
    TRY(request_flag(request, "details", &is_detailed, problem));
    Bytes bytes = {.most = app->reply_most};
    char last[40];
    bytes_text(&bytes, "{\"jobs\": [");
    const Status status = jobs_list_page(app, search, state, is_detailed, &bytes, last, problem);
    if (status != STATUS_OK) {
        bytes_clear(&bytes);
        return status;
    }
    bytes_text(&bytes, "]}\n");
    if (last[0] != '\0')
        reply_link_next(request, reply, "before", last, &bytes);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}
