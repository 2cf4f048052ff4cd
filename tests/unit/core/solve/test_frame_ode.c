// Two free bodies that meet once, through the general engine: what was recorded of an isolated
// contact comes back, whatever the law and the separation rule.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "core/contact/identify.h"
#include "core/contact/power.h"
#include "core/solve/frame.h"
#include "tests/support/fields.h"
#include "tests/support/scenes.h"

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
    StructureSdof *sdof = (StructureSdof *)(void *)simulation->scene.structure;
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
    if (frame_run(&with, response, &problem) != STATUS_OK)
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

static void linear_contacts_come_back_under_both_rules(void **state) {
    (void)state;
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

static void power_laws_last_as_recorded_and_part_as_they_say(void **state) {
    (void)state;
    static const double es[] = {0.02, 0.1, 0.5, 0.61, 0.9, 0.99, 1};
    static const double exponents[] = {1, 1.5, 2.5};
    for (size_t law = 0; contacts[law] != NULL; law++) {
        if (contacts[law]->form != CONTACT_POWER)
            continue;
        worst_restitution = worst_time = 0;
        for (size_t i = 0; i < COUNT(es); i++)
            for (size_t n = 0; n < COUNT(exponents); n++)
                for (size_t k = 0; k < COUNT(ratios); k++) {
                    if (es[i] < contacts[law]->least_restitution)
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
                    check(&pair, contacts[law]->reached(factor, exponents[n]), 1e-9);
                }
        print_message("%s: worst e %.1e, T_c %.1e\n", contacts[law]->kind.name, worst_restitution,
                      worst_time);
    }
}

static void hunt_and_crossleys_exact_factor_gives_the_restitution_asked_for(void **state) {
    (void)state;
    static const double es[] = {0.001, 0.01, 0.05, 0.3, 0.5, 0.7, 0.9, 0.97, 0.999, 1};
    for (size_t i = 0; i < COUNT(es); i++) {
        const Pair pair = {"hunt_crossley", 0, 0.082, es[i], 0.01, NAN, 1.5, 0.7, NAN};
        Derived derived;
        double residual;
        const Impact impact = meet(&pair, &derived, &residual);
        assert_true(fabs(impact.restitution - es[i]) < 1e-8);
    }
}

static void hertz_meets_its_closed_forms(void **state) {
    (void)state;
    const double k = 1e6, v0 = 0.4, m_e = effective_mass(1.35, 0.0135);
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

static void losses_are_those_of_the_speeds(void **state) {
    (void)state;
    const double m_e = effective_mass(1.35, 0.1 * 1.35);
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(linear_contacts_come_back_under_both_rules),
        cmocka_unit_test(power_laws_last_as_recorded_and_part_as_they_say),
        cmocka_unit_test(hunt_and_crossleys_exact_factor_gives_the_restitution_asked_for),
        cmocka_unit_test(hertz_meets_its_closed_forms),
        cmocka_unit_test(losses_are_those_of_the_speeds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
