// How a scene becomes a job. Cached results finish it at once, equal scenes share one task, and
// unfinished jobs of the database are resumed in the same way. A job with a key, of a study or of a
// scene that names a record is inserted before it is queued: the database then arbitrates between
// requests of one key, keeps the rows of a sweep, and does not let the record be deleted.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/jobs/documents.h"
#include "server/jobs/idempotency.h"
#include "server/jobs/job_id.h"
#include "server/jobs/jobs_private.h"
#include "server/jobs/limits.h"
#include "server/json/encode.h"
#include "server/util/bytes.h"
#include "server/util/clock.h"

// All labels of a job, in bytes.
enum { LABELS_MAX = 8192 };

// A submission on its way to becoming a job.
typedef struct Entry {
    JobManager *manager;
    Job *job;
    StudyRequest inquiry;
    bool is_retry; // of a sweep: whatever is cached, it is computed
    IdempotencyKey key;
    Job *earlier; // of the same key
} Entry;

// With the lock held: the task of this scene, to be shared. One for readers alone saves nothing.
static Task *submit_find_task(const JobManager *manager, const char *result) {
    Task *task = hashmap_find(manager->tasks, result);
    return task != NULL && task->recompute_only ? NULL : task;
}

// Plan, summary, work and notes of a result that is there already. STATUS_NOT_FOUND if it is not.
static Status submit_find_result(JobManager *manager, Job *job, Problem *problem) {
    pthread_mutex_lock(&manager->lock);
    job->summary = cache_head(manager->cache, job->row.result);
    const bool is_computed =
        job->summary == NULL && submit_find_task(manager, job->row.result) != NULL;
    pthread_mutex_unlock(&manager->lock);
    if (job->summary != NULL)
        return STATUS_OK;
    if (is_computed)
        return STATUS_NOT_FOUND;
    ResultRow row = {0};
    const Status status = db_result_head(manager->db, job->row.result, &row, NULL);
    if (status == STATUS_OK)
        job->summary = result_summary_new(&row);
    result_row_clear(&row);
    pthread_mutex_lock(&manager->lock);
    manager->rows.hits += status == STATUS_OK;
    manager->rows.misses += status == STATUS_NOT_FOUND;
    if (job->summary != NULL)
        cache_put(manager->cache, job->row.result, NULL, job->summary);
    pthread_mutex_unlock(&manager->lock);
    if (status == STATUS_OK || status == STATUS_NOT_FOUND)
        return status;
    return problem_set(problem, status, "the results could not be searched");
}

static bool submit_inserts_first(const Job *job) {
    return job->row.idempotency_key != NULL || job->row.study != NULL || job->row.uses != NULL;
}

// Inserts the job and waits. Where another request with the same key was earlier, entry->earlier is
// its job.
static Status submit_insert(Entry *entry, StudyRequest *inquiry, Problem *problem) {
    const Status status = job_insert_now(entry->job, problem);
    if (status != STATUS_CONFLICT)
        return status;
    problem_clear(problem);
    TRY(idempotency_find(entry->manager, &entry->key, &entry->earlier, problem));
    if (entry->earlier != NULL)
        return STATUS_OK;
    // Otherwise a record was deleted just now.
    request_drop_records(inquiry);
    TRY(request_load_records(entry->manager->db, inquiry, problem));
    return problem_add(problem, STATUS_INVALID, "/excitation",
                       "names a record that was deleted just now");
}

static Status submit_finish(Entry *entry, Problem *problem) {
    JobManager *manager = entry->manager;
    Job *job = entry->job;
    JobRow *row = &job->row;
    row->state = JOB_SUCCESSFUL;
    row->is_cached = true;
    row->started_unix_ms = row->finished_unix_ms = clock_unix_ms();
    row->total = 1e-9 * (double)(clock_monotonic_ns() - job->submitted_ns);
    if (row->idempotency_key != NULL)
        TRY(submit_insert(entry, &entry->inquiry, problem));
    else {
        pthread_mutex_lock(&manager->lock);
        job_insert(job);
        pthread_mutex_unlock(&manager->lock);
    }
    if (entry->earlier == NULL)
        job_metrics_ended(&manager->metrics, JOB_SUCCESSFUL, true);
    return STATUS_OK;
}

