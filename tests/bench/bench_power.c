// CPU time of contacts under power laws per impact, over the tolerance of the solver exact, beside
// the solver adaptive (SUNDIALS), and the error of the displacement against full accuracy. The
// flight between contacts is subtracted: it is that of the same scene with impulses. Minimum of
// repeats.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/fft.h"
#include "core/solve/exact.h"
#include "core/solve/solver.h"
#include "core/solve/time_stepping.h"
#include "server/util/clock.h"
#include "tests/support/paper.h"

typedef struct Case {
    const char *name, *model;
    double restitution, contact_time, exponent;
    bool is_random;
    double duration;
} Case;

static const Case cases[] = {
    {"hertz 0.3 ms, free", "hertz", 1, 0.0003, 1.5, false, 3},
    {"hunt_crossley sponge, free", "hunt_crossley", 0.61, 0.025, 1.5, false, 3},
    {"hunt_crossley aluminium, free", "hunt_crossley", 0.46, 0.0003, 1.5, false, 3},
    {"hunt_crossley sponge, random", "hunt_crossley", 0.61, 0.025, 1.5, true, 3},
    {"hunt_crossley aluminium, random", "hunt_crossley", 0.46, 0.0003, 1.5, true, 3},
    {"jankowski aluminium, random", "jankowski", 0.46, 0.0003, 1.5, true, 3},
    {"hunt_crossley n = 1.37, random", "hunt_crossley", 0.46, 0.0003, 1.37, true, 3},
    {"jankowski n = 1.37, random", "jankowski", 0.46, 0.0003, 1.37, true, 3},
};

static Problem problem;

static void bench_make(const Case *from, const char *model, const char *solver, double tolerance,
                       Simulation *simulation) {
    static const char *const names[] = {"displacement"};
    paper_scene(simulation, from->restitution, from->contact_time, from->duration);
    if (from->is_random)
        paper_random(simulation, 1, 1);
    paper_channels(simulation, names, 1);
    paper_no_psd(simulation);
    paper_model(simulation, model);
    if (strcmp(model, "impulse") != 0)
        simulation->scene.dampers.at[0].buffer.exponent = from->exponent;
    Variant *accuracy = variant_new(kind_find(&solver_kinds, solver));
    variant_free(simulation->accuracy);
    simulation->accuracy = accuracy;
    if (strcmp(solver, "exact") == 0)
        ((AccuracyExact *)(void *)accuracy)->tolerance = tolerance;
    else
        ((AccuracyTolerance *)(void *)accuracy)->tolerance = tolerance;
    if (simulation_complete(simulation, NULL, NULL, &problem) != STATUS_OK) {
        printf("%s\n", problem.faults[0].detail);
        exit(1);
    }
}

typedef struct Result {
    Response response;
    double *x;
    double steps;
} Result;

static void result_clear(Result *result) {
    response_clear(&result->response);
    free(result->x);
}

// CPU of one run, without its plan [s].
static double bench_measure(const Case *from, const char *model, const char *solver,
                            double tolerance, Result *result) {
    Simulation simulation;
    double least = INFINITY;
    Plan *plan;
    Base base = {0};
    bench_make(from, model, solver, tolerance, &simulation);
    const Excitation *excitation = scene_excitation(&simulation.scene);
    const Span span = {.duration = from->duration, .sample_rate = simulation.scene.sample_rate};
    if (plan_new(&simulation.scene, solver, solver, &plan, &problem) != STATUS_OK ||
        excitation_make(excitation, &span, NULL, &base, &problem) != STATUS_OK)
        exit(1);
    result->x = calloc(plan->count, sizeof *result->x);
    const RunColumn column = {CHANNEL_DISPLACEMENT, 0, result->x};
    Run run = {.plan = plan,
               .base = &base,
               .accuracy = (const Accuracy *)(const void *)simulation.accuracy,
               .columns = &column,
               .column_count = 1};
    memset(&result->response, 0, sizeof result->response);
    for (int i = 0; i < 5; i++) {
        response_clear(&result->response);
        run.steps = 0;
        const int64_t start = clock_thread_cpu_ns();
        const Status status =
            strcmp(solver, "exact") == 0
                ? exact_run_engine(&run, &result->response, &problem)
                : solver_adaptive.run(&solver_adaptive, &run, &result->response, &problem);
        if (status != STATUS_OK) {
            printf("%s\n", problem.detail);
            break;
        }
        least = fmin(least, (double)(clock_thread_cpu_ns() - start) * 1e-9);
    }
    result->steps = run.steps;
    base_clear(&base);
    plan_free(plan);
    simulation_clear(&simulation);
    return least;
}

// Largest difference over the reference's peak displacement.
static double result_error(const Result *result, const Result *reference) {
    const double *a = result->x, *b = reference->x;
    double worst = 0;
    for (size_t i = 0; i < result->response.count; i++)
        worst = fmax(worst, fabs(a[i] - b[i]));
    return worst / reference->response.peaks.displacement;
}

static void bench_print(const Case *from, const char *solver, double tolerance, double flight,
                        const Result *best) {
    Result result;
    const double cpu = bench_measure(from, from->model, solver, tolerance, &result);
    const double impacts = (double)result.response.impacts.count;
    printf("  %-9s %8.0e %10.2f %10.1f %8.1f %10.1e %10.1e\n", solver, tolerance,
           (cpu - flight) / impacts * 1e6, result.steps / impacts, cpu / result.steps * 1e9,
           result_error(&result, best), result.response.error_estimate);
    result_clear(&result);
}

int main(int argc, char **argv) {
    fft_start();
    printf("  %-9s %8s %10s %10s %8s %10s %10s\n", "solver", "tol", "us/impact", "steps/imp",
           "ns/step", "error", "estimate");
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        const Case *at = &cases[c];
        if (argc > 1 && strstr(at->name, argv[1]) == NULL)
            continue;
        Result flown, best;
        const double flight = bench_measure(at, "impulse", "exact", NAN, &flown);
        (void)bench_measure(at, at->model, "exact", NAN, &best);
        printf("%s: %llu impacts, flight %.0f us\n", at->name,
               (unsigned long long)best.response.impacts.count, flight * 1e6);
        bench_print(at, "exact", 1e-15, flight, &best);
        for (double tolerance = argc > 3 ? 1e-7 : 1e-12;
             tolerance<0.5; tolerance *= argc> 3 ? 3 : 1e3)
            bench_print(at, "exact", tolerance, flight, &best);
        bench_print(at, "exact", 1e-1, flight, &best);
        if (argc > 2)
            continue;
        bench_print(at, "adaptive", 1e-13, flight, &best);
        bench_print(at, "adaptive", 1e-6, flight, &best);
        result_clear(&flown);
        result_clear(&best);
    }
    return 0;
}
