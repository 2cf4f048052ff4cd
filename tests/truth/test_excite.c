// Motions of the base through the whole journey: against a plain integration in long double, and
// against the same motion told in another way.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/excitation/excitation.h"
#include "core/excitation/recorded_motion.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

#define PI 3.14159265358979323846264338328L

static Outcome *run(Simulation *simulation) {
    static Problem problem;
    static const char *const names[] = {"displacement", "damper_displacement"};
    Outcome *outcome = NULL;
    paper_channels(simulation, names,
                   simulation->scene.dampers.count > 0 ? COUNT(names) : COUNT(names) - 1);
    paper_no_psd(simulation);
    problem_clear(&problem);
    if (simulation_complete(simulation, NULL, NULL, &problem) != STATUS_OK ||
        simulation_run(simulation, NULL, NULL, NULL, &outcome, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    simulation_clear(simulation);
    return outcome;
}

static const double *displacement(const Outcome *outcome) {
    return columns_find(&outcome->response.series, "displacement")->values;
}

// The largest difference of every `step`-th sample of `other`, from `skipped` on, over the largest
// displacement.
static double parted(const Outcome *one, const Outcome *other, size_t step, size_t skipped) {
    const double *x = displacement(one), *y = displacement(other);
    double most = 0, largest = 0;
    for (size_t i = 0; i < one->response.count && i * step + skipped < other->response.count; i++) {
        most = fmax(most, fabs(x[i] - y[i * step + skipped]));
        largest = fmax(largest, fabs(x[i]));
    }
    assert_true(largest > 1e-4);
    return most / largest;
}

static ExcitationPulse *pulse(Simulation *simulation, const char *kind, double amplitude,
                              double start, double length) {
    scene_choose(&simulation->scene.excitation, &excitation_kinds, kind);
    ExcitationPulse *made = (ExcitationPulse *)(void *)simulation->scene.excitation;
    made->amplitude = amplitude;
    made->start = start;
    made->length = length;
    return made;
}

static void record(Simulation *simulation, const double *samples, size_t count, double interval) {
    scene_choose(&simulation->scene.excitation, &excitation_kinds, "record");
    ExcitationRecord *made = (ExcitationRecord *)(void *)simulation->scene.excitation;
    made->samples.at = malloc(count * sizeof *samples);
    assert_non_null(made->samples.at);
    for (size_t i = 0; i < count; i++)
        made->samples.at[i] = samples[i];
    made->samples.count = count;
    made->interval = interval;
}

// Runge and Kutta's fourth order for x'' = -a_g - (C x' + K x) / M of the paper's structure, in
// steps that end where a_g has its kinks. a_g is asked inside each step only.
typedef long double Ground(long double time);

static long double pull(Ground *ground, long double t, long double x, long double v) {
    return -ground(t) - (1.092L * v + 865 * x) / 1.35L;
}

static double integrate(Ground *ground, const Outcome *outcome, double interval, int steps) {
    const double *samples = displacement(outcome);
    const long double h = (long double)interval / steps, inside = h * 1e-9L;
    long double x = 0, v = 0, most = 0, largest = 0;
    for (size_t i = 0; i < outcome->response.count; i++) {
        most = fmaxl(most, fabsl(x - samples[i]));
        largest = fmaxl(largest, fabsl(x));
        for (int j = 0; j < steps; j++) {
            const long double t = (long double)i * interval + j * h;
            const long double a = pull(ground, t + inside, x, v);
            const long double b = pull(ground, t + h / 2, x + v * h / 2, v + a * h / 2);
            const long double c =
                pull(ground, t + h / 2, x + v * h / 2 + a * h * h / 4, v + b * h / 2);
            const long double d =
                pull(ground, t + h - inside, x + v * h + b * h * h / 2, v + c * h);
            x += h * v + h * h * (a + b + c) / 6;
            v += h * (a + 2 * b + 2 * c + d) / 6;
        }
    }
    assert_true(largest > 1e-4);
    return (double)(most / largest);
}

static long double half_sine(long double t) {
    return t < 0.1003L || t > 0.1316L ? 0 : 20 * sinl(PI * (t - 0.1003L) / 0.0313L);
}

static long double triangle(long double t) {
    return fmaxl(20 * (1 - fabsl(t - 0.1003L - 0.01565L) / 0.01565L), 0);
}

static long double sweep(long double t) {
    return t > 8 ? 0 : sinl(2 * PI * (9 * t - 8 * t * t / 16));
}

TEST(pulses_between_the_samples_are_met_to_rounding) {
    static const struct {
        const char *kind;
        Ground *ground;
    } pulses[] = {{"half_sine", half_sine}, {"triangular", triangle}};
    for (size_t i = 0; i < COUNT(pulses); i++) {
        Simulation simulation;
        scene_without_damper(&simulation);
        simulation.scene.duration = 2;
        pulse(&simulation, pulses[i].kind, 20, 0.1003, 0.0313);
        Outcome *outcome = run(&simulation);
        const double error = integrate(pulses[i].ground, outcome, 1e-3, 40);
        if (!(error < 1e-10))
            fail_msg("%s is off by %g", pulses[i].kind, error);
        outcome_unref(outcome);
    }
}

static ExcitationChirp *chirp(Simulation *simulation) {
    scene_without_damper(simulation);
    scene_choose(&simulation->scene.excitation, &excitation_kinds, "chirp");
    ExcitationChirp *made = (ExcitationChirp *)(void *)simulation->scene.excitation;
    made->start_frequency = 9;
    made->end_frequency = 1;
    made->amplitude = 1;
    made->sweep_time = 8;
    return made;
}

// 200 knots in the shortest cycle: the base within 8.3e-5, what the structure does of it far less.
TEST(a_sweep_is_met_to_a_billionth) {
    Simulation simulation;
    chirp(&simulation);
    Outcome *outcome = run(&simulation);
    const double error = integrate(sweep, outcome, 1e-3, 10);
    if (!(error < 1e-9))
        fail_msg("is off by %g", error);
    outcome_unref(outcome);
}

TEST(a_sweep_with_fewer_knots_errs_with_their_fourth_power) {
    double errors[2];
    for (int i = 0; i < 2; i++) {
        Simulation simulation;
        chirp(&simulation)->rate = i == 0 ? 250 : 500;
        Outcome *outcome = run(&simulation);
        errors[i] = integrate(sweep, outcome, 1e-3, 4);
        outcome_unref(outcome);
    }
    if (!(errors[0] > 12 * errors[1] && errors[1] < 1e-6))
        fail_msg("is off by %g and %g", errors[0], errors[1]);
}

enum { SWINGS = 700 };

static void record_scene(Simulation *simulation, bool is_stiff, bool is_impulse, double rate) {
    paper_scene(simulation, is_stiff ? 0.46 : 0.61, is_stiff ? 3e-4 : 0.025, 2);
    paper_model(simulation, is_impulse ? "impulse" : "spring_damper");
    simulation->scene.sample_rate = rate;
}

// 2.5 ms knots meet 2 kHz samples, not those of 1 kHz; 1.7 ms ones meet 10 kHz.
TEST(a_record_on_another_grid_gives_the_same_motion) {
    static const struct {
        double interval, rate;
        size_t step;
    } grids[] = {{2.5e-3, 2000, 2}, {1.7e-3, 10000, 10}, {7e-3, 1000, 1}, {0.31e-3, 100000, 100}};
    double swings[SWINGS], fine[7 * SWINGS];
    for (size_t i = 0; i < SWINGS; i++)
        swings[i] = 6 * sin((double)i * 0.071) * cos((double)(i * i) * 0.0013);
    for (size_t i = 0; i < COUNT(fine); i++) {
        const size_t j = i / 7;
        const double next = j + 1 < SWINGS ? swings[j + 1] : 0;
        fine[i] = swings[j] + (next - swings[j]) * (double)(i % 7) / 7;
    }
    for (size_t i = 0; i < COUNT(grids); i++)
        for (int form = 0; form < 4; form++) {
            Simulation simulation;
            Outcome *outcomes[3];
            for (int j = 0; j < 3; j++) {
                record_scene(&simulation, form & 1, form & 2, j == 1 ? grids[i].rate : 1000);
                if (j < 2)
                    record(&simulation, swings, SWINGS, grids[i].interval);
                else // up to the last knot, so that both end there
                    record(&simulation, fine, 7 * (SWINGS - 1) + 1, grids[i].interval / 7);
                outcomes[j] = run(&simulation);
            }
            assert_true(outcomes[0]->summary.impacts > 0 || i == 3);
            assert_true(outcomes[0]->summary.impacts == outcomes[1]->summary.impacts);
            const double other = parted(outcomes[0], outcomes[1], grids[i].step, 0);
            const double finer = parted(outcomes[0], outcomes[2], 1, 0);
            if (!(other < 1e-9 && finer < 1e-9))
                fail_msg("knots %g s apart, form %d: %g and %g", grids[i].interval, form, other,
                         finer);
            for (int j = 0; j < 3; j++)
                outcome_unref(outcomes[j]);
        }
}

// Knots 1/80 of the structure's 1/omega apart, so that all arcs are short and the base moves them.
TEST(the_balance_closes_under_a_base_far_faster_than_the_structure) {
    const double intervals[] = {0.5e-3, 0.99e-3, 0.25e-3};
    double swings[4 * SWINGS];
    for (size_t i = 0; i < COUNT(swings); i++)
        swings[i] = i % 3 == 2 ? -1 : (double)(i % 3);
    for (size_t i = 0; i < COUNT(intervals); i++) {
        Simulation simulation;
        record_scene(&simulation, true, false, 1000);
        record(&simulation, swings, COUNT(swings), intervals[i]);
        Outcome *outcome = run(&simulation);
        if (!(outcome->summary.energy_residual < 1e-12))
            fail_msg("knots %g s apart leave %g", intervals[i], outcome->summary.energy_residual);
        outcome_unref(outcome);
    }
}

TEST(pulses_are_what_other_kinds_make_of_them) {
    Simulation simulation;
    paper_scene(&simulation, 0.61, 0.025, 3);
    pulse(&simulation, "triangular", 8, 0, 0.25);
    Outcome *one = run(&simulation);
    paper_scene(&simulation, 0.61, 0.025, 3);
    record(&simulation, (const double[]){0, 8, 0}, 3, 0.125);
    Outcome *other = run(&simulation);
    assert_true(one->summary.impacts > 3 && parted(one, other, 1, 0) < 1e-12);
    outcome_unref(one);
    outcome_unref(other);
    paper_scene(&simulation, 0.46, 3e-4, 0.5);
    pulse(&simulation, "half_sine", 3, 0, 0.5);
    one = run(&simulation);
    paper_scene(&simulation, 0.46, 3e-4, 0.5);
    paper_sine(&simulation, 3, 1);
    other = run(&simulation);
    assert_true(one->summary.impacts > 1 && parted(one, other, 1, 0) < 1e-12);
    outcome_unref(one);
    outcome_unref(other);
}

TEST(a_later_pulse_gives_the_same_motion_later) {
    static const char *const kinds[] = {"half_sine", "triangular"};
    for (size_t i = 0; i < COUNT(kinds); i++)
        for (int is_stiff = 0; is_stiff < 2; is_stiff++) {
            Simulation simulation;
            record_scene(&simulation, is_stiff, false, 1000);
            pulse(&simulation, kinds[i], 15, 0.01234, 0.0567);
            Outcome *one = run(&simulation);
            record_scene(&simulation, is_stiff, false, 1000);
            pulse(&simulation, kinds[i], 15, 1000.01234, 0.0567);
            simulation.scene.duration = 1002;
            Outcome *other = run(&simulation);
            assert_true(one->summary.impacts > 3);
            assert_true(one->summary.impacts == other->summary.impacts);
            assert_true(parted(one, other, 1, 1000000) < 1e-10);
            outcome_unref(one);
            outcome_unref(other);
        }
}

// 1 ns of the area of a release speed; it must not make the contacts after it any dearer.
TEST(a_pulse_far_shorter_than_all_else_is_a_release) {
    Simulation simulation;
    record_scene(&simulation, false, false, 1000);
    pulse(&simulation, "half_sine", (double)(PI / 2 * 0.3e9L), 0, 1e-9);
    Outcome *one = run(&simulation);
    record_scene(&simulation, false, false, 1000);
    scene_start(&simulation, 0, -0.3);
    Outcome *other = run(&simulation);
    assert_true(one->summary.impacts > 3 && one->summary.impacts == other->summary.impacts);
    assert_true(one->summary.energy_residual < 1e-12);
    assert_true(parted(one, other, 1, 0) < 1e-6);
    outcome_unref(one);
    outcome_unref(other);
}