// With the lock held: whether there is room in the queue.
static Status submit_check_room(const JobManager *manager, const Job *job, Problem *problem) {
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

// The task of this scene, without jobs. Takes the inquiry. NULL without memory.
static Task *submit_make_task(JobManager *manager, const JobRow *row, StudyRequest *inquiry) {
    Task *task = task_new(manager, row->result);
    if (task != NULL) {
        task->scene = strdup(row->scene);
        task->warnings = strdup(row->warnings);
        task->inquiry = *inquiry;
        *inquiry = (StudyRequest){0};
        if (task->scene != NULL && task->warnings != NULL)
            return task;
    }
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
    Task *task = submit_make_task(manager, &job->row, &entry->inquiry);
    if (task == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    const bool inserts_first = submit_inserts_first(job);
    bool is_queued = false, is_cached = false;
    pthread_mutex_lock(&manager->lock);
    // It may have been saved meanwhile.
    if (!entry->is_retry && submit_find_task(manager, job->row.result) == NULL)
        is_cached = (job->summary = cache_head(manager->cache, job->row.result)) != NULL;
    Status status = is_cached ? STATUS_OK : submit_check_room(manager, job, problem);
    if (status == STATUS_OK && !is_cached) {
        job_admit(job);
        if (!inserts_first)
            is_queued = submit_start(job, task);
    }
    pthread_mutex_unlock(&manager->lock);
    if (status == STATUS_OK && is_cached) {
        entry->inquiry = task->inquiry;
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

// As a JSON array; "" if there are none.
static char *submit_write_labels(const Texts *labels) {
    Bytes bytes = {0};
    for (size_t i = 0; i < labels->count; i++) {
        bytes_text(&bytes, i > 0 ? ", " : "[");
        bytes_json_string(&bytes, labels->at[i]);
    }
    bytes_text(&bytes, labels->count > 0 ? "]" : "");
    return bytes_take(&bytes, NULL);
}

// What a search by words looks into.
static Status submit_write_words(const char *title, const Texts *labels, char **text,
                                 Problem *problem) {
    Bytes words = {0};
    job_words(&words, title, (const char *const *)labels->at, labels->count);
    const size_t size = words.count;
    *text = size <= LABELS_MAX ? bytes_take(&words, NULL) : NULL;
    bytes_clear(&words);
    if (size > LABELS_MAX)
        return problem_add(problem, STATUS_INVALID, "/labels",
                           "must have at most %d bytes in all, has about %zu", LABELS_MAX, size);
    return *text != NULL ? STATUS_OK
                         : problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
}

// NULL in place of an empty text.
static char *submit_drop_empty(char *text) {
    if (text != NULL && text[0] != '\0')
        return text;
    free(text);
    return NULL;
}

// Title, labels and study, as they are shown and searched.
static Status submit_fill_notes(JobRow *row, const StudyRequest *inquiry, Problem *problem) {
    const Simulation *simulation = &inquiry->simulation;
    TRY(submit_write_words(simulation->title, &simulation->labels, &row->words, problem));
    row->words = submit_drop_empty(row->words);
    row->labels = submit_drop_empty(submit_write_labels(&simulation->labels));
    row->title = simulation->title == NULL ? NULL : strdup(simulation->title);
    row->study = inquiry->study == NULL ? NULL : strdup(inquiry->study->kind->name);
    return (row->title != NULL || simulation->title == NULL) &&
                   (row->labels != NULL || simulation->labels.count == 0) &&
                   (row->study != NULL || inquiry->study == NULL)
               ? STATUS_OK
               : STATUS_NO_MEMORY;
}

// Takes *text, "" as NULL, in place of the row's.
static void annotate_replace(char **member, char **text) {
    if (*text == NULL)
        return;
    free(*member);
    *member = submit_drop_empty(*text);
    *text = NULL;
}

Status jobs_annotate(JobManager *manager, const char *id, const char *title, const Texts *labels,
                     Problem *problem) {
    const Texts none = {NULL, 0};
    char *title_words = NULL, *label_words = NULL, *array = NULL;
    char *copy = title != NULL ? strdup(title) : NULL;
    Status status = title != NULL ? submit_write_words(title[0] != '\0' ? title : NULL, &none,
                                                       &title_words, problem)
                                  : STATUS_OK;
    if (status == STATUS_OK && labels != NULL) {
        array = submit_write_labels(labels);
        status = submit_write_words(NULL, labels, &label_words, problem);
    }
    if (status == STATUS_OK &&
        ((title != NULL && copy == NULL) || (labels != NULL && array == NULL)))
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the job");
    // An empty title is an empty line of the words; the labels' words begin with that line.
    const JobNotes notes = {
        .id = id,
        .title = copy,
        .labels = array,
        .title_words = title_words != NULL && title_words[0] == '\0' ? "\n" : title_words,
        .label_words =
            label_words != NULL && label_words[0] == '\n' ? label_words + 1 : label_words};
    if (status == STATUS_OK)
        status = db_job_annotate(manager->db, &notes, problem);
    if (status == STATUS_OK) {
        pthread_mutex_lock(&manager->lock);
        Job *job = hashmap_find(manager->jobs, id);
        // While it is being written the writer has its texts, and then it is read from there.
        if (job != NULL && job->is_durable && !job->is_inserting && !job->is_ending) {
            annotate_replace(&job->row.title, &copy);
            annotate_replace(&job->row.labels, &array);
        }
        pthread_mutex_unlock(&manager->lock);
    }
    free(copy);
    free(array);
    free(title_words);
    free(label_words);
    return status;
}

static Status submit_fill_sender(JobRow *row, const IdempotencyKey *key) {
    const bool has_key = key->key[0] != '\0';
    row->client = key->client == NULL ? NULL : strdup(key->client);
    row->idempotency_key = has_key ? strdup(key->key) : NULL;
    row->request = has_key ? strdup(key->request) : NULL;
    return (row->client == NULL && key->client != NULL) ||
                   (has_key && (row->idempotency_key == NULL || row->request == NULL))
               ? STATUS_NO_MEMORY
               : STATUS_OK;
}

static Status submit_fill_job(Job *job, const StudyRequest *inquiry, const Warnings *warnings,
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
    references_write(&uses, inquiry, false);
    const bool has_uses = uses.count > 0;
    row->uses = bytes_take(&uses, NULL);
    if (row->uses != NULL && !has_uses) {
        free(row->uses);
        row->uses = NULL;
    }
    TRY(submit_fill_notes(row, inquiry, problem));
    if (row->result[0] == '\0' || (has_uses && row->uses == NULL) || row->scene == NULL ||
        row->warnings == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    return STATUS_OK;
}

static void submit_fail_row(JobRow *row, const Problem *problem) {
    Bytes bytes = {.most = 1 << 20};
    encode_problem(&bytes, problem, encode_problem_code(problem->status), NULL);
    row->state = JOB_FAILED;
    row->problem = bytes_take(&bytes, NULL);
    row->finished_unix_ms = clock_unix_ms();
}

// The client of the queue, if it may submit one more now. Those without a token are one client.
static Status submit_enter_client(JobManager *manager, const char *name, QueueClient **client,
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
    return submit_enter_client(manager, client, &charged, problem);
}

// *accepted is the new job or, where it was earlier, that of the same key.
static Status submit_scene(JobManager *manager, const Submission *submission,
                           const IdempotencyKey *key, Job **accepted, bool *is_replayed,
                           Problem *problem) {
    Entry entry = {.manager = manager, .is_retry = submission->retry_of != NULL, .key = *key};
    QueueClient *client;
    TRY(submit_enter_client(manager, submission->client, &client, problem));
    Job *job = entry.job = job_new(manager);
    if (job == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    job->submitted_ns = clock_monotonic_ns();
    job->client = client;
    Warnings warnings = {NULL, 0};
    Status status =
        jobs_prepare_request(manager, submission->text, submission->size, &manager->settings.limits,
                             &entry.inquiry, &warnings, problem);
    if (status == STATUS_OK)
        status = submit_fill_job(job, &entry.inquiry, &warnings, problem);
    if (status == STATUS_OK && (status = submit_fill_sender(&job->row, key)) != STATUS_OK)
        problem_set(problem, status, "no memory for a job");
    if (status == STATUS_OK) {
        const Status cached =
            entry.is_retry ? STATUS_NOT_FOUND : submit_find_result(manager, job, problem);
        status = cached == STATUS_OK          ? submit_finish(&entry, problem)
                 : cached == STATUS_NOT_FOUND ? submit_queue(&entry, problem)
                                              : cached;
    }
    study_request_clear(&entry.inquiry);
    warnings_clear(&warnings);
    *is_replayed = status == STATUS_OK && entry.earlier != NULL;
    if (status == STATUS_OK && entry.earlier == NULL) {
        *accepted = job;
        return STATUS_OK;
    }
    job_unref(job);
    *accepted = entry.earlier;
    return status;
}

static Status retry_find(JobManager *manager, const char *id, SweepRow *row, Problem *problem) {
    Job *job = NULL;
    char result[72];
    TRY(jobs_find(manager, id, &job, problem));
    const bool is_finished = job_is_finished(job);
    memcpy(result, job->row.result, sizeof result); // never changes
    job_unref(job);
    if (!is_finished)
        return problem_set(problem, STATUS_CONFLICT,
                           "the job %.40s is not finished: its failed points can be made again "
                           "when it is",
                           id);
    TRY(db_sweep_load(manager->db, result, row, problem));
    if (!db_result_exists(manager->db, result))
        return problem_set(problem, STATUS_CONFLICT,
                           "the sweep was not brought to an end: submit its scene again");
    return STATUS_OK;
}

// Failed points of another engine version cannot be computed by this one.
static Status retry_check_engine(JobManager *manager, const SweepRow *row, Problem *problem) {
    StudyRequest inquiry = {0};
    Warnings warnings = {NULL, 0};
    char result[72] = "";
    Status status = jobs_prepare(manager->db, row->scene, strlen(row->scene), NULL, &inquiry,
                                 &warnings, problem);
    if (status == STATUS_OK)
        jobs_result_id(&inquiry, result);
    if (status == STATUS_OK && strcmp(result, row->result) != 0)
        status = problem_set(problem, STATUS_GONE,
                             "the sweep was made by another engine version, this is %s: POST to "
                             "/v1/results/%.72s/again, which submits its scene anew",
                             engine_version, row->result);
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    return status;
}

// With the lock of retries held, so that no chunk of a sweep under way is opened.
static Status retry_reopen(JobManager *manager, const char *result, Problem *problem) {
    pthread_mutex_lock(&manager->lock);
    const Task *task = hashmap_find(manager->tasks, result);
    const bool is_under_way = task != NULL && !task->recompute_only;
    pthread_mutex_unlock(&manager->lock);
    return is_under_way ? STATUS_OK : db_sweep_reopen(manager->db, result, problem);
}

// The sweep of the finished job `id` with its failed points to be made again. A retry that is under
// way already is shared. `row` is cleared by sweep_row_clear in any case.
static Status retry_open(JobManager *manager, const char *id, SweepRow *row, Problem *problem) {
    memset(row, 0, sizeof *row);
    TRY(retry_find(manager, id, row, problem));
    TRY(retry_check_engine(manager, row, problem));
    return retry_reopen(manager, row->result, problem);
}

static Status submit_retry(JobManager *manager, const Submission *submission,
                           const IdempotencyKey *key, Job **accepted, bool *is_replayed,
                           Problem *problem) {
    SweepRow row;
    pthread_mutex_lock(&manager->retries);
    Status status = retry_open(manager, submission->retry_of, &row, problem);
    if (status == STATUS_OK) {
        Submission scene = *submission;
        scene.text = row.scene;
        scene.size = strlen(row.scene);
        status = submit_scene(manager, &scene, key, accepted, is_replayed, problem);
    }
    pthread_mutex_unlock(&manager->retries);
    sweep_row_clear(&row);
    return status;
}

Status jobs_submit(JobManager *manager, const Submission *submission, Job **accepted,
                   Problem *problem) {
    IdempotencyKey key;
    bool is_replayed = false;
    *accepted = NULL;
    TRY(idempotency_read(submission, &key, problem));
    TRY(idempotency_find(manager, &key, accepted, problem));
    Status status = STATUS_OK;
    if (*accepted != NULL)
        is_replayed = true;
    else if (submission->retry_of != NULL)
        status = submit_retry(manager, submission, &key, accepted, &is_replayed, problem);
    else
        status = submit_scene(manager, submission, &key, accepted, &is_replayed, problem);
    if (submission->is_replayed != NULL)
        *submission->is_replayed = is_replayed;
    return status;
}

// Takes the row and the inquiry.
static Status submit_resume(JobManager *manager, JobRow *row, StudyRequest *inquiry,
                            Problem *problem) {
    Job *job = job_new(manager);
    QueueClient *client = queue_client(manager->queue, row->client != NULL ? row->client : "");
    jobs_result_id(inquiry, row->result);
    Task *task = row->result[0] != '\0' ? submit_make_task(manager, row, inquiry) : NULL;
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

Status jobs_take_up(JobManager *manager, JobRow *row, Problem *problem) {
    Problem *fault = calloc(1, sizeof *fault);
    StudyRequest inquiry = {0};
    Warnings warnings = {NULL, 0};
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the unfinished jobs");
    Status status = jobs_prepare(manager->db, row->scene, strlen(row->scene),
                                 &manager->settings.limits, &inquiry, &warnings, fault);
    if (status == STATUS_OK) {
        status = submit_resume(manager, row, &inquiry, problem);
    } else if (status == STATUS_INVALID || status == STATUS_UNREADABLE) {
        // The limits or the program changed meanwhile: the job's owner learns why.
        submit_fail_row(row, fault);
        status = db_job_update(manager->db, row, problem);
    } else {
        problem_set(problem, status, "%s", fault->detail);
    }
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    free(fault);
    return status;
}
