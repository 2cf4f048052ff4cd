// A sweep of the paper's free sponge scene, summary only, through the whole jobs room (judging,
// chunks, database, result), beside the core alone in a loop on as many threads, and an ensemble of
// as many draws of the same clearances; then what judging and storing cost by themselves. Rounds of
// all in turn, medians.
//
//     bench_sweep [points [threads [rounds]]]
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

#include "core/math/fft.h"
#include "core/study/sweep.h"
#include "server/db/records.h"
#include "server/jobs/jobs.h"
#include "server/jobs/sweep.h"
#include "server/util/clock.h"

enum { ROUNDS_MAX = 64 };

static size_t points = 10000, threads = 2, rounds = 5;

typedef enum BenchStudy { BENCH_SWEEP, BENCH_ENSEMBLE, BENCH_SHAKEN, BENCH_FRAGILITY } BenchStudy;

enum { RECORDS = 10, RECORD_SAMPLES_MADE = 500 };
#define RECORD_NAMES "[\"r0\",\"r1\",\"r2\",\"r3\",\"r4\",\"r5\",\"r6\",\"r7\",\"r8\",\"r9\"]"

// Of BENCH_SHAKEN and BENCH_FRAGILITY the runs are the same: records at levels, by a sweep of the
// factor and by a fragility.
static void study_text(char target[600], size_t count, BenchStudy study) {
    static const char *const formats[] = {
        [BENCH_SWEEP] = "{\"kind\": \"sweep\", \"axes\": [{\"pointer\": \"/dampers/0/clearance\", "
                        "\"from\": 0.01, \"to\": 0.03, \"count\": %zu}]}",
        [BENCH_ENSEMBLE] =
            "{\"kind\": \"ensemble\", \"runs\": %zu, \"inputs\": [{\"pointer\": "
            "\"/dampers/0/clearance\", \"distribution\": \"uniform\", \"from\": 0.01, \"to\": "
            "0.03}]}",
        [BENCH_SHAKEN] = "{\"kind\": \"sweep\", \"axes\": [{\"pointer\": \"/excitation/name\", "
                         "\"values\": " RECORD_NAMES "}, {\"pointer\": \"/excitation/scale\", "
                         "\"from\": 0.1, \"to\": 3, \"count\": %zu}]}",
        [BENCH_FRAGILITY] =
            "{\"kind\": \"fragility\", \"records\": " RECORD_NAMES ", \"levels\": {\"from\": "
            "0.1, \"to\": 3, \"count\": %zu}, \"limits\": [{\"metric\": \"peak_displacement\", "
            "\"value\": 0.01}]}",
    };
    snprintf(target, 600, formats[study], study >= BENCH_SHAKEN ? count / RECORDS : count);
}

static void scene_text(char target[1600], size_t count, double mass, BenchStudy study) {
    char text[600];
    study_text(text, count, study);
    snprintf(target, 1600,
             "{\"structure\": {\"mass\": %.17g, \"stiffness\": 865, \"damping\": 1.092},"
             " \"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"sponge\"}],"
             " \"excitation\": {\"kind\": %s},"
             " \"duration\": 10, \"sample_rate\": 1000,"
             " \"output\": {\"channels\": [], \"psd\": null, \"impacts\": false},"
             " \"study\": %s}",
             mass,
             study >= BENCH_SHAKEN ? "\"record\", \"name\": \"r0\""
                                   : "\"free\", \"displacement\": 0.015",
             text);
}

// Ground motions of 10 s with a peak of 1 m/s^2.
static Status add_records(Db *db, Problem *problem) {
    double values[RECORD_SAMPLES_MADE];
    for (size_t r = 0; r < RECORDS; r++) {
        char name[8], digest[RECORD_DIGEST_SIZE];
        bool is_there;
        for (size_t i = 0; i < RECORD_SAMPLES_MADE; i++)
            values[i] = sin(0.02 * (double)i * (6 + (double)r)) * sin(3.14159 * (double)i / 500);
        values[250] = 1;
        const Reals samples = {values, RECORD_SAMPLES_MADE};
        snprintf(name, sizeof name, "r%zu", r);
        record_digest(0.02, &samples, digest);
        const RecordRow row = {.name = name,
                               .layout = "json",
                               .unit = "m/s^2",
                               .interval = 0.02,
                               .count = RECORD_SAMPLES_MADE,
                               .peak = 1,
                               .digest = digest};
        TRY(db_record_add(db, &row, &samples, &is_there, problem));
    }
    return STATUS_OK;
}

static int fail(const char *what, const Problem *problem) {
    fprintf(stderr, "%s: %s\n", what, problem->detail);
    return 1;
}

// Of all threads [s]: what a busy machine leaves alone.
static double process_cpu(void) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

