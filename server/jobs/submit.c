// How a scene becomes a job. Its row is on the way to the store while it is computed already;
// nobody hears of it before the store has it. Known results finish it at once, equal scenes in
// flight share one computation, and jobs of an earlier life of the daemon come in by the same way.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/jobs/documents.h"
#include "server/jobs/idempotency.h"
#include "server/jobs/job_id.h"
#include "server/jobs/jobs_private.h"
#include "server/jobs/limits.h"
#include "server/jobs/resolve_record.h"
#include "server/jobs/sweep_retry.h"
#include "server/json/encode.h"
#include "server/util/bytes.h"
#include "server/util/clock.h"

// With the lock held: one of this scene that is under way, to be shared. One for readers alone
// saves nothing.
static Task *find_shared(const JobManager *manager, const char *result) {
    Task *task = hashmap_find(manager->in_flight, result);
    return task != NULL && task->recompute_only ? NULL : task;
}

// Plan, summary, work and notes of a result that is there already. STATUS_NOT_FOUND if it is not.
static Status find_known(JobManager *manager, Job *job, Problem *problem) {
    pthread_mutex_lock(&manager->lock);
    job->head = cache_head(manager->cache, job->row.result);
    // What is in flight is not there either.
    const bool is_new = job->head == NULL && find_shared(manager, job->row.result) != NULL;
    pthread_mutex_unlock(&manager->lock);
    if (job->head != NULL)
        return STATUS_OK;
    if (is_new)
        return STATUS_NOT_FOUND;
    ResultRow row = {0};
    const Status status = db_result_head(manager->db, job->row.result, &row, NULL);
    if (status == STATUS_OK)
        job->head = result_summary_new(&row);
    result_row_clear(&row);
    pthread_mutex_lock(&manager->lock);
    manager->rows.hits += status == STATUS_OK;
    manager->rows.misses += status == STATUS_NOT_FOUND;
    if (job->head != NULL)
        cache_put(manager->cache, job->row.result, NULL, job->head);
    pthread_mutex_unlock(&manager->lock);
    if (status == STATUS_OK || status == STATUS_NOT_FOUND)
        return status;
    return problem_set(problem, status, "the results could not be searched");
}

// The store has answered that it was accepted.
static void opened(void *context, Status status, const char *detail) {
    Job *job = context;
    JobManager *manager = job->manager;
    pthread_mutex_lock(&manager->lock);
    job->ticket = NULL;
    // What closes it saves the whole, and tells.
    if (!job->is_closing) {
        free(job->row.scene);
        job->row.scene = NULL;
    }
    if (!job->is_closing && status != STATUS_OK)
        jobs_refuse(job, status, detail);
    if (status == STATUS_OK && (!job->is_closing || !job_state_is_final(job->row.state))) {
        job->is_kept = true;
        subscribers_call(&job->save_waiters);
    }
    jobs_settle(manager);
    pthread_mutex_unlock(&manager->lock);
    job_unref(job); // the post's hold
}

// With the lock held.
static Status post(JobManager *manager, Job *job, WritePriority turn, Problem *problem) {
    const WriteDone done = {opened, job_ref(job)};
    job->insert_row = job->row;
    const Status status = db_job_post(manager->db, &job->insert_row, turn, &done, &job->ticket);
    if (status == STATUS_OK) {
        manager->posted++;
        return STATUS_OK;
    }
    job_unref(job); // the post's hold
    return problem_set(problem, status, "no memory for a job");
}

static Status finish_known(JobManager *manager, Job *job, Problem *problem) {
    JobRow *row = &job->row;
    row->state = JOB_SUCCESSFUL;
    row->is_cached = true;
    row->started_unix_ms = row->finished_unix_ms = clock_unix_ms();
    row->total = 1e-9 * (double)(clock_monotonic_ns() - job->submitted_ns);
    pthread_mutex_lock(&manager->lock);
    const Status status = post(manager, job, STORE_NOW, problem);
    pthread_mutex_unlock(&manager->lock);
    if (status == STATUS_OK)
        job_metrics_ended(&manager->totals, JOB_SUCCESSFUL, true);
    return status;
}

