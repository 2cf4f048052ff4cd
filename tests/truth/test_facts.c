// Facts of the physics that a correct program meets: closed forms, Table I, known orbits, the
// paper's thesis.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/excitation/excitation.h"
#include "core/excitation/recorded_motion.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static const double TURN = 6.283185307179586;

// Completes, runs and clears the simulation; a failure ends the test with its words.
static Outcome *run(Simulation *simulation) {
    static Problem problem;
    Warnings warnings = {NULL, 0};
    Outcome *outcome = NULL;
    problem_clear(&problem);
    if (simulation_complete(simulation, NULL, &warnings, &problem) != STATUS_OK ||
        simulation_run(simulation, NULL, NULL, NULL, &outcome, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.detail, problem.count > 0 ? problem.faults[0].pointer : "");
    warnings_clear(&warnings);
    simulation_clear(simulation);
    return outcome;
}

static SdofStructure *structure(Simulation *simulation) {
    return (SdofStructure *)(void *)simulation->scene.structure;
}

static const Impact *impact(const Outcome *outcome, size_t index) {
    assert_true(index < outcome->response.impacts.count);
    return &outcome->response.impacts.at[index];
}

static const double *channel(const Outcome *outcome, const char *name) {
    const Column *column = columns_find(&outcome->response.series, name);
    assert_non_null(column);
    return column->values;
}

static void assert_near(double value, double wanted, double relative) {
    if (!(fabs(value - wanted) <= relative * fabs(wanted)))
        fail_msg("%.17g is not %.17g within %g", value, wanted, relative);
}

TEST(table_one_follows_from_restitution_and_contact_time) {
    for (size_t i = 0; i < COUNT(paper_buffers); i++) {
        const PaperBuffer *buffer = &paper_buffers[i];
        Simulation simulation;
        paper_scene(&simulation, buffer->restitution, buffer->contact_time, 0.1);
        Outcome *outcome = run(&simulation);
        const Derived *derived = &outcome->plan.derived.at[0];
        assert_near(derived->stiffness, buffer->stiffness, 0.005);
        assert_near(derived->damping, buffer->damping, 0.005);
        outcome_unref(outcome);
    }
}

TEST(the_first_impact_comes_at_the_same_instant_with_every_model) {
    for (size_t i = 0; i < COUNT(paper_buffers); i++)
        for (int is_impulse = 0; is_impulse < 2; is_impulse++) {
            Simulation simulation;
            paper_scene(&simulation, paper_buffers[i].restitution, paper_buffers[i].contact_time,
                        0.2);
            paper_model(&simulation, is_impulse ? "impulse" : "spring_damper");
            Outcome *outcome = run(&simulation);
            assert_true(fabs(impact(outcome, 0)->start - 0.0416214083419515) <= 1e-13);
            outcome_unref(outcome);
        }
}

static double third_impact(double restitution, double contact_time, const char *model) {
    Simulation simulation;
    paper_scene(&simulation, restitution, contact_time, 1);
    simulation.scene.dampers.at[0].mass = 0.11;
    paper_model(&simulation, model);
    Outcome *outcome = run(&simulation);
    const double start = impact(outcome, 2)->start;
    outcome_unref(outcome);
    return start;
}

TEST(where_contact_takes_time_the_models_part_at_the_third_impact) {
    const double sponge = third_impact(0.61, 0.025, "spring_damper");
    assert_near(sponge, 0.26559, 2e-5);
    assert_near(third_impact(0.61, 0.025, "impulse"), 0.16939, 3e-5);
    const double aluminium = third_impact(0.46, 0.0003, "spring_damper");
    assert_near(third_impact(0.46, 0.0003, "impulse"), aluminium, 8e-4);
}

// Two bodies alone: the contact returns just what it was identified from.
TEST(an_isolated_pair_returns_restitution_and_contact_time) {
    const double restitutions[] = {0.02, 0.1, 0.46, 0.61, 0.9, 0.99},
                 ratios[] = {1e-3, 0.082, 1, 10};
    const double times[] = {1e-6, 0.0003, 0.025};
    for (size_t i = 0; i < COUNT(restitutions); i++)
        for (size_t j = 0; j < COUNT(ratios); j++)
            for (size_t k = 0; k < COUNT(times); k++) {
                Simulation simulation;
                paper_scene(&simulation, restitutions[i], times[k], 0.1);
                structure(&simulation)->stiffness = structure(&simulation)->damping = 0;
                paper_free(&simulation, 0);
                simulation.scene.dampers.at[0].mass = 1.35 * ratios[j];
                simulation.scene.dampers.at[0].velocity = -0.5;
                Outcome *outcome = run(&simulation);
                const Impact *first = impact(outcome, 0);
                assert_true(first->side == SIDE_LEFT);
                assert_near(first->start, 0.015, 1e-14);
                assert_near(first->restitution, restitutions[i], 1e-12);
                assert_near(first->duration, times[k], 1e-12);
                outcome_unref(outcome);
            }
}

TEST(sponge_contacts_in_free_vibration_last_as_long_as_published) {
    Simulation simulation;
    paper_scene(&simulation, 0.61, 0.025, 10);
    Outcome *outcome = run(&simulation);
    double least = 1, most = 0;
    for (size_t i = 0; i < outcome->response.impacts.count; i++) {
        least = fmin(least, impact(outcome, i)->duration);
        most = fmax(most, impact(outcome, i)->duration);
    }
    assert_true(fabs(least - 0.0241) < 1e-4 && fabs(most - 0.0288) < 1e-4);
    assert_true(outcome->summary.impacts == 22);
    assert_near(outcome->summary.rms_displacement, 0.0025838755, 1e-7);
    assert_near(outcome->summary.rms_acceleration, 1.5233478, 1e-7);
    assert_near(outcome->summary.peak_acceleration, 9.6111111, 1e-7);
    assert_near(impact(outcome, 0)->peak_force, 3.8424065276783246, 1e-12);
    assert_near(outcome->summary.peak_contact_force, impact(outcome, 1)->peak_force, 0);
    outcome_unref(outcome);
}

static void constant_base(Simulation *simulation, double acceleration, double duration) {
    scene_choose(&simulation->scene.excitation, &excitation_kinds, "record");
    ExcitationRecord *record = (ExcitationRecord *)(void *)simulation->scene.excitation;
    record->samples.at = malloc(2 * sizeof *record->samples.at);
    assert_non_null(record->samples.at);
    record->samples.at[0] = record->samples.at[1] = acceleration;
    record->samples.count = 2;
    record->interval = 2 * duration;
}

// A structure so heavy that it does not notice, already at rest under the pull.
TEST(a_bouncing_mass_comes_to_rest_after_infinitely_many_impacts) {
    const double g = 9.81, e = 0.5;
    Simulation simulation;
    paper_scene(&simulation, e, 1e-3, 2);
    paper_model(&simulation, "impulse");
    structure(&simulation)->mass = 1e12;
    structure(&simulation)->stiffness = 1e18;
    structure(&simulation)->damping = 0;
    simulation.scene.dampers.at[0].mass = 1e-3;
    simulation.scene.dampers.at[0].clearance = 2;
    constant_base(&simulation, -g, 2);
    scene_start(&simulation, g * 1e-6, 0); // M g / K
    Outcome *outcome = run(&simulation);
    double speed = sqrt(2 * g);
    size_t count = 0;
    for (; impact(outcome, count)->kind == IMPACT_IMPACT; count++, speed *= e)
        if (speed > 1e-9)
            assert_near(impact(outcome, count)->approach_speed, speed, 1e-6);
    assert_true(count > 32);
    assert_near(impact(outcome, count)->start, 1.354570922957, 1e-10);
    assert_near(impact(outcome, count)->peak_force, 1e-3 * g, 1e-6);
    assert_true(outcome->response.impacts.count == count + 1);
    outcome_unref(outcome);
}

// Masri and Caughey's two symmetric impacts per cycle.
TEST(the_masri_caughey_orbit_is_reached_and_kept) {
    const double C = 0.1, amplitude = 1 / sqrt(1 + C * C);
    Simulation simulation;
    paper_scene(&simulation, 0.6, 0.025, 300 * TURN);
    paper_model(&simulation, "impulse");
    structure(&simulation)->mass = structure(&simulation)->stiffness = 1;
    structure(&simulation)->damping = C;
    simulation.scene.dampers.at[0].mass = 0.1;
    simulation.scene.dampers.at[0].clearance = 20;
    simulation.scene.sample_rate = 20;
    paper_sine(&simulation, amplitude, 1 / TURN);
    ((ExcitationSine *)(void *)simulation.scene.excitation)->quantity = SINE_DISPLACEMENT;
    static const char *const names[] = {"displacement", "damper_displacement", "damper_velocity"};
    paper_channels(&simulation, names, COUNT(names));
    Outcome *outcome = run(&simulation);
    const size_t count = outcome->response.count;
    double most = 0;
    for (size_t i = count - 2000; i < count; i++) {
        const double t = (double)i / 20;
        assert_near(fabs(channel(outcome, "damper_velocity")[i] + amplitude * cos(t)),
                    6.441388128148, 1e-9);
        most = fmax(most, fabs(channel(outcome, "displacement")[i] + amplitude * sin(t)));
    }
    // Where the structure is at impact: the free mass flies straight, and is at a stop then.
    const Impact *last = &outcome->response.impacts.at[outcome->response.impacts.count - 1];
    const size_t before = (size_t)floor(last->start * 20);
    const double at = (double)before / 20,
                 slope = channel(outcome, "damper_velocity")[before] + amplitude * cos(at);
    const double z = channel(outcome, "damper_displacement")[before] + amplitude * sin(at) +
                     slope * (last->start - at);
    assert_near(fabs(z - (last->side == SIDE_RIGHT ? 10 : -10)), 0.118108811155, 1e-8);
    assert_near(most, 0.186892479 * 10, 2e-3); // of samples, so a little less than the true peak
    const Impacts *impacts = &outcome->response.impacts;
    for (size_t i = impacts->count - 40; i < impacts->count; i++)
        assert_near(impacts->at[i].start - impacts->at[i - 1].start, TURN / 2, 1e-9);
    outcome_unref(outcome);
}

static void model_distance(const PaperBuffer *buffer, bool is_random, double out[2]) {
    Outcome *outcomes[2];
    for (int i = 0; i < 2; i++) {
        Simulation simulation;
        paper_scene(&simulation, buffer->restitution, buffer->contact_time, is_random ? 30 : 10);
        if (is_random)
            paper_random(&simulation, 1, 1);
        paper_model(&simulation, i == 0 ? "spring_damper" : "impulse");
        outcomes[i] = run(&simulation);
    }
    out[0] = paper_distance(outcomes[0], outcomes[1], 0.5, 15);
    out[1] = paper_distance(outcomes[0], outcomes[1], 15, 100);
    outcome_unref(outcomes[0]);
    outcome_unref(outcomes[1]);
}

TEST(the_models_agree_on_aluminium_and_differ_on_the_sponge) {
    const PaperBuffer *sponge = &paper_buffers[0], *aluminium = &paper_buffers[4];
    double soft[2], hard[2];
    model_distance(sponge, false, soft);
    model_distance(aluminium, false, hard);
    printf("free:   sponge %.1f / %.1f dB, aluminium %.1f / %.1f dB\n", soft[0], soft[1], hard[0],
           hard[1]);
    assert_true(fabs(soft[0] - 8.6) < 0.1 && fabs(soft[1] - 20.4) < 0.1);
    assert_true(fabs(hard[0] - 2.8) < 0.1 && fabs(hard[1] - 7.6) < 0.1);
    model_distance(sponge, true, soft);
    model_distance(aluminium, true, hard);
    printf("random: sponge %.1f / %.1f dB, aluminium %.1f / %.1f dB\n", soft[0], soft[1], hard[0],
           hard[1]);
    assert_true(soft[1] > 4 * hard[1] && hard[1] < 4 && soft[0] > hard[0]);
}

// A free mass that misses its stops leaves the structure to itself; white base acceleration of
// density G gives var(x) = G / (8 xi w^3).
TEST(white_noise_gives_the_variance_of_theory) {
    Simulation simulation;
    paper_scene(&simulation, 0.61, 0.025, 20000);
    fields_clear(damper_fields, &simulation.scene.dampers.at[0]);
    simulation.scene.dampers.count = 0;
    paper_free(&simulation, 0);
    simulation.scene.sample_rate = 200;
    paper_random(&simulation, 1, 3);
    ExcitationRandom *random = (ExcitationRandom *)(void *)simulation.scene.excitation;
    random->band.at[1] = 100;
    static const char *const names[] = {"displacement"};
    paper_channels(&simulation, names, COUNT(names));
    simulation.output.statistics_from = 100;
    Outcome *outcome = run(&simulation);
    const double w = sqrt(865 / 1.35), xi = 1.092 / (2 * sqrt(865 * 1.35)), G = 1.0 / 100;
    const double variance = outcome->summary.rms_displacement * outcome->summary.rms_displacement;
    assert_near(variance, G / (8 * xi * w * w * w), 0.05);
    outcome_unref(outcome);
}

// Statistics that begin late leave the transient out of peaks as of rms values.
TEST(statistics_leave_the_transient_out) {
    Simulation simulation;
    paper_scene(&simulation, 0.61, 0.025, 10);
    simulation.output.statistics_from = 5;
    static const char *const names[] = {"displacement"};
    paper_channels(&simulation, names, COUNT(names));
    Outcome *outcome = run(&simulation);
    double most = 0;
    for (size_t i = 5000; i < outcome->response.count; i++)
        most = fmax(most, fabs(channel(outcome, "displacement")[i]));
    assert_true(most < 0.001);
    assert_near(outcome->summary.peak_displacement, most, 1e-3);
    assert_true(outcome->summary.peak_contact_force < 1);
    outcome_unref(outcome);
}

// Statistics that begin within a contact leave out how hard it pressed before.
TEST(statistics_leave_out_how_hard_a_contact_pressed_before) {
    double peak[2] = {0, 0}; // of every 33rd of a second, and of samples that see the contact
    for (int i = 0; i < 2; i++) {
        Simulation simulation;
        paper_scene(&simulation, 0.46, 0.12, 4);
        paper_sine(&simulation, 3, 3.1);
        simulation.scene.sample_rate = i == 0 ? 33 : 33 * 100;
        simulation.output.statistics_from = 47.0 / 33;
        static const char *const names[] = {"contact_force"};
        paper_channels(&simulation, names, COUNT(names));
        Outcome *outcome = run(&simulation);
        peak[0] = i == 0 ? outcome->summary.peak_contact_force : peak[0];
        for (size_t k = 4700; k < outcome->response.count; k++)
            peak[1] = fmax(peak[1], fabs(channel(outcome, "contact_force")[k]));
        outcome_unref(outcome);
    }
    assert_near(peak[0], peak[1], 1e-4);
}

// A base that shakes a soft structure faster than it can follow: contacts may not count its motion
// from where the base would hold it, which is far away.
TEST(contacts_of_soft_structures_keep_the_energy_balance) {
    for (int trial = 0; trial < 20; trial++) {
        Simulation simulation;
        paper_scene(&simulation, 0.4, trial % 2 == 0 ? 0.0002 : 0.07, 2);
        paper_random(&simulation, 3, (uint64_t)trial);
        structure(&simulation)->stiffness = 0.3 * pow(2, trial / 2);
        simulation.scene.dampers.at[0].clearance = 0.002;
        simulation.scene.sample_rate = trial % 4 < 2 ? 1000 : 8000;
        Outcome *outcome = run(&simulation);
        if (!(outcome->summary.energy_residual < 1e-11))
            fail_msg("trial %d: residual %g", trial, outcome->summary.energy_residual);
        outcome_unref(outcome);
    }
}

// A hop so short that it ends within the arc in which the mass left its stop keeps its speed: stiff
// structures at low sample rates are full of them.
TEST(hops_after_a_rest_keep_the_energy_balance) {
    for (int trial = 0; trial < 40; trial++) {
        Simulation simulation;
        paper_scene(&simulation, 0.5 + 0.012 * trial, 0.025, 10);
        paper_model(&simulation, "impulse");
        structure(&simulation)->stiffness = 865 * pow(1.3, trial % 20);
        simulation.scene.dampers.at[0].clearance = 0.002;
        simulation.scene.sample_rate = trial % 2 == 0 ? 10 : 1000;
        paper_sine(&simulation, 0.1, 0.18610413821287916);
        Outcome *outcome = run(&simulation);
        if (!(outcome->summary.energy_residual < 1e-11))
            fail_msg("trial %d: residual %g", trial, outcome->summary.energy_residual);
        outcome_unref(outcome);
    }
}

// A whole period of a sine takes a mass without a spring back to where it stood: what energy there
// was is gone when the balance is struck.
TEST(energy_that_comes_and_goes_is_not_gained_from_nowhere) {
    for (int trial = 0; trial < 3; trial++) {
        Simulation simulation;
        paper_scene(&simulation, 0.61, 0.025, 1);
        paper_sine(&simulation, 1, 1);
        structure(&simulation)->stiffness = 0;
        structure(&simulation)->damping = 0;
        simulation.scene.dampers.at[0].clearance = 10;
        simulation.scene.sample_rate = trial == 0 ? 300 : trial == 1 ? 1000 : 4000;
        Outcome *outcome = run(&simulation);
        assert_true(outcome->summary.energy_residual < 1e-12);
        outcome_unref(outcome);
    }
}
