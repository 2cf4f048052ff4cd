// ns of CPU per sample of the exact solver at the paper's scenes, 5 channels at 1 kHz, beside a
// memset and a memcpy of the same bytes in the same run; and what a short scene costs as a whole.
// Smallest of the repeats.
#include <stdio.h>

#include "core/math/fft.h"
#include "server/base/clock.h"
#include "tests/bench/cases.h"
#include "tests/support/paper.h"

// CPU of simulation_run as a whole [us]; 0, and a line printed, if it fails.
static double scene_us(bool is_random, bool has_channels, double duration) {
    enum { RUNS = 50 };
    Simulation simulation;
    Problem problem;
    problem_clear(&problem);
    paper_scene(&simulation, 0.61, 0.025, duration);
    if (is_random)
        paper_random(&simulation, 1, 1);
    paper_no_psd(&simulation);
    if (!has_channels)
        paper_channels(&simulation, NULL, 0);
    Workspace workspace = {0};
    double us = 1e300;
    Status status = simulation_complete(&simulation, NULL, NULL, &problem);
    for (int i = 0; i < BENCH_REPEATS && status == STATUS_OK; i++) {
        const int64_t start = clock_thread_cpu_ns();
        for (int j = 0; j < RUNS && status == STATUS_OK; j++) {
            Outcome *outcome = NULL;
            status = simulation_run(&simulation, NULL, NULL, &workspace, &outcome, &problem);
            outcome_unref(outcome);
        }
        const double here = (double)(clock_thread_cpu_ns() - start) / 1e3 / RUNS;
        us = here < us ? here : us;
    }
    workspace_clear(&workspace);
    simulation_clear(&simulation);
    if (status == STATUS_OK)
        return us;
    printf("%s\n", problem.detail);
    return 0;
}

int main(void) {
    fft_start();
    printf("%-20s %8s %8s %8s %9s %8s %9s %9s %9s\n", "ns per sample", "memset", "memcpy", "run",
           "x memset", "base", "whole", "impacts", "plan us");
    for (size_t i = 0; i < bench_case_count; i++) {
        BenchScene scene;
        BenchTimes times;
        if (!bench_open(&bench_cases[i], &scene) || !bench_run(&scene, &times)) {
            bench_close(&scene);
            return 1;
        }
        const double set = bench_memset(&scene), copy = bench_memcpy(&scene);
        printf("%-20s %8.2f %8.2f %8.2f %9.2f %8.2f %9.2f %9zu %9.2f\n", bench_cases[i].name, set,
               copy, times.run, times.run / set, times.base, times.whole, times.impacts,
               times.plan_us);
        bench_close(&scene);
    }
    printf("\nsponge scenes as a whole   %12s %14s\n", "us per scene", "per second");
    const struct {
        const char *name;
        bool is_random, has_channels;
        double duration;
    } wholes[] = {
        {"1 s free, summary only", false, false, 1}, {"1 s random, summary only", true, false, 1},
        {"2 s free, summary only", false, false, 2}, {"2 s random, summary only", true, false, 2},
        {"2 s free, 5 channels", false, true, 2},    {"2 s random, 5 channels", true, true, 2}};
    for (size_t i = 0; i < COUNT(wholes); i++) {
        const double us = scene_us(wholes[i].is_random, wholes[i].has_channels, wholes[i].duration);
        if (us == 0)
            return 1;
        printf("%-26s %12.1f %14.0f\n", wholes[i].name, us, 1e6 / us);
    }
    return 0;
}
