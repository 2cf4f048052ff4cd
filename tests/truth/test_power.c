// Random scenes of one storey and one damper under power laws: every law, exponents of 1 to 3, e of
// 1e-3 to 1, T_c of 1e-5 to 0.1 s, still, sine and random bases. At full accuracy through
// power_reference.h; with a tolerance against full accuracy, where the run's own estimate is
// judged. `test_power COUNT SEED` runs a longer campaign and prints it.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/fft.h"
#include "core/solve/exact.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"
#include "tests/truth/drawn.h"
#include "tests/truth/power_reference.h"

static size_t scenes = 12;
static uint64_t seed = 1;
static bool is_verbose = false;

enum { IMPACTS_MAX = 300 };
static const double FLOOR = 2e-11;   // what is always allowed
static const double REFERENCE = 3e4; // what the reference misses, over a rounding's effect
static const double CHAOTIC = 1e-10; // a scene that a rounding changes more is not judged

typedef struct PowerScene {
    Simulation simulation;
    Plan *plan;
    Base base;
} PowerScene;

static Draws draws;

static Base draw_base(double interval, double duration) {
    Base base = {0};
    const double level = draws_scattered(&draws, 0.1, 30);
    if (draws_chance(&draws, 0.3))
        return base;
    if (draws_chance(&draws, 0.4)) {
        base.form = BASE_SINE;
        base.amplitude = level;
        base.omega = draws_scattered(&draws, 1, 200);
        return base;
    }
    base.form = BASE_SAMPLED;
    base.interval = draws_chance(&draws, 0.7) ? interval : interval * draws_uniform(&draws, 0.3, 3);
    base.count = (size_t)(duration / base.interval) + 2;
    base.values = malloc(base.count * sizeof *base.values);
    if (base.values == NULL)
        abort();
    double at = 0;
    for (size_t i = 0; i < base.count; i++)
        base.values[i] = at = 0.9 * at + level * draws_uniform(&draws, -1, 1);
    return base;
}

static const ContactLaw *draw_law(void) {
    const ContactLaw *law;
    do
        law = contacts[draws_bits(&draws) % 9];
    while (law->form != CONTACT_POWER);
    return law;
}

static double draw_exponent(void) {
    static const double usual[] = {1.5, 1.5, 1.5, 1, 2, 2.5, 3, 4.0 / 3};
    return draws_chance(&draws, 0.7) ? usual[draws_bits(&draws) % 8] : draws_uniform(&draws, 1, 3);
}

static void power_draw(PowerScene *scene, uint64_t number) {
    draws.state = number * 0x2545f4914f6cdd1dU;
    static const double rates[] = {1000, 1000, 200, 97, 4000};
    const ContactLaw *law = draw_law();
    const bool is_hard = draws_chance(&draws, 0.1);
    const double e = law->factor == NULL ? 1
                     : is_hard           ? draws_scattered(&draws, 1e-3, 0.1)
                                         : draws_uniform(&draws, 0.1, 1);
    Simulation *simulation = &scene->simulation;
    scene_with_damper(simulation, e, draws_scattered(&draws, 1e-5, 0.1));
    scene_choose(&simulation->scene.contact, &contact_kinds, law->kind.name);
    SdofStructure *sdof = (SdofStructure *)(void *)simulation->scene.structure;
    const double omega = draws_chance(&draws, 0.1) ? 0 : draws_scattered(&draws, 1, 300);
    sdof->stiffness = sdof->mass * omega * omega;
    sdof->damping = 2 * draws_scattered(&draws, 1e-3, 1) * omega * sdof->mass;
    Damper *damper = &simulation->scene.dampers.at[0];
    damper->mass = sdof->mass * draws_scattered(&draws, 1e-3, 10);
    damper->clearance = draws_scattered(&draws, 1e-4, 0.1);
    damper->position = damper->clearance * draws_uniform(&draws, -0.5, 0.5);
    damper->velocity = draws_uniform(&draws, -1, 1);
    damper->buffer.exponent = draw_exponent();
    simulation->scene.sample_rate = rates[draws_bits(&draws) % 5];
    simulation->scene.duration = 1;
    scene_start(simulation, draws_uniform(&draws, -0.02, 0.02), draws_uniform(&draws, -1, 1));
    Problem problem;
    problem_clear(&problem);
    if (simulation_complete(simulation, NULL, NULL, &problem) != STATUS_OK ||
        plan_new(&simulation->scene, "exact", "exact", &scene->plan, &problem) != STATUS_OK)
        fail_msg("scene %llu: %s", (unsigned long long)number, problem.detail);
    scene->base = draw_base(1 / simulation->scene.sample_rate, 1);
}

static void power_clear(PowerScene *scene) {
    base_clear(&scene->base);
    plan_free(scene->plan);
    simulation_clear(&scene->simulation);
}

typedef struct Answer {
    Response response;
    double *x;
    double steps;
    Status status;
} Answer;

static Answer power_run(const PowerScene *scene, double tolerance) {
    Answer answer = {.x = calloc(scene->plan->count, sizeof(double))};
    const RunColumn column = {CHANNEL_DISPLACEMENT, 0, answer.x};
    const AccuracyExact accuracy = {.tolerance = tolerance};
    Problem problem;
    problem_clear(&problem);
    Run run = {.plan = scene->plan,
               .base = &scene->base,
               .accuracy = &accuracy.accuracy,
               .columns = &column,
               .column_count = 1,
               .steps_max = 1e9,
               .impacts_max = 100000};
    answer.status = exact_run_engine(&run, &answer.response, &problem);
    answer.steps = run.steps;
    if (answer.status != STATUS_OK && is_verbose)
        printf("%s\n", problem.detail);
    return answer;
}

