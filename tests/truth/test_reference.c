// Random scenes through the exact solver and through reference.h: what the solver misses may be
// little more than what a plain double of the reference's own method misses. `test_reference COUNT
// SEED` runs a longer campaign.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "tests/support/test.h"
#include "tests/truth/drawn.h"
#include "tests/truth/reference_compare.h"

static size_t scenes = 15;
static uint64_t seed = 1;
static bool is_verbose = false;

enum { DOUBLES = 3 }; // of other sub-steps, for one may be right by luck
static const double STEPS_MAX = 25000;
static const double CHAOTIC = 1e-8; // a double that misses more cannot be judged by
static const double FACTOR = 100;   // of what that double misses
static const double FLOOR = 1e-12;

typedef struct Tally {
    size_t judged, chaotic, heavy, failed, rests, impacts;
    double worst_ratio, quad_seconds;
} Tally;

static void fault(Tally *tally, bool *is_told, const ReferenceScene *scene, size_t number,
                  const char *text) {
    if (!*is_told) {
        printf("scene %zu (seed %llu):\n", number, (unsigned long long)seed);
        drawn_print(scene);
        tally->failed++;
    }
    *is_told = true;
    printf("  %s\n", text);
}

static void judge(const ReferenceScene *scene, size_t number, Tally *tally) {
    ReferenceAnswer quad, plain[DOUBLES], solved;
    memset(&solved, 0, sizeof solved);
    memset(&quad, 0, sizeof quad);
    bool is_told = false;
    char text[400];
    const clock_t before = clock();
    for (int i = 0; i < DOUBLES; i++)
        reference_double(scene, 1 - 0.2 * i, 2 * STEPS_MAX, &plain[i]);
    if (plain[0].is_whole)
        reference_quad(scene, 1, STEPS_MAX, &quad);
    tally->quad_seconds += (double)(clock() - before) / CLOCKS_PER_SEC;
    Outcome *outcome = drawn_run(scene, true);
    if (outcome == NULL)
        fault(tally, &is_told, scene, number, "the solver gave up");
    else if (!(outcome->summary.energy_residual < 1e-9)) {
        snprintf(text, sizeof text, "energy residual %g", outcome->summary.energy_residual);
        fault(tally, &is_told, scene, number, text);
    }
    if (!quad.is_whole)
        tally->heavy++;
    else if (outcome != NULL && drawn_answer(outcome, &solved)) {
        ReferenceMisses by_double, by_solver;
        reference_compare(scene, &plain[0], &quad, &by_double);
        for (int i = 1; i < DOUBLES; i++) {
            ReferenceMisses other;
            reference_compare(scene, &plain[i], &quad, &other);
            for (int k = 0; k < MISS_COUNT; k++)
                by_double.of[k] = fmax(by_double.of[k], other.of[k]);
            if (!other.is_same)
                by_double = other;
        }
        reference_compare(scene, &solved, &quad, &by_solver);
        if (!by_double.is_same || by_double.of[MISS_DISPLACEMENT] > CHAOTIC ||
            by_double.of[MISS_START] > CHAOTIC) {
            tally->chaotic++;
            if (is_verbose)
                printf("scene %zu chaotic: %g %g, solver %g %g; %s | %s\n", number, by_double.of[0],
                       by_double.of[1], by_solver.of[0], by_solver.of[1], by_double.why,
                       by_solver.why);
        } else {
            tally->judged++;
            tally->impacts += quad.impact_count;
            for (size_t i = 0; i < quad.impact_count; i++)
                tally->rests += quad.impacts[i].is_resting;
            if (!by_solver.is_same)
                fault(tally, &is_told, scene, number, by_solver.why);
            for (int i = 0; i < MISS_COUNT && by_solver.is_same; i++) {
                const double limit =
                    fmax(FACTOR * by_double.of[i], i <= MISS_START ? FLOOR : 100 * FLOOR);
                if (i <= MISS_START)
                    tally->worst_ratio = fmax(tally->worst_ratio, by_solver.of[i] / limit);
                if (!(by_solver.of[i] <= limit)) {
                    snprintf(text, sizeof text, "%s misses %g, a plain double %g",
                             reference_metric_names[i], by_solver.of[i], by_double.of[i]);
                    fault(tally, &is_told, scene, number, text);
                }
            }
        }
    }
    outcome_unref(outcome);
    reference_clear(&quad);
    for (int i = 0; i < DOUBLES; i++)
        reference_clear(&plain[i]);
    reference_clear(&solved);
}

TEST(random_scenes_agree_with_quad_precision) {
    Tally tally = {0, 0, 0, 0, 0, 0, 0, 0};
    for (size_t i = 0; i < scenes; i++) {
        ReferenceScene scene;
        drawn_scene(&scene, seed * 1000003 + i, 3);
        drawn_zero_force(&scene, seed * 1000003 + i);
        judge(&scene, i, &tally);
        drawn_clear(&scene);
    }
    printf("%zu scenes: %zu judged with %zu impacts and %zu rests, %zu too chaotic, %zu too heavy, "
           "%zu failed; "
           "worst at %.2g of the limit; %.1f s in the reference\n",
           scenes, tally.judged, tally.impacts, tally.rests, tally.chaotic, tally.heavy,
           tally.failed, tally.worst_ratio, tally.quad_seconds);
    assert_true(tally.failed == 0);
    assert_true(2 * tally.judged > scenes);
}