// The core's part: scenes made beforehand, run one after the other.
typedef struct EventLoop {
    const Simulation *scenes;
    size_t first;
    pthread_t thread;
} EventLoop;

static void *run_loop(void *context) {
    const EventLoop *loop = context;
    Workspace workspace = {0};
    for (size_t i = loop->first; i < points; i += threads) {
        Outcome *outcome;
        if (simulation_run(&loop->scenes[i], NULL, NULL, &workspace, &outcome, NULL) == STATUS_OK)
            outcome_unref(outcome);
    }
    workspace_clear(&workspace);
    return NULL;
}

static double time_core(const Simulation *scenes) {
    EventLoop loops[64];
    const int64_t began_ns = clock_monotonic_ns();
    for (size_t i = 0; i < threads; i++) {
        loops[i] = (EventLoop){.scenes = scenes, .first = i};
        pthread_create(&loops[i].thread, NULL, run_loop, &loops[i]);
    }
    for (size_t i = 0; i < threads; i++)
        pthread_join(loops[i].thread, NULL);
    return 1e-9 * (double)(clock_monotonic_ns() - began_ns);
}

// A new study each time: the structure's mass is another.
static double time_room(JobManager *manager, size_t round, BenchStudy study, Problem *problem) {
    char text[1600];
    Job *job;
    scene_text(text, points, 1.35 + 1e-9 * (double)round, study);
    const Submission submission = {.text = text, .size = strlen(text)};
    const int64_t began_ns = clock_monotonic_ns();
    if (jobs_submit(manager, &submission, &job, problem) != STATUS_OK)
        return -1;
    const struct timespec nap = {0, 500000};
    while (!job_is_finished(job))
        nanosleep(&nap, NULL);
    job_unref(job);
    return 1e-9 * (double)(clock_monotonic_ns() - began_ns);
}

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, size_t count) {
    qsort(values, count, sizeof *values, by_value);
    return values[count / 2];
}

static int bench_judging(Db *db, Problem *problem) {
    char text[1600];
    StudyRequest inquiry = {0};
    Warnings warnings = {NULL, 0};
    SweepGrid *plan;
    const SimulationLimits limits = {.samples = 1 << 25, .points = 1 << 20};
    scene_text(text, 100000, 1.35, BENCH_SWEEP);
    int64_t began_ns = clock_monotonic_ns();
    if (jobs_prepare(db, text, strlen(text), &limits, &inquiry, &warnings, problem) != STATUS_OK)
        return fail("judging", problem);
    printf("POST of 100000 points, its axes judged: %.3f s\n",
           1e-9 * (double)(clock_monotonic_ns() - began_ns));
    const SweepStudy *study = (const SweepStudy *)(const void *)inquiry.study;
    if (sweep_grid_new(study, &inquiry.simulation, &limits, &plan, problem) != STATUS_OK)
        return fail("planning", problem);
    began_ns = clock_monotonic_ns();
    (void)sweep_grid_validate(plan, SIZE_MAX, &limits, NULL, problem);
    printf("all 100000 points judged before the first run: %.3f s\n",
           1e-9 * (double)(clock_monotonic_ns() - began_ns));
    sweep_grid_free(plan);
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    return 0;
}

static int bench_rows(Db *db, Problem *problem) {
    enum { CHUNKS = 64, ROWS = 10000, METRICS = 6 };
    SweepRow row = {.points = (uint64_t)CHUNKS * ROWS, .metrics = METRICS, .chunks = CHUNKS};
    strcpy(row.result, "r-bench");
    row.scene = strdup("{}");
    SweepChunkRow chunk = {.rows = {calloc(ROWS, 1 + 8 * METRICS), ROWS * (1 + 8 * METRICS)}};
    if (chunk.rows.at == NULL || db_sweep_begin(db, &row, problem) != STATUS_OK)
        return fail("rows", problem);
    chunk.sweep = row.number;
    const int64_t began_ns = clock_monotonic_ns();
    for (size_t i = 0; i < CHUNKS; i++) {
        chunk.chunk = i;
        if (db_sweep_take(db, &chunk, problem) != STATUS_OK)
            return fail("rows", problem);
    }
    const double took = 1e-9 * (double)(clock_monotonic_ns() - began_ns);
    printf("rows into the database, durable, a chunk of %d each: %.3g rows/s (%.2f ms a chunk)\n",
           ROWS, CHUNKS * ROWS / took, 1e3 * took / CHUNKS);
    free(chunk.rows.at);
    sweep_row_clear(&row);
    return 0;
}

