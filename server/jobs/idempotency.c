// draft-ietf-httpapi-idempotency-key-header: the key is a quoted string, "8e03...", but many send
// it bare. It stands in the job's row, unique for its client, so it lasts as long as the job does.
// Two requests of one key at once go one behind the other: the second finds the first one's job.
#include "server/jobs/idempotency.h"

#include <string.h>

#include "server/util/sha256.h"

static Status read_key(const char *text, char key[KEY_MAX + 1], Problem *problem) {
    size_t size = strlen(text);
    if (size >= 2 && text[0] == '"' && text[size - 1] == '"') {
        text++;
        size -= 2;
    }
    bool is_sound = size >= 1 && size <= KEY_MAX;
    for (size_t i = 0; i < size && is_sound; i++)
        is_sound = text[i] >= ' ' && text[i] <= '~' && text[i] != '"' && text[i] != '\\';
    if (!is_sound)
        return problem_set(problem, STATUS_USAGE,
                           "Idempotency-Key must be 1 to %d printable ASCII characters without "
                           "\" and \\, best a UUID in quotes; it has %zu",
                           KEY_MAX, size);
    memcpy(key, text, size);
    key[size] = '\0';
    return STATUS_OK;
}

static bool is_taken(const JobManager *manager, const IdempotencyHold *hold) {
    for (const IdempotencyHold *other = manager->keys; other != NULL; other = other->next)
        if (strcmp(other->key, hold->key) == 0 && strcmp(other->client, hold->client) == 0)
            return true;
    return false;
}

static Status check_same(const IdempotencyHold *hold, const JobRow *row, Problem *problem) {
    if (row->request != NULL && strcmp(row->request, hold->request) == 0)
        return STATUS_OK;
    return problem_set(problem, STATUS_REUSED,
                       "the Idempotency-Key \"%.80s\" was used with another body, for the job "
                       "%.40s; take a new key for a new request",
                       hold->key, row->id);
}

// With the lock held: *found is the job of that key which the store may not have yet, held, or
// NULL. Those that it has, or never will have, are let go.
static Status find_new(JobManager *manager, const IdempotencyHold *hold, Job **found,
                       Problem *problem) {
    Job *same = NULL;
    for (Job **at = &manager->keyed; *at != NULL;) {
        Job *job = *at;
        if (job->is_kept || job->refusal != STATUS_OK) {
            *at = job->next_keyed;
            job_unref(job);
            continue;
        }
        const char *client = job->row.client != NULL ? job->row.client : "";
        if (strcmp(job->row.idempotency_key, hold->key) == 0 && strcmp(client, hold->client) == 0)
            same = job;
        at = &job->next_keyed;
    }
    *found = NULL;
    if (same != NULL) {
        TRY(check_same(hold, &same->row, problem));
        *found = job_ref(same);
    }
    return STATUS_OK;
}

Status idempotency_begin(JobManager *manager, const Submission *submission, IdempotencyHold *hold,
                         Job **job, Problem *problem) {
    *job = NULL;
    hold->is_held = false;
    hold->key[0] = '\0';
    if (submission->idempotency_key == NULL)
        return STATUS_OK;
    hold->client = submission->client != NULL ? submission->client : "";
    TRY(read_key(submission->idempotency_key, hold->key, problem));
    Sha256 *digest = sha256_new();
    if (digest == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    if (submission->retry_of != NULL) {
        sha256_add(digest, "retry ", 6);
        sha256_add(digest, submission->retry_of, strlen(submission->retry_of));
    } else {
        sha256_add(digest, submission->text, submission->size);
    }
    sha256_end(digest, hold->request);

    pthread_mutex_lock(&manager->lock);
    while (is_taken(manager, hold))
        pthread_cond_wait(&manager->keys_free, &manager->lock);
    hold->next = manager->keys;
    manager->keys = hold;
    hold->is_held = true;
    const Status status = find_new(manager, hold, job, problem);
    pthread_mutex_unlock(&manager->lock);
    if (status != STATUS_OK || *job != NULL)
        return status;

    JobRow row;
    const Status known = db_job_keyed(manager->db, submission->client, hold->key, &row, problem);
    if (known == STATUS_NOT_FOUND) {
        problem_clear(problem);
        return STATUS_OK;
    }
    TRY(known);
    const Status same = check_same(hold, &row, problem);
    char id[40];
    text_fit(id, sizeof id, row.id);
    job_row_clear(&row);
    return same == STATUS_OK ? jobs_find(manager, id, job, problem) : same;
}

void idempotency_remember(JobManager *manager, const IdempotencyHold *hold, Job *job) {
    if (!hold->is_held)
        return;
    pthread_mutex_lock(&manager->lock);
    job->next_keyed = manager->keyed;
    manager->keyed = job_ref(job);
    pthread_mutex_unlock(&manager->lock);
}

void idempotency_end(JobManager *manager, IdempotencyHold *hold) {
    if (!hold->is_held)
        return;
    pthread_mutex_lock(&manager->lock);
    for (IdempotencyHold **at = &manager->keys; *at != NULL; at = &(*at)->next)
        if (*at == hold) {
            *at = hold->next;
            break;
        }
    pthread_cond_broadcast(&manager->keys_free);
    pthread_mutex_unlock(&manager->lock);
}
