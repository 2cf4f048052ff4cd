// ns of CPU per sample of the exact solver at the paper's scenes, 1 kHz and 5 channels, beside a
// memset of the same output in the same run; the making of the random base is timed apart. Then
// whole simulations of short scenes with a summary only. Smallest of the repeats.
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
    double restitution, contact_time, duration;
    bool is_random, has_damper;
} Case;

static const Case cases[] = {
    {"no contact, free", 0.61, 0.025, 60, false, false},
    {"no contact, random", 0.61, 0.025, 60, true, false},
    {"free sponge", 0.61, 0.025, 10, false, true},
    {"free aluminium", 0.46, 0.0003, 10, false, true},
    {"random sponge", 0.61, 0.025, 60, true, true},
    {"random aluminium", 0.46, 0.0003, 60, true, true},
};

static const Case shorts[] = {
    {"free sponge", 0.61, 0.025, 1, false, true},
    {"free sponge", 0.61, 0.025, 2, false, true},
    {"free aluminium", 0.46, 0.0003, 1, false, true},
    {"free aluminium", 0.46, 0.0003, 2, false, true},
    {"random sponge", 0.61, 0.025, 2, true, true},
};

static const ChannelId wanted[CHANNELS] = {CHANNEL_DISPLACEMENT, CHANNEL_VELOCITY,
                                           CHANNEL_ACCELERATION, CHANNEL_DAMPER_DISPLACEMENT,
                                           CHANNEL_CONTACT_FORCE};

static double least(double a, double b) {
    return a < b ? a : b;
}

static Status prepare(Simulation *simulation, const Case *c) {
    Warnings warnings = {NULL, 0};
    Problem problem;
    problem_clear(&problem);
    paper_scene(simulation, c->restitution, c->contact_time, c->duration);
    if (!c->has_damper)
        simulation->scene.dampers.count = 0;
    if (c->is_random)
        paper_random(simulation, 1, 1);
    const Status status = simulation_complete(simulation, NULL, &warnings, &problem);
    if (status != STATUS_OK)
        printf("%s: %s\n", c->name, problem.detail);
    warnings_clear(&warnings);
    return status;
}

static double time_memset(double *block, size_t bytes) {
    double ns = 1e300;
    for (int i = 0; i < REPEATS; i++) {
        const int64_t start = clock_thread_cpu_ns();
        memset(block, i, bytes);
        __asm__ volatile("" ::"r"(block) : "memory");
        ns = least(ns, (double)(clock_thread_cpu_ns() - start));
    }
    return ns;
}

static bool run_case(const Case *c, double *block) {
    Simulation simulation;
    Problem problem;
    problem_clear(&problem);
    if (prepare(&simulation, c) != STATUS_OK)
        return false;
    const size_t count = (size_t)(c->duration * simulation.scene.sample_rate) + 1;
    const double set_ns = time_memset(block, count * CHANNELS * sizeof *block) / (double)count;
    double run_ns = 1e300, plan_ns = 1e300, base_ns = 1e300;
    size_t impacts = 0;
    bool is_fine = true;
    for (int i = 0; i < REPEATS && is_fine; i++) {
        Plan *plan;
        Base base = {0};
        Response response = {0};
        const Span span = {c->duration, simulation.scene.sample_rate, 0};
        const Excitation *excitation = scene_excitation(&simulation.scene);
        const int64_t start = clock_thread_cpu_ns();
        if (plan_new(&simulation.scene, "auto", "exact", &plan, &problem) != STATUS_OK)
            return false;
        const int64_t planned = clock_thread_cpu_ns();
        is_fine = excitation_kind(excitation)->make(excitation, &span, NULL, &base, &problem) ==
                  STATUS_OK;
        const int64_t based = clock_thread_cpu_ns();
        RunColumn columns[CHANNELS];
        for (size_t k = 0; k < CHANNELS; k++)
            columns[k] = (RunColumn){wanted[k], 0, block + k * count};
        Run run = {.plan = plan, .base = &base, .columns = columns, .column_count = CHANNELS};
        const int64_t ready = clock_thread_cpu_ns();
        is_fine = is_fine && solver_exact.run(&run, &response, &problem) == STATUS_OK;
        run_ns = least(run_ns, (double)(clock_thread_cpu_ns() - ready) / (double)count);
        plan_ns = least(plan_ns, (double)(planned - start));
        base_ns = least(base_ns, (double)(based - planned) / (double)count);
        impacts = response.impacts.count;
        response_clear(&response);
        base_clear(&base);
        plan_free(plan);
    }
    printf("%-20s %4.0f %10.2f %10.2f %10.2f %8zu %10.2f %12.2f\n", c->name, c->duration, run_ns,
           set_ns, run_ns / set_ns, impacts, plan_ns / 1e3, base_ns);
    simulation_clear(&simulation);
    return is_fine;
}

// Planning, running and summing up, with nothing sampled and no spectrum.
static bool run_short(const Case *c) {
    Simulation simulation;
    if (prepare(&simulation, c) != STATUS_OK)
        return false;
    const size_t sampled = simulation.output.channels.count;
    const size_t densities = simulation.output.psd.channels.count;
    simulation.output.channels.count = simulation.output.psd.channels.count = 0;
    double ns = 1e300;
    bool is_fine = true;
    for (int i = 0; i < 10 * REPEATS && is_fine; i++) {
        Outcome *outcome;
        const int64_t start = clock_thread_cpu_ns();
        is_fine = simulation_run(&simulation, NULL, NULL, &outcome, NULL) == STATUS_OK;
        ns = least(ns, (double)(clock_thread_cpu_ns() - start));
        outcome_drop(outcome);
    }
    printf("%-20s %4.0f %10.2f %12.0f\n", c->name, c->duration, ns / 1e3, 1e9 / ns);
    simulation.output.channels.count = sampled;
    simulation.output.psd.channels.count = densities;
    simulation_clear(&simulation);
    return is_fine;
}

int main(void) {
    fourier_start();
    double *block = malloc((size_t)60001 * CHANNELS * sizeof *block);
    if (block == NULL)
        return 1;
    bool is_fine = true;
    printf("%-20s %4s %10s %10s %10s %8s %10s %12s\n", "scene", "s", "ns/sample", "memset",
           "x memset", "impacts", "plan us", "base ns/smp");
    for (size_t c = 0; c < COUNT(cases); c++)
        is_fine = run_case(&cases[c], block) && is_fine;
    printf("\n%-20s %4s %10s %12s\n", "summary only", "s", "us/scene", "scenes/s");
    for (size_t c = 0; c < COUNT(shorts); c++)
        is_fine = run_short(&shorts[c]) && is_fine;
    free(block);
    return is_fine ? 0 : 1;
}
