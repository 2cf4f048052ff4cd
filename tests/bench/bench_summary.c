// What a summary alone costs beside the whole series with its spectrum, on the paper's random
// scenes and in one run: CPU of simulation_run, smallest of the repeats, and the ratio. The base's
// making is a part of both.
#include <stdio.h>

#include "core/math/fourier.h"
#include "server/base/clock.h"
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

// [us]
static double once(const Simulation *simulation, Workspace *workspace, Status *status,
                   Problem *problem) {
    Outcome *outcome = NULL;
    const int64_t start = clock_thread_cpu_ns();
    *status = simulation_run(simulation, NULL, NULL, workspace, &outcome, problem);
    outcome_drop(outcome);
    return (double)(clock_thread_cpu_ns() - start) / 1e3;
}

int main(void) {
    static const double durations[] = {10, 30, 60};
    fourier_start();
    printf("%-12s %9s %14s %14s %8s\n", "random base", "duration", "summary [us]", "series [us]",
           "ratio");
    for (size_t i = 0; i < 2 * COUNT(durations); i++) {
        const PaperBuffer *buffer = &paper_buffers[i < COUNT(durations) ? 0 : 4];
        const double duration = durations[i % COUNT(durations)];
        Simulation summary, series;
        Workspace workspace = {0};
        Problem problem;
        problem_clear(&problem);
        double least[2] = {1e300, 1e300};
        Status status = make(&summary, buffer, duration, false, &problem);
        const Status other = make(&series, buffer, duration, true, &problem);
        status = status == STATUS_OK ? other : status;
        // Side by side, so that both meet the same machine.
        for (int j = 0; j < 3 * BENCH_REPEATS && status == STATUS_OK; j++) {
            const double us = once(j % 2 == 0 ? &summary : &series, &workspace, &status, &problem);
            least[j % 2] = us < least[j % 2] ? us : least[j % 2];
        }
        workspace_clear(&workspace);
        simulation_clear(&summary);
        simulation_clear(&series);
        if (status != STATUS_OK) {
            printf("%s\n", problem.detail);
            return 1;
        }
        printf("%-12s %7.0f s %14.1f %14.1f %8.2f\n", buffer->name, duration, least[0], least[1],
               least[0] / least[1]);
    }
    return 0;
}
