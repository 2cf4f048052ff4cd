// What a summary alone costs beside the whole series with its spectrum, on the paper's random
// scenes and in one run: CPU of simulation_run, median of the
// repeats, and the ratio. Once with
// outcomes that are kept, as the daemon keeps them, so that each series is written into memory of
// its own; and once into the same memory again and again. The base's making is a part of all.
#include <stdio.h>
#include <stdlib.h>

#include "core/math/fft.h"
#include "server/util/clock.h"
#include "tests/bench/cases.h"
#include "tests/support/paper.h"

// Channels and spectrum as they are by default, or none of both.
static Status make(Simulation *simulation, const PaperBuffer *buffer, double duration,
                   bool is_whole, Problem *problem) {
    paper_scene(simulation, buffer->restitution, buffer->contact_time, duration);
    paper_free(simulation, 0);
    paper_random(simulation, 1, 1);
    if (!is_whole) {
        paper_no_psd(simulation);
        paper_channels(simulation, NULL, 0);
    }
    return simulation_complete(simulation, NULL, NULL, problem);
}

enum { RUNS = 2 * BENCH_REPEATS + 1 };

// [us]
static double once(const Simulation *simulation, Workspace *workspace, Outcome **outcome,
                   Status *status, Problem *problem) {
    const int64_t start = clock_thread_cpu_ns();
    *status = simulation_run(simulation, NULL, NULL, workspace, outcome, problem);
    return (double)(clock_thread_cpu_ns() - start) / 1e3;
}

static int by_size(const void *a, const void *b) {
    const double first = *(const double *)a, second = *(const double *)b;
    return (first > second) - (first < second);
}

// Side by side, so that both meet the same machine.
static Status measure(const Simulation *const simulations[2], bool are_kept, double middle[2],
                      Problem *problem) {
    Outcome *outcomes[2][RUNS] = {0};
    double us[2][RUNS] = {0};
    Workspace workspace = {0};
    Status status = STATUS_OK;
    for (size_t j = 0; j < 2 * RUNS && status == STATUS_OK; j++) {
        Outcome **outcome = &outcomes[j % 2][j / 2];
        us[j % 2][j / 2] = once(simulations[j % 2], &workspace, outcome, &status, problem);
        if (!are_kept) {
            outcome_unref(*outcome);
            *outcome = NULL;
        }
    }
    for (size_t i = 0; i < 2; i++) {
        for (size_t j = 0; j < RUNS; j++)
            outcome_unref(outcomes[i][j]);
        qsort(us[i], RUNS, sizeof us[i][0], by_size);
        middle[i] = us[i][RUNS / 2];
    }
    workspace_clear(&workspace);
    return status;
}

int main(void) {
    static const double durations[] = {10, 30, 60};
    fft_start();
    printf("%-12s %9s %21s %8s %21s %8s\n", "random base", "duration", "kept: summary, series",
           "ratio", "warm: summary, series", "ratio");
    for (size_t i = 0; i < 2 * COUNT(durations); i++) {
        const PaperBuffer *buffer = &paper_buffers[i < COUNT(durations) ? 0 : 4];
        const double duration = durations[i % COUNT(durations)];
        Simulation summary, series;
        Problem problem;
        problem_clear(&problem);
        double kept[2], warm[2];
        Status status = make(&summary, buffer, duration, false, &problem);
        const Status other = make(&series, buffer, duration, true, &problem);
        const Simulation *const both[2] = {&summary, &series};
        status = status == STATUS_OK ? other : status;
        if (status == STATUS_OK)
            status = measure(both, true, kept, &problem);
        if (status == STATUS_OK)
            status = measure(both, false, warm, &problem);
        simulation_clear(&summary);
        simulation_clear(&series);
        if (status != STATUS_OK) {
            printf("%s\n", problem.detail);
            return 1;
        }
        printf("%-12s %7.0f s %8.0f us %7.0f us %8.2f %8.0f us %7.0f us %8.2f\n", buffer->name,
               duration, kept[0], kept[1], kept[0] / kept[1], warm[0], warm[1], warm[0] / warm[1]);
    }
    return 0;
}
