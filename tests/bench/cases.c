#include "tests/bench/cases.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/solver.h"
#include "server/util/clock.h"
#include "tests/support/paper.h"

const BenchCase bench_cases[] = {
    {"no contact, free", 0.61, 0.025, false, false, 60, 1000},
    {"no contact, random", 0.61, 0.025, true, false, 60, 1000},
    {"free sponge", 0.61, 0.025, false, true, 60, 1000},
    {"free aluminium", 0.46, 0.0003, false, true, 60, 1000},
    {"random sponge", 0.61, 0.025, true, true, 60, 1000},
    {"random aluminium", 0.46, 0.0003, true, true, 60, 1000},
    // The same impacts, hardly any flight after them.
    {"free sponge, 10 s", 0.61, 0.025, false, true, 10, 1000},
    {"free aluminium, 10 s", 0.46, 0.0003, false, true, 10, 1000},
    // Many pieces in a sample interval.
    {"random sponge, 50 Hz", 0.61, 0.025, true, true, 60, 50},
    {"random aluminium, 50 Hz", 0.46, 0.0003, true, true, 60, 50},
};
const size_t bench_case_count = COUNT(bench_cases);

static const ChannelId wanted[BENCH_CHANNELS] = {CHANNEL_DISPLACEMENT, CHANNEL_VELOCITY,
                                                 CHANNEL_ACCELERATION, CHANNEL_DAMPER_DISPLACEMENT,
                                                 CHANNEL_CONTACT_FORCE};

static double since(int64_t start) {
    return (double)(clock_thread_cpu_ns() - start);
}

static double least(double a, double b) {
    return a < b ? a : b;
}

static Status make_base(BenchScene *scene, Base *base, Problem *problem) {
    const Scene *of = &scene->simulation.scene;
    const Span span = {.duration = of->duration,
                       .sample_rate = of->sample_rate,
                       .transforms = &scene->workspace.transforms};
    const Excitation *excitation = scene_excitation(of);
    return excitation_make(excitation, &span, NULL, base, problem);
}

bool bench_open(const BenchCase *bench, BenchScene *scene) {
    Problem problem;
    problem_clear(&problem);
    memset(scene, 0, sizeof *scene);
    paper_scene(&scene->simulation, bench->restitution, bench->contact_time, bench->duration);
    scene->simulation.scene.sample_rate = bench->sample_rate;
    if (!bench->has_contact)
        scene->simulation.scene.dampers.at[0].clearance = 100;
    if (bench->is_random)
        paper_random(&scene->simulation, 1, 1);
    if (simulation_complete(&scene->simulation, NULL, NULL, &problem) != STATUS_OK ||
        plan_new(&scene->simulation.scene, "auto", "exact", &scene->plan, &problem) != STATUS_OK ||
        make_base(scene, &scene->base, &problem) != STATUS_OK) {
        printf("%s: %s\n", bench->name, problem.detail);
        return false;
    }
    scene->count = scene->plan->count;
    const size_t bytes = scene->count * BENCH_CHANNELS * sizeof *scene->block;
    if ((scene->block = malloc(bytes)) == NULL)
        return false;
    memset(scene->block, 1, bytes);
    return true;
}

void bench_close(BenchScene *scene) {
    simulation_clear(&scene->simulation);
    plan_free(scene->plan);
    base_clear(&scene->base);
    free(scene->block);
    workspace_clear(&scene->workspace);
}

double bench_memset(BenchScene *scene) {
    double ns = 1e300;
    for (int i = 0; i < BENCH_REPEATS; i++) {
        const int64_t start = clock_thread_cpu_ns();
        memset(scene->block, i, scene->count * BENCH_CHANNELS * sizeof *scene->block);
        __asm__ volatile("" ::"r"(scene->block) : "memory");
        ns = least(ns, since(start));
    }
    return ns / (double)scene->count;
}

double bench_memcpy(BenchScene *scene) {
    const size_t bytes = scene->count * BENCH_CHANNELS * sizeof *scene->block;
    double ns = 1e300, *copy = malloc(bytes);
    if (copy == NULL)
        return ns;
    memset(copy, 1, bytes);
    for (int i = 0; i < BENCH_REPEATS; i++) {
        const int64_t start = clock_thread_cpu_ns();
        memcpy(copy, scene->block, bytes);
        __asm__ volatile("" ::"r"(copy) : "memory");
        ns = least(ns, since(start));
    }
    free(copy);
    return ns / (double)scene->count;
}

bool bench_run(BenchScene *scene, BenchTimes *times) {
    Problem problem;
    RunColumn columns[BENCH_CHANNELS];
    for (size_t i = 0; i < BENCH_CHANNELS; i++)
        columns[i] = (RunColumn){wanted[i], 0, scene->block + i * scene->count};
    *times = (BenchTimes){1e300, 1e300, 1e300, 1e300, 0};
    problem_clear(&problem);
    for (int i = 0; i < BENCH_REPEATS; i++) {
        Plan *plan = NULL;
        Base base = {0};
        Response response = {0};
        const int64_t start = clock_thread_cpu_ns();
        Status status = plan_new(&scene->simulation.scene, "auto", "exact", &plan, &problem);
        times->plan_us = least(times->plan_us, since(start) / 1e3);
        const int64_t planned = clock_thread_cpu_ns();
        if (status == STATUS_OK)
            status = make_base(scene, &base, &problem);
        times->base = least(times->base, since(planned) / (double)scene->count);
        Run run = {.plan = plan,
                   .base = &base,
                   .workspace = &scene->workspace,
                   .columns = columns,
                   .column_count = BENCH_CHANNELS};
        const int64_t ready = clock_thread_cpu_ns();
        if (status == STATUS_OK)
            status = solver_exact.run(&solver_exact, &run, &response, &problem);
        times->run = least(times->run, since(ready) / (double)scene->count);
        times->whole = least(times->whole, since(start) / (double)scene->count);
        times->impacts = response.impacts.count;
        response_clear(&response);
        base_clear(&base);
        plan_free(plan);
        if (status != STATUS_OK) {
            printf("%s\n", problem.detail);
            return false;
        }
    }
    return true;
}
