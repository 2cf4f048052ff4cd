// The core alone in a loop: bench_core SCENE THREADS SECONDS prints runs a second over all threads,
// and the CPU time of one [us]. SCENE is the JSON that a client would send, read once by the
// program's own reader; every run is another scene by its seed, or by where it starts, and all that
// a job has done by the core: judged and completed under the daemon's usual limits, its cost
// predicted, run, summed up. For service.py to stand beside.
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "core/math/fft.h"
#include "core/solve/solver.h"
#include "server/jobs/jobs.h"
#include "server/util/clock.h"
#include "server/util/process.h"

typedef struct Lane {
    pthread_t thread;
    StudyRequest inquiry;
    double displacement; // as read [m]
    int64_t end_ns;
    uint64_t number, runs;
    double cpu; // [s]
    Status status;
    Problem problem;
} Lane;

static const SimulationLimits limits = {.samples = 1 << 25,
                                        .impacts = 500000,
                                        .steps = SIMULATION_CPU_SECONDS / SOLVER_STEP,
                                        .bytes = SIMULATION_BYTES,
                                        .points = 1};

static Excitation *excitation_of(Lane *lane) {
    return (Excitation *)(void *)lane->inquiry.simulation.scene.excitation;
}

static void alter(Lane *lane) {
    Excitation *excitation = excitation_of(lane);
    if (excitation_kind(excitation) == &excitation_random)
        ((ExcitationRandom *)(void *)excitation)->seed = lane->number;
    else if (excitation->displacement.count > 0)
        excitation->displacement.at[0] = lane->displacement + 1e-9 * (double)lane->number;
    lane->number += 64;
}

static Status run_one(Lane *lane, Workspace *workspace) {
    Warnings warnings = {NULL, 0};
    Outcome *outcome = NULL;
    Cost cost;
    alter(lane);
    Status status = study_request_complete(&lane->inquiry, &limits, &warnings, &lane->problem);
    if (status == STATUS_OK)
        status = study_request_cost(&lane->inquiry, &limits, &cost, &lane->problem);
    if (status == STATUS_OK)
        status = simulation_run(&lane->inquiry.simulation, &limits, NULL, workspace, &outcome,
                                &lane->problem);
    outcome_unref(outcome);
    warnings_clear(&warnings);
    return status;
}

static void *work(void *context) {
    Lane *lane = context;
    Workspace workspace = {0};
    const int64_t began = clock_thread_cpu_ns();
    while (lane->status == STATUS_OK && clock_monotonic_ns() < lane->end_ns) {
        lane->status = run_one(lane, &workspace);
        lane->runs++;
    }
    lane->cpu = 1e-9 * (double)(clock_thread_cpu_ns() - began);
    workspace_clear(&workspace);
    return NULL;
}

static Status read_scene(Db *db, const char *text, Lane *lane) {
    Warnings warnings = {NULL, 0};
    const Status status =
        jobs_prepare(db, text, strlen(text), &limits, &lane->inquiry, &warnings, &lane->problem);
    warnings_clear(&warnings);
    if (status == STATUS_OK && excitation_of(lane)->displacement.count > 0)
        lane->displacement = excitation_of(lane)->displacement.at[0];
    return status;
}

int main(int argc, char **argv) {
    enum { LANES = 64 };
    const size_t threads = argc == 4 ? strtoul(argv[2], NULL, 10) : 0;
    const double seconds = argc == 4 ? strtod(argv[3], NULL) : 0;
    if (threads < 1 || threads > LANES || !(seconds > 0)) {
        fprintf(stderr, "usage: bench_core SCENE THREADS SECONDS\n");
        return 2;
    }
    process_return_memory(); // as the daemon does
    fft_start();
    static Lane lanes[LANES];
    Db *db = NULL;
    Problem *problem = &lanes[0].problem;
    Status status = db_open(NULL, &db, problem);
    for (size_t i = 0; i < threads && status == STATUS_OK; i++) {
        problem = &lanes[i].problem;
        lanes[i].number = 1 + i;
        status = read_scene(db, argv[1], &lanes[i]);
    }
    db_close(db);
    const int64_t began = clock_monotonic_ns();
    size_t started = 0;
    for (; started < threads && status == STATUS_OK; started++) {
        lanes[started].end_ns = began + (int64_t)(1e9 * seconds);
        if (pthread_create(&lanes[started].thread, NULL, work, &lanes[started]) != 0)
            status = problem_set(problem, STATUS_INTERNAL, "a thread cannot be started");
    }
    uint64_t runs = 0;
    double cpu = 0;
    for (size_t i = 0; i < started; i++) {
        pthread_join(lanes[i].thread, NULL);
        runs += lanes[i].runs;
        cpu += lanes[i].cpu;
        if (lanes[i].status != STATUS_OK) {
            status = lanes[i].status;
            problem = &lanes[i].problem;
        }
    }
    const double took = 1e-9 * (double)(clock_monotonic_ns() - began);
    for (size_t i = 0; i < threads; i++)
        study_request_clear(&lanes[i].inquiry);
    if (status != STATUS_OK) {
        fprintf(stderr, "bench_core: %s\n", problem->detail);
        return 1;
    }
    printf("%.1f %.2f\n", (double)runs / took, 1e6 * cpu / (double)runs);
    return 0;
}
