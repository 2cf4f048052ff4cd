// One contact of two free bodies in the event engine has the restitution and the contact time that
// its buffer was identified from, under every law and separation rule.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/contact/identification.h"
#include "core/contact/power_law.h"
#include "core/solve/exact.h"
#include "tests/support/fields.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static const double ratios[] = {1e-3, 0.082, 1, 10};

typedef struct Pair {
    const char *model;
    int separation;
    double ratio; // of the free mass to the other
    double restitution, contact_time, stiffness, exponent;
    double speed;
    double rig; // NAN: none; else a fixed base and this mass
} Pair;

// From mid-clearance with speed towards the right stop, until shortly after the contact.
static void pair_scene(Simulation *simulation, const Pair *pair) {
    scene_with_damper(simulation, pair->restitution, pair->contact_time);
    SdofStructure *sdof = (SdofStructure *)(void *)simulation->scene.structure;
    sdof->mass = 1.35;
    sdof->stiffness = sdof->damping = 0;
    Damper *damper = &simulation->scene.dampers.at[0];
    damper->mass = pair->ratio * 1.35;
    damper->clearance = 0.02 * pair->speed;
    damper->velocity = pair->speed;
    damper->buffer.stiffness = pair->stiffness;
    damper->buffer.exponent = pair->exponent;
    if (!isnan(pair->rig)) {
        damper->identified_for = IDENTIFIED_FOR_RIG;
        damper->rig = (Rig){pair->rig, NAN};
    }
    scene_choose(&simulation->scene.contact, &contact_kinds, pair->model);
    ((Contact *)(void *)simulation->scene.contact)->separation = pair->separation;
    scene_start(simulation, 0, 0);
    simulation->scene.duration = 1;
    simulation->scene.sample_rate = 100;
}

