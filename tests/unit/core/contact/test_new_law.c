// The contact law that web/guide/extending.md shows as an example, compiled from that page.
#include <math.h>

#include "core/contact/contact.h"
#include "tests/support/paper.h"
#include "tests/support/test.h"

extern const ContactLaw contact_hu_guo;

TEST(the_example_reaches_the_restitution_of_its_formula) {
    assert_true(contact_hu_guo.factor(1) == 0);
    // D = 1.5 for e = 0.5; the root of A(-D e) = A(D), A(x) = x - ln(1 + x), by bisection.
    const double reached = contact_hu_guo.restitution(contact_hu_guo.factor(0.5), 1.5);
    assert_true(fabs(reached - 0.48774125601534846) < 1e-14);
}

TEST(a_scene_runs_under_the_example) {
    const double restitution = 0.5, contact_time = 0.0003;
    Simulation simulation;
    Problem problem;
    Outcome *outcome;
    problem_clear(&problem);
    paper_scene(&simulation, restitution, contact_time, 5);
    variant_free(simulation.scene.contact);
    simulation.scene.contact = variant_new(&contact_hu_guo.kind);
    assert_non_null(simulation.scene.contact);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
    assert_int_equal(simulation_run(&simulation, NULL, NULL, NULL, &outcome, &problem), STATUS_OK);
    assert_string_equal(outcome->plan.contact_model, "hu_guo");
    const Impacts *impacts = &outcome->response.impacts;
    assert_true(impacts->count >= 10);
    // The structure's spring acts during a contact, too, but little in so short a time.
    for (size_t i = 0; i < 10; i++) {
        assert_true(fabs(impacts->at[i].restitution - 0.4877) < 0.005);
        assert_true(fabs(impacts->at[i].duration / contact_time - 1) < 0.01);
    }
    assert_true(outcome->summary.energy_residual < 1e-9);
    outcome_unref(outcome);
    simulation_clear(&simulation);
}
