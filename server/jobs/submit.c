// How a scene becomes a job. Cached results finish it at once, equal scenes share one task, and
// unfinished jobs of the database are resumed in the same way. A job with a key, of a study or of a
// scene that names a record is inserted before it is queued: the database then arbitrates between
// requests of one key, keeps the rows of a sweep, and does not let the record be deleted.
//
// Idempotency-Key (draft-ietf-httpapi-idempotency-key-header): a quoted string, "8e03...", but many
// clients send it bare. It is in the job's row, unique for its client, so it lasts as long as the
// job: of two requests at once the second one's insertion fails, and it finds the job of the first.
//
// Rate limit: a bucket of jobs that fills steadily and holds those of one minute. Clients without a
// token have no rate limit and no quota; the limits of the queue apply to them.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/jobs/documents.h"
#include "server/jobs/jobs_private.h"
#include "server/jobs/study.h"
#include "server/util/clock.h"
#include "server/util/sha256.h"

enum { KEY_MAX = 255, LABELS_MAX = 8192 }; // bytes of a key, of all labels of a job

// A submission on its way to becoming a job.
typedef struct Entry {
    JobManager *manager;
    const Submission *submission;
    char key[KEY_MAX + 1]; // "": none
    char digest[65];       // with a key: SHA-256 of the body
    Job *job;
    StudyRequest request;
    Job *earlier; // of the same key; a reference
} Entry;

