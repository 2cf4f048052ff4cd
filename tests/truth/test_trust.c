// How far a trajectory can be trusted: trust_horizon against the earliest instant at which one of
// several equally good runs, their inputs an ulp apart, parts from quad precision by 1e-6 of the
// largest displacement. `test_trust 40` is the whole campaign, `test_trust 40 SECONDS SEED`
// another.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/excitation/excitation.h"
#include "core/math/fft.h"
#include "tests/support/paper.h"
#include "tests/support/test.h"
#include "tests/truth/drawn.h"

enum { DOUBLES = 9, SPARSE = 10 };
static size_t scenes = 4;
static double duration = 30;
static uint64_t seed = 1;
static const double PARTED = 1e-6, RATE = 1000;

// Paper-like: every buffer and both models, a sine of some 1 m/s^2 or a base of 0-15 Hz.
static void paper_like(ReferenceScene *scene, size_t number) {
    Draws draws = {seed * 1000003 + number};
    const PaperBuffer *buffer = &paper_buffers[number / 2 % COUNT(paper_buffers)];
    *scene = (ReferenceScene){.mass = 1.35,
                              .stiffness = 865,
                              .damping = 1.092,
                              .damper_mass = 0.1107,
                              .clearance = 0.015,
                              .is_impulse = number % 8 >= 6,
                              .restitution = {buffer->restitution, buffer->restitution},
                              .contact_time = {buffer->contact_time, buffer->contact_time},
                              .duration = duration,
                              .sample_rate = RATE};
    if (number % 2 == 0) {
        scene->base = REFERENCE_SINE;
        scene->frequency = number == 0 ? 1 : draws_uniform(&draws, 0.8, 1.6);
        scene->amplitude = number == 0 ? 1 : draws_uniform(&draws, 0.8, 2);
        return;
    }
    Simulation simulation;
    Base base = {0};
    Problem problem;
    problem_clear(&problem);
    paper_scene(&simulation, 0.61, 0.025, duration);
    paper_random(&simulation, draws_uniform(&draws, 0.7, 1.5), seed * 1000 + number);
    if (simulation_complete(&simulation, NULL, NULL, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    const Excitation *excitation = scene_excitation(&simulation.scene);
    const Span span = {.duration = duration, .sample_rate = RATE};
    if (excitation_make(excitation, &span, NULL, &base, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    scene->base = REFERENCE_RECORD;
    scene->samples = base.values; // the scene's own now
    scene->sample_count = base.count;
    scene->interval = base.interval;
    simulation_clear(&simulation);
}

// One of the scene's numbers, up or down by an ulp; 0 leaves all as they are.
static void nudge(ReferenceScene *scene, int way) {
    double *const numbers[] = {&scene->stiffness, &scene->mass, &scene->damper_mass,
                               &scene->clearance};
    if (way == 0)
        return;
    double *number = numbers[(way - 1) / 2];
    *number = nextafter(*number, way % 2 == 0 ? 0 : INFINITY);
}

typedef struct Trusted {
    double parting, last; // earliest and latest of the doubles [s]; INFINITY: not within the run
    double horizon;       // what the run says [s]; INFINITY: not within the run
    bool is_told;
} Trusted;

static double parting(const double *values, const ReferenceAnswer *truth) {
    const double *quad = truth->channels[REFERENCE_DISPLACEMENT];
    double most = 0;
    for (size_t i = 0; i < truth->count; i++)
        most = fmax(most, fabs(quad[i]));
    for (size_t i = 0; i < truth->count; i++)
        if (!(fabs(values[i * SPARSE] - quad[i]) <= PARTED * most))
            return (double)(i * SPARSE) / RATE;
    return INFINITY;
}

static Trusted measure(const ReferenceScene *scene) {
    Trusted trusted = {INFINITY, 0, INFINITY, false};
    ReferenceScene sparse = *scene;
    ReferenceAnswer truth;
    sparse.sample_rate = RATE / SPARSE;
    reference_quad(&sparse, 1, 1e7, &truth);
    assert_true(truth.is_whole);
    for (int way = 0; way < DOUBLES; way++) {
        ReferenceScene nudged = *scene;
        nudge(&nudged, way);
        Outcome *outcome = drawn_run(&nudged, true);
        assert_non_null(outcome);
        const double here =
            parting(columns_find(&outcome->response.series, "displacement")->values, &truth);
        trusted.parting = fmin(trusted.parting, here);
        trusted.last = fmax(trusted.last, here);
        if (way == 0) {
            trusted.is_told = !isnan(outcome->summary.error_estimate);
            if (!isnan(outcome->summary.trust_horizon))
                trusted.horizon = outcome->summary.trust_horizon;
        }
        outcome_unref(outcome);
    }
    reference_clear(&truth);
    return trusted;
}

// Of the horizon over the parting; what lies beyond the run is known to lie there and no more.
static double ratio_of(const Trusted *trusted) {
    if (isinf(trusted->horizon) && isinf(trusted->parting))
        return 1;
    return fmin(trusted->horizon, duration) / fmin(trusted->parting, duration);
}

TEST(trust_ends_where_runs_part_from_quad_precision) {
    size_t within = 0, above = 0, told = 0;
    printf("%5s %-7s %-14s %-6s %9s %9s %9s %7s\n", "scene", "base", "buffer", "model", "earliest",
           "latest", "horizon", "ratio");
    const clock_t start = clock();
    for (size_t i = 0; i < scenes; i++) {
        ReferenceScene scene;
        paper_like(&scene, i);
        const Trusted trusted = measure(&scene);
        const double ratio = ratio_of(&trusted);
        printf("%5zu %-7s %-14s %-6s %9.3f %9.3f %9.3f %7.3f%s\n", i,
               i % 2 == 0 ? "sine" : "random", paper_buffers[i / 2 % COUNT(paper_buffers)].name,
               scene.is_impulse ? "imp" : "sd", trusted.parting, trusted.last, trusted.horizon,
               ratio, trusted.is_told ? "" : " (not told)");
        told += trusted.is_told;
        within += ratio >= 0.5 && ratio <= 1.3;
        above += ratio > 1.5;
        drawn_clear(&scene);
    }
    printf("%zu of %zu within 0.5 to 1.3, %zu above 1.5; %.1f s\n", within, scenes, above,
           (double)(clock() - start) / CLOCKS_PER_SEC);
    assert_true(told == scenes && above == 0 && 10 * within >= 9 * scenes);
}

int main(int argc, char **argv) {
    if (argc > 1)
        scenes = strtoul(argv[1], NULL, 10);
    if (argc > 2)
        duration = strtod(argv[2], NULL);
    if (argc > 3)
        seed = strtoull(argv[3], NULL, 10);
    fft_start();
    return test_run(0, NULL);
}