// With the lock held: whether there is room in the queue.
static Status find_room(const JobManager *manager, const Job *job, Problem *problem) {
    if (manager->is_closing)
        return problem_set(problem, STATUS_BUSY, "the daemon is stopping");
    if (manager->live >= manager->settings.queue_most)
        return problem_set(problem, STATUS_BUSY,
                           "the queue is full: of unfinished jobs it has %zu, and may have %zu",
                           manager->live, manager->settings.queue_most);
    if (manager->scene_bytes + strlen(job->row.scene) > manager->settings.queue_bytes)
        return problem_set(problem, STATUS_BUSY,
                           "the queue is full: %zu bytes of scenes wait, %zu are allowed",
                           manager->scene_bytes, manager->settings.queue_bytes);
    return limits_check(manager, job->client, problem);
}

// A computation of this scene, without jobs. Takes the inquiry. NULL without memory.
static Task *begin(const JobRow *row, StudyRequest *inquiry) {
    Task *task = task_new(row->result);
    if (task != NULL) {
        task->scene = strdup(row->scene);
        task->warnings = strdup(row->warnings);
        task->inquiry = *inquiry;
        *inquiry = (StudyRequest){0};
        if (task->scene != NULL && task->warnings != NULL)
            return task;
    }
    task_free(task);
    study_request_clear(inquiry);
    return NULL;
}

