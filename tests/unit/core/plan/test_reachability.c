// What is said of a run before it begins, against the run itself with all its machinery: a mass
// that is said to stay clear of its stops must never meet one, nor come nearer than was said.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/plan.h"
#include "core/solve/exact.h"
#include "tests/support/frames.h"
#include "tests/support/test.h"

enum { SCENES = 900, SAMPLES = 401 };
#define RATE 100.0

// Within (0, 1), the same each time.
static double draw(uint64_t *state) {
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return ((double)(*state >> 11) + 0.5) * 0x1p-53;
}

static double between(uint64_t *state, double least, double most) {
    return least * pow(most / least, draw(state));
}

static void draw_base(uint64_t *state, BaseForm form, double *values, Base *base) {
    const double size = between(state, 0.01, 3);
    memset(base, 0, sizeof *base);
    base->form = form;
    if (form == BASE_SINE) {
        base->amplitude = draw(state) < 0.5 ? size : -size;
        base->omega = between(state, 1, 60);
    }
    if (form == BASE_SAMPLED) { // its own grid, and over before the run now and then
        const size_t count = draw(state) < 0.5 ? SAMPLES + 1 : SAMPLES / 2;
        base->values = values;
        base->count = count;
        base->interval = draw(state) < 0.5 ? 1 / RATE : 0.013;
        const double low = between(state, 1, 60);
        for (size_t i = 0; i < count; i++)
            values[i] = size * sin(low * (double)i * base->interval) * cos(7.3 * (double)i);
    }
    if (form == BASE_PIECES) { // a triangle
        const double start = draw(state), half = between(state, 0.01, 0.5);
        base->piece_count = 3;
        base->pieces[0] = (BasePiece){start, 0, size / half};
        base->pieces[1] = (BasePiece){start + half, size, -size / half};
        base->pieces[2] = (BasePiece){start + 2 * half, 0, 0};
    }
}

static Plan *draw_plan(uint64_t *state, BaseForm form) {
    const size_t storeys = 1 + (size_t)(3 * draw(state));
    Plan *plan = frames_new(storeys, 1 + (draw(state) < 0.3), (SAMPLES - 1) / RATE, RATE);
    double mass[3], stiffness[3], damping[3];
    for (size_t i = 0; i < 3; i++) {
        mass[i] = between(state, 0.5, 5);
        stiffness[i] = between(state, 10, 5000);
        // From none over coupled to more than critical.
        damping[i] = draw(state) < 0.2 ? 0 : between(state, 0.01, 300);
    }
    frames_shear(plan, mass, stiffness, damping);
    for (size_t d = 0; d < plan->damper_count; d++) {
        frames_damper(plan, d, (size_t)((double)storeys * draw(state)), 0.1,
                      between(state, 1e-3, 30), 0.6, 0.02);
        plan->dampers[d].offset = draw(state) - 0.5;
        if (draw(state) < 0.5)
            plan->dampers[d].position = plan->dampers[d].clearance * 0.4 * (draw(state) - 0.5);
        // A sine carries a mass off unless it starts with that speed.
        if (draw(state) < 0.5)
            plan->dampers[d].velocity = 0.2 * (draw(state) - 0.5);
    }
    for (size_t i = 0; i < storeys && (form == BASE_STILL || draw(state) < 0.5); i++) {
        plan->displacement[i] = 0.02 * (draw(state) - 0.5);
        plan->velocity[i] = draw(state) < 0.5 ? 0 : 0.2 * (draw(state) - 0.5);
    }
    return plan;
}

// How far the masses come from the middle of their stops at samples, as a part of the way.
static double furthest(const Plan *plan, const double *structure, const double *mass) {
    double most = 0;
    for (size_t d = 0; d < plan->damper_count; d++)
        for (size_t i = 0; i < SAMPLES; i++)
            most = fmax(most, fabs(mass[d * SAMPLES + i] - structure[d * SAMPLES + i] -
                                   plan->dampers[d].offset) /
                                  (plan->dampers[d].clearance / 2));
    return most;
}

typedef struct Told {
    size_t clear, missed, hit; // proved; not proved and yet no impact; impacts
} Told;

