#include "server/api/compare_side.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/reply.h"
#include "server/util/clock.h"

static const double wait_most = 60; // [s]

Status side_resolve(App *app, const char *name, const char *id, char result[72], Problem *problem) {
    Job *job = NULL;
    JobView show = {0};
    if (strncmp(id, "j-", 2) != 0) {
        snprintf(result, 72, "%s", id);
        return db_result_exists(app->db, result)
                   ? STATUS_OK
                   : problem_set(problem, STATUS_NOT_FOUND, "there is no result %.80s (\"%s\")", id,
                                 name);
    }
    TRY(jobs_find(app->manager, id, &job, problem));
    Status status = job_view(job, &show);
    job_unref(job);
    if (status != STATUS_OK)
        status = problem_set(problem, status, "the job cannot be shown");
    else if (show.state != JOB_SUCCESSFUL)
        status =
            problem_set(problem, STATUS_CONFLICT, "the job %s (\"%s\") has no result: it is %s",
                        show.id, name, job_state_names[show.state]);
    else
        snprintf(result, 72, "%s", show.result);
    job_view_clear(&show);
    return status;
}

Sides sides_begin(const Request *request) {
    Sides sides = {{NULL}, NULL, NULL};
    if (request->kept == NULL)
        return sides;
    sides = *(const Sides *)request->kept;
    free(request->kept);
    return sides;
}

void sides_end(Sides *sides) {
    for (size_t i = 0; i < SIDES; i++)
        outcome_unref(sides->outcomes[i]);
    if (sides->release != NULL)
        sides->release(sides->asked);
    *sides = (Sides){{NULL}, NULL, NULL};
}

static void forget(void *kept) {
    sides_end(kept);
    free(kept);
}

static Status sleep_on(const Request *request, Reply *reply, Sides *sides, Problem *problem) {
    const double left = wait_most - 1e-9 * (double)(clock_monotonic_ns() - request->started_ns);
    if (left <= 0 || request->is_expired) {
        reply->retry_after = 5;
        return problem_set(problem, STATUS_BUSY,
                           "the series are still being computed anew; ask again a little later");
    }
    Sides *kept = malloc(sizeof *kept);
    if (kept == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory to wait for the series");
    *kept = *sides;
    *sides = (Sides){{NULL}, NULL, NULL};
    reply_wait(reply, (int)(1000 * left) + 1, kept, forget);
    return STATUS_OK;
}

Status sides_outcomes(App *app, const Request *request, Reply *reply, size_t count,
                      char results[][72], Sides *sides, bool *is_waiting, Problem *problem) {
    *is_waiting = false;
    for (size_t i = 0; i < count; i++) {
        if (sides->outcomes[i] == NULL)
            TRY(jobs_outcome(app->manager, results[i], request->callback, &sides->outcomes[i],
                             problem));
        *is_waiting = *is_waiting || sides->outcomes[i] == NULL;
    }
    return *is_waiting ? sleep_on(request, reply, sides, problem) : STATUS_OK;
}