int main(int argc, char **argv) {
    static Problem problem;
    char folder[] = "/tmp/impactd-bench-XXXXXX", text[1600];
    if (argc > 1)
        points = strtoul(argv[1], NULL, 10);
    if (argc > 2)
        threads = strtoul(argv[2], NULL, 10);
    if (argc > 3)
        rounds = strtoul(argv[3], NULL, 10);
    if (points < 2 || threads < 1 || threads > 64 || rounds < 1 || rounds > ROUNDS_MAX ||
        mkdtemp(folder) == NULL)
        return 2;
    Db *db;
    JobManager *manager;
    const JobManagerSettings settings = {.workers = threads,
                                         .queue_most = 100,
                                         .cache_bytes = 1 << 24,
                                         .limits = {.samples = 1 << 25, .points = 1 << 24}};
    fft_start();
    if (db_open(folder, &db, &problem) != STATUS_OK || add_records(db, &problem) != STATUS_OK ||
        jobs_open(db, &settings, &manager, &problem) != STATUS_OK)
        return fail("opening", &problem);
    StudyRequest inquiry = {0};
    Warnings warnings = {NULL, 0};
    SweepGrid *plan;
    scene_text(text, points, 1.35, BENCH_SWEEP);
    if (jobs_prepare(db, text, strlen(text), NULL, &inquiry, &warnings, &problem) != STATUS_OK ||
        sweep_grid_new((const SweepStudy *)(const void *)inquiry.study, &inquiry.simulation, NULL,
                       &plan, &problem) != STATUS_OK)
        return fail("planning", &problem);
    Simulation *scenes = calloc(points, sizeof *scenes);
    for (size_t i = 0; scenes != NULL && i < points; i++)
        (void)sweep_grid_scene(plan, i, true, NULL, &scenes[i], NULL);
    if (scenes == NULL)
        return 1;

    double core[ROUNDS_MAX], room[ROUNDS_MAX], ratio[ROUNDS_MAX];
    double core_cpu[ROUNDS_MAX], room_cpu[ROUNDS_MAX], draws[ROUNDS_MAX], draws_ratio[ROUNDS_MAX],
        draws_cpu[ROUNDS_MAX];
    double shaken[ROUNDS_MAX], fragility[ROUNDS_MAX], fragility_ratio[ROUNDS_MAX];
    const bool has_records = points <= 10000 && points >= 2 * RECORDS;
    for (size_t i = 0; i < rounds; i++) {
        double began = process_cpu();
        core[i] = time_core(scenes);
        core_cpu[i] = process_cpu() - began;
        began = process_cpu();
        room[i] = time_room(manager, i + 1, BENCH_SWEEP, &problem);
        room_cpu[i] = process_cpu() - began;
        began = process_cpu();
        draws[i] = points <= 10000 ? time_room(manager, i + 1, BENCH_ENSEMBLE, &problem) : 0;
        draws_cpu[i] = process_cpu() - began;
        draws_ratio[i] = room[i] / draws[i];
        shaken[i] = has_records ? time_room(manager, i + 1, BENCH_SHAKEN, &problem) : 0;
        fragility[i] = has_records ? time_room(manager, i + 1, BENCH_FRAGILITY, &problem) : 0;
        fragility_ratio[i] = shaken[i] / fragility[i];
        if (room[i] < 0 || draws[i] < 0 || shaken[i] < 0 || fragility[i] < 0)
            return fail("submitting", &problem);
        ratio[i] = core[i] / room[i];
    }
    const double micro = 1e6 / (double)points;
    printf("%zu points, %zu threads, median of %zu rounds\n", points, threads, rounds);
    printf("core alone in a loop: %.0f points/s\n", (double)points / median(core, rounds));
    printf("sweep, whole and durable: %.0f points/s\n", (double)points / median(room, rounds));
    printf("sweep / core: %.2f\n", median(ratio, rounds));
    if (points <= 10000)
        printf("ensemble of uncertain inputs: %.0f runs/s\nensemble / sweep: %.2f\n",
               (double)points / median(draws, rounds), median(draws_ratio, rounds));
    if (has_records)
        printf("fragility: %.0f runs/s, sweep of the same runs: %.0f points/s\nfragility / sweep: "
               "%.2f\n",
               (double)points / median(fragility, rounds), (double)points / median(shaken, rounds),
               median(fragility_ratio, rounds));
    printf("CPU a point: core %.1f us, sweep %.1f us, ensemble %.1f us\n",
           micro * median(core_cpu, rounds), micro * median(room_cpu, rounds),
           micro * median(draws_cpu, rounds));
    int code = bench_judging(db, &problem);
    if (code == 0)
        code = bench_rows(db, &problem);
    for (size_t i = 0; i < points; i++)
        simulation_clear(&scenes[i]);
    free(scenes);
    sweep_grid_free(plan);
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    jobs_close(manager);
    db_close(db);
    snprintf(text, sizeof text, "rm -rf '%s'", folder);
    return system(text) != 0 ? 1 : code;
}
