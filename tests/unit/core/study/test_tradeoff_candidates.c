

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "core/simulation/error_metrics.h"
#include "core/solve/exact.h"
#include "core/solve/solver.h"
#include "core/study/study.h"
#include "core/study/tradeoff.h"
#include "tests/support/document.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static Problem problem;

static Simulation scene_make(double contact_time, double duration) {
    Simulation simulation;
    problem_clear(&problem);
    paper_scene(&simulation, 0.61, contact_time, duration);
    return simulation;
}

static void complete(Simulation *simulation) {
    if (simulation_complete(simulation, NULL, NULL, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
}

static TradeoffPoints make(const Simulation *simulation) {
    const Texts all = {NULL, 0};
    TradeoffPoints points;
    assert_int_equal(candidate_settings_list(&all, simulation, &points), STATUS_OK);
    return points;
}

static void forget(TradeoffPoints *points) {
    for (size_t i = 0; i < points->count; i++)
        fields_clear(tradeoff_point_fields, &points->at[i]);
    free(points->at);
}

static size_t steps_of(const TradeoffPoints *points, const char *solver, double *coarsest,
                       double *finest) {
    size_t count = 0;
    for (size_t i = 0; i < points->count; i++) {
        const TradeoffPoint *point = &points->at[i];
        if (strcmp(point->solver, solver) != 0 || isnan(point->step))
            continue;
        if (count > 0)
            assert_true(fabs(point->step * 10 / *finest - 1) < 1e-12);
        if (count++ == 0)
            *coarsest = point->step;
        *finest = point->step;
    }
    return count;
}

TEST(steps_go_by_decades_from_the_sample_interval_into_the_contact) {
    static const struct {
        double contact_time;
        size_t count;
    } cases[] = {{0.025, 3}, {0.0003, 5}, {1e-6, 7}, {1e-12, 8}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        Simulation simulation = scene_make(cases[i].contact_time, 2);
        double coarsest = 0, finest = 0;
        complete(&simulation);
        TradeoffPoints points = make(&simulation);
        assert_int_equal(steps_of(&points, "rk4", &coarsest, &finest), cases[i].count);
        assert_true(coarsest == 1e-3);
        forget(&points);
        simulation_clear(&simulation);
    }
}

static size_t count_named(const TradeoffPoints *points, const char *part) {
    size_t count = 0;
    for (size_t i = 0; i < points->count; i++)
        count += strstr(points->at[i].name, part) != NULL;
    return count;
}

TEST(only_what_the_scene_has_can_be_given_up) {
    Simulation simulation = scene_make(0.025, 10);
    complete(&simulation);
    TradeoffPoints points = make(&simulation);
    assert_int_equal(count_named(&points, "contact impulse"), 1);
    assert_int_equal(count_named(&points, "segments of"), 2);
    assert_int_equal(count_named(&points, " s long"), 1); // a quarter would cut the segment
    assert_int_equal(count_named(&points, "sampled at"), 3);
    forget(&points);
    simulation_clear(&simulation);

    simulation = scene_make(0.025, 10);
    paper_model(&simulation, "impulse");
    paper_no_psd(&simulation);
    complete(&simulation);
    points = make(&simulation);
    assert_int_equal(count_named(&points, "contact impulse"), 0);
    assert_int_equal(count_named(&points, "segments of"), 0);
    assert_int_equal(count_named(&points, " s long"), 0);
    forget(&points);
    simulation_clear(&simulation);

    simulation = scene_make(0.025, 0.001); // two samples
    complete(&simulation);
    points = make(&simulation);
    assert_int_equal(count_named(&points, "sampled at"), 0);
    forget(&points);
    simulation_clear(&simulation);
}

TEST(a_frame_may_keep_half_its_modes_and_half_of_these) {
    static const struct {
        const char *masses, *stiffnesses;
        size_t count;
    } cases[] = {{"1, 1, 1", "9, 9, 9", 0},
                 {"1, 1, 1, 1", "9, 9, 9, 9", 2},
                 {"1, 1, 1, 1, 1, 1, 1, 1, 1", "9, 9, 9, 9, 9, 9, 9, 9, 9", 3}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        Simulation simulation;
        char members[256];
        snprintf(members, sizeof members,
                 "\"structure\": {\"kind\": \"frame\", \"masses\": [%s], \"stiffnesses\": [%s]}",
                 cases[i].masses, cases[i].stiffnesses);
        document_pass(&simulation, members);
        TradeoffPoints points = make(&simulation);
        assert_int_equal(count_named(&points, " mode"), cases[i].count);
        for (size_t k = 0; k < points.count; k++) {
            const TradeoffPoint *point = &points.at[k];
            if (point->modes == COUNT_ABSENT)
                continue;
            Simulation target;
            assert_int_equal(candidate_settings_apply(&simulation, point, NULL, &target, &problem),
                             STATUS_OK);
            const Accuracy *accuracy = (const Accuracy *)(const void *)target.accuracy;
            assert_int_equal(accuracy->modes, point->modes);
            assert_string_equal(accuracy->variant.kind->name, "exact");
            // The effect of the other modes is predicted too; none is faster than 6 rad/s.
            const Scene *scene = &simulation.scene;
            assert_true(candidate_settings_cost(&simulation, point) <
                        simulation_cost(&simulation).steps +
                            truncation_cost(scene->duration, scene->sample_rate, 0, 6,
                                            structure_storeys(scene_structure(scene))));
            simulation_clear(&target);
        }
        forget(&points);
        simulation_clear(&simulation);
    }
}

static TradeoffPoint exact(void) {
    TradeoffPoint point;
    assert_int_equal(fields_default(tradeoff_point_fields, &point), STATUS_OK);
    point.solver = "exact";
    return point;
}

static Simulation apply(const Simulation *simulation, const TradeoffPoint *point) {
    Simulation target;
    if (candidate_settings_apply(simulation, point, NULL, &target, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return target;
}

// Closed forms have nothing to trade, contacts under a power law their tolerance.
TEST(tolerances_of_the_exact_solver_are_for_power_laws) {
    static const char *const models[] = {"spring_damper", "impulse", "hunt_crossley", "jankowski"};
    for (size_t i = 0; i < COUNT(models); i++) {
        Simulation simulation = scene_make(0.025, 0.001);
        paper_model(&simulation, models[i]);
        complete(&simulation);
        TradeoffPoints points = make(&simulation);
        size_t whole = 0, traded = 0;
        double last = 1;
        for (size_t k = 0; k < points.count; k++) {
            const TradeoffPoint *point = &points.at[k];
            if (strcmp(point->solver, "exact") != 0 || point->contact_model != NULL)
                continue;
            *(isnan(point->tolerance) ? &whole : &traded) += 1;
            if (isnan(point->tolerance))
                continue;
            assert_true(point->tolerance < last);
            last = point->tolerance;
            // It is the tolerance that the point's own simulation keeps, for less.
            Simulation target = {0};
            assert_int_equal(candidate_settings_apply(&simulation, point, NULL, &target, &problem),
                             STATUS_OK);
            assert_true(exact_tolerance((const Accuracy *)(const void *)target.accuracy) ==
                        point->tolerance);
            assert_true(candidate_settings_cost(&simulation, point) <
                        simulation_cost(&simulation).steps);
            simulation_clear(&target);
        }
        assert_int_equal(whole, 1);
        assert_int_equal(traded, i < 2 ? 0 : 6);
        assert_true(i < 2 || last < 2e-13);
        forget(&points);
        simulation_clear(&simulation);
    }
}

TEST(fewer_samples_leave_the_base_as_it_is) {
    Simulation simulation = scene_make(0.025, 10);
    paper_random(&simulation, 1, 1);
    complete(&simulation);
    TradeoffPoint point = exact();
    point.sample_rate = 250;
    Simulation target = apply(&simulation, &point);
    const ExcitationRandom *random =
        (const ExcitationRandom *)(const void *)target.scene.excitation;
    assert_true(target.scene.sample_rate == 250 && random->rate == 1000);
    // The same resolution of the spectra: a quarter of the samples, the same overlap.
    assert_int_equal(target.output.psd.segment, 1024);
    assert_int_equal(target.output.psd.overlap, 512);
    // Every fourth sample is the same to rounding.
    Outcome *whole, *coarse;
    assert_int_equal(simulation_run(&simulation, NULL, NULL, NULL, &whole, &problem), STATUS_OK);
    assert_int_equal(simulation_run(&target, NULL, NULL, NULL, &coarse, &problem), STATUS_OK);
    const double *x = whole->response.series.at[0].values,
                 *y = coarse->response.series.at[0].values;
    for (size_t i = 0; i < 1000; i++)
        assert_true(fabs(x[4 * i] - y[i]) < 1e-9);
    outcome_unref(whole);
    outcome_unref(coarse);
    simulation_clear(&target);
    simulation_clear(&simulation);
}

TEST(what_a_point_does_not_name_stays_the_scenes) {
    Simulation simulation = scene_make(0.025, 10);
    simulation.output.statistics_from = 8;
    complete(&simulation);
    TradeoffPoint point = exact();
    point.duration = 5;
    point.segment = 100;
    Simulation target = apply(&simulation, &point);
    assert_true(target.scene.duration == 5 && target.scene.sample_rate == 1000);
    assert_true(target.output.statistics_from == 5); // not behind the end
    assert_int_equal(target.output.psd.segment, 100);
    assert_int_equal(target.output.psd.overlap, 50);
    assert_int_equal(target.output.channels.count, simulation.output.channels.count);
    assert_int_equal(error_metrics_request(&target, &problem), STATUS_OK);
    assert_int_equal(target.output.channels.count, 2);
    assert_string_equal(target.output.channels.at[0], "displacement");
    assert_string_equal(target.output.channels.at[1], "mean_acceleration");
    simulation_clear(&target);
    simulation_clear(&simulation);
}

TEST(a_buffer_of_stiffness_and_damping_has_its_restitution_under_impulse) {
    Simulation simulation = scene_make(0.025, 1);
    Buffer *buffer = &simulation.scene.dampers.at[0].buffer;
    buffer->restitution = buffer->contact_time = (double)NAN;
    buffer->stiffness = 1655.6190925128012;
    buffer->damping = 4.04573773197014;
    complete(&simulation);
    TradeoffPoint point = exact();
    point.contact_model = "impulse";
    Simulation target = apply(&simulation, &point);
    const Buffer *made = &target.scene.dampers.at[0].buffer;
    assert_true(fabs(made->restitution - 0.61) < 1e-9 && isnan(made->stiffness));
    assert_false(simulation_has_force(&target));
    assert_true(simulation_has_force(&simulation));
    simulation_clear(&target);
    simulation_clear(&simulation);
}

TEST(a_step_ten_times_finer_costs_about_ten_times_as_much) {
    Simulation simulation = scene_make(0.025, 10);
    simulation.output.reduction = false; // as in the candidates
    complete(&simulation);
    TradeoffPoint point = exact();
    const double exact_cost = candidate_settings_cost(&simulation, &point);
    assert_true(exact_cost == simulation_cost(&simulation).steps);
    point.solver = "rk4";
    point.step = 1e-4;
    const double coarse = candidate_settings_cost(&simulation, &point);
    point.step = 1e-5;
    const double fine = candidate_settings_cost(&simulation, &point);
    assert_true(coarse > exact_cost && fine > 8 * coarse && fine < 12 * coarse);
    simulation_clear(&simulation);
}
