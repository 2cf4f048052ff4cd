// Every second it has the intake try again what there was no room for. Every few seconds it looks
// for what is to go, in the store and in memory, and goes on at once while there is something to
// remove, with a pause between the steps in which others write. What cannot be removed now is tried
// again the next time.
#include "server/jobs/maintenance.h"

#include <pthread.h>
#include <stdlib.h>
#include <time.h>

#include "server/util/clock.h"
#include "server/util/process.h"

enum { LOOK_MS = 5000, PAUSE_MS = 10, RETRY_MS = 1000 };

struct Maintenance {
    Db *db;
    JobManager *manager;
    KeepRules rules;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t wake;
    bool is_stopping;
};

// Until then, a second at most. False where it is to stop.
static bool pause_for(Maintenance *keeper, int64_t until_ns) {
    const int64_t retry_ns = clock_monotonic_ns() + RETRY_MS * 1000000LL;
    const int64_t end_ns = until_ns < retry_ns ? until_ns : retry_ns;
    const struct timespec end = {(time_t)(end_ns / 1000000000), (long)(end_ns % 1000000000)};
    pthread_mutex_lock(&keeper->lock);
    while (!keeper->is_stopping &&
           pthread_cond_timedwait(&keeper->wake, &keeper->lock, &end) == 0) {
    }
    const bool goes_on = !keeper->is_stopping;
    pthread_mutex_unlock(&keeper->lock);
    return goes_on;
}

static void *work(void *context) {
    Maintenance *keeper = context;
    int64_t next_ns = 0; // to look for what is to go
    uint64_t pages = 0;
    do {
        jobs_retry_writes(keeper->manager);
        if (clock_monotonic_ns() < next_ns)
            continue;
        Removed removed;
        const Status status = db_remove(keeper->db, &keeper->rules, &removed, NULL);
        for (size_t i = 0; status == STATUS_OK && i < removed.results; i++)
            jobs_forget(keeper->manager, removed.result[i]);
        const int64_t pause_ms = status == STATUS_OK && removed.is_more ? PAUSE_MS : LOOK_MS;
        process_trim_memory(&pages);
        next_ns = clock_monotonic_ns() + pause_ms * 1000000;
    } while (pause_for(keeper, next_ns));
    return NULL;
}

static void maintenance_free(Maintenance *keeper) {
    pthread_cond_destroy(&keeper->wake);
    pthread_mutex_destroy(&keeper->lock);
    free(keeper);
}

Status maintenance_start(Db *db, JobManager *manager, const KeepRules *rules, Maintenance **keeper,
                         Problem *problem) {
    *keeper = NULL;
    Maintenance *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the keeper");
    made->db = db;
    made->manager = manager;
    made->rules = *rules;
    pthread_mutex_init(&made->lock, NULL);
    pthread_condattr_t monotonic; // a clock that is set back makes no pause longer
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&made->wake, &monotonic);
    pthread_condattr_destroy(&monotonic);
    if (pthread_create(&made->thread, NULL, work, made) != 0) {
        maintenance_free(made);
        return problem_set(problem, STATUS_INTERNAL, "the keeper's thread cannot be started");
    }
    *keeper = made;
    return STATUS_OK;
}

void maintenance_stop(Maintenance *keeper) {
    if (keeper == NULL)
        return;
    pthread_mutex_lock(&keeper->lock);
    keeper->is_stopping = true;
    pthread_cond_signal(&keeper->wake);
    pthread_mutex_unlock(&keeper->lock);
    pthread_join(keeper->thread, NULL);
    maintenance_free(keeper);
}
