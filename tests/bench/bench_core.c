// The core alone in a loop: bench_core free|random THREADS SECONDS prints runs a second over all
// threads, and the CPU time of one [us]. Every run is another scene, summary only: the sponge's
// free vibration of 10 s, or 60 s under a random base of its own seed. For service.py to stand
// beside.
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/fourier.h"
#include "server/base/clock.h"
#include "tests/bench/cases.h"
#include "tests/support/paper.h"

typedef struct Lane {
    pthread_t thread;
    bool is_random;
    int64_t end_ns;
    uint64_t number, runs;
    double cpu; // [s]
    Status status;
} Lane;

static Status run_one(Lane *lane, Workspace *workspace) {
    Simulation simulation;
    Outcome *outcome = NULL;
    const uint64_t number = lane->number += 64;
    paper_scene(&simulation, 0.61, 0.025, lane->is_random ? 60 : 10);
    if (lane->is_random) {
        paper_free(&simulation, 0);
        paper_random(&simulation, 2, number);
    } else {
        paper_free(&simulation, 0.015 + 1e-9 * (double)number);
    }
    paper_no_psd(&simulation);
    paper_channels(&simulation, NULL, 0);
    simulation.output.impacts = false;
    Status status = simulation_complete(&simulation, NULL, NULL, NULL);
    if (status == STATUS_OK)
        status = simulation_run(&simulation, NULL, NULL, workspace, &outcome, NULL);
    outcome_drop(outcome);
    simulation_clear(&simulation);
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

int main(int argc, char **argv) {
    const size_t threads = argc == 4 ? strtoul(argv[2], NULL, 10) : 0;
    const double seconds = argc == 4 ? strtod(argv[3], NULL) : 0;
    if (threads < 1 || threads > 64 || !(seconds > 0)) {
        fprintf(stderr, "usage: bench_core free|random THREADS SECONDS\n");
        return 2;
    }
    fourier_start();
    Lane lanes[64] = {0};
    const int64_t began = clock_monotonic_ns();
    for (size_t i = 0; i < threads; i++) {
        lanes[i].is_random = strcmp(argv[1], "random") == 0;
        lanes[i].number = 1 + i;
        lanes[i].end_ns = began + (int64_t)(1e9 * seconds);
        if (pthread_create(&lanes[i].thread, NULL, work, &lanes[i]) != 0)
            return 1;
    }
    uint64_t runs = 0;
    double cpu = 0;
    Status status = STATUS_OK;
    for (size_t i = 0; i < threads; i++) {
        pthread_join(lanes[i].thread, NULL);
        runs += lanes[i].runs;
        cpu += lanes[i].cpu;
        status = lanes[i].status != STATUS_OK ? lanes[i].status : status;
    }
    printf("%.1f %.2f\n", (double)runs / (1e-9 * (double)(clock_monotonic_ns() - began)),
           1e6 * cpu / (double)runs);
    return status == STATUS_OK ? 0 : 1;
}
