// Jobs and the tasks that compute for them: ids, references, subscribers, places in the tables of
// the manager, and the memory that running tasks share.
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "server/jobs/jobs_private.h"
#include "server/util/clock.h"

const char *const job_state_names[] = {"accepted", "running",   "successful",
                                       "failed",   "dismissed", NULL};

bool job_state_is_final(int state) {
    return state != JOB_ACCEPTED && state != JOB_RUNNING;
}

// Of two ids in one microsecond the second gets the next.
static int64_t job_id_us(void) {
    static atomic_int_fast64_t last;
    const int64_t now = clock_unix_us();
    int64_t before = atomic_load(&last), next;
    do {
        next = now > before ? now : before + 1;
    } while (!atomic_compare_exchange_weak(&last, &before, next));
    return next;
}

bool job_id_make(char id[40]) {
    static const char digits[] = "0123456789abcdef";
    uint64_t secret;
    if (getrandom(&secret, sizeof secret, 0) != (ssize_t)sizeof secret)
        return false;
    uint64_t time = (uint64_t)job_id_us();
    id[0] = 'j';
    id[1] = '-';
    for (int i = 15; i >= 2; i--, time >>= 4)
        id[i] = digits[time & 15];
    for (int i = 31; i >= 16; i--, secret >>= 4)
        id[i] = digits[secret & 15];
    id[JOB_ID_LENGTH] = '\0';
    return true;
}

int64_t job_id_unix_ms(const char *id) {
    if (strncmp(id, "j-", 2) != 0 || strlen(id) != JOB_ID_LENGTH ||
        strspn(id + 2, "0123456789abcdef") != JOB_ID_LENGTH - 2)
        return -1;
    char time[15] = "";
    memcpy(time, id + 2, 14);
    return strtoll(time, NULL, 16) / 1000;
}

bool subscribers_add(Subscribers *subscribers, const Callback *callback) {
    for (size_t i = 0; i < subscribers->count; i++)
        if (subscribers->at[i].context == callback->context)
            return true;
    Callback *grown = realloc(subscribers->at, (subscribers->count + 1) * sizeof *grown);
    if (grown == NULL)
        return false;
    subscribers->at = grown;
    grown[subscribers->count++] = *callback;
    return true;
}

void subscribers_call(Subscribers *subscribers) {
    for (size_t i = 0; i < subscribers->count; i++)
        subscribers->at[i].wake(subscribers->at[i].context);
    free(subscribers->at);
    *subscribers = (Subscribers){NULL, 0};
}

Job *job_new(JobManager *manager) {
    Job *job = calloc(1, sizeof *job);
    if (job == NULL)
        return NULL;
    atomic_init(&job->refcount, 1);
    job->manager = manager;
    return job;
}

Job *job_ref(Job *job) {
    atomic_fetch_add(&job->refcount, 1);
    return job;
}

void job_unref(Job *job) {
    if (job == NULL || atomic_fetch_sub(&job->refcount, 1) != 1)
        return;
    job_row_clear(&job->row);
    result_summary_unref(job->summary);
    free(job->subscribers.at);
    free(job);
}

void job_lock(Job *job) {
    if (job->manager != NULL)
        pthread_mutex_lock(&job->manager->lock);
}

void job_unlock(Job *job) {
    if (job->manager != NULL)
        pthread_mutex_unlock(&job->manager->lock);
}

bool job_is_finished(Job *job) {
    job_lock(job);
    const bool is_finished = job_state_is_final(job->row.state);
    job_unlock(job);
    return is_finished;
}

const char *job_client(const Job *job) {
    return job->row.client; // never changes
}

Status job_is_durable(Job *job, bool *is_durable, Problem *problem) {
    job_lock(job);
    *is_durable = job->is_durable;
    const Status status = job->is_durable ? STATUS_OK : job->refusal;
    if (status != STATUS_OK)
        problem_set(problem, status, "%s", job->refused);
    job_unlock(job);
    return status;
}

bool job_subscribe(Job *job, JobEvent event, const Callback *callback) {
    bool is_subscribed = true;
    job_lock(job);
    if (event == JOB_IS_FINISHED ? job_state_is_final(job->row.state)
                                 : job->is_durable || job->refusal != STATUS_OK)
        callback->wake(callback->context);
    else
        is_subscribed = subscribers_add(&job->subscribers, callback);
    job_unlock(job);
    return is_subscribed;
}

void job_unsubscribe(Job *job, const Callback *callback) {
    job_lock(job);
    Subscribers *subscribers = &job->subscribers;
    for (size_t i = 0; i < subscribers->count; i++)
        if (subscribers->at[i].context == callback->context) {
            subscribers->at[i] = subscribers->at[--subscribers->count];
            break;
        }
    job_unlock(job);
}

