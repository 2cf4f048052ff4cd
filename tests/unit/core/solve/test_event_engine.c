// The general engine: what is known in closed form, what symmetry and conservation demand, and the
// single engine's answers where both can run.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/exact.h"
#include "tests/support/frames.h"
#include "tests/support/paper.h"
#include "tests/support/test.h"

enum { CHANNELS = 6 };
static const ChannelId of_storeys[3] = {CHANNEL_DISPLACEMENT, CHANNEL_VELOCITY,
                                        CHANNEL_ACCELERATION};
static const ChannelId of_dampers[3] = {CHANNEL_DAMPER_DISPLACEMENT, CHANNEL_DAMPER_VELOCITY,
                                        CHANNEL_CONTACT_FORCE};

typedef Status (*Engine)(Run *run, Response *response, Problem *problem);

typedef struct Answer {
    double *values; // three channels of each storey, then three of each damper
    size_t count, storeys;
    Response response;
} Answer;

static const double *of_storey(const Answer *answer, int channel, size_t storey) {
    return answer->values + ((size_t)channel * answer->storeys + storey) * answer->count;
}
static const double *of_damper(const Answer *answer, int channel, size_t damper, size_t dampers) {
    return answer->values +
           (3 * answer->storeys + (size_t)channel * dampers + damper) * answer->count;
}

static Status exact_run(Run *run, Response *response, Problem *problem) {
    return solver_exact.run(&solver_exact, run, response, problem);
}

