// Collisions of many masses at one instant: who is pressed, who parts, and what stays the same.
#include <math.h>
#include <stdlib.h>

#include "core/solve/engine.h"
#include "tests/support/frames.h"
#include "tests/support/test.h"

static const Base still = {.form = BASE_STILL};

typedef struct Bench {
    Plan *plan;
    Run run;
    ModalState frame;
} Bench;

// Two storeys of 4 and 6 kg and three masses of 1, 2 and 3 kg, the last on the first storey.
static Bench make(double coupling) {
    const double mass[] = {4, 6}, stiffness[] = {100, 200}, damping[] = {0, 0};
    Bench bench = {.plan = frames_new(2, 3, 1, 100)};
    frames_shear(bench.plan, mass, stiffness, damping);
    bench.plan->mass[1] = bench.plan->mass[2] = coupling;
    for (size_t d = 0; d < 3; d++)
        frames_damper(bench.plan, d, d == 2 ? 0 : 1, 1 + (double)d, 0.1, 0.5, NAN);
    return bench;
}

static void start(Bench *bench) {
    bench->run = (Run){.plan = bench->plan, .base = &still};
    assert_int_equal(modal_state_make(&bench->frame, &bench->run, NULL), STATUS_OK);
}

static void clear(Bench *bench) {
    modal_state_clear(&bench->frame);
    plan_free(bench->plan);
}

static double velocity(const ModalState *frame, size_t storey) {
    return modal_state_dot(frame->modes->shapes + storey * frame->mode_count, frame->p,
                           frame->mode_count);
}

// Absolute momentum and kinetic energy of everything.
static void measure(ModalState *frame, double *momentum, double *energy) {
    *momentum = 0;
    for (size_t i = 0; i < 2; i++)
        for (size_t j = 0; j < 2; j++)
            *momentum += frame->plan->mass[i * 2 + j] * velocity(frame, j);
    for (size_t d = 0; d < 3; d++)
        *momentum += frame->damper[d].plan->mass *
                     (velocity(frame, frame->damper[d].plan->storey) + frame->damper[d].w);
    *energy = modal_state_energy(frame).kinetic;
}

static void hit(ModalState *frame, size_t d, Side side, double speed, double restitution) {
    DamperState *damper = &frame->damper[d];
    damper->in_collision = true;
    damper->side = side;
    damper->w = side == SIDE_RIGHT ? speed : -speed;
    damper->approach_speed = speed;
    damper->separation_speed = restitution * speed;
}

TEST(one_mass_takes_its_effective_mass) {
    Bench bench = make(0);
    start(&bench);
    double before, after, kinetic, left;
    hit(&bench.frame, 1, SIDE_RIGHT, 3, 0.5);
    measure(&bench.frame, &before, &kinetic);
    collision_resolve(&bench.frame);
    measure(&bench.frame, &after, &left);
    const double m = 2 * 6 / (2 + 6.0);
    assert_true(fabs(bench.frame.damper[1].impulse - m * 4.5) < 1e-14);
    assert_true(fabs(bench.frame.damper[1].w + 1.5) < 1e-15);
    assert_true(fabs(after - before) < 1e-14);
    assert_true(fabs(kinetic - left - 0.5 * m * (9 - 2.25)) < 1e-13);
    clear(&bench);
}

// The mass of 1 kg rests at the right stop; one of 2 kg comes from the left onto the same storey's
// right stop: a hit to the right draws the stop away from the resting mass.
TEST(a_resting_mass_is_left_behind_by_a_hit_away_from_it) {
    Bench bench = make(0);
    start(&bench);
    bench.frame.damper[0].in_collision = true;
    bench.frame.damper[0].side = SIDE_RIGHT;
    hit(&bench.frame, 1, SIDE_RIGHT, 3, 0.5);
    collision_resolve(&bench.frame);
    assert_true(bench.frame.damper[0].impulse == 0);
    assert_true(bench.frame.damper[0].w < 0); // away from its stop
    assert_true(fabs(bench.frame.damper[1].impulse - 2 * 6 / 8.0 * 4.5) < 1e-14);
    clear(&bench);
}

// At the left stop it is pushed along, and both bodies together take the hit.
TEST(a_resting_mass_is_pushed_along_by_a_hit_towards_it) {
    Bench bench = make(0);
    start(&bench);
    bench.frame.damper[0].in_collision = true;
    bench.frame.damper[0].side = SIDE_LEFT;
    hit(&bench.frame, 1, SIDE_RIGHT, 3, 0.5);
    collision_resolve(&bench.frame);
    const double m = 2 * 7 / (2 + 7.0); // of 2 kg and 6 + 1 kg
    assert_true(fabs(bench.frame.damper[1].impulse - m * 4.5) < 1e-14);
    assert_true(fabs(bench.frame.damper[0].impulse - m * 4.5 / 7) < 1e-14);
    assert_true(bench.frame.damper[0].w == 0);
    clear(&bench);
}

// Where M couples the storeys a hit on one is felt at once on the other.
TEST(a_hit_is_felt_on_other_storeys_through_the_mass_matrix) {
    Bench apart = make(0), coupled = make(1);
    for (int i = 0; i < 2; i++) {
        Bench *bench = i == 0 ? &apart : &coupled;
        start(bench);
        bench->frame.damper[2].in_collision = true;
        bench->frame.damper[2].side = SIDE_RIGHT; // at rest on the other storey
        hit(&bench->frame, 1, SIDE_RIGHT, 3, 0.5);
        collision_resolve(&bench->frame);
    }
    assert_true(apart.frame.damper[2].impulse == 0 && apart.frame.damper[2].w == 0);
    // (M^-1)_12 is negative: the other storey goes left, into its mass.
    assert_true(coupled.frame.damper[2].impulse > 0.01 && coupled.frame.damper[2].w == 0);
    clear(&apart);
    clear(&coupled);
}

