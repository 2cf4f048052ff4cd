// What a job costs beside its computation, without HTTP: the core alone in a loop, new jobs through
// the intake until they are durable, known scenes, and what making rows durable costs by the
// commit's size and the ids' order. One table; the disk's own figures stand in it.
//
//     bench_intake [DIRECTORY] [SECONDS] [jobs]
//
// With "jobs" the rows are left out: for a profile.
#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "core/math/fft.h"
#include "server/jobs/jobs.h"
#include "server/util/clock.h"

enum { CLIENTS = 64 };

static double seconds = 2;
static char folder[4000];
static Problem problem;

static double now(void) {
    return 1e-9 * (double)clock_monotonic_ns();
}

static double cpu(void) {
    return (double)clock() / CLOCKS_PER_SEC; // of all threads
}

static int scene_text(char target[2400], unsigned number) {
    char filler[1500];
    memset(filler, 'x', sizeof filler - 1);
    filler[sizeof filler - 1] = '\0';
    return snprintf(target, 2400,
                    "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092},"
                    " \"dampers\": [{\"mass\": 0.1107, \"clearance\": %.17g, \"buffer\": "
                    "\"sponge\"}], \"excitation\": {\"kind\": \"free\", \"displacement\": 0.015},"
                    " \"duration\": 10, \"sample_rate\": 1000,"
                    " \"output\": {\"channels\": [], \"psd\": null, \"impacts\": false},"
                    " \"labels\": [\"%.*s\"]}",
                    0.015 + 1e-9 * number, number == 0 ? 1450 : 60, filler);
}

static void stop(const char *what) {
    fprintf(stderr, "bench_intake: %s: %s\n", what, problem.detail);
    exit(1);
}

static void measure_core(Db *db) {
    char text[2400];
    StudyRequest inquiry = {0};
    Warnings warnings = {NULL, 0};
    const int size = scene_text(text, 1);
    if (jobs_prepare(db, text, (size_t)size, NULL, &inquiry, &warnings, &problem) != STATUS_OK)
        stop("the scene");
    Workspace workspace = {0};
    size_t count = 0;
    const double began = now();
    double took;
    do {
        Outcome *outcome = NULL;
        if (simulation_run(&inquiry.simulation, NULL, NULL, &workspace, &outcome, &problem) !=
            STATUS_OK)
            stop("the core");
        outcome_unref(outcome);
        count++;
        took = now() - began;
    } while (took < seconds);
    printf("%-44s %10.0f /s %8.2f us\n", "core alone, one thread", (double)count / took,
           1e6 * took / (double)count);
    workspace_clear(&workspace);
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
}

typedef struct QueueClient {
    JobManager *manager;
    pthread_mutex_t lock;
    pthread_cond_t woken;
    bool is_woken;
    size_t count;
    double end;
} QueueClient;

static atomic_uint next_number = 1;

static void wake(void *context) {
    QueueClient *client = context;
    pthread_mutex_lock(&client->lock);
    client->is_woken = true;
    pthread_cond_signal(&client->woken);
    pthread_mutex_unlock(&client->lock);
}

// New jobs, each until it is finished and durable.
static void *submit_new(void *context) {
    QueueClient *client = context;
    Problem *fault = calloc(1, sizeof *fault);
    char text[2400];
    while (fault != NULL && now() < client->end) {
        const int size = scene_text(text, atomic_fetch_add(&next_number, 1));
        const Submission submission = {.text = text, .size = (size_t)size};
        const Callback callback = {client, wake};
        Job *job = NULL;
        client->is_woken = false;
        problem_clear(fault);
        if (jobs_submit(client->manager, &submission, &job, fault) != STATUS_OK)
            continue;
        (void)job_subscribe(job, JOB_IS_FINISHED, &callback);
        pthread_mutex_lock(&client->lock);
        while (!client->is_woken)
            pthread_cond_wait(&client->woken, &client->lock);
        pthread_mutex_unlock(&client->lock);
        bool is_kept = false;
        client->count += job_is_durable(job, &is_kept, fault) == STATUS_OK && is_kept;
        job_unref(job);
    }
    free(fault);
    return NULL;
}