static Answer run(Engine engine, const Plan *plan, const Base *base) {
    static RunColumn columns[3 * 64];
    const size_t n = plan->storeys, m = plan->damper_count, count = 3 * (n + m);
    Problem problem;
    problem_clear(&problem);
    Answer answer = {.count = plan->count, .storeys = n};
    answer.values = calloc(count * plan->count, sizeof *answer.values);
    assert_non_null(answer.values);
    for (size_t i = 0; i < count; i++)
        columns[i] =
            (RunColumn){i < 3 * n ? of_storeys[i / n] : of_dampers[(i - 3 * n) / m],
                        i < 3 * n ? i % n : (i - 3 * n) % m, answer.values + i * plan->count};
    Run with = {.plan = plan, .base = base, .columns = columns, .column_count = count};
    if (engine(&with, &answer.response, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return answer;
}

static void answer_clear(Answer *answer) {
    free(answer->values);
    response_clear(&answer->response);
}

// The largest difference over the largest value.
static double difference(const double *a, const double *b, size_t count) {
    double most = 0, scale = 0;
    for (size_t i = 0; i < count; i++) {
        most = fmax(most, fabs(a[i] - b[i]));
        scale = fmax(scale, fabs(b[i]));
    }
    return most == 0 ? 0 : most / scale;
}

static const Base still = {.form = BASE_STILL};

// A completed scene's plan and base.
static void prepare(Simulation *simulation, Plan **plan, Base *base) {
    const Excitation *excitation = scene_excitation(&simulation->scene);
    const Span span = {.duration = simulation->scene.duration,
                       .sample_rate = simulation->scene.sample_rate};
    assert_int_equal(simulation_complete(simulation, NULL, NULL, NULL), STATUS_OK);
    assert_int_equal(plan_new(&simulation->scene, "exact", "exact", plan, NULL), STATUS_OK);
    assert_int_equal(excitation_make(excitation, &span, NULL, base, NULL), STATUS_OK);
}

TEST(the_papers_scenes_are_those_of_the_single_engine) {
    for (int i = 0; i < 5 * 2 * 3; i++) {
        const PaperBuffer *buffer = &paper_buffers[i / 6];
        Simulation simulation;
        paper_scene(&simulation, buffer->restitution, buffer->contact_time, 3);
        paper_model(&simulation, i % 2 == 0 ? "spring_damper" : "impulse");
        if (i / 2 % 3 == 1)
            paper_random(&simulation, 1, 2);
        if (i / 2 % 3 == 2)
            paper_sine(&simulation, 1, 1);
        Plan *plan;
        Base base = {0};
        prepare(&simulation, &plan, &base);
        Answer one = run(exact_run, plan, &base), other = run(exact_run_engine, plan, &base);
        // A scene may amplify a last digit: what that does to the single engine's answer is
        // allowed.
        plan->dampers[0].clearance *= 1 + 0x1p-52;
        Answer digit = run(exact_run, plan, &base);
        const double *want[] = {of_storey(&one, 0, 0), of_damper(&one, 0, 0, 1)};
        const double *have[] = {of_storey(&other, 0, 0), of_damper(&other, 0, 0, 1)};
        const double *near[] = {of_storey(&digit, 0, 0), of_damper(&digit, 0, 0, 1)};
        for (int k = 0; k < 2; k++)
            assert_true(difference(have[k], want[k], one.count) <
                        fmax(1e-11, 30 * difference(near[k], want[k], one.count)));
        assert_int_equal(other.response.impacts.count, one.response.impacts.count);
        for (size_t k = 0; k < one.response.impacts.count; k++) {
            const Impact *a = &other.response.impacts.at[k], *b = &one.response.impacts.at[k];
            assert_int_equal(a->kind, b->kind);
            assert_int_equal(a->side, b->side);
            const double speed = b->kind == IMPACT_RESTING ? 1e-3 : b->approach_speed;
            assert_true(fabs(a->start - b->start) * speed < 1e-11);
            if (!isnan(b->peak_force))
                assert_true(fabs(a->peak_force - b->peak_force) <=
                            1e-8 * one.response.peaks.contact_force);
            assert_true(fabs(a->energy_lost - b->energy_lost) <=
                        1e-9 * one.response.energy.contact);
        }
        const Peaks *a = &other.response.peaks, *b = &one.response.peaks;
        assert_true(fabs(a->acceleration - b->acceleration) <= 1e-8 * b->acceleration);
        assert_true(fabs(a->displacement - b->displacement) <= 1e-10 * b->displacement);
        assert_true(other.response.energy.residual < 1e-13);
        answer_clear(&one);
        answer_clear(&other);
        answer_clear(&digit);
        plan_free(plan);
        base_clear(&base);
        simulation_clear(&simulation);
    }
}

// x = shape exp(-xi w t) (cos + xi w / w_d sin): each mode of a uniform chain by itself.
TEST(free_vibration_without_dampers_is_the_closed_form) {
    const size_t n = 6;
    for (size_t k = 0; k < n; k++) {
        Plan *plan = frames_new(n, 0, 5, 100);
        frames_uniform(plan, 3, 2000, 0.01);
        const double half = acos(-1) / (2 * (2 * (double)n + 1));
        const double first = 2 * sqrt(2000 / 3.0) * sin(half);
        const double angle = (double)(2 * k + 1) * half;
        const double omega = 2 * sqrt(2000 / 3.0) * sin(angle);
        const double decay = 0.01 * (10 * first + omega * omega / first) / 11;
        const double turn = sqrt(omega * omega - decay * decay);
        double shape[6];
        for (size_t j = 0; j < n; j++)
            plan->displacement[j] = shape[j] = 0.01 * sin(2 * angle * (double)(j + 1));
        Answer answer = run(exact_run_engine, plan, &still);
        for (size_t i = 0; i < plan->count; i++) {
            const double t = (double)i / 100;
            const double swing = exp(-decay * t) * (cos(turn * t) + decay / turn * sin(turn * t));
            for (size_t j = 0; j < n; j++)
                assert_true(fabs(of_storey(&answer, 0, j)[i] - shape[j] * swing) < 2e-14);
        }
        assert_true(answer.response.energy.residual < 1e-13);
        answer_clear(&answer);
        plan_free(plan);
    }
}

// Few samples go by arcs, many by whole intervals made beforehand.
TEST(whole_intervals_are_as_exact_as_arcs) {
    double values[30];
    for (size_t i = 0; i < 30; i++)
        values[i] = sin((double)(i * i));
    const Base bases[] = {still,
                          {.form = BASE_SAMPLED, .values = values, .count = 30, .interval = 0.02},
                          {.form = BASE_SINE, .amplitude = 1, .omega = 40}};
    for (size_t b = 0; b < 3; b++) {
        Plan *plan = frames_new(5, 0, 10, 100);
        frames_uniform(plan, 3, 2000, 0.02);
        plan->damping[0] *= 7; // couples the modes
        plan->displacement[4] = 0.01;
        Answer many = run(exact_run_engine, plan, &bases[b]);
        plan->count = 100;
        plan->duration = 0.99;
        Answer few = run(exact_run_engine, plan, &bases[b]);
        for (size_t j = 0; j < 5; j++)
            for (int channel = 0; channel < 3; channel++)
                assert_true(difference(of_storey(&many, channel, j), of_storey(&few, channel, j),
                                       100) < 1e-13);
        assert_true(many.response.energy.residual < 1e-13);
        assert_true(few.response.energy.residual < 1e-13);
        answer_clear(&many);
        answer_clear(&few);
        plan_free(plan);
    }
}

static Plan *shaken_frame(size_t dampers, bool is_impulse, double split) {
    Plan *plan = frames_new(4, dampers, 6, 500);
    frames_uniform(plan, 10, 8000, 0.02);
    for (size_t d = 0; d < dampers; d++) {
        frames_damper(plan, d, 2, 0.8 / split, 0.02, 0.6, is_impulse ? NAN : 0.02);
        // Of the whole mass, so that equal parts make one whole.
        const Identification whole = identification_from_restitution(
            contact_effective_mass(10, 0.8), 0.6, 0.02, SEPARATION_ZERO_PENETRATION);
        for (int side = 0; side < 2; side++) {
            plan->dampers[d].stops[side].parameters.stiffness = whole.stiffness / split;
            plan->dampers[d].stops[side].parameters.damping = whole.damping / split;
        }
    }
    for (size_t j = 0; j < 4; j++)
        plan->displacement[j] = 0.02 * (double)(j + 1);
    return plan;
}

TEST(two_halves_of_a_damper_move_as_the_whole) {
    for (int model = 0; model < 2; model++) {
        Plan *halves = shaken_frame(2, model == 1, 2), *whole = shaken_frame(1, model == 1, 1);
        Answer two = run(exact_run_engine, halves, &still),
               one = run(exact_run_engine, whole, &still);
        assert_int_equal(two.response.impacts.count, 2 * one.response.impacts.count);
        assert_true(one.response.impacts.count > 20);
        for (size_t j = 0; j < 4; j++)
            assert_true(difference(of_storey(&two, 0, j), of_storey(&one, 0, j), one.count) < 1e-9);
        for (size_t d = 0; d < 2; d++)
            assert_true(difference(of_damper(&two, 0, d, 2), of_damper(&one, 0, 0, 1), one.count) <
                        1e-9);
        answer_clear(&two);
        answer_clear(&one);
        plan_free(halves);
        plan_free(whole);
    }
}

TEST(a_mirrored_scene_has_the_mirrored_answer) {
    for (int model = 0; model < 2; model++) {
        Plan *plan = shaken_frame(2, model == 1, 3), *mirror = shaken_frame(2, model == 1, 3);
        plan->dampers[1].storey = mirror->dampers[1].storey = 0;
        for (size_t j = 0; j < 4; j++)
            mirror->displacement[j] = -plan->displacement[j];
        Answer a = run(exact_run_engine, plan, &still), b = run(exact_run_engine, mirror, &still);
        assert_true(a.response.impacts.count > 10);
        for (size_t i = 0; i < 3 * 6 * a.count; i++)
            assert_true(a.values[i] == -b.values[i]);
        answer_clear(&a);
        answer_clear(&b);
        plan_free(plan);
        plan_free(mirror);
    }
}

TEST(a_storey_on_an_unmoved_one_is_a_structure_by_itself) {
    const double mass[] = {1e13, 1.35}, stiffness[] = {1e15, 865}, damping[] = {0, 1.092};
    const double alone_mass = 1.35;
    Plan *plan = frames_new(2, 1, 3, 1000), *alone = frames_new(1, 1, 3, 1000);
    frames_shear(plan, mass, stiffness, damping);
    frames_shear(alone, &alone_mass, stiffness + 1, damping + 1);
    frames_damper(plan, 0, 1, 0.1107, 0.015, 0.61, 0.025);
    frames_damper(alone, 0, 0, 0.1107, 0.015, 0.61, 0.025);
    plan->displacement[1] = alone->displacement[0] = 0.015;
    Answer two = run(exact_run_engine, plan, &still), one = run(exact_run_engine, alone, &still);
    assert_int_equal(two.response.impacts.count, one.response.impacts.count);
    assert_true(difference(of_storey(&two, 0, 1), of_storey(&one, 0, 0), one.count) < 1e-9);
    answer_clear(&two);
    answer_clear(&one);
    plan_free(plan);
    plan_free(alone);
}

TEST(momentum_is_kept_by_everything_that_collides) {
    for (int model = 0; model < 2; model++) {
        const double mass[] = {2, 3, 1}, stiffness[] = {0, 900, 700}, damping[] = {0, 0.5, 1};
        Plan *plan = frames_new(3, 3, 5, 200);
        frames_shear(plan, mass, stiffness, damping);
        for (size_t d = 0; d < 3; d++) {
            frames_damper(plan, d, d == 2 ? 0 : 2, 0.3 + 0.2 * (double)d, 0.02, 0.5,
                          model == 1 ? NAN : 0.01);
            plan->dampers[d].velocity = 0.7 - 0.5 * (double)d;
        }
        plan->velocity[1] = 0.4;
        Answer answer = run(exact_run_engine, plan, &still);
        double want = 0;
        for (size_t i = 0; i < plan->count; i++) {
            double sum = 0;
            for (size_t j = 0; j < 3; j++)
                sum += mass[j] * of_storey(&answer, 1, j)[i];
            for (size_t d = 0; d < 3; d++)
                sum += plan->dampers[d].mass * of_damper(&answer, 1, d, 3)[i];
            if (i == 0)
                want = sum;
            assert_true(fabs(sum - want) < 1e-13);
        }
        assert_true(answer.response.impacts.count > 20);
        assert_true(answer.response.energy.residual < 1e-13);
        answer_clear(&answer);
        plan_free(plan);
    }
}

TEST(peaks_and_sums_are_the_largest_storeys) {
    Plan *plan = shaken_frame(1, false, 1);
    Answer answer = run(exact_run_engine, plan, &still);
    double peak[2] = {0, 0}, sums[2] = {0, 0};
    for (size_t j = 0; j < 4; j++)
        for (int channel = 0; channel < 2; channel++) {
            const double *values = of_storey(&answer, channel * 2, j);
            double sum = 0;
            for (size_t i = 0; i < plan->count; i++) {
                sum += values[i] * values[i];
                peak[channel] = fmax(peak[channel], fabs(values[i]));
            }
            sums[channel] = fmax(sums[channel], sum);
        }
    const Response *response = &answer.response;
    assert_true(fabs(response->sum_squares_displacement / sums[0] - 1) < 1e-14);
    assert_true(fabs(response->sum_squares_acceleration / sums[1] - 1) < 1e-14);
    assert_int_equal(response->statistics_count, plan->count);
    assert_true(response->peaks.displacement >= peak[0]);
    assert_true(response->peaks.displacement < 1.001 * peak[0]);
    assert_true(response->peaks.acceleration >= peak[1]);
    assert_true(response->peaks.acceleration < 1.2 * peak[1]);
    answer_clear(&answer);
    plan_free(plan);
}

// Each is let go and taken by its other stop, one after the other at one instant.
TEST(many_held_masses_change_stops_together) {
    enum { HELD = 40 };
    const double mass = 1, stiffness = 42000, damping = 0;
    Plan *plan = frames_new(1, HELD + 1, 0.6, 1000);
    frames_shear(plan, &mass, &stiffness, &damping);
    for (size_t d = 0; d <= HELD; d++)
        frames_damper(plan, d, 0, 1, d < HELD ? 0 : 0.01, d < HELD ? 0.5 : 0.9, NAN);
    const Base base = {.form = BASE_SINE, .amplitude = 10, .omega = 8 * acos(-1)};
    Run with = {.plan = plan, .base = &base};
    Response response = {0};
    assert_int_equal(exact_run_engine(&with, &response, NULL), STATUS_OK);
    assert_true(response.energy.residual < 1e-11);
    response_clear(&response);
    plan_free(plan);
}

static bool stop(void *context, double fraction) {
    (void)fraction;
    return ++*(int *)context < 3;
}

static Status status_of(const Plan *plan, Run with, Problem *problem) {
    Response response = {0};
    with.plan = plan;
    with.base = &still;
    problem_clear(problem);
    const Status status = exact_run_engine(&with, &response, problem);
    response_clear(&response);
    return status;
}

TEST(limits_and_cancelling_end_a_run_with_their_reason) {
    Plan *plan = shaken_frame(2, false, 2);
    Problem problem;
    int asked = 0;
    const Progress progress = {&asked, stop};
    plan->duration = 600;
    plan->count = 300001;
    assert_int_equal(status_of(plan, (Run){.progress = &progress}, &problem), STATUS_CANCELLED);
    assert_int_equal(asked, 3);
    assert_int_equal(status_of(plan, (Run){.impacts_max = 5}, &problem), STATUS_LIMIT);
    assert_non_null(strstr(problem.detail, "5 impacts"));
    assert_int_equal(status_of(plan, (Run){.steps_max = 2e4}, &problem), STATUS_LIMIT);
    assert_non_null(strstr(problem.detail, "2e+04 solver steps"));
    plan->displacement[0] = 1e308;
    assert_int_equal(status_of(plan, (Run){0}, &problem), STATUS_UNSTABLE);
    plan_free(plan);
}

// Under 1e300 m/s^2 a mass is let go and taken by its other stop within 1e-150 s, again and again.
TEST(chatter_in_which_the_clock_stands_still_ends_a_run) {
    const double mass = 1.35, stiffness = 865, damping = 1.092;
    const Base base = {.form = BASE_SINE, .amplitude = 1e300, .omega = 8 * acos(-1)};
    Plan *plan = frames_new(1, 1, 1, 100);
    Response response = {0};
    Problem problem;
    frames_shear(plan, &mass, &stiffness, &damping);
    frames_damper(plan, 0, 0, 0.1107, 0.015, 0.6, NAN);
    plan->displacement[0] = 0.01;
    problem_clear(&problem);
    Run with = {.plan = plan, .base = &base, .steps_max = 1e6};
    assert_int_equal(exact_run_engine(&with, &response, &problem), STATUS_UNSTABLE);
    assert_non_null(strstr(problem.detail, "more than 10000 contact events within"));
    response_clear(&response);
    plan_free(plan);
}

// A mass that never meets its stops: the run and its neighbour take each sample once.
TEST(the_work_of_the_neighbour_is_counted) {
    Plan *plan = frames_new(3, 1, 10, 1000);
    frames_uniform(plan, 1000, 1e6, 0.02);
    frames_damper(plan, 0, 2, 10, 10, 0.5, 0.001);
    plan->displacement[2] = 0.01;
    Response response = {0};
    Run run = {.plan = plan, .base = &still};
    assert_int_equal(exact_run_engine(&run, &response, NULL), STATUS_OK);
    const double flight =
        (double)plan->count *
        step_work_steps(STEP_WORK_FLIGHT, 3, 1, plan->modes.count > 0 && !plan->modes.is_classical);
    assert_int_equal(response.impacts.count, 0);
    if (!(run.steps > 1.9 * flight && run.steps < 2.2 * flight))
        fail_msg("%g steps, twice %g wanted", run.steps, flight);
    response_clear(&response);
    plan_free(plan);
}

static double drawn(uint64_t *state, double a, double b) {
    *state = *state * 6364136223846793005U + 1442695040888963407U;
    return a + (b - a) * (double)(*state >> 11) * 0x1p-53;
}

// Far from the base nothing moves at first but by rounding.
// A bounce at the size of rounding parts a resting mass for less than the clock resolves.
TEST(small_bounces_do_not_lift_resting_masses) {
    const Base sine = {.form = BASE_SINE, .amplitude = 1, .omega = 10};
    const double mass[] = {3, 2}, stiffness[] = {900, 700}, damping[] = {6, 4};
    Plan *plan = frames_new(2, 2, 6, 200);
    frames_shear(plan, mass, stiffness, damping);
    frames_damper(plan, 0, 1, 0.3, 0.004, 0.27, NAN);
    frames_damper(plan, 1, 1, 0.5, 0.02, 0.64, NAN);
    plan->form = CONTACT_IMPULSIVE;
    Answer answer = run(exact_run_engine, plan, &sine);
    size_t rests = 0;
    for (size_t i = 0; i < answer.response.impacts.count; i++)
        rests += answer.response.impacts.at[i].kind == IMPACT_RESTING;
    assert_in_range(rests, 1, 1000);
    answer_clear(&answer);
    plan_free(plan);
}

TEST(masses_held_tight_wait_for_the_base_to_reach_them) {
    uint64_t at = 1;
    for (int scene = 0; scene < 600; scene++) {
        const size_t n = 2 + (size_t)scene % 9;
        double mass[16], stiffness[16], damping[16];
        double values[3] = {drawn(&at, -1, 1), drawn(&at, -1, 1), 0};
        const Base base = {.form = BASE_SAMPLED, .interval = 0.01, .count = 3, .values = values};
        Plan *plan = frames_new(n, 1, 0.005, 1000);
        for (size_t i = 0; i < n; i++) {
            mass[i] = drawn(&at, 5, 15);
            stiffness[i] = drawn(&at, 5e3, 15e3);
            damping[i] = 1e-3 * stiffness[i] * drawn(&at, 0.1, 3);
        }
        frames_shear(plan, mass, stiffness, damping);
        frames_damper(plan, 0, n - 1, drawn(&at, 0.1, 10), 0, drawn(&at, 0.1, 0.9),
                      pow(10, drawn(&at, -3.5, -1.5)));
        plan->dampers[0].stops[1].parameters.stiffness *= drawn(&at, 0.5, 2);
        plan->separation = scene % 2 == 0 ? SEPARATION_ZERO_PENETRATION : SEPARATION_ZERO_FORCE;
        Response response = {0};
        Problem problem;
        Run with = {.plan = plan, .base = &base, .steps_max = 1e6};
        problem_clear(&problem);
        if (exact_run_engine(&with, &response, &problem) != STATUS_OK)
            fail_msg("scene %d: %s", scene, problem.detail);
        assert_true(response.energy.residual < 1e-11);
        response_clear(&response);
        plan_free(plan);
    }
}

typedef struct Asked {
    size_t times, most;
    double fraction;
} Asked;

static bool stop_after(void *context, double fraction) {
    Asked *asked = context;
    asked->fraction = fraction;
    return ++asked->times < asked->most;
}

TEST(making_the_tables_of_many_coupled_storeys_is_cancelled_on_the_way) {
    enum { MANY = 60 };
    Plan *plan = frames_new(MANY, 0, 10, 1000);
    Problem problem;
    frames_uniform(plan, 1000, 1e6, 0.02);
    plan->damping[0] *= 5;
    plan->displacement[0] = 0.01;
    for (size_t most = 1; most < 14; most += 6) {
        Asked asked = {.most = most};
        const Progress progress = {&asked, stop_after};
        assert_int_equal(status_of(plan, (Run){.progress = &progress}, &problem), STATUS_CANCELLED);
        assert_int_equal(asked.times, most);
        assert_true(asked.fraction == 0);
    }
    plan_free(plan);
}

// A half-sine of the base that lasts `length` and leaves the same speed however short it is.
static double knocked(const Plan *plan, double length, double *steps) {
    const double start = 0.0123, amplitude = 1 / length;
    const Base base = {.form = BASE_PIECES,
                       .omega = 3.14159265358979323846 / length,
                       .pieces = {{.time = start, .slope = amplitude}, {.time = start + length}},
                       .piece_count = 2};
    Response response = {0};
    Run with = {.plan = plan, .base = &base};
    assert_int_equal(exact_run_engine(&with, &response, NULL), STATUS_OK);
    assert_true(response.impacts.count > 2 && response.energy.residual < 1e-12);
    *steps = with.steps;
    const double peak = response.peaks.displacement;
    response_clear(&response);
    return peak;
}

TEST(a_short_pulse_costs_what_a_long_one_does) {
    for (int is_impulse = 0; is_impulse < 2; is_impulse++) {
        double steps[2];
        Plan *plan = shaken_frame(2, is_impulse != 0, 2);
        const double peak = knocked(plan, 1e-4, &steps[0]);
        const double sudden = knocked(plan, 1e-10, &steps[1]);
        assert_true(fabs(sudden / peak - 1) < 0.02);
        assert_true(steps[1] < 1.5 * steps[0] + 1000);
        plan_free(plan);
    }
}
