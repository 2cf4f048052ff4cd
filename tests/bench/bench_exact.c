// ns of CPU per sample of the exact solver at the paper's scenes, 60 s at 1 kHz and 5 channels,
// beside a memset and a memcpy of the same output in the same run. The making of the random base is
// timed apart. Smallest of the repeats.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/fourier.h"
#include "core/solve/solver.h"
#include "server/base/clock.h"
#include "tests/support/paper.h"

enum { REPEATS = 20, CHANNELS = 5 };

typedef struct Case {
    const char *name;
    double restitution, contact_time;
    bool is_random, has_damper;
} Case;

static const Case cases[] = {
    {"no contact, free", 0.61, 0.025, false, false},
    {"no contact, random", 0.61, 0.025, true, false},
    {"free sponge", 0.61, 0.025, false, true},
    {"free aluminium", 0.46, 0.0003, false, true},
    {"random sponge", 0.61, 0.025, true, true},
    {"random aluminium", 0.46, 0.0003, true, true},
};

static const ChannelId wanted[CHANNELS] = {CHANNEL_DISPLACEMENT, CHANNEL_VELOCITY,
                                           CHANNEL_ACCELERATION, CHANNEL_DAMPER_DISPLACEMENT,
                                           CHANNEL_CONTACT_FORCE};

static double least(double a, double b) {
    return a < b ? a : b;
}

int main(void) {
    fourier_start();
    const double duration = 60;
    const size_t count = 60001;
    double *block = malloc(count * CHANNELS * sizeof *block),
           *copy = malloc(count * CHANNELS * sizeof *copy);
    if (block == NULL || copy == NULL)
        return 1;
    memset(copy, 1, count * CHANNELS * sizeof *copy);
    double set_ns = 1e300, copy_ns = 1e300;
    for (int i = 0; i < REPEATS; i++) {
        const int64_t start = clock_thread_cpu_ns();
        memset(block, i, count * CHANNELS * sizeof *block);
        __asm__ volatile("" ::"r"(block) : "memory");
        const int64_t middle = clock_thread_cpu_ns();
        memcpy(copy, block, count * CHANNELS * sizeof *block);
        __asm__ volatile("" ::"r"(copy) : "memory");
        set_ns = least(set_ns, (double)(middle - start) / (double)count);
        copy_ns = least(copy_ns, (double)(clock_thread_cpu_ns() - middle) / (double)count);
    }
    printf("%-20s %9s %10s %8s %10s %12s\n", "scene", "ns/sample", "x memset", "impacts", "plan us",
           "base ns/smp");
    printf("%-20s %9.2f %10.2f\n%-20s %9.2f %10.2f\n", "memset", set_ns, 1.0, "memcpy", copy_ns,
           copy_ns / set_ns);
    for (size_t c = 0; c < COUNT(cases); c++) {
        Simulation simulation;
        Warnings warnings = {NULL, 0};
        Problem problem;
        problem_clear(&problem);
        paper_scene(&simulation, cases[c].restitution, cases[c].contact_time, duration);
        if (!cases[c].has_damper)
            simulation.scene.dampers.count = 0;
        if (cases[c].is_random)
            paper_random(&simulation, 1, 1);
        if (simulation_complete(&simulation, NULL, &warnings, &problem) != STATUS_OK)
            return printf("%s: %s\n", cases[c].name, problem.detail), 1;
        double run_ns = 1e300, plan_ns = 1e300, base_ns = 1e300;
        size_t impacts = 0;
        for (int i = 0; i < REPEATS; i++) {
            Plan *plan;
            Base base = {0};
            Response response = {0};
            const Span span = {duration, simulation.scene.sample_rate, 0};
            const Excitation *excitation = scene_excitation(&simulation.scene);
            const int64_t start = clock_thread_cpu_ns();
            if (plan_new(&simulation.scene, "auto", "exact", &plan, &problem) != STATUS_OK)
                return 1;
            const int64_t planned = clock_thread_cpu_ns();
            if (excitation_kind(excitation)->make(excitation, &span, NULL, &base, &problem) !=
                STATUS_OK)
                return 1;
            const int64_t based = clock_thread_cpu_ns();
            RunColumn columns[CHANNELS];
            for (size_t i2 = 0; i2 < CHANNELS; i2++)
                columns[i2] = (RunColumn){wanted[i2], 0, block + i2 * count};
            Run run = {.plan = plan, .base = &base, .columns = columns, .column_count = CHANNELS};
            const int64_t ready = clock_thread_cpu_ns();
            if (solver_exact.run(&run, &response, &problem) != STATUS_OK)
                return printf("%s\n", problem.detail), 1;
            run_ns = least(run_ns, (double)(clock_thread_cpu_ns() - ready) / (double)count);
            plan_ns = least(plan_ns, (double)(planned - start));
            base_ns = least(base_ns, (double)(based - planned) / (double)count);
            impacts = response.impacts.count;
            response_clear(&response);
            base_clear(&base);
            plan_free(plan);
        }
        printf("%-20s %9.2f %10.2f %8zu %10.2f %12.2f\n", cases[c].name, run_ns, run_ns / set_ns,
               impacts, plan_ns / 1e3, base_ns);
        simulation_clear(&simulation);
        warnings_clear(&warnings);
    }
    free(block);
    free(copy);
    return 0;
}
