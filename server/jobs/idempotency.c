// draft-ietf-httpapi-idempotency-key-header: the key is a quoted string, "8e03...", but many
// clients send it bare. It is in the job's row, unique for its client, so it lasts as long as the
// job. Such a job is inserted before anything else is done for it: of two requests at once the
// second one's insertion fails, and it finds the job of the first.
#include "server/jobs/idempotency.h"

#include <string.h>

#include "server/jobs/jobs_private.h"
#include "server/util/sha256.h"

static Status idempotency_read_key(const char *text, char key[KEY_MAX + 1], Problem *problem) {
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
    memcpy(key, text, size);
    key[size] = '\0';
    return STATUS_OK;
}

Status idempotency_read(const Submission *submission, IdempotencyKey *key, Problem *problem) {
    *key = (IdempotencyKey){.client = submission->client};
    if (submission->idempotency_key == NULL)
        return STATUS_OK;
    TRY(idempotency_read_key(submission->idempotency_key, key->key, problem));
    Sha256 *digest = sha256_new();
    if (digest == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    if (submission->retry_of != NULL) {
        sha256_add(digest, "retry ", 6);
        sha256_add(digest, submission->retry_of, strlen(submission->retry_of));
    } else {
        sha256_add(digest, submission->text, submission->size);
    }
    sha256_end(digest, key->request);
    return STATUS_OK;
}

Status idempotency_find(JobManager *manager, const IdempotencyKey *key, Job **job,
                        Problem *problem) {
    JobRow row;
    *job = NULL;
    if (key->key[0] == '\0')
        return STATUS_OK;
    Status status = db_job_keyed(manager->db, key->client, key->key, &row, problem);
    if (status == STATUS_NOT_FOUND) {
        problem_clear(problem);
        return STATUS_OK;
    }
    TRY(status);
    if (row.request != NULL && strcmp(row.request, key->request) == 0)
        status = jobs_find(manager, row.id, job, problem);
    else
        status = problem_set(problem, STATUS_REUSED,
                             "the Idempotency-Key \"%.80s\" was used with another body, for the "
                             "job %.40s; take a new key for a new request",
                             key->key, row.id);
    job_row_clear(&row);
    return status;
}