void job_admit(Job *job) {
    JobManager *manager = job->manager;
    job->scene_size = strlen(job->row.scene);
    hashmap_add(manager->jobs, &job_ref(job)->indexed);
    job->is_live = true;
    job->is_counted = true;
    manager->live++;
    job->client->live++;
    manager->scene_bytes += job->scene_size;
}

void job_release(Job *job) {
    if (!job->is_counted)
        return;
    job->is_counted = false;
    job->manager->live--;
    job->client->live--;
    job->manager->scene_bytes -= job->scene_size;
}

void job_retire(Job *job) {
    job_release(job);
    if (!job->is_live)
        return;
    job->is_live = false;
    hashmap_remove(job->manager->jobs, &job->indexed);
    job_unref(job);
}

void job_refuse(Job *job, Status status, const char *detail) {
    job->refusal = status;
    text_fit(job->refused, sizeof job->refused, detail);
    job->row.state = JOB_FAILED;
    subscribers_call(&job->subscribers);
    job_retire(job);
}

Status jobs_find(JobManager *manager, const char *id, Job **found, Problem *problem) {
    pthread_mutex_lock(&manager->lock);
    *found = hashmap_find(manager->jobs, id);
    if (*found != NULL)
        job_ref(*found);
    pthread_mutex_unlock(&manager->lock);
    if (*found != NULL)
        return STATUS_OK;
    Job *job = job_new(NULL);
    if (job == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    job->is_durable = true;
    Status status = db_job_load(manager->db, id, &job->row, problem);
    if (status == STATUS_OK && job->row.state == JOB_SUCCESSFUL && job->row.has_result)
        status = result_summary_load(manager->db, job->row.result, &job->summary, problem);
    if (status == STATUS_NOT_FOUND && job->row.has_result) { // deleted just now
        problem_clear(problem);
        job->row.has_result = false;
        status = STATUS_OK;
    }
    if (status != STATUS_OK) {
        job_unref(job);
        return status;
    }
    *found = job;
    return STATUS_OK;
}

// --- summaries of results ---

// The texts stand behind the struct, in one block.
ResultSummary *result_summary_new(const ResultRow *row) {
    const char *const texts[] = {row->plan, row->summary, row->work, row->notes};
    size_t bytes = sizeof(ResultSummary);
    for (size_t i = 0; i < COUNT(texts); i++)
        bytes += texts[i] != NULL ? strlen(texts[i]) + 1 : 0;
    ResultSummary *summary = malloc(bytes);
    if (summary == NULL)
        return NULL;
    char *at = (char *)(summary + 1);
    const char *copies[COUNT(texts)] = {NULL};
    for (size_t i = 0; i < COUNT(texts); i++) {
        if (texts[i] == NULL)
            continue;
        const size_t size = strlen(texts[i]) + 1;
        copies[i] = memcpy(at, texts[i], size);
        at += size;
    }
    summary->plan = copies[0];
    summary->summary = copies[1];
    summary->work = copies[2];
    summary->notes = copies[3];
    summary->bytes = bytes;
    atomic_init(&summary->refcount, 1);
    return summary;
}

Status result_summary_load(Db *db, const char *result, ResultSummary **summary, Problem *problem) {
    ResultRow row = {0};
    Status status = db_result_head(db, result, &row, problem);
    *summary = status == STATUS_OK ? result_summary_new(&row) : NULL;
    if (status == STATUS_OK && *summary == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the result's summary");
    result_row_clear(&row);
    return status;
}

ResultSummary *result_summary_ref(ResultSummary *summary) {
    if (summary != NULL)
        atomic_fetch_add(&summary->refcount, 1);
    return summary;
}

void result_summary_unref(ResultSummary *summary) {
    if (summary != NULL && atomic_fetch_sub(&summary->refcount, 1) == 1)
        free(summary);
}

// --- tasks ---

void run_result_clear(RunResult *run_result) {
    outcome_unref(run_result->outcome);
    fields_clear(study_answer_fields, &run_result->answer);
    result_row_clear(&run_result->result);
    free(run_result->problem);
    *run_result = (RunResult){0};
}

Task *task_new(JobManager *manager, const char *result) {
    Task *task = calloc(1, sizeof *task);
    if (task == NULL)
        return NULL;
    task->manager = manager;
    text_fit(task->result, sizeof task->result, result);
    task->indexed.key = task->result;
    return task;
}

void task_free(Task *task) {
    if (task == NULL)
        return;
    study_request_clear(&task->inquiry);
    run_result_clear(&task->run_result);
    result_summary_unref(task->summary);
    free(task->scene);
    free(task->warnings);
    free(task->result_waiters.at);
    free(task);
}

Task *task_of(QueueEntry *entry) {
    return (Task *)(void *)((char *)entry - offsetof(Task, queued));
}

bool task_is_shared(const Task *task) {
    const Variant *study = task->inquiry.study;
    return study != NULL && !task->recompute_only && study_has_members(study);
}

// Its client is charged for the scene's own run when that begins: the members of a study have turns
// of their own.
void task_estimate(Task *task) {
    const StudyRequest *inquiry = &task->inquiry;
    const Cost own = simulation_cost(&inquiry->simulation);
    Cost whole = own;
    // A series that is computed again needs no study.
    if (!task->recompute_only &&
        study_request_cost(inquiry, &task->manager->settings.limits, &whole, NULL) != STATUS_OK)
        whole.cpu_seconds = queue_quick; // the run will report it
    task->queued.seconds = whole.cpu_seconds;
    task->queued.charge = task_is_shared(task) ? own.cpu_seconds : 0;
    task->bytes = (uint64_t)fmin(whole.bytes, 1e18);
}

// Until when this thread's CPU time was counted.
static _Thread_local int64_t task_counted_ns;

void task_count_cpu(void) {
    task_counted_ns = clock_thread_cpu_ns();
}

// A series that is computed again was within the limits when it was computed first.
void task_allow_run(Task *task) {
    const double steps = task->manager->settings.limits.steps;
    task->cpu_seconds = task->recompute_only ? 0 : steps * SOLVER_STEP;
    task->shorten = "take a shorter duration, or fewer samples";
    atomic_store(&task->cpu_ns, 0);
    atomic_store(&task->is_too_long, false);
}

void task_allow_study(Task *task) {
    const JobManagerSettings *settings = &task->manager->settings;
    const Variant *study = task->inquiry.study;
    const double own = study_max_steps(study, &settings->limits) * SOLVER_STEP;
    const bool is_less = settings->study_seconds > 0 && !(own > 0 && own < settings->study_seconds);
    task->cpu_seconds = is_less ? settings->study_seconds : own;
    task->shorten = study_kind(study)->shorten;
}

bool task_is_wanted(void *context, double fraction) {
    Task *task = context;
    (void)fraction;
    const int64_t now_ns = clock_thread_cpu_ns(), more_ns = now_ns - task_counted_ns;
    task_counted_ns = now_ns;
    const double used = 1e-9 * (double)(atomic_fetch_add(&task->cpu_ns, more_ns) + more_ns);
    if (task->cpu_seconds > 0 && used > SIMULATION_PATIENCE * task->cpu_seconds)
        atomic_store(&task->is_too_long, true);
    return !atomic_load(&task->is_stopped) && !atomic_load(&task->is_too_long);
}

bool task_advance(void *context, double fraction) {
    Task *task = context;
    const double share = fraction < 0 ? 0 : fraction > 1 ? 1 : fraction;
    atomic_store(&task->progress, (unsigned)(share * 10000));
    return task_is_wanted(task, fraction);
}

Status task_result(const Task *task, Status status, Problem *problem) {
    if (status != STATUS_CANCELLED || !atomic_load(&task->is_too_long))
        return status;
    problem_clear(problem);
    return problem_set(problem, STATUS_LIMIT,
                       "took %g s of CPU, %d times the %g s that are allowed: %s",
                       SIMULATION_PATIENCE * task->cpu_seconds, SIMULATION_PATIENCE,
                       task->cpu_seconds, task->shorten);
}

void jobs_call_worker(JobManager *manager) {
    pthread_cond_signal(&manager->work);
    if (manager->slow_running >= manager->settings.workers)
        pthread_cond_signal(&manager->spare_work);
}

void task_enqueue(Task *task, QueueClient *client) {
    JobManager *manager = task->manager;
    hashmap_add(manager->tasks, &task->indexed);
    request_drop_records(&task->inquiry); // until it begins
    if (client == NULL)
        queue_push_front(manager->queue, &task->queued);
    else
        queue_put(manager->queue, &task->queued, client, 1e-9 * (double)clock_monotonic_ns());
    jobs_call_worker(manager);
}

// One budget for all that run. A task of no more than a worker's share of one half of it is not
// counted: there are at most as many as workers. All others share the other half, first come first
// served; one alone may exceed it, up to the limit of a run. A study holds its memory between its
// chunks, so it is counted in any case.
bool task_begin(Task *task) {
    JobManager *manager = task->manager;
    const uint64_t half = manager->settings.memory_bytes / 2;
    if (half == 0 || (task->bytes <= half / manager->settings.workers && !task_is_shared(task)))
        return true;
    if (manager->memory_waiters > 0 ||
        (manager->memory > 0 && manager->memory + task->bytes > half)) {
        task_wait(task);
        task->waits_for_memory = true;
        manager->memory_waiters++;
        return false;
    }
    manager->memory += task->bytes;
    task->has_memory = true;
    return true;
}

void task_wait(Task *task) {
    JobManager *manager = task->manager;
    if (task->is_waiting)
        return;
    task->is_waiting = true;
    task->next = NULL;
    if (manager->waiting == NULL)
        manager->waiting_last = &manager->waiting;
    *manager->waiting_last = task;
    manager->waiting_last = &task->next;
}

void task_unwait(Task *task) {
    JobManager *manager = task->manager;
    if (!task->is_waiting)
        return;
    Task **at = &manager->waiting;
    while (*at != task)
        at = &(*at)->next;
    *at = task->next;
    if (task->next == NULL)
        manager->waiting_last = at;
    manager->memory_waiters -= task->waits_for_memory;
    task->is_waiting = task->waits_for_memory = false;
}

void task_attach(Task *task, Job *job) {
    job->task = task;
    job->next_shared = task->jobs;
    task->jobs = job_ref(job);
    if (task->is_running) {
        job->row.state = JOB_RUNNING;
        job->row.started_unix_ms = clock_unix_ms();
        job->started_ns = clock_monotonic_ns();
    }
}

void job_detach(Job *job) {
    Task *task = job->task;
    if (task == NULL)
        return;
    JobManager *manager = job->manager;
    Job **at = &task->jobs;
    while (*at != job)
        at = &(*at)->next_shared;
    *at = job->next_shared;
    job->task = NULL;
    job->next_shared = NULL;
    job_unref(job);
    if (task->jobs != NULL || task->result_waiters.count > 0 || task->is_saving)
        return;
    // It has neither jobs nor readers. The next job of the same scene starts anew.
    hashmap_remove(manager->tasks, &task->indexed);
    if (!task->is_running) {
        queue_remove(manager->queue, &task->queued);
        task_unwait(task);
        task_free(task);
        return;
    }
    atomic_store(&task->is_stopped, true);
    if (task->workers == 0) { // a study between its chunks: a worker ends it
        queue_remove(manager->queue, &task->queued);
        queue_push_front(manager->queue, &task->queued);
        jobs_call_worker(manager);
    }
}

void task_release(Task *task) {
    hashmap_remove(task->manager->tasks, &task->indexed);
    while (task->jobs != NULL) {
        Job *job = task->jobs;
        task->jobs = job->next_shared;
        job->task = NULL;
        job->next_shared = NULL;
        job_retire(job);
        subscribers_call(&job->subscribers);
        job_unref(job);
    }
    subscribers_call(&task->result_waiters);
}

void jobs_end_write(JobManager *manager) {
    if (--manager->writes == 0)
        pthread_cond_broadcast(&manager->settled);
}

// --- metrics ---

void job_metrics_ended(JobMetrics *metrics, int state, bool is_cached) {
    counter_add(&metrics->ended[state], 1);
    if (is_cached)
        counter_add(&metrics->cached, 1);
}

void job_metrics_run(JobMetrics *metrics, const Outcome *outcome, int64_t cpu_ns) {
    size_t i = 0;
    while (solvers[i] != NULL && (outcome->plan.solver == NULL ||
                                  strcmp(solvers[i]->kind.name, outcome->plan.solver) != 0))
        i++;
    if (solvers[i] == NULL || i >= METRICS_SOLVERS)
        return;
    SolverMetrics *solver = &metrics->solvers[i];
    counter_add(&solver->runs, 1);
    counter_add(&solver->cpu_ns, cpu_ns > 0 ? (uint64_t)cpu_ns : 0);
    const char *work = (const char *)&outcome->work;
    for (size_t k = 0; work_counters_fields[k].kind == FIELD_KIND_COUNT && k < METRICS_WORK; k++)
        counter_add(&solver->work[k],
                    *(const uint64_t *)(const void *)(work + work_counters_fields[k].offset));
}

void job_metrics_study(JobMetrics *metrics, bool is_begun, int64_t cpu_ns) {
    counter_add(&metrics->study_runs, is_begun ? 1 : 0);
    counter_add(&metrics->study_cpu_ns, cpu_ns > 0 ? (uint64_t)cpu_ns : 0);
}