// Scenes in which something is exactly 0, or happens within one sample, one arc or one unit of the
// clock.
TEST(awkward_scenes_agree_with_quad_precision) {
    const ReferenceScene usual = {.mass = 1,
                                  .damper_mass = 0.1,
                                  .clearance = 0.01,
                                  .restitution = {0.5, 0.5},
                                  .contact_time = {1e-3, 1e-3},
                                  .duration = 3,
                                  .sample_rate = 1000};
    ReferenceScene awkward[12];
    size_t count = 0;
    // Nothing holds the structure: it pushes no stop, and -0 is not a push either.
    ReferenceScene scene = usual;
    scene.is_impulse = true;
    scene.relative_velocity = 0.1;
    awkward[count++] = scene;
    scene.base = REFERENCE_SINE;
    scene.frequency = scene.amplitude = 1;
    awkward[count++] = scene;
    scene.is_impulse = false;
    awkward[count++] = scene;
    // Chatter within one long sample interval.
    scene = usual;
    scene.is_impulse = true;
    scene.stiffness = 1e4;
    scene.damping = 10;
    scene.position = 0.0049;
    scene.restitution[0] = scene.restitution[1] = 0.97;
    scene.base = REFERENCE_SINE;
    scene.frequency = 0.1;
    scene.amplitude = 5;
    scene.sample_rate = 1;
    awkward[count++] = scene;
    // Leaving its stop after a rest, the mass is back before half a millisecond is over.
    awkward[count++] = (ReferenceScene){.mass = 0.46701926499704804,
                                        .stiffness = 1924.7210902027753,
                                        .damping = 0.060269535257521302,
                                        .damper_mass = 0.2921284657236275,
                                        .clearance = 0.015945329076344859,
                                        .position = -1.217937248267568e-05,
                                        .relative_velocity = -2.3701621139095943,
                                        .is_impulse = true,
                                        .restitution = {0.88196233379853894, 0.81533580694737784},
                                        .contact_time = {1e-3, 1e-3},
                                        .base = REFERENCE_SINE,
                                        .frequency = 0.20463130410327543,
                                        .amplitude = 67.171029374396454,
                                        .is_amplitude_displacement = true,
                                        .duration = 3,
                                        .sample_rate = 333};
    // A structure with damping alone, a base whose samples fall between the output's.
    static const double samples[] = {0,    0.5, -0.3, 0.8,  -0.6, 0.2, 0.4,
                                     -0.7, 0.1, 0.9,  -0.8, 0.3,  0.6};
    scene = usual;
    scene.damping = 0.025;
    scene.clearance = 1;
    scene.base = REFERENCE_RECORD;
    scene.samples = samples;
    scene.sample_count = COUNT(samples);
    scene.interval = 0.11;
    scene.sample_rate = 20;
    awkward[count++] = scene;
    // No clearance; a start at a stop.
    scene = usual;
    scene.stiffness = 600;
    scene.damping = 0.5;
    scene.displacement = 0.01;
    scene.position = 0.005;
    awkward[count++] = scene;
    scene.is_impulse = true;
    awkward[count++] = scene;
    scene.clearance = scene.position = 0;
    awkward[count++] = scene;
    scene.is_impulse = false;
    awkward[count++] = scene;
    scene.base = REFERENCE_SINE;
    scene.displacement = 0;
    scene.frequency = scene.amplitude = 3;
    awkward[count++] = scene;
    // A sine above the sample rate.
    scene.frequency = 700;
    scene.amplitude = 300;
    scene.clearance = 1e-4;
    scene.sample_rate = 100;
    awkward[count++] = scene;
    Tally tally = {0, 0, 0, 0, 0, 0, 0, 0};
    for (size_t i = 0; i < count; i++)
        judge(&awkward[i], i, &tally);
    assert_true(tally.failed == 0);
    assert_true(tally.judged == count);
}

// The reference itself: two bodies alone return just what their contact was identified from, under
// both rules and to quad precision.
TEST(the_reference_returns_restitution_and_contact_time) {
    const double restitutions[] = {0.02, 0.1, 0.135, 0.136, 0.46, 0.97};
    for (size_t i = 0; i < COUNT(restitutions); i++)
        for (int rule = 0; rule < 2; rule++) {
            const double e = restitutions[i], T = 3e-3;
            const ReferenceScene scene = {.mass = 1.35,
                                          .damper_mass = 0.1107,
                                          .clearance = 0.015,
                                          .is_zero_force = rule == 1,
                                          .restitution = {e, e},
                                          .contact_time = {T, T},
                                          .relative_velocity = 0.5,
                                          .duration = 0.03,
                                          .sample_rate = 1000};
            ReferenceAnswer answer;
            reference_quad(&scene, 1, STEPS_MAX, &answer);
            assert_true(answer.is_whole && answer.impact_count == 1);
            const ReferenceImpact *impact = &answer.impacts[0];
            const double energy = 1.35 * 0.1107 / (1.35 + 0.1107) * 0.5 * 0.5 / 2 * (1 - e * e);
            assert_true(fabs(impact->separation / impact->approach - e) < 1e-15);
            assert_true(fabs(impact->end - impact->start - T) < 1e-15 * 0.03 / T);
            assert_true(fabs(impact->lost / energy - 1) < 1e-14);
            reference_clear(&answer);
        }
}

int main(int argc, char **argv) {
    if (argc > 1)
        scenes = strtoul(argv[1], NULL, 10);
    if (argc > 2)
        seed = strtoull(argv[2], NULL, 10);
    is_verbose = argc > 3;
    return test_run(0, NULL);
}