static uint64_t seed = 7;
static double uniform(double a, double b) {
    seed = seed * 6364136223846793005U + 1442695040888963407U;
    return a + (b - a) * (double)(seed >> 11) * 0x1p-53;
}

// Pressed or parting fast enough, one of them equal; momentum kept and no energy gained.
TEST(random_collisions_meet_their_conditions) {
    for (int i = 0; i < 2000; i++) {
        Bench bench = make(uniform(-3, 3));
        start(&bench);
        double before, after, kinetic, left, taken = 0, closing[3], parting[3];
        for (size_t d = 0; d < 3; d++) {
            const double speed = uniform(0, 1) < 0.4 ? 0 : uniform(0, 5);
            hit(&bench.frame, d, uniform(0, 1) < 0.5 ? SIDE_LEFT : SIDE_RIGHT, speed,
                uniform(0, 1));
            closing[d] = bench.frame.damper[d].approach_speed;
            parting[d] = bench.frame.damper[d].separation_speed;
        }
        bench.frame.p[0] = uniform(-1, 1);
        measure(&bench.frame, &before, &kinetic);
        collision_resolve(&bench.frame);
        measure(&bench.frame, &after, &left);
        for (size_t d = 0; d < 3; d++) {
            const DamperState *damper = &bench.frame.damper[d];
            const double away = -modal_state_sign(damper->side) * damper->w;
            assert_true(damper->impulse >= 0);
            assert_true(away >= parting[d] - 1e-13);
            if (damper->impulse > 0)
                assert_true(fabs(away - parting[d]) < 1e-13);
            taken += damper->impulse * (closing[d] - parting[d]) / 2;
        }
        assert_true(fabs(after - before) < 1e-12);
        assert_true(fabs(kinetic - left - taken) < 1e-11);
        assert_true(taken >= 0);
        clear(&bench);
    }
}

// Masses far heavier than their storeys hardly feel a push that throws these to and fro: the
// impulses of all are far larger than what any of them lacks.
TEST(masses_heavier_than_their_storeys_are_no_worse) {
    for (int i = 0; i < 500; i++) {
        Bench bench = make(0);
        for (size_t d = 0; d < 3; d++) {
            bench.plan->dampers[d].mass = pow(10, uniform(3, 7));
            bench.plan->dampers[d].storey = 0;
        }
        start(&bench);
        double before, after, kinetic, left, taken = 0, closing[3], size = 0;
        for (size_t d = 0; d < 3; d++) {
            const double speed = d > 0 && uniform(0, 1) < 0.4 ? 0 : uniform(1, 5);
            hit(&bench.frame, d, uniform(0, 1) < 0.5 ? SIDE_LEFT : SIDE_RIGHT, speed,
                uniform(0, 1));
            closing[d] = speed;
            size += speed * bench.plan->dampers[d].mass;
        }
        measure(&bench.frame, &before, &kinetic);
        collision_resolve(&bench.frame);
        measure(&bench.frame, &after, &left);
        for (size_t d = 0; d < 3; d++)
            taken += bench.frame.damper[d].impulse *
                     (closing[d] - bench.frame.damper[d].separation_speed) / 2;
        assert_true(fabs(after - before) < 1e-8 * size);
        assert_true(fabs(kinetic - left - taken) < 1e-8 * kinetic);
        clear(&bench);
    }
}

// Where all masses are heavy beside what they stand on, each impulse acts on every other one.
TEST(many_heavy_masses_on_one_storey_meet_their_conditions) {
    enum { MANY = 64 };
    const double mass = 1, stiffness = 100, damping = 0;
    for (int i = 0; i < 100; i++) {
        Bench bench = {.plan = frames_new(1, MANY, 1, 100)};
        frames_shear(bench.plan, &mass, &stiffness, &damping);
        for (size_t d = 0; d < MANY; d++)
            frames_damper(bench.plan, d, 0, uniform(0.5, 1) * pow(10, i % 5), 0.1, 0.5, NAN);
        start(&bench);
        ModalState *frame = &bench.frame;
        for (size_t d = 0; d < MANY; d++)
            hit(frame, d, uniform(0, 1) < 0.5 ? SIDE_LEFT : SIDE_RIGHT,
                uniform(0, 1) < 0.4 ? 0 : uniform(0, 5), uniform(0, 1));
        collision_resolve(frame);
        size_t pressed = 0;
        double impulse = 0, size = 0;
        for (size_t d = 0; d < MANY; d++) {
            const DamperState *damper = &frame->damper[d];
            assert_true(damper->impulse >= 0);
            assert_true(-modal_state_sign(damper->side) * damper->w >=
                        damper->separation_speed - 1e-8);
            pressed += damper->impulse > 0;
            impulse += modal_state_sign(damper->side) * damper->impulse;
            size += damper->impulse;
        }
        assert_true(pressed > 0 && pressed < MANY);
        // All that the storey gets.
        assert_true(fabs(frame->p[0] * frame->damper[0].shape[0] - impulse) < 1e-12 * size);
        clear(&bench);
    }
}