static void measure_jobs(Db *db, size_t workers, size_t clients) {
    static QueueClient all[CLIENTS];
    pthread_t threads[CLIENTS];
    const JobManagerSettings settings = {.workers = workers,
                                         .queue_most = 10000,
                                         .cache_bytes = (size_t)64 << 20,
                                         .limits = {.samples = 1 << 25, .impacts = 500000}};
    JobManager *manager;
    if (jobs_open(db, &settings, &manager, &problem) != STATUS_OK)
        stop("the intake");
    const double began = now(), cpu_began = cpu();
    for (size_t i = 0; i < clients; i++) {
        all[i] = (QueueClient){.manager = manager, .end = began + seconds};
        pthread_mutex_init(&all[i].lock, NULL);
        pthread_cond_init(&all[i].woken, NULL);
        if (pthread_create(&threads[i], NULL, submit_new, &all[i]) != 0)
            stop("a thread");
    }
    size_t count = 0;
    for (size_t i = 0; i < clients; i++) {
        pthread_join(threads[i], NULL);
        count += all[i].count;
    }
    const double took = now() - began;
    char name[64];
    snprintf(name, sizeof name, "new jobs, durable, %zu clients, %zu workers", clients, workers);
    printf("%-44s %10.0f /s %8.2f us of CPU\n", name, (double)count / took,
           1e6 * (cpu() - cpu_began) / (double)count);
    jobs_close(manager);
}

// Until the job is finished; false where it computed something.
static bool submit_known(JobManager *manager, const Submission *submission) {
    Job *job = NULL;
    JobView show;
    if (jobs_submit(manager, submission, &job, &problem) != STATUS_OK)
        stop("a scene");
    while (!job_is_finished(job))
        nanosleep(&(struct timespec){0, 1000000}, NULL);
    if (job_view(job, &show) != STATUS_OK)
        stop("a job");
    const bool is_cached = show.row.is_cached;
    job_view_clear(&show);
    job_unref(job);
    return is_cached;
}

static void measure_known(Db *db) {
    char text[2400];
    const int size = scene_text(text, 0);
    const Submission submission = {.text = text, .size = (size_t)size};
    const JobManagerSettings settings = {.workers = 1,
                                         .queue_most = 10000,
                                         .cache_bytes = (size_t)64 << 20,
                                         .limits = {.samples = 1 << 25, .impacts = 500000}};
    JobManager *manager;
    if (jobs_open(db, &settings, &manager, &problem) != STATUS_OK)
        stop("the intake");
    bool is_cached = false;
    while (!is_cached)
        is_cached = submit_known(manager, &submission);
    size_t count = 0;
    const double began = now(), cpu_began = cpu();
    do {
        if (!submit_known(manager, &submission))
            stop("a cached scene");
        count++;
    } while (now() - began < seconds);
    const double took = now() - began;
    printf("%-44s %10.0f /s %8.2f us of CPU with its row, durable\n",
           "cached scenes of 2 KB, one thread", (double)count / took,
           1e6 * (cpu() - cpu_began) / (double)count);
    jobs_close(manager);
}

static void measure_disk(void) {
    char path[4100], page[4096] = {1};
    snprintf(path, sizeof path, "%s/sync", folder);
    const int file = open(path, O_RDWR | O_CREAT | O_TRUNC, 0600);
    double took[200];
    size_t count = 0;
    for (; file >= 0 && count < COUNT(took); count++) {
        const double began = now();
        if (pwrite(file, page, sizeof page, (off_t)(count * sizeof page)) < 0 ||
            fdatasync(file) != 0)
            break;
        took[count] = now() - began;
    }
    for (size_t i = 1; i < count; i++) // insertion
        for (size_t j = i; j > 0 && took[j] < took[j - 1]; j--) {
            const double other = took[j];
            took[j] = took[j - 1];
            took[j - 1] = other;
        }
    if (count > 0)
        printf("%-44s %10.0f /s %8.2f us median, %.2f us at 95 %%\n",
               "the disk's fdatasync of 4 KB", 1 / took[count / 2], 1e6 * took[count / 2],
               1e6 * took[count * 95 / 100]);
    close(file);
}

