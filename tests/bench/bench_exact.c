// ns of CPU per sample of the exact solver for the paper's scenes, 5 channels, at 1 kHz mostly,
// beside a memset and a memcpy of the same bytes in the same run; and the CPU time of short scenes
// as a whole. Smallest of the repeats. Once for every vector width of this processor, or for the
// widths that the arguments name: bench_exact [avx512] [avx2] [plain].
#include <stdio.h>
#include <string.h>

#include "core/math/fft.h"
#include "server/util/clock.h"
#include "tests/bench/cases.h"
#include "tests/support/paper.h"
#include "tests/support/vectors.h"

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

// ns per sample of every scene; false, and a line printed, if one fails.
static bool print_samples(void) {
    printf("%-23s %8s %8s %8s %9s %8s %9s %9s %9s\n", "ns per sample", "memset", "memcpy", "run",
           "x memset", "base", "whole", "impacts", "plan us");
    for (size_t i = 0; i < bench_case_count; i++) {
        BenchScene scene;
        BenchTimes times;
        if (!bench_open(&bench_cases[i], &scene) || !bench_run(&scene, &times)) {
            bench_close(&scene);
            return false;
        }
        const double set = bench_memset(&scene), copy = bench_memcpy(&scene);
        printf("%-23s %8.2f %8.2f %8.2f %9.2f %8.2f %9.2f %9zu %9.2f\n", bench_cases[i].name, set,
               copy, times.run, times.run / set, times.base, times.whole, times.impacts,
               times.plan_us);
        bench_close(&scene);
    }
    return true;
}

static bool print_scenes(void) {
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
            return false;
        printf("%-26s %12.1f %14.0f\n", wholes[i].name, us, 1e6 / us);
    }
    return true;
}

int main(int count, char **arguments) {
    fft_start();
    for (Vectors vectors = 0; vectors < VECTORS_COUNT; vectors++) {
        bool is_named = count == 1;
        for (int i = 1; i < count; i++)
            is_named |= strcmp(arguments[i], vectors_names[vectors]) == 0;
        if (!is_named || !vectors_set(vectors))
            continue;
        printf("vectors: %s\n", vectors_names[vectors]);
        if (!print_samples() || !print_scenes())
            return 1;
        printf("\n");
    }
    return 0;
}