static Impact run(Simulation *simulation, Response *response, Plan **plan) {
    Problem problem;
    problem_clear(&problem);
    const Base base = {0};
    if (simulation_complete(simulation, NULL, NULL, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    assert_int_equal(plan_new(&simulation->scene, "exact", "exact", plan, &problem), STATUS_OK);
    Run with = {.plan = *plan, .base = &base};
    if (exact_run_engine(&with, response, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    assert_true(response->impacts.count >= 1);
    return response->impacts.at[0];
}

static Impact meet(const Pair *pair, Derived *derived, double *residual) {
    Simulation simulation;
    Response response = {0};
    Plan *plan;
    pair_scene(&simulation, pair);
    // Long enough for the contact, short enough for no second one.
    const double T = isnan(pair->contact_time) ? 0.5 : pair->contact_time;
    simulation.scene.duration = 0.01 + 1.5 * T;
    simulation.scene.sample_rate = 10 / simulation.scene.duration;
    const Impact impact = run(&simulation, &response, &plan);
    *derived = plan->report.derived.at[1];
    derived->material = NULL;
    *residual = response.energy.residual;
    plan_free(plan);
    response_clear(&response);
    simulation_clear(&simulation);
    return impact;
}

static void assert_near(const Pair *pair, const char *what, double is, double should,
                        double relative) {
    if (!(fabs(is - should) <= relative * fabs(should)))
        fail_msg(
            "%s, e = %g, T_c = %g, mass ratio %g, rule %d: %s is %.17g, should be %.17g (%.2g)",
            pair->model, pair->restitution, pair->contact_time, pair->ratio, pair->separation, what,
            is, should, is / should - 1);
}

static double worst_restitution, worst_time;

static void check(const Pair *pair, double restitution, double relative) {
    Derived derived;
    double residual;
    const Impact impact = meet(pair, &derived, &residual);
    worst_restitution = fmax(worst_restitution, fabs(impact.restitution / restitution - 1));
    worst_time = fmax(worst_time, fabs(impact.duration / pair->contact_time - 1));
    assert_near(pair, "restitution", impact.restitution, restitution, relative);
    assert_near(pair, "duration", impact.duration, pair->contact_time, relative);
    assert_true(residual < 1e-11);
}

TEST(linear_contacts_come_back_under_both_rules) {
    static const double es[] = {0.02, 0.1, 0.1353352832366127, 0.2, 0.5, 0.61, 0.9, 0.99};
    static const double times[] = {0.0003, 0.025};
    worst_restitution = worst_time = 0;
    for (int rule = 0; rule < 2; rule++)
        for (size_t i = 0; i < COUNT(es); i++)
            for (size_t j = 0; j < COUNT(times); j++)
                for (size_t k = 0; k < COUNT(ratios); k++) {
                    const Pair pair = {
                        "spring_damper", rule, ratios[k], es[i], times[j], NAN, NAN, 0.3, NAN};
                    check(&pair, es[i], 1e-9);
                }
    print_message("worst e %.1e, T_c %.1e\n", worst_restitution, worst_time);
}

TEST(power_laws_last_as_recorded_and_part_as_they_say) {
    static const double es[] = {0.02, 0.1, 0.5, 0.61, 0.9, 0.99, 1};
    static const double exponents[] = {1, 1.5, 2.5};
    for (size_t law = 0; contacts[law] != NULL; law++) {
        if (contacts[law]->form != CONTACT_POWER)
            continue;
        worst_restitution = worst_time = 0;
        for (size_t i = 0; i < COUNT(es); i++)
            for (size_t n = 0; n < COUNT(exponents); n++)
                for (size_t k = 0; k < COUNT(ratios); k++) {
                    if (es[i] < contacts[law]->restitution_min)
                        continue;
                    const Pair pair = {contacts[law]->kind.name,
                                       0,
                                       ratios[k],
                                       es[i],
                                       k % 2 == 0 ? 0.0003 : 0.025,
                                       NAN,
                                       exponents[n],
                                       0.3,
                                       NAN};
                    const double factor =
                        contacts[law]->factor != NULL ? contacts[law]->factor(es[i]) : 0;
                    check(&pair, contacts[law]->restitution(factor, exponents[n]), 1e-9);
                }
        print_message("%s: worst e %.1e, T_c %.1e\n", contacts[law]->kind.name, worst_restitution,
                      worst_time);
    }
}

TEST(hunt_and_crossleys_exact_factor_gives_the_restitution_asked_for) {
    static const double es[] = {0.001, 0.01, 0.05, 0.3, 0.5, 0.7, 0.9, 0.97, 0.999, 1};
    for (size_t i = 0; i < COUNT(es); i++) {
        const Pair pair = {"hunt_crossley", 0, 0.082, es[i], 0.01, NAN, 1.5, 0.7, NAN};
        Derived derived;
        double residual;
        const Impact impact = meet(&pair, &derived, &residual);
        assert_true(fabs(impact.restitution - es[i]) < 1e-8);
    }
}

TEST(hertz_meets_its_closed_forms) {
    const double k = 1e6, v0 = 0.4, m_e = contact_effective_mass(1.35, 0.0135);
    const Pair pair = {"hertz", 0, 0.01, NAN, NAN, k, NAN, v0, NAN};
    Derived derived;
    double residual;
    const Impact impact = meet(&pair, &derived, &residual);
    const double p = pow(5 * m_e * v0 * v0 / (4 * k), 0.4);
    assert_near(&pair, "peak force", impact.peak_force, k * pow(p, 1.5), 1e-12);
    assert_near(&pair, "duration", impact.duration, 2.9432752 * p / v0, 1e-7);
    assert_near(&pair, "restitution", impact.restitution, 1, 1e-11);
    assert_near(&pair, "impulse", impact.impulse, 2 * m_e * v0, 1e-11);
    assert_true(fabs(impact.energy_lost) < 1e-11 * m_e * v0 * v0);
}

TEST(losses_are_those_of_the_speeds) {
    const double m_e = contact_effective_mass(1.35, 0.1 * 1.35);
    for (size_t law = 0; contacts[law] != NULL; law++) {
        if (contacts[law]->form != CONTACT_POWER || contacts[law]->factor == NULL)
            continue;
        const Pair pair = {contacts[law]->kind.name, 0, 0.1, 0.4, 0.02, NAN, 1.5, 0.5, NAN};
        Derived derived;
        double residual;
        const Impact impact = meet(&pair, &derived, &residual);
        const double after = impact.separation_speed;
        assert_near(&pair, "loss", impact.energy_lost, 0.5 * m_e * (0.25 - after * after), 1e-10);
        assert_near(&pair, "impulse", impact.impulse, m_e * (0.5 + after), 1e-10);
    }
}

// Each impact of a run has the table's values at its own approach speed. Two free bodies meet again
// and again, slower each time.
TEST(impacts_keep_to_the_table_at_their_speed) {
    static const char *const models[] = {"spring_damper", "hunt_crossley", "impulse"};
    for (size_t i = 0; i < COUNT(models); i++) {
        const Pair pair = {models[i], 0, 0.5, NAN, NAN, NAN, NAN, 1, NAN};
        Simulation simulation;
        pair_scene(&simulation, &pair);
        Buffer *buffer = &simulation.scene.dampers.at[0].buffer;
        buffer->table.count = 3;
        buffer->table.at = calloc(3, sizeof *buffer->table.at);
        assert_non_null(buffer->table.at);
        buffer->table.at[0] = (ContactRow){0.1, 0.9, 0.001};
        buffer->table.at[1] = (ContactRow){0.4, 0.7, 0.003};
        buffer->table.at[2] = (ContactRow){0.8, 0.5, 0.002};
        Response response = {0};
        Plan *plan;
        run(&simulation, &response, &plan);
        assert_false(plan_is_single(plan));
        assert_true(response.impacts.count > 5);
        for (size_t k = 0; k < response.impacts.count; k++) {
            const Impact *impact = &response.impacts.at[k];
            const ContactRow row = contact_rows_interpolate(&buffer->table, impact->approach_speed);
            if (isnan(impact->duration))
                continue;
            assert_near(&pair, "restitution", impact->restitution, row.restitution, 1e-10);
            if (plan->form != CONTACT_IMPULSIVE)
                assert_near(&pair, "duration", impact->duration, row.contact_time, 1e-10);
        }
        plan_free(plan);
        response_clear(&response);
        simulation_clear(&simulation);
    }
}

TEST(a_rigs_contact_is_that_of_its_masses) {
    for (int rule = 0; rule < 2; rule++) {
        const Pair pair = {"spring_damper", rule, 0.082, 0.61, 0.025, NAN, NAN, 0.3, 0.3};
        Derived derived;
        double residual;
        const Impact impact = meet(&pair, &derived, &residual);
        const Identification there =
            identification_from_restitution(0.3, 0.61, 0.025, (Separation)rule);
        assert_true(derived.stiffness == there.stiffness && derived.damping == there.damping);
        assert_true(derived.identified_mass == 0.3 && derived.restitution == 0.61);
        // A lighter pair is damped more.
        assert_true(derived.reached_restitution < 0.5 && derived.reached_contact_time < 0.02);
        assert_near(&pair, "restitution", impact.restitution, derived.reached_restitution, 1e-12);
        assert_near(&pair, "duration", impact.duration, derived.reached_contact_time, 1e-12);
    }
    for (size_t law = 0; contacts[law] != NULL; law++) {
        if (contacts[law]->form != CONTACT_POWER || contacts[law]->factor == NULL)
            continue;
        const Pair pair = {contacts[law]->kind.name, 0, 0.082, 0.61, 0.025, NAN, NAN, 0.3, 0.3};
        Derived derived;
        double residual;
        const Impact impact = meet(&pair, &derived, &residual);
        assert_near(&pair, "restitution", impact.restitution, derived.reached_restitution, 1e-9);
        assert_near(&pair, "duration", impact.duration, derived.reached_contact_time, 1e-9);
    }
}

// Hertz with n = 1 is a spring without damping, whose motion is exact in the linear engine.
TEST(a_linear_power_law_moves_as_a_spring) {
    Response responses[2];
    memset(responses, 0, sizeof responses);
    for (int power = 0; power < 2; power++) {
        Simulation simulation;
        Plan *plan;
        scene_with_damper(&simulation, NAN, NAN);
        simulation.scene.duration = 1.5;
        scene_choose(&simulation.scene.contact, &contact_kinds, power ? "hertz" : "spring_damper");
        Buffer *buffer = &simulation.scene.dampers.at[0].buffer;
        buffer->stiffness = 3e3;
        if (power)
            buffer->exponent = 1;
        else
            buffer->damping = 0;
        run(&simulation, &responses[power], &plan);
        assert_true(responses[power].energy.residual < 1e-11);
        plan_free(plan);
        simulation_clear(&simulation);
    }
    const Impacts *spring = &responses[0].impacts, *hertz = &responses[1].impacts;
    assert_true(spring->count > 5);
    assert_int_equal(spring->count, hertz->count);
    for (size_t k = 0; k < spring->count; k++) {
        assert_true(fabs(spring->at[k].start - hertz->at[k].start) < 1e-10);
        assert_true(fabs(spring->at[k].peak_force / hertz->at[k].peak_force - 1) < 1e-8);
        assert_true(fabs(spring->at[k].impulse / hertz->at[k].impulse - 1) < 1e-8);
    }
    response_clear(&responses[0]);
    response_clear(&responses[1]);
}
