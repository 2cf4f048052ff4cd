// Facts of contacts that a correct program meets: what the force does within one, what samples see
// of it, what errors of e and T_c do, and what holds a mass at rest on its stop.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/contact/identification.h"
#include "core/excitation/excitation.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static const PaperBuffer *const sponge = &paper_buffers[0], *const aluminium = &paper_buffers[4];

static Outcome *run(Simulation *simulation) {
    static Problem problem;
    Outcome *outcome = NULL;
    problem_clear(&problem);
    if (simulation_complete(simulation, NULL, NULL, &problem) != STATUS_OK ||
        simulation_run(simulation, NULL, NULL, NULL, &outcome, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.detail, problem.count > 0 ? problem.faults[0].pointer : "");
    simulation_clear(simulation);
    return outcome;
}

static const double *channel(const Outcome *outcome, const char *name) {
    const Column *column = columns_find(&outcome->response.series, name);
    assert_non_null(column);
    return column->values;
}

static void assert_within(double value, double least, double most) {
    if (!(value >= least && value <= most))
        fail_msg("%.17g is not within %g and %g", value, least, most);
}

// Two bodies alone, the free mass on its way to the left stop at 0.5 m/s, 2^-7 m away.
static void lonely_pair(Simulation *simulation, double restitution, double contact_time,
                        double duration) {
    paper_scene(simulation, restitution, contact_time, duration);
    SdofStructure *structure = (SdofStructure *)(void *)simulation->scene.structure;
    structure->stiffness = structure->damping = 0;
    paper_free(simulation, 0);
    simulation->scene.dampers.at[0].clearance = 0x1p-6;
    simulation->scene.dampers.at[0].velocity = -0.5;
}

// The last part of a contact pulls: a tenth with the sponge, 15 % with bare aluminium.
TEST(the_end_of_a_contact_is_tensile) {
    const struct {
        const PaperBuffer *buffer;
        double part;
    } cases[] = {{sponge, 0.099}, {aluminium, 0.154}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        const double T = cases[i].buffer->contact_time;
        Simulation simulation;
        lonely_pair(&simulation, cases[i].buffer->restitution, T, 0x1p-6 + T * 1.01);
        simulation.scene.sample_rate = 5000 / T;
        Outcome *outcome = run(&simulation);
        const double *force = channel(outcome, "contact_force");
        size_t pulled = 0;
        for (size_t n = 0; n < outcome->response.count; n++)
            pulled += force[n] > 0; // the left stop presses to the left
        assert_within((double)pulled / 5000, cases[i].part - 0.001, cases[i].part + 0.001);
        outcome_unref(outcome);
    }
}

// The force jumps to c_b v; a sample at that very instant shows what follows. Above a damping ratio
// of one half nothing larger comes.
TEST(the_force_jumps_at_touch_and_samples_show_what_follows) {
    const double restitutions[] = {0.05, 0.1, 0.61};
    for (size_t i = 0; i < COUNT(restitutions); i++) {
        const double e = restitutions[i], T = 0.025, v = 0.5;
        const double m = 1.35 * 0.1107 / (1.35 + 0.1107), jump = -2 * m * log(e) / T * v;
        const double Z = -log(e) / sqrt(9.869604401089358 + log(e) * log(e));
        Simulation simulation;
        lonely_pair(&simulation, e, T, 0.0625);
        simulation.scene.sample_rate = 1024; // the touch is sample 16
        Outcome *outcome = run(&simulation);
        const Impact *impact = &outcome->response.impacts.at[0];
        const double *force = channel(outcome, "contact_force");
        assert_true(impact->start == 0x1p-6 && force[15] == 0);
        assert_true(fabs(force[16] / -jump - 1) < 1e-12);
        assert_true(fabs(channel(outcome, "acceleration")[16] / (-jump / 1.35) - 1) < 1e-12);
        assert_true((fabs(impact->peak_force / jump - 1) < 1e-12) == (Z > 0.5));
        assert_true(impact->peak_force >= jump * (1 - 1e-12));
        outcome_unref(outcome);
    }
}

// At 1 kHz most contacts of bare aluminium hold no sample: their peaks are the events'.
TEST(peaks_of_stiff_contacts_are_not_those_of_samples) {
    Simulation simulation;
    paper_scene(&simulation, aluminium->restitution, aluminium->contact_time, 10);
    Outcome *outcome = run(&simulation);
    const Impacts *impacts = &outcome->response.impacts;
    const double *force = channel(outcome, "contact_force");
    size_t seen = 0;
    double most = 0;
    for (size_t i = 0; i < impacts->count; i++)
        seen += floor(impacts->at[i].end * 1000) > floor(impacts->at[i].start * 1000);
    for (size_t n = 0; n < outcome->response.count; n++)
        most = fmax(most, fabs(force[n]));
    assert_true(impacts->count > 20 && 2 * seen < impacts->count);
    assert_true(most < 0.95 * outcome->summary.peak_contact_force);
    outcome_unref(outcome);
}

TEST(the_sponge_is_hit_eighty_times_less_hard_than_aluminium) {
    double peak[2][2];
    for (int i = 0; i < 2; i++) {
        const PaperBuffer *buffer = i == 0 ? sponge : aluminium;
        Simulation simulation;
        paper_scene(&simulation, buffer->restitution, buffer->contact_time, 10);
        Outcome *outcome = run(&simulation);
        peak[i][0] = outcome->response.impacts.at[0].peak_force;
        peak[i][1] = outcome->summary.peak_contact_force;
        outcome_unref(outcome);
    }
    printf("aluminium over sponge: first impact %.1f, largest %.1f\n", peak[1][0] / peak[0][0],
           peak[1][1] / peak[0][1]);
    assert_within(peak[1][0] / peak[0][0], 70, 88);
    assert_within(peak[1][1] / peak[0][1], 70, 88);
}

// A tenth of error in T_c with 15 % in e moves rms values by 1 to 5 %, the peak force by 9 to 14 %,
// and single samples by 9 to 26 % of the largest.
TEST(statistics_bear_errors_of_measurement_better_than_samples) {
    for (int is_random = 0; is_random < 2; is_random++) {
        Outcome *outcomes[2];
        for (int i = 0; i < 2; i++) {
            Simulation simulation;
            paper_scene(&simulation, i == 0 ? 0.61 : 0.5185, i == 0 ? 0.025 : 0.0275,
                        is_random ? 30 : 10);
            if (is_random)
                paper_random(&simulation, 1, 1);
            outcomes[i] = run(&simulation);
        }
        const Summary *a = &outcomes[0]->summary, *b = &outcomes[1]->summary;
        const double *x = channel(outcomes[0], "displacement"),
                     *y = channel(outcomes[1], "displacement");
        double worst = 0;
        for (size_t n = 0; n < outcomes[0]->response.count; n++)
            worst = fmax(worst, fabs(x[n] - y[n]));
        const double rms = fabs(b->rms_displacement / a->rms_displacement - 1);
        const double force = fabs(b->peak_contact_force / a->peak_contact_force - 1);
        printf("%s: rms %.3f, peak force %.3f, samples %.3f\n", is_random ? "random" : "free", rms,
               force, worst / a->peak_displacement);
        if (!is_random) {
            assert_within(rms, 0.01, 0.05);
            assert_within(force, 0.09, 0.14);
            assert_within(worst / a->peak_displacement, 0.09, 0.26);
        }
        assert_true(rms < worst / a->peak_displacement);
        outcome_unref(outcomes[0]);
        outcome_unref(outcomes[1]);
    }
}

// Under a base that goes on, a contact's length is nobody's contact time.
TEST(contacts_under_a_moving_base_do_not_last_their_contact_time) {
    Simulation simulation;
    paper_scene(&simulation, sponge->restitution, sponge->contact_time, 60);
    paper_random(&simulation, 1, 1);
    Outcome *outcome = run(&simulation);
    const Impacts *impacts = &outcome->response.impacts;
    double least = INFINITY, most = 0;
    for (size_t i = 0; i < impacts->count; i++) {
        least = fmin(least, impacts->at[i].duration / 0.025);
        most = fmax(most, impacts->at[i].duration / 0.025);
    }
    printf("sponge under a random base: %.2f to %.2f T_c\n", least, most);
    assert_true(least < 0.8 && most > 2);
    outcome_unref(outcome);
}

// While it rests on its stop the force is m (C v + K x) / (M + m), and it leaves where that is 0.
TEST(a_resting_mass_is_held_by_the_structures_push) {
    Simulation simulation;
    paper_scene(&simulation, 0.3, 0.025, 4);
    paper_model(&simulation, "impulse");
    simulation.scene.dampers.at[0].clearance = 0.004;
    simulation.scene.sample_rate = 10000;
    Outcome *outcome = run(&simulation);
    const Impacts *impacts = &outcome->response.impacts;
    const double *force = channel(outcome, "contact_force"), *x = channel(outcome, "displacement"),
                 *v = channel(outcome, "velocity");
    size_t rests = 0, held = 0;
    for (size_t i = 0; i < impacts->count; i++) {
        const Impact *rest = &impacts->at[i];
        if (rest->kind != IMPACT_RESTING || isnan(rest->end))
            continue;
        rests++;
        const size_t first = (size_t)ceil(rest->start * 10000 + 1e-6),
                     last = (size_t)floor(rest->end * 10000 - 1e-6);
        for (size_t n = first; n <= last; n++, held++) {
            const double push = 0.1107 * (1.092 * v[n] + 865 * x[n]) / (1.35 + 0.1107);
            if (!(fabs(force[n] - push) < 1e-12 * 1.1))
                fail_msg("sample %zu: %g is not %g", n, force[n], push);
            assert_true(rest->side == SIDE_RIGHT ? force[n] > 0 : force[n] < 0);
        }
        // At the end nothing is left but what one sample changes.
        if (last > first)
            assert_true(fabs(force[last]) < 1.1 * fabs(force[last] - force[last - 1]));
    }
    assert_true(rests > 2 && held > 1000);
    outcome_unref(outcome);
}

// A buffer that gives nothing back: the mass stays where it hit, unless it is pulled off at once.
TEST(without_restitution_the_mass_stays_at_its_stop) {
    Simulation simulation;
    paper_scene(&simulation, 0, NAN, 10);
    paper_model(&simulation, "impulse");
    Outcome *outcome = run(&simulation);
    const Impacts *impacts = &outcome->response.impacts;
    size_t stays = 0;
    for (size_t i = 0; i < impacts->count; i++) {
        if (impacts->at[i].kind == IMPACT_IMPACT)
            assert_true(impacts->at[i].separation_speed == 0);
        else
            stays += i > 0 && impacts->at[i].start == impacts->at[i - 1].start;
    }
    assert_true(stays > 3);
    assert_true(outcome->summary.energy_residual < 1e-12);
    outcome_unref(outcome);
}

// What an error of e or T_c does to k_b and c_b, to first order.
TEST(parameters_are_as_sensitive_as_published) {
    const double m = 0.1, e = 0.61, T = 0.025, small = 1e-6, loss = log(e);
    const double pi2 = 9.869604401089358;
    const Separation rule = SEPARATION_ZERO_PENETRATION;
    const Identification low_e = identification_from_restitution(m, e * (1 - small), T, rule),
                         high_e = identification_from_restitution(m, e * (1 + small), T, rule),
                         low_T = identification_from_restitution(m, e, T * (1 - small), rule),
                         high_T = identification_from_restitution(m, e, T * (1 + small), rule);
    const double found[] = {
        log(high_e.stiffness / low_e.stiffness), log(high_T.stiffness / low_T.stiffness),
        log(high_e.damping / low_e.damping), log(high_T.damping / low_T.damping)};
    const double wanted[] = {2 * loss / (pi2 + loss * loss), -2, 1 / loss, -1};
    for (size_t i = 0; i < COUNT(found); i++)
        assert_true(fabs(found[i] / (2 * small) - wanted[i]) < 1e-8);
}

// Point samples of the acceleration catch stiff spikes at random and hide that the models agree.
TEST(point_samples_of_the_acceleration_tell_less_than_means) {
    const struct {
        const PaperBuffer *buffer;
        double low, high;
    } cases[] = {{sponge, 14.5, 28.1}, {aluminium, 23.6, 53.8}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        Outcome *outcomes[2];
        for (int j = 0; j < 2; j++) {
            Simulation simulation;
            paper_scene(&simulation, cases[i].buffer->restitution, cases[i].buffer->contact_time,
                        10);
            paper_model(&simulation, j == 0 ? "spring_damper" : "impulse");
            Texts *wanted = &simulation.output.psd.channels;
            paper_no_psd(&simulation);
            static const char *const names[] = {"acceleration"};
            paper_channels(&simulation, names, 1);
            *wanted = simulation.output.channels;
            simulation.output.channels = (Texts){NULL, 0};
            paper_channels(&simulation, names, 1);
            outcomes[j] = run(&simulation);
        }
        const double low = paper_distance(outcomes[0], outcomes[1], 0.5, 15),
                     high = paper_distance(outcomes[0], outcomes[1], 15, 100);
        printf("%s: %.1f / %.1f dB\n", cases[i].buffer->name, low, high);
        assert_true(fabs(low - cases[i].low) < 0.1 && fabs(high - cases[i].high) < 0.1);
        outcome_unref(outcomes[0]);
        outcome_unref(outcomes[1]);
    }
}