static void answer_clear(Answer *answer) {
    response_clear(&answer->response);
    free(answer->x);
}

static double difference(const double *a, const double *b, size_t count) {
    double most = 0;
    for (size_t i = 0; i < count; i++)
        most = fmax(most, fabs(a[i] - b[i]));
    return most;
}

static void print_scene(uint64_t number, const PowerScene *scene) {
    const ContactStop *stop = &scene->plan->dampers[0].stops[0];
    printf("scene %llu: %s n %.4g e %.3g T_c %.3g base %d rate %g: ", (unsigned long long)number,
           scene->plan->law->kind.name, stop->parameters.exponent, stop->numbers.restitution,
           stop->numbers.contact_time, (int)scene->base.form, scene->plan->sample_rate);
}

static void judge_impacts(uint64_t number, const PowerScene *scene, const Answer *answer,
                          const PowerTruth *truth, double allowed) {
    const Impacts *impacts = &answer->response.impacts;
    if (impacts->count != truth->count) {
        print_scene(number, scene);
        fail_msg("%zu impacts, should be %zu", impacts->count, truth->count);
    }
    for (size_t i = 0; i < truth->count; i++) {
        const Impact *is = &impacts->at[i];
        const PowerImpact *should = &truth->impacts[i];
        const double speed = fmax(should->approach, 1e-3);
        const double misses[] = {
            (is->approach_speed - should->approach) / speed,
            isnan(should->end) ? 0 : (is->separation_speed - should->separation) / speed,
            isnan(should->end) ? 0 : is->impulse / should->impulse - 1,
            should->peak > 0 ? fmax(should->peak / is->peak_force - 1, 0) : 0,
        };
        for (size_t k = 0; k < COUNT(misses); k++)
            if (!(fabs(misses[k]) <= 100 * allowed)) {
                print_scene(number, scene);
                fail_msg("impact %zu of %zu at %.9g s misses number %zu by %.2e, approach %.3g", i,
                         truth->count, is->start, k, misses[k], should->approach);
            }
    }
}

TEST(full_accuracy_is_that_of_another_integrator) {
    size_t judged = 0;
    double worst = 0;
    for (uint64_t number = seed; number < seed + scenes; number++) {
        PowerScene scene;
        PowerTruth truth;
        power_draw(&scene, number);
        Answer answer = power_run(&scene, (double)NAN);
        if (answer.status != STATUS_OK) {
            print_scene(number, &scene);
            fail_msg("failed");
        }
        assert_false(answer.response.is_stepped);
        assert_true(answer.response.energy.residual < 1e-10);
        const double size = answer.response.peaks.displacement;
        const double estimate = answer.response.error_estimate;
        power_truth(scene.plan, &scene.base, IMPACTS_MAX, &truth);
        if (estimate < CHAOTIC && truth.is_whole) {
            const double allowed = FLOOR + REFERENCE * estimate;
            const double error = difference(answer.x, truth.x, scene.plan->count) / size;
            if (is_verbose) {
                print_scene(number, &scene);
                printf("%zu impacts, error %.1e, estimate %.1e, %.0f steps\n", truth.count, error,
                       estimate, answer.steps);
            }
            if (!(error <= allowed)) {
                print_scene(number, &scene);
                fail_msg("error %.3e, allowed %.3e", error, allowed);
            }
            judge_impacts(number, &scene, &answer, &truth, allowed);
            worst = fmax(worst, error);
            judged++;
        } else if (is_verbose) {
            print_scene(number, &scene);
            printf("not judged: estimate %.1e, %zu impacts\n", estimate, truth.count);
        }
        power_truth_clear(&truth);
        answer_clear(&answer);
        power_clear(&scene);
    }
    print_message("%zu of %zu judged, worst error %.1e\n", judged, scenes, worst);
    assert_true(judged > scenes / 3);
}

TEST(a_tolerance_s_estimate_holds) {
    static const double tolerances[] = {1e-2, 1e-4, 1e-6, 1e-9};
    size_t held = 0, judged = 0, wide = 0;
    for (uint64_t number = seed; number < seed + scenes; number++) {
        PowerScene scene;
        power_draw(&scene, number);
        Answer best = power_run(&scene, (double)NAN);
        for (size_t i = 0; i < COUNT(tolerances) && best.status == STATUS_OK; i++) {
            Answer answer = power_run(&scene, tolerances[i]);
            const double size = best.response.peaks.displacement;
            const double error = difference(answer.x, best.x, scene.plan->count) / size;
            const double estimate = answer.response.error_estimate;
            // What full accuracy is wrong by is not the tolerance's.
            if (answer.status == STATUS_OK && error > 30 * best.response.error_estimate) {
                assert_true(answer.response.is_stepped);
                judged++;
                held += estimate >= fmin(error, 1);
                wide += estimate > 30 * error && estimate < 1;
                if (is_verbose && !(estimate >= fmin(error, 1) && estimate <= 30 * error)) {
                    print_scene(number, &scene);
                    printf("tolerance %.0e: error %.2e, estimate %.2e\n", tolerances[i], error,
                           estimate);
                }
            }
            answer_clear(&answer);
        }
        answer_clear(&best);
        power_clear(&scene);
    }
    print_message("%zu of %zu estimates hold, %zu are more than 30 times the error\n", held, judged,
                  wide);
    assert_true((double)held >= 0.98 * (double)judged);
    assert_true((double)wide <= 0.1 * (double)judged);
}

int main(int argc, char **argv) {
    fft_start();
    if (argc > 2) {
        scenes = (size_t)strtoul(argv[1], NULL, 10);
        seed = strtoull(argv[2], NULL, 10);
        is_verbose = argc > 3;
        if (argc > 4)
            cmocka_set_test_filter(argv[4]);
    }
    return test_run(0, NULL);
}