static void judge(uint64_t seed, BaseForm form, Told *told) {
    static double values[SAMPLES + 1], structure[2 * SAMPLES], mass[2 * SAMPLES];
    uint64_t state = seed;
    Base base;
    Plan *plan = draw_plan(&state, form);
    draw_base(&state, form, values, &base);
    // As the plan of a scene has them.
    Problem problem;
    problem_clear(&problem);
    modes_clear(&plan->modes);
    assert_int_equal(modes_make(&plan->modes, plan->storeys, plan->mass, plan->stiffness,
                                plan->damping, plan->influence, &problem),
                     STATUS_OK);
    RunColumn columns[4];
    for (size_t d = 0; d < plan->damper_count; d++) {
        columns[2 * d] =
            (RunColumn){CHANNEL_DISPLACEMENT, plan->dampers[d].storey, structure + d * SAMPLES};
        columns[2 * d + 1] = (RunColumn){CHANNEL_DAMPER_DISPLACEMENT, d, mass + d * SAMPLES};
    }
    const bool is_shared =
        plan->damper_count > 1 && plan->dampers[0].storey == plan->dampers[1].storey;
    Run run = {
        .plan = plan, .base = &base, .columns = columns, .column_count = 2 * plan->damper_count};
    if (is_shared) { // each once
        columns[2] = columns[3];
        run.column_count = 3;
    }
    Response response = {0};
    const Regime regime = regime_find(plan, &base);
    if (exact_run_engine(&run, &response, &problem) != STATUS_OK)
        fail_msg("seed %llu: %s", (unsigned long long)seed, problem.detail);
    if (is_shared)
        memcpy(structure + SAMPLES, structure, SAMPLES * sizeof *structure);
    const size_t impacts = response.impacts.count;
    if (regime.is_clear) {
        if (impacts > 0)
            fail_msg("seed %llu, base %d: said to stay clear, and %zu impacts",
                     (unsigned long long)seed, (int)form, impacts);
        assert_int_equal(run.work.contacts + run.work.bounces, 0);
        const double came = furthest(plan, structure, mass);
        if (!(came <= regime.reach * (1 + 1e-9)))
            fail_msg("seed %llu, base %d: said to come to %.9g, and comes to %.9g",
                     (unsigned long long)seed, (int)form, regime.reach, came);
    }
    told->clear += regime.is_clear;
    told->missed += !regime.is_clear && impacts == 0;
    told->hit += impacts > 0;
    response_clear(&response);
    plan_free(plan);
}

static void judge_all(BaseForm form, double least_part) {
    Told told = {0};
    for (uint64_t seed = 1; seed <= SCENES / 4; seed++)
        judge(seed, form, &told);
    print_message("base %d: %zu clear, %zu not told, %zu with impacts\n", (int)form, told.clear,
                  told.missed, told.hit);
    assert_true(told.hit > SCENES / 40);
    assert_true((double)told.clear >= least_part * (double)(told.clear + told.missed));
}

TEST(a_mass_said_to_stay_clear_over_a_still_base_does) {
    judge_all(BASE_STILL, 0.8);
}

TEST(a_mass_said_to_stay_clear_under_a_sine_does) {
    judge_all(BASE_SINE, 0.5);
}

TEST(a_mass_said_to_stay_clear_under_samples_does) {
    judge_all(BASE_SAMPLED, 0.5);
}

TEST(a_mass_said_to_stay_clear_under_a_pulse_does) {
    judge_all(BASE_PIECES, 0.5);
}

static Plan *single(double clearance) {
    Plan *plan = frames_new(1, 1, 10, 1000);
    frames_shear(plan, &(double){1.35}, &(double){865}, &(double){1.092});
    frames_damper(plan, 0, 0, 0.1107, clearance, 0.61, 0.025);
    modes_clear(&plan->modes);
    return plan;
}

TEST(from_rest_over_a_still_base_nothing_moves) {
    Plan *plan = single(0.015);
    Base base = {0};
    Regime regime = regime_find(plan, &base);
    assert_true(regime.is_at_rest && regime.is_clear && regime.is_unforced);
    assert_true(regime.reach == 0);
    plan->dampers[0].velocity = 1e-300;
    regime = regime_find(plan, &base);
    assert_true(regime.is_clear && !regime.is_at_rest);
    plan->dampers[0].velocity = 0;
    base = (Base){.form = BASE_SINE, .amplitude = 1e-300, .omega = 1};
    regime = regime_find(plan, &base);
    assert_true(!regime.is_at_rest && !regime.is_unforced);
    plan_free(plan);
}

// There its first touch may be at t = 0.
TEST(a_mass_on_its_stop_or_without_room_is_not_clear) {
    Plan *plan = single(0.015);
    const Base base = {0};
    plan->dampers[0].position = 0.0075;
    assert_false(regime_find(plan, &base).is_clear);
    plan->dampers[0].position = 0;
    plan->dampers[0].clearance = 0;
    assert_false(regime_find(plan, &base).is_clear);
    plan_free(plan);
}

// Released from 15 mm the mass stays there while the structure swings out to the other side.
TEST(the_bound_of_a_release_is_no_larger_than_the_swing) {
    const Base base = {0};
    Plan *plan = single(0.0601);
    plan->displacement[0] = 0.015;
    const Regime regime = regime_find(plan, &base);
    assert_true(regime.is_clear);
    assert_true(fabs(regime.reach - 0.03 / 0.03005) < 1e-9);
    plan->dampers[0].clearance = 0.06;
    assert_false(regime_find(plan, &base).is_clear);
    plan_free(plan);
}

TEST(what_is_no_number_proves_nothing) {
    Plan *plan = single(1);
    const Base base = {.form = BASE_SINE, .amplitude = 1e308, .omega = 1e-300};
    assert_false(regime_find(plan, &base).is_clear);
    plan->displacement[0] = 1e308;
    plan->velocity[0] = 1e308;
    const Regime regime = regime_find(plan, &(Base){0});
    assert_false(regime.is_clear);
    assert_true(regime.reach == regime.reach);
    plan_free(plan);
}