// Queues it, or lets it share what is under way. Takes the inquiry.
static Status start(JobManager *manager, Job *job, StudyRequest *inquiry, bool is_retry,
                    Problem *problem) {
    Task *task = begin(&job->row, inquiry);
    if (task == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    pthread_mutex_lock(&manager->lock);
    Task *other = find_shared(manager, job->row.result);
    // It mostly has run before anyone must be told that it was accepted, and is then written once.
    // But a sweep's rows need their job beside them.
    const WritePriority turn = job->row.study == NULL ? STORE_LATER : STORE_NOW;
    // It may have become known meanwhile.
    if (other == NULL && !is_retry &&
        (job->head = cache_head(manager->cache, job->row.result)) != NULL) {
        pthread_mutex_unlock(&manager->lock);
        task_free(task);
        return finish_known(manager, job, problem);
    }
    Status status = find_room(manager, job, problem);
    if (status == STATUS_OK)
        status = post(manager, job, turn, problem);
    if (status == STATUS_OK) {
        jobs_admit(manager, job);
        if (other == NULL)
            jobs_enqueue(manager, task, job->client);
        else
            queue_rebalance(manager->queue, &other->queued, job->client);
        jobs_attach(job, other != NULL ? other : task);
    }
    pthread_mutex_unlock(&manager->lock);
    if (status != STATUS_OK || other != NULL)
        task_free(task);
    return status;
}

// All labels of a job, in bytes.
enum { LABELS_MAX = 8192 };

// Title, labels and study, as they are shown and searched.
static Status fill_notes(JobRow *row, const StudyRequest *inquiry, Problem *problem) {
    const Simulation *simulation = &inquiry->simulation;
    const Texts *labels = &simulation->labels;
    Bytes shown = {0}, words = {0};
    job_words(&words, simulation->title, (const char *const *)labels->at, labels->count);
    if (words.count > LABELS_MAX) {
        const size_t size = words.count;
        bytes_clear(&words);
        return problem_add(problem, STATUS_INVALID, "/labels",
                           "must have at most %d bytes in all, has about %zu", LABELS_MAX, size);
    }
    for (size_t i = 0; i < labels->count; i++) {
        bytes_text(&shown, i > 0 ? ", " : "[");
        bytes_json_string(&shown, labels->at[i]);
    }
    bytes_text(&shown, labels->count > 0 ? "]" : "");
    const bool is_named = words.count > 0;
    row->title = simulation->title == NULL ? NULL : strdup(simulation->title);
    row->labels = bytes_take(&shown, NULL);
    row->words = bytes_take(&words, NULL);
    row->study = inquiry->study == NULL ? NULL : strdup(inquiry->study->kind->name);
    const bool is_whole = (row->title != NULL || simulation->title == NULL) &&
                          row->labels != NULL && row->words != NULL &&
                          (row->study != NULL || inquiry->study == NULL);
    if (labels->count == 0) {
        free(row->labels);
        row->labels = NULL;
    }
    if (!is_named) {
        free(row->words);
        row->words = NULL;
    }
    return is_whole ? STATUS_OK : STATUS_NO_MEMORY;
}

static Status fill_sender(Job *job, const Submission *submission, const IdempotencyHold *hold) {
    JobRow *row = &job->row;
    const bool has_key = hold->key[0] != '\0';
    row->client = submission->client == NULL ? NULL : strdup(submission->client);
    row->idempotency_key = has_key ? strdup(hold->key) : NULL;
    row->request = has_key ? strdup(hold->request) : NULL;
    return (row->client == NULL && submission->client != NULL) ||
                   (has_key && (row->idempotency_key == NULL || row->request == NULL))
               ? STATUS_NO_MEMORY
               : STATUS_OK;
}

static Status fill_job(Job *job, const StudyRequest *inquiry, const Warnings *warnings,
                       Problem *problem) {
    JobRow *row = &job->row;
    Bytes scene = {0}, told = {0}, uses = {0};
    if (!job_id_make(row->id))
        return problem_set(problem, STATUS_INTERNAL, "no random numbers for a job's id");
    job->indexed.key = row->id;
    row->created_unix_ms = clock_unix_ms();
    jobs_result_id(inquiry, row->result);
    document_scene(&scene, inquiry);
    document_warnings(&told, warnings);
    row->scene = bytes_take(&scene, NULL);
    row->warnings = bytes_take(&told, NULL);
    resolve_record_uses(inquiry, &uses);
    const bool has_uses = uses.count > 0;
    row->uses = bytes_take(&uses, NULL);
    if (row->uses != NULL && !has_uses) {
        free(row->uses);
        row->uses = NULL;
    }
    TRY(fill_notes(row, inquiry, problem));
    if (row->result[0] == '\0' || (has_uses && row->uses == NULL) || row->scene == NULL ||
        row->warnings == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    return STATUS_OK;
}

static void fail_row(JobRow *row, const Problem *problem) {
    Bytes bytes = {.most = 1 << 20};
    encode_problem(&bytes, problem, encode_problem_code(problem->status), NULL);
    row->state = JOB_FAILED;
    row->problem = bytes_take(&bytes, NULL);
    row->finished_unix_ms = clock_unix_ms();
}

static Status submit(JobManager *manager, Job *job, StudyRequest *inquiry, bool is_retry,
                     Problem *problem) {
    const Status known = is_retry ? STATUS_NOT_FOUND : find_known(manager, job, problem);
    if (known == STATUS_OK)
        return finish_known(manager, job, problem);
    if (known != STATUS_NOT_FOUND)
        return known;
    return start(manager, job, inquiry, is_retry, problem);
}

// Who asks, if it may.
static Status enter_client(JobManager *manager, const char *name, QueueClient **client,
                           Problem *problem) {
    Status status = STATUS_OK;
    pthread_mutex_lock(&manager->lock);
    *client = queue_client(manager->queue, name != NULL ? name : "");
    if (*client == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    else
        status = limits_add(manager, *client, problem);
    pthread_mutex_unlock(&manager->lock);
    return status;
}

Status jobs_charge(JobManager *manager, const char *client, Problem *problem) {
    QueueClient *charged;
    return enter_client(manager, client, &charged, problem);
}

// A record that it names may have been deleted since it was looked up under `generation`. From here
// on none is before the store knows of the job.
static Status submit_named(JobManager *manager, Job *job, StudyRequest *inquiry,
                           uint64_t catalog_version, const Submission *submission,
                           Problem *problem) {
    Status status = STATUS_OK;
    naming_enter(&manager->naming);
    if (db_catalog_version(manager->db) != catalog_version)
        status = resolve_records_again(manager->db, inquiry, problem);
    if (status == STATUS_OK)
        status = submit(manager, job, inquiry, submission->retry_of != NULL, problem);
    naming_leave(&manager->naming);
    return status;
}

static Status submit_new(JobManager *manager, const Submission *submission,
                         const IdempotencyHold *hold, Job **accepted, Problem *problem) {
    QueueClient *client;
    TRY(enter_client(manager, submission->client, &client, problem));
    Job *job = job_new(manager);
    if (job == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    job->submitted_ns = clock_monotonic_ns();
    job->client = client;
    StudyRequest inquiry = {0};
    Warnings warnings = {NULL, 0};
    const uint64_t catalog_version = db_catalog_version(manager->db);
    bool has_place;
    Status status =
        jobs_prepare_request(manager, submission->text, submission->size, &manager->settings.limits,
                             &has_place, &inquiry, &warnings, problem);
    if (status == STATUS_OK)
        status = fill_job(job, &inquiry, &warnings, problem);
    if (status == STATUS_OK)
        status = fill_sender(job, submission, hold);
    if (status == STATUS_OK && job->row.uses == NULL)
        status = submit(manager, job, &inquiry, submission->retry_of != NULL, problem);
    else if (status == STATUS_OK)
        status = submit_named(manager, job, &inquiry, catalog_version, submission, problem);
    jobs_leave_place(manager, has_place);
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    if (status != STATUS_OK) {
        job_unref(job);
        return status;
    }
    *accepted = job;
    return STATUS_OK;
}

static Status submit_retry(JobManager *manager, const Submission *submission,
                           const IdempotencyHold *hold, Job **accepted, Problem *problem) {
    SweepRow row;
    pthread_mutex_lock(&manager->retries);
    Status status = sweep_retry_open(manager, submission->retry_of, &row, problem);
    if (status == STATUS_OK) {
        Submission scene = *submission;
        scene.text = row.scene;
        scene.size = strlen(row.scene);
        status = submit_new(manager, &scene, hold, accepted, problem);
    }
    pthread_mutex_unlock(&manager->retries);
    sweep_row_clear(&row);
    return status;
}

Status jobs_submit(JobManager *manager, const Submission *submission, Job **accepted,
                   Problem *problem) {
    IdempotencyHold hold;
    Status status = idempotency_begin(manager, submission, &hold, accepted, problem);
    if (submission->is_replayed != NULL)
        *submission->is_replayed = *accepted != NULL;
    if (status == STATUS_OK && *accepted == NULL) {
        status = submission->retry_of != NULL
                     ? submit_retry(manager, submission, &hold, accepted, problem)
                     : submit_new(manager, submission, &hold, accepted, problem);
        if (status == STATUS_OK)
            idempotency_remember(manager, &hold, *accepted);
    }
    idempotency_end(manager, &hold);
    return status;
}

// Takes the row and the inquiry.
static Status resume(JobManager *manager, JobRow *row, StudyRequest *inquiry, Problem *problem) {
    Job *job = job_new(manager);
    QueueClient *client = queue_client(manager->queue, row->client != NULL ? row->client : "");
    Task *task = NULL;
    jobs_result_id(inquiry, row->result);
    if (job != NULL && client != NULL && row->result[0] != '\0' &&
        (task = hashmap_find(manager->in_flight, row->result)) == NULL &&
        (task = begin(row, inquiry)) != NULL)
        jobs_enqueue(manager, task, client);
    if (task == NULL) {
        job_unref(job);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the unfinished jobs");
    }
    // Its age counts as waiting.
    const int64_t age_ms = clock_unix_ms() - row->created_unix_ms;
    job->submitted_ns = clock_monotonic_ns() - (age_ms > 0 ? age_ms : 0) * 1000000;
    job->row = *row;
    *row = (JobRow){0};
    job->is_kept = true;
    job->row.state = JOB_ACCEPTED;
    job->client = client;
    job->indexed.key = job->row.id;
    jobs_admit(manager, job);
    jobs_attach(job, task);
    free(job->row.scene);
    job->row.scene = NULL;
    job_unref(job);
    return STATUS_OK;
}

Status jobs_take_up(JobManager *manager, JobRow *row, Problem *problem) {
    Problem *fault = calloc(1, sizeof *fault);
    StudyRequest inquiry = {0};
    Warnings warnings = {NULL, 0};
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the unfinished jobs");
    Status status = jobs_prepare(manager->db, row->scene, strlen(row->scene),
                                 &manager->settings.limits, &inquiry, &warnings, fault);
    if (status == STATUS_OK) {
        status = resume(manager, row, &inquiry, problem);
    } else if (status == STATUS_INVALID || status == STATUS_UNREADABLE) {
        // The limits or the program changed meanwhile: the job's owner learns why.
        fail_row(row, fault);
        status = db_job_update(manager->db, row, problem);
    } else {
        problem_set(problem, status, "%s", fault->detail);
    }
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    free(fault);
    return status;
}