static Status key_read(const Submission *submission, Entry *entry, Problem *problem) {
    const char *text = submission->idempotency_key;
    if (text == NULL)
        return STATUS_OK;
    size_t size = strlen(text);
    if (size >= 2 && text[0] == '"' && text[size - 1] == '"') {
        text++;
        size -= 2;
    }
    bool is_valid = size >= 1 && size <= KEY_MAX;
    for (size_t i = 0; i < size && is_valid; i++)
        is_valid = text[i] >= ' ' && text[i] <= '~' && text[i] != '"' && text[i] != '\\';
    if (!is_valid)
        return problem_set(problem, STATUS_USAGE,
                           "Idempotency-Key must be 1 to %d printable ASCII characters without "
                           "\" and \\, best a UUID in quotes; it has %zu",
                           KEY_MAX, size);
    memcpy(entry->key, text, size);
    Sha256 *digest = sha256_new();
    if (digest == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    if (submission->retry_of != NULL) {
        sha256_add(digest, "retry ", 6);
        sha256_add(digest, submission->retry_of, strlen(submission->retry_of));
    } else {
        sha256_add(digest, submission->text, submission->size);
    }
    sha256_end(digest, entry->digest);
    return STATUS_OK;
}

// Sets entry->earlier to the job of an earlier request with this key, if there is one.
static Status key_find(Entry *entry, Problem *problem) {
    JobRow row;
    if (entry->key[0] == '\0')
        return STATUS_OK;
    Status status =
        db_job_keyed(entry->manager->db, entry->submission->client, entry->key, &row, problem);
    if (status == STATUS_NOT_FOUND) {
        problem_clear(problem);
        return STATUS_OK;
    }
    TRY(status);
    if (text_same(row.request, entry->digest))
        status = jobs_find(entry->manager, row.id, &entry->earlier, problem);
    else
        status = problem_set(problem, STATUS_REUSED,
                             "the Idempotency-Key \"%.80s\" was used with another body, for the "
                             "job %.40s; take a new key for a new request",
                             entry->key, row.id);
    job_row_clear(&row);
    return status;
}

static double client_allowance(const JobManager *manager, const QueueClient *client) {
    const double max = manager->settings.rate;
    if (client->allowed_ns == 0)
        return max;
    const double passed = 1e-9 * (double)(clock_monotonic_ns() - client->allowed_ns);
    return fmin(max, client->allowance + passed * max / 60);
}

// The client of the queue, if it may submit one more now.
static Status client_enter(JobManager *manager, const char *name, QueueClient **entered,
                           Problem *problem) {
    Status status = STATUS_OK;
    pthread_mutex_lock(&manager->lock);
    QueueClient *client = *entered = queue_client(manager->queue, name != NULL ? name : "");
    if (client == NULL) {
        status = study_result(STATUS_NO_MEMORY, problem);
    } else if (manager->settings.rate > 0 && name != NULL) {
        const double left = client_allowance(manager, client);
        if (left < 1) {
            status = problem_set(problem, STATUS_QUOTA,
                                 "the token \"%.60s\" may send %.6g jobs a minute and has sent "
                                 "them",
                                 name, manager->settings.rate);
        } else {
            client->allowance = left - 1;
            client->allowed_ns = clock_monotonic_ns();
        }
    }
    pthread_mutex_unlock(&manager->lock);
    return status;
}

const SimulationLimits *jobs_limits(const JobManager *manager) {
    return &manager->settings.limits;
}

Status jobs_charge(JobManager *manager, const char *client, Problem *problem) {
    QueueClient *charged;
    return client_enter(manager, client, &charged, problem);
}

// With the lock held: whether it may have one more unfinished job.
static Status client_check_quota(const JobManager *manager, const QueueClient *client,
                                 Problem *problem) {
    const size_t max = manager->settings.quota;
    if (max == 0 || client->name[0] == '\0' || client->live < max)
        return STATUS_OK;
    return problem_set(problem, STATUS_QUOTA,
                       "the token \"%.60s\" has %zu unfinished jobs, %zu are allowed; wait for "
                       "them or dismiss some",
                       client->name, client->live, max);
}

// Until a running task will have ended [s], by its progress and the estimate of its CPU time.
static double task_left(Task *task) {
    const double passed = 1e-9 * (double)(clock_monotonic_ns() - task->began_ns);
    const double done = atomic_load(&task->progress) / 10000.0;
    // The first part of a run may go faster than the rest.
    const double estimated = task->queued.seconds - passed;
    const double seen = done > 0.02 ? passed * (1 - done) / done : 0;
    return fmax(fmax(estimated, seen), 0);
}

// The sooner of `soonest` and the end of the task, if it is one of `client` (NULL: of any).
static double task_soonest(Task *task, const QueueClient *client, double soonest) {
    for (const Job *job = task->jobs; client != NULL; job = job->next_shared) {
        if (job == NULL)
            return soonest;
        if (job->client == client)
            break;
    }
    return fmin(soonest, task_left(task));
}

int jobs_retry_after(JobManager *manager, const char *name, Status status) {
    double seconds = INFINITY;
    pthread_mutex_lock(&manager->lock);
    const QueueClient *client =
        status == STATUS_QUOTA ? queue_client(manager->queue, name != NULL ? name : "") : NULL;
    if (client != NULL && manager->settings.rate > 0 &&
        client_check_quota(manager, client, NULL) == STATUS_OK) {
        seconds = (1 - client_allowance(manager, client)) * 60 / manager->settings.rate;
    } else {
        // A place is free when the first running task ends.
        for (size_t i = 0; i < manager->worker_count; i++)
            if (manager->workers[i].running != NULL)
                seconds = task_soonest(manager->workers[i].running, client, seconds);
        for (const StudyRun *run = manager->studies; run != NULL; run = run->next)
            seconds = task_soonest(run->task, client, seconds);
    }
    if (!isfinite(seconds)) // none of its jobs runs: their turn comes within what waits
        seconds = queue_seconds(manager->queue) / (double)manager->settings.workers;
    pthread_mutex_unlock(&manager->lock);
    return seconds < 1 ? 1 : seconds > 3600 ? 3600 : (int)ceil(seconds);
}

// With the lock held: the task of this scene, to be shared. One for readers alone saves nothing.
static Task *submit_find_task(const JobManager *manager, const char *result) {
    Task *task = hashmap_find(manager->tasks, result);
    return task != NULL && task->recompute_only ? NULL : task;
}

// Sets job->summary where the result is there already. STATUS_NOT_FOUND if it is not. One that is
// damaged is an error: its row, which other jobs have too, is not computed anew before it is
// deleted.
static Status submit_find_result(JobManager *manager, Job *job, Problem *problem) {
    pthread_mutex_lock(&manager->lock);
    job->summary = cache_head(manager, job->row.result);
    const bool is_computed =
        job->summary == NULL && submit_find_task(manager, job->row.result) != NULL;
    const uint64_t deletions = manager->deletions;
    pthread_mutex_unlock(&manager->lock);
    if (job->summary != NULL)
        return STATUS_OK;
    if (is_computed)
        return STATUS_NOT_FOUND;
    const Status status = result_summary_load(manager->db, job->row.result, &job->summary, problem);
    pthread_mutex_lock(&manager->lock);
    manager->rows.hits += status == STATUS_OK;
    manager->rows.misses += status == STATUS_NOT_FOUND;
    if (job->summary != NULL && deletions == manager->deletions)
        cache_put(manager, job->row.result, NULL, job->summary);
    pthread_mutex_unlock(&manager->lock);
    if (status == STATUS_NOT_FOUND)
        problem_clear(problem);
    return status;
}

// Inserts the job and waits. Where another request with the same key was earlier, entry->earlier is
// its job.
static Status submit_insert(Entry *entry, StudyRequest *request, Problem *problem) {
    const Status status = job_insert_now(entry->job, problem);
    if (status != STATUS_CONFLICT)
        return status;
    problem_clear(problem);
    TRY(key_find(entry, problem));
    if (entry->earlier != NULL)
        return STATUS_OK;
    // Otherwise a record was deleted just now.
    request_drop_records(request);
    TRY(request_load_records(entry->manager->db, request, problem));
    return problem_add(problem, STATUS_INVALID, "/excitation",
                       "names a record that was deleted just now");
}

// A job whose result is there already.
static Status submit_finish(Entry *entry, Problem *problem) {
    JobManager *manager = entry->manager;
    Job *job = entry->job;
    JobRow *row = &job->row;
    row->state = JOB_SUCCESSFUL;
    row->is_cached = true;
    row->started_unix_ms = row->finished_unix_ms = clock_unix_ms();
    row->total = 1e-9 * (double)(clock_monotonic_ns() - job->submitted_ns);
    if (row->idempotency_key != NULL) {
        TRY(submit_insert(entry, &entry->request, problem));
    } else {
        pthread_mutex_lock(&manager->lock);
        job_insert_later(job);
        pthread_mutex_unlock(&manager->lock);
    }
    if (entry->earlier == NULL)
        job_metrics_ended(&manager->metrics, JOB_SUCCESSFUL, true);
    return STATUS_OK;
}

// With the lock held: whether there is room in the queue.
static Status submit_check_room(const JobManager *manager, const Job *job, Problem *problem) {
    if (manager->is_closing)
        return problem_set(problem, STATUS_BUSY, "the server is stopping");
    if (manager->live >= manager->settings.queue_most)
        return problem_set(problem, STATUS_BUSY,
                           "the queue is full: of unfinished jobs it has %zu, and may have %zu",
                           manager->live, manager->settings.queue_most);
    if (manager->scene_bytes + strlen(job->row.scene) > manager->settings.queue_bytes)
        return problem_set(problem, STATUS_BUSY,
                           "the queue is full: %zu bytes of scenes wait, %zu are allowed",
                           manager->scene_bytes, manager->settings.queue_bytes);
    return client_check_quota(manager, job->client, problem);
}

// The task of this scene, without jobs. Takes the request. NULL without memory.
static Task *submit_make_task(JobManager *manager, const JobRow *row, StudyRequest *request) {
    Task *task = task_new(manager, row->result);
    if (task == NULL)
        return NULL;
    task->scene = strdup(row->scene);
    task->warnings = strdup(row->warnings);
    task->inquiry = *request;
    *request = (StudyRequest){0};
    task_estimate(task);
    if (task->scene != NULL && task->warnings != NULL)
        return task;
    task_free(task);
    return NULL;
}

// With the lock held, of an admitted job: queues `task`, or lets the job share another one; then
// it returns false.
static bool submit_start(Job *job, Task *task) {
    JobManager *manager = job->manager;
    Task *other = submit_find_task(manager, job->row.result);
    if (manager->is_closing) { // until the next start
        job_retire(job);
        return false;
    }
    if (job_state_is_final(job->row.state)) // cancelled meanwhile
        return false;
    if (other == NULL)
        task_enqueue(task, job->client);
    else
        queue_rebalance(manager->queue, &other->queued, job->client);
    task_attach(other != NULL ? other : task, job);
    return other == NULL;
}

// Admits it, and queues it or lets it share a task.
static Status submit_queue(Entry *entry, Problem *problem) {
    JobManager *manager = entry->manager;
    Job *job = entry->job;
    const bool inserts_first =
        job->row.idempotency_key != NULL || job->row.study != NULL || job->row.uses != NULL;
    const bool is_retry = entry->submission->retry_of != NULL; // computed even if it is cached
    Task *task = submit_make_task(manager, &job->row, &entry->request);
    if (task == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    bool is_queued = false, is_cached = false;
    pthread_mutex_lock(&manager->lock);
    // It may have been saved meanwhile.
    if (!is_retry && submit_find_task(manager, job->row.result) == NULL)
        is_cached = cache_has(manager, job->row.result, false) &&
                    (job->summary = cache_head(manager, job->row.result)) != NULL;
    Status status = is_cached ? STATUS_OK : submit_check_room(manager, job, problem);
    if (status == STATUS_OK && !is_cached) {
        job_admit(job);
        if (!inserts_first)
            is_queued = submit_start(job, task);
    }
    pthread_mutex_unlock(&manager->lock);
    if (status == STATUS_OK && is_cached) {
        entry->request = task->inquiry;
        task->inquiry = (StudyRequest){0};
        status = submit_finish(entry, problem);
    } else if (status == STATUS_OK && inserts_first) {
        status = submit_insert(entry, &task->inquiry, problem);
        if (status == STATUS_OK && entry->earlier == NULL) {
            pthread_mutex_lock(&manager->lock);
            is_queued = submit_start(job, task);
            pthread_mutex_unlock(&manager->lock);
        }
    }
    if (!is_queued)
        task_free(task);
    return status;
}

// Takes the text out; none is NULL.
static Status submit_take(Bytes *bytes, char **target) {
    if (bytes->count == 0 && !bytes->is_failed) {
        bytes_clear(bytes);
        *target = NULL;
        return STATUS_OK;
    }
    return status_made((*target = bytes_take(bytes, NULL)) != NULL);
}

// The labels as a JSON array.
static void submit_write_labels(Bytes *bytes, const Texts *labels) {
    for (size_t i = 0; i < labels->count; i++) {
        bytes_text(bytes, i > 0 ? ", " : "[");
        bytes_json_string(bytes, labels->at[i]);
    }
    bytes_text(bytes, labels->count > 0 ? "]" : "");
}

// The text that a search by words looks into.
static Status submit_write_words(Bytes *words, const char *title, const Texts *labels,
                                 Problem *problem) {
    job_words(words, title, (const char *const *)labels->at, labels->count);
    const size_t size = words->count;
    if (size <= LABELS_MAX)
        return STATUS_OK;
    bytes_clear(words);
    return problem_add(problem, STATUS_INVALID, "/labels",
                       "must have at most %d bytes in all, has about %zu", LABELS_MAX, size);
}

// The row of the job: its scene, its sender, and what of it is shown and searched.
static Status submit_fill(const Entry *entry, const Warnings *warnings, Problem *problem) {
    JobRow *row = &entry->job->row;
    const StudyRequest *request = &entry->request;
    const Simulation *simulation = &request->simulation;
    const Texts *labels = &simulation->labels;
    const bool has_key = entry->key[0] != '\0';
    Bytes scene = {0}, warned = {0}, uses = {0}, shown = {0}, words = {0};
    TRY(submit_write_words(&words, simulation->title, labels, problem));
    if (!job_id_make(row->id))
        return problem_set(problem, STATUS_INTERNAL, "no random numbers for a job's id");
    entry->job->indexed.key = row->id;
    row->created_unix_ms = clock_unix_ms();
    document_scene(&scene, request);
    document_warnings(&warned, warnings);
    references_write(&uses, request, false);
    submit_write_labels(&shown, labels);
    const Status all[] = {
        submit_take(&scene, &row->scene),
        submit_take(&warned, &row->warnings),
        submit_take(&uses, &row->uses),
        submit_take(&shown, &row->labels),
        submit_take(&words, &row->words),
        text_copy(simulation->title, &row->title),
        text_copy(request->study == NULL ? NULL : request->study->kind->name, &row->study),
        text_copy(entry->submission->client, &row->client),
        text_copy(has_key ? entry->key : NULL, &row->idempotency_key),
        text_copy(has_key ? entry->digest : NULL, &row->request),
        jobs_result_id(request, row->result, NULL)};
    return study_result(status_first(all, COUNT(all)), problem);
}

// Takes the text, "" as NULL, in place of the row's.
static void annotate_replace(char **member, Bytes *text) {
    free(*member);
    (void)submit_take(text, member);
}

Status jobs_annotate(JobManager *manager, const char *id, const char *title, const Texts *labels,
                     Problem *problem) {
    const Texts none = {NULL, 0};
    Bytes shown = {0}, array = {0}, title_words = {0}, label_words = {0};
    Status status = STATUS_OK;
    bytes_text(&shown, title != NULL ? title : "");
    if (title != NULL && title[0] != '\0')
        status = submit_write_words(&title_words, title, &none, problem);
    if (title_words.count == 0)
        bytes_text(&title_words, "\n"); // an empty title is an empty line of the words
    if (status == STATUS_OK && labels != NULL) {
        submit_write_labels(&array, labels);
        bytes_text(&label_words, ""); // none is not NULL
        status = submit_write_words(&label_words, NULL, labels, problem);
    }
    if (status == STATUS_OK &&
        (shown.is_failed || array.is_failed || title_words.is_failed || label_words.is_failed))
        status = study_result(STATUS_NO_MEMORY, problem);
    // The labels' words begin with the line of the title.
    const JobNotes notes = {.id = id,
                            .title = title,
                            .labels = labels == NULL ? NULL : array.at,
                            .title_words = title == NULL ? NULL : title_words.at,
                            .label_words = labels == NULL || label_words.count == 0
                                               ? label_words.at
                                               : label_words.at + (label_words.at[0] == '\n')};
    if (status == STATUS_OK)
        status = db_job_annotate(manager->db, &notes, problem);
    if (status == STATUS_OK) {
        pthread_mutex_lock(&manager->lock);
        Job *job = hashmap_find(manager->jobs, id);
        // While it is being written the writer has its texts, and then it is read from there.
        if (job != NULL && job->is_durable && !job->is_inserting && !job->is_ending) {
            if (title != NULL)
                annotate_replace(&job->row.title, &shown);
            if (labels != NULL)
                annotate_replace(&job->row.labels, &array);
        }
        pthread_mutex_unlock(&manager->lock);
    }
    bytes_clear(&shown);
    bytes_clear(&array);
    bytes_clear(&title_words);
    bytes_clear(&label_words);
    return status;
}

// *accepted is the new job or, where it was earlier, that of the same key.
static Status submit_scene(Entry *entry, const char *text, size_t size, Problem *problem) {
    JobManager *manager = entry->manager;
    QueueClient *client;
    TRY(client_enter(manager, entry->submission->client, &client, problem));
    Job *job = entry->job = job_new(manager);
    if (job == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    job->submitted_ns = clock_monotonic_ns();
    job->client = client;
    Warnings warnings = {NULL, 0};
    Status status = jobs_prepare_request(manager, text, size, &manager->settings.limits,
                                         &entry->request, &warnings, problem);
    if (status == STATUS_OK)
        status = submit_fill(entry, &warnings, problem);
    if (status == STATUS_OK) {
        const Status cached = entry->submission->retry_of != NULL
                                  ? STATUS_NOT_FOUND
                                  : submit_find_result(manager, job, problem);
        status = cached == STATUS_OK          ? submit_finish(entry, problem)
                 : cached == STATUS_NOT_FOUND ? submit_queue(entry, problem)
                                              : cached;
    }
    study_request_clear(&entry->request);
    warnings_clear(&warnings);
    return status;
}

// The sweep of a finished job, in this engine's version: failed points of another one cannot be
// computed. `row` is cleared by sweep_row_clear in any case.
static Status retry_find(JobManager *manager, const char *id, SweepRow *row, Problem *problem) {
    Job *job = NULL;
    StudyRequest request = {0};
    bool is_same;
    char result[72];
    memset(row, 0, sizeof *row);
    TRY(jobs_find(manager, id, &job, problem));
    const bool is_finished = job_is_finished(job);
    memcpy(result, job->row.result, sizeof result); // never changes
    job_unref(job);
    if (!is_finished)
        return problem_set(problem, STATUS_CONFLICT,
                           "the job %.40s is not finished: its failed points can be made again "
                           "when it is",
                           id);
    Status status = db_result_find(manager->db, result, problem);
    if (status == STATUS_NOT_FOUND) {
        problem_clear(problem);
        return problem_set(problem, STATUS_CONFLICT,
                           "the job %.40s has no result: submit its scene again", id);
    }
    TRY(status);
    TRY(db_sweep_load(manager->db, result, row, problem));
    status = jobs_prepare_stored(manager->db, row->scene, row->result, &request, &is_same, problem);
    if (status == STATUS_OK && !is_same)
        status = problem_set(problem, STATUS_GONE,
                             "the sweep was made by another engine version, this is %s: POST to "
                             "/v1/results/%.72s/again, which submits its scene again",
                             engine_version, row->result);
    study_request_clear(&request);
    return status;
}

// Submits the scene of a sweep whose failed points are opened again. A retry that is under way
// already is shared: no chunk of a sweep under way is opened.
static Status submit_retry(Entry *entry, Problem *problem) {
    JobManager *manager = entry->manager;
    SweepRow row;
    pthread_mutex_lock(&manager->retries);
    Status status = retry_find(manager, entry->submission->retry_of, &row, problem);
    if (status == STATUS_OK) {
        pthread_mutex_lock(&manager->lock);
        const bool is_under_way = submit_find_task(manager, row.result) != NULL;
        pthread_mutex_unlock(&manager->lock);
        if (!is_under_way)
            status = db_sweep_reopen(manager->db, row.result, problem);
    }
    if (status == STATUS_OK)
        status = submit_scene(entry, row.scene, strlen(row.scene), problem);
    pthread_mutex_unlock(&manager->retries);
    sweep_row_clear(&row);
    return status;
}

Status jobs_submit(JobManager *manager, const Submission *submission, Job **accepted,
                   Problem *problem) {
    Entry entry = {.manager = manager, .submission = submission};
    *accepted = NULL;
    TRY(key_read(submission, &entry, problem));
    Status status = key_find(&entry, problem);
    if (status == STATUS_OK && entry.earlier == NULL)
        status = submission->retry_of != NULL
                     ? submit_retry(&entry, problem)
                     : submit_scene(&entry, submission->text, submission->size, problem);
    const bool is_new = status == STATUS_OK && entry.earlier == NULL;
    *accepted = is_new ? entry.job : entry.earlier;
    if (!is_new)
        job_unref(entry.job);
    if (submission->is_replayed != NULL)
        *submission->is_replayed = status == STATUS_OK && !is_new;
    return status;
}

// Takes the row and the request.
static Status submit_resume(JobManager *manager, JobRow *row, StudyRequest *request,
                            Problem *problem) {
    Job *job = job_new(manager);
    QueueClient *client = queue_client(manager->queue, row->client != NULL ? row->client : "");
    const bool has_id = jobs_result_id(request, row->result, NULL) == STATUS_OK;
    Task *task = has_id ? submit_make_task(manager, row, request) : NULL;
    if (job == NULL || client == NULL || task == NULL) {
        job_unref(job);
        task_free(task);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the unfinished jobs");
    }
    // Its age counts as waiting.
    const int64_t age_ms = clock_unix_ms() - row->created_unix_ms;
    job->submitted_ns = clock_monotonic_ns() - (age_ms > 0 ? age_ms : 0) * 1000000;
    job->row = *row;
    *row = (JobRow){0};
    job->is_durable = true;
    job->row.state = JOB_ACCEPTED;
    job->client = client;
    job->indexed.key = job->row.id;
    job_admit(job);
    if (!submit_start(job, task))
        task_free(task);
    free(job->row.scene);
    job->row.scene = NULL;
    job_unref(job);
    return STATUS_OK;
}

Status jobs_resume(JobManager *manager, const char *id, Problem *problem) {
    JobRow row;
    StudyRequest request = {0};
    Warnings warnings = {NULL, 0};
    Problem fault;
    problem_clear(&fault);
    Status status = db_job_load_with_scene(manager->db, id, &row, &fault);
    const bool is_damaged = status == STATUS_INTERNAL;
    // A damaged index also leads to jobs that have ended: these stay as they are.
    if (status == STATUS_OK && job_state_is_final(row.state)) {
        job_row_clear(&row);
        return STATUS_OK;
    }
    if (status == STATUS_OK)
        status = jobs_prepare(manager->db, row.scene, strlen(row.scene), &manager->settings.limits,
                              &request, &warnings, &fault);
    if (status == STATUS_OK) {
        status = submit_resume(manager, &row, &request, problem);
    } else if (status == STATUS_INVALID || status == STATUS_UNREADABLE || is_damaged) {
        // The limits or the program changed meanwhile, or the row: the job's owner learns why.
        text_fit(row.id, sizeof row.id, id);
        row.state = JOB_FAILED;
        row.problem = problem_document(&fault);
        row.finished_unix_ms = clock_unix_ms();
        status = db_job_update(manager->db, &row, problem);
    } else {
        problem_set(problem, status, "%s", fault.detail);
    }
    job_row_clear(&row);
    study_request_clear(&request);
    warnings_clear(&warnings);
    return status;
}
