// Rate limit: a bucket of jobs that fills steadily and holds those of one minute. Clients without a
// token share one client and have no rate limit; the limits of the queue apply to them.
//
// Retry-After: a place is free when the first running computation ends, which is predicted from its
// progress, the estimated CPU time and the recent bias of the estimates.
#include "server/jobs/limits.h"

#include <math.h>

#include "server/jobs/study.h"
#include "server/util/clock.h"

static double allowance(const JobManager *manager, const QueueClient *client) {
    const double most = manager->settings.rate;
    if (client->allowed_ns == 0)
        return most;
    const double passed = 1e-9 * (double)(clock_monotonic_ns() - client->allowed_ns);
    return fmin(most, client->allowance + passed * most / 60);
}

Status limits_add(JobManager *manager, QueueClient *client, Problem *problem) {
    if (!(manager->settings.rate > 0) || client->name[0] == '\0')
        return STATUS_OK;
    const double left = allowance(manager, client);
    if (left < 1)
        return problem_set(problem, STATUS_QUOTA,
                           "the token \"%.60s\" may send %.6g jobs a minute and has sent them",
                           client->name, manager->settings.rate);
    client->allowance = left - 1;
    client->allowed_ns = clock_monotonic_ns();
    return STATUS_OK;
}

Status limits_check(const JobManager *manager, const QueueClient *client, Problem *problem) {
    const size_t most = manager->settings.quota;
    if (most == 0 || client->name[0] == '\0' || client->live < most)
        return STATUS_OK;
    return problem_set(problem, STATUS_QUOTA,
                       "the token \"%.60s\" has %zu unfinished jobs, %zu are allowed; wait for "
                       "them or dismiss some",
                       client->name, client->live, most);
}

static bool is_of(const Task *task, const QueueClient *client) {
    for (const Job *job = task->jobs; job != NULL; job = job->next_shared)
        if (job->client == client)
            return true;
    return false;
}

// Until `computation`, which runs, will have ended.
static double left_of(const JobManager *manager, Task *task) {
    const double passed = 1e-9 * (double)(clock_monotonic_ns() - task->began_ns);
    const double done = atomic_load(&task->progress) / 10000.0;
    // The first part of a run may go faster than the rest.
    const double estimated = task->queued.seconds * manager->estimate_bias - passed;
    const double seen = done > 0.02 ? passed * (1 - done) / done : 0;
    return fmax(fmax(estimated, seen), 0);
}

int jobs_retry_after(JobManager *manager, const char *name, Status status) {
    double seconds = 0;
    pthread_mutex_lock(&manager->lock);
    const QueueClient *client = queue_client(manager->queue, name != NULL ? name : "");
    const bool is_own = status == STATUS_QUOTA && client != NULL;
    const bool is_many = is_own && limits_check(manager, client, NULL) != STATUS_OK;
    if (is_own && !is_many && manager->settings.rate > 0) {
        seconds = (1 - allowance(manager, client)) * 60 / manager->settings.rate;
    } else {
        double soonest = INFINITY;
        for (size_t i = 0; i < manager->worker_count; i++) {
            Task *running = manager->workers[i].running;
            if (running != NULL && (!is_own || is_of(running, client)))
                soonest = fmin(soonest, left_of(manager, running));
        }
        for (const StudyRun *run = manager->studies; run != NULL; run = run->next)
            if (!is_own || is_of(run->task, client))
                soonest = fmin(soonest, left_of(manager, run->task));
        // None of its jobs runs: their turn comes within what waits.
        seconds = isfinite(soonest) ? soonest
                                    : queue_seconds(manager->queue) * manager->estimate_bias /
                                          (double)manager->settings.workers;
    }
    pthread_mutex_unlock(&manager->lock);
    return seconds < 1 ? 1 : seconds > 3600 ? 3600 : (int)ceil(seconds);
}