static void name_row(JobRow *row, bool is_rising, size_t number) {
    uint64_t mix = (uint64_t)number * 0x9E3779B97F4A7C15u + 1;
    mix = (mix ^ (mix >> 29)) * 0xBF58476D1CE4E5B9u;
    if (is_rising)
        snprintf(row->id, sizeof row->id, "j-%014zx%016llx", number, (unsigned long long)mix);
    else
        snprintf(row->id, sizeof row->id, "j-%016llx%014zx", (unsigned long long)mix, number);
}

static atomic_size_t answered;

static void note(void *context, Status status, const char *detail) {
    (void)context;
    (void)detail;
    atomic_fetch_add(&answered, status == STATUS_OK);
}

// Rows of jobs: one commit each, or as many as come while the last commit is made durable.
static void measure_rows(bool is_grouped, bool is_rising) {
    char directory[4100], command[4200];
    snprintf(directory, sizeof directory, "%s/rows", folder);
    Db *db;
    if (db_open(directory, &db, &problem) != STATUS_OK)
        stop("the store");
    enum { ON_THE_WAY = 64 };
    static JobRow rows[ON_THE_WAY];
    size_t count = 0;
    atomic_store(&answered, 0);
    const double began = now(), cpu_began = cpu();
    while (now() - began < seconds) {
        while (is_grouped && count - atomic_load(&answered) >= ON_THE_WAY)
            sched_yield();
        JobRow *row = &rows[count % ON_THE_WAY];
        *row = (JobRow){.scene = "", .warnings = "[]"};
        name_row(row, is_rising, count);
        static PendingWrite writes[ON_THE_WAY];
        PendingWrite *write = &writes[count % ON_THE_WAY];
        write->done = (WriteDone){note, NULL};
        if (is_grouped)
            db_job_post(db, row, write);
        else if (db_job_add(db, row, &problem) != STATUS_OK)
            stop("a row");
        count++;
    }
    while (is_grouped && atomic_load(&answered) < count)
        sched_yield();
    const double took = now() - began;
    char name[64];
    snprintf(name, sizeof name, "durable rows, %s, %s ids",
             is_grouped ? "64 on the way" : "one commit each", is_rising ? "rising" : "random");
    printf("%-44s %10.0f /s %8.2f us of CPU\n", name, (double)count / took,
           1e6 * (cpu() - cpu_began) / (double)count);
    db_close(db);
    snprintf(command, sizeof command, "rm -rf '%s'", directory);
    if (system(command) != 0)
        stop("the folder");
}

int main(int argc, char **argv) {
    snprintf(folder, sizeof folder, "%s", argc > 1 ? argv[1] : "/tmp");
    if (argc > 2)
        seconds = strtod(argv[2], NULL);
    const size_t used = strlen(folder);
    snprintf(folder + used, sizeof folder - used, "/bench_intake_XXXXXX");
    if (mkdtemp(folder) == NULL)
        stop(folder);
    fft_start();
    Db *db;
    char directory[4100], command[4200];
    snprintf(directory, sizeof directory, "%s/jobs", folder);
    if (db_open(directory, &db, &problem) != STATUS_OK)
        stop("the store");
    measure_core(db);
    measure_jobs(db, 2, CLIENTS);
    measure_jobs(db, 1, 1);
    measure_known(db);
    db_close(db);
    if (argc <= 3) {
        measure_disk();
        measure_rows(false, true);
        measure_rows(true, true);
        measure_rows(true, false);
    }
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command) == 0 ? 0 : 1;
}
