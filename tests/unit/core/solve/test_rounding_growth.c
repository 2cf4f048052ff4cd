// The maps of a small error against closed forms and matrix exponentials, and the horizon against
// the parting of runs whose inputs are one rounding apart.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "core/solve/rounding_growth.h"
#include "tests/support/matrix_forms.h"
#include "tests/support/paper.h"
#include "tests/support/test.h"

static const double RESTITUTION = 0.46, CONTACT_TIME = 0.0003, PI = 3.141592653589793;
// So large that neither roundings nor limits are seen beside errors of about 1.
static const State far = {1e6, 0, 0, 0};

static Motion motion_of(double stiffness, double damping, double contact_time) {
    const double mass = 1.35, share = 0.1107 / (1.35 + 0.1107), loss = log(RESTITUTION);
    Motion motion = {.omega2 = stiffness / mass, .damping = damping / mass, .share = share};
    if (contact_time > 0) {
        motion.contact_omega2 = (PI * PI + loss * loss) / (contact_time * contact_time);
        motion.contact_damping = -2 * loss / contact_time;
    }
    motion.rate = sqrt(motion.omega2) + motion.damping +
                  fmax(sqrt(motion.contact_omega2), motion.contact_damping);
    return motion;
}

static RoundingGrowth *trust_make(double stiffness, double damping, double contact_time) {
    const Motion flying = motion_of(stiffness, damping, 0);
    const Motion touching = motion_of(stiffness, damping, contact_time);
    const Motion both[2] = {touching, touching};
    RoundingGrowth *trust = malloc(sizeof *trust);
    assert_non_null(trust);
    memset(trust, 0xa5, sizeof *trust); // rounding_growth_start must write all that is read
    rounding_growth_start(trust, &flying, both, &far, 0.015, false, 10);
    return trust;
}

static double share_of(const RoundingGrowth *trust) {
    return trust->systems[GROWTH_FLIGHT].motion.share;
}

static void fly(RoundingGrowth *trust, double time) {
    rounding_growth_end_phase(trust, PHASE_FLIGHT, SIDE_LEFT, time, &far, 0);
}

static void touch(RoundingGrowth *trust, Side side, double time) {
    rounding_growth_end_phase(trust, PHASE_CONTACT, side, time, &far, 0);
}

static void assert_near(double value, double wanted, double most) {
    if (!(fabs(value - wanted) <= most))
        fail_msg("%.17g is not within %g of %.17g", value, most, wanted);
}

static void seed(RoundingGrowth *trust, double x, double v, double r, double w) {
    const double y[4] = {x, v, r, w};
    for (int row = 0; row < 4; row++)
        for (int lane = 0; lane < GROWTH_LANES; lane++)
            trust->y[row][lane] = y[row];
}

static void assert_errors(const RoundingGrowth *trust, double x, double v, double r, double w,
                          double most) {
    const double y[4] = {x, v, r, w};
    for (int row = 0; row < 4; row++)
        for (int lane = 0; lane < GROWTH_LANES; lane++)
            assert_near(trust->y[row][lane], y[row], most);
}

// Two free bodies: the centre x + share r goes straight on, and what leaves a stop at -e w left it
// `late` after the touch.
static void assert_isolated(const RoundingGrowth *trust, double after, double lasting) {
    const double share = share_of(trust), e = RESTITUTION, x = 0.3, v = -0.7, r = 0.9, w = 0.4;
    const double before = 0.25, total = before + lasting + after;
    const double left_w = -e * w, left_r = -e * (r + w * (total - lasting));
    const double centre = x + share * r + (v + share * w) * total;
    assert_errors(trust, centre - share * left_r, v + share * (w - left_w), left_r, left_w, 2e-4);
}

TEST(an_impulse_changes_an_error_as_two_free_bodies_do) {
    RoundingGrowth *trust = trust_make(0, 0, 0);
    seed(trust, 0.3, -0.7, 0.9, 0.4);
    fly(trust, 0.25);
    rounding_growth_bounce(trust, RESTITUTION, 0.31, 0);
    fly(trust, 1);
    assert_isolated(trust, 0.75, 0);
    free(trust);
}

TEST(a_contact_changes_an_error_as_two_free_bodies_do) {
    static const double times[] = {CONTACT_TIME, 0.025, 0.4};
    for (size_t i = 0; i < COUNT(times); i++) {
        RoundingGrowth *trust = trust_make(0, 0, times[i]);
        seed(trust, 0.3, -0.7, 0.9, 0.4);
        fly(trust, 0.25);
        touch(trust, i % 2 == 0 ? SIDE_LEFT : SIDE_RIGHT, 0.25 + times[i]);
        fly(trust, 1 + times[i]);
        assert_isolated(trust, 0.75, times[i]);
        free(trust);
    }
}

// A mass that is thrown at a stop which pushes with s: its energy error stays, but for e^2.
TEST(a_late_bounce_meets_another_speed) {
    RoundingGrowth *trust = trust_make(0, 0, 0);
    trust->systems[GROWTH_FLIGHT].motion.share = 0;
    const double r = 1e-3, w = 0.3, push = 4;
    seed(trust, 0, 0, r, 0);
    rounding_growth_bounce(trust, RESTITUTION, w, push);
    // w dw - s dr is what the energy w^2 / 2 - s r is wrong by.
    const double before = -push * r,
                 after = -RESTITUTION * w * trust->y[3][0] - push * trust->y[2][0];
    assert_near(after, RESTITUTION * RESTITUTION * before, 1e-12);
    free(trust);
}

TEST(a_contact_of_any_length_follows_its_system) {
    static const double lengths[] = {1e-9, 0.00007, 0.0003, 0.0071, 0.33, 4.5};
    const Motion m = motion_of(865, 1.092, CONTACT_TIME);
    const long double c = m.contact_damping, k = m.contact_omega2, d = m.damping, o = m.omega2,
                      s = m.share;
    const long double system[16] = {0,  1,  s * c,
                                    0, //
                                    -o, -d, s * k - d * s * c,
                                    0, //
                                    0,  0,  -c,
                                    1, //
                                    o,  d,  d * s * c - k,
                                    0};
    for (size_t i = 0; i < COUNT(lengths); i++) {
        long double power[16];
        matrix_exponential(system, 4, lengths[i], power);
        for (int column = 0; column < 4; column++) {
            RoundingGrowth *trust = trust_make(865, 1.092, CONTACT_TIME);
            seed(trust, column == 0, column == 1, column == 2, column == 3);
            touch(trust, SIDE_RIGHT, lengths[i]);
            for (int row = 0; row < 4; row++) {
                // Rates carry the system's fastest rate.
                const double unit = (row % 2 == 1 ? m.rate : 1) / (column % 2 == 1 ? m.rate : 1);
                assert_near(trust->y[row][0] / unit, (double)power[4 * row + column] / unit, 5e-4);
            }
            free(trust);
        }
    }
}

TEST(a_rest_forgets_the_relative_error_and_keeps_the_momentum) {
    RoundingGrowth *trust = trust_make(865, 1.092, 0);
    seed(trust, 0.3, -0.7, 0.9, 0.4);
    rounding_growth_stick(trust);
    assert_errors(trust, 0.3, -0.7 + share_of(trust) * 0.4, 0, 0, 1e-12);
    // Both swing together, slower.
    const double omega = sqrt(trust->systems[GROWTH_REST].motion.omega2);
    assert_near(omega * omega, 865 / (1.35 + 0.1107), 1e-9);
    rounding_growth_end_phase(trust, PHASE_RESTING, SIDE_LEFT, 2 * PI / omega, &far, 0);
    assert_near(trust->y[2][0], 0, 0);
    assert_near(trust->y[3][0], 0, 0);
    free(trust);
}

static const char *const wanted[] = {"displacement"};

static Outcome *outcome_of(Simulation *simulation) {
    static Problem problem;
    Outcome *outcome = NULL;
    problem_clear(&problem);
    paper_channels(simulation, wanted, COUNT(wanted));
    paper_no_psd(simulation);
    if (simulation_complete(simulation, NULL, NULL, &problem) != STATUS_OK ||
        simulation_run(simulation, NULL, NULL, NULL, &outcome, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    simulation_clear(simulation);
    return outcome;
}

enum { RANDOM, SINE, KINDS, NEIGHBOURS = 4 };

static Outcome *run(const PaperBuffer *buffer, int kind, bool is_impulse, double level, int ulps) {
    Simulation simulation;
    paper_scene(&simulation, buffer->restitution, buffer->contact_time, 30);
    paper_model(&simulation, is_impulse ? "impulse" : "spring_damper");
    if (kind == RANDOM)
        paper_random(&simulation, level, 7);
    else
        paper_sine(&simulation, level, 5);
    double *const numbers[] = {&simulation.scene.dampers.at[0].clearance,
                               &simulation.scene.dampers.at[0].mass,
                               &simulation.scene.dampers.at[0].buffer.restitution};
    for (size_t i = 0; i < COUNT(numbers); i++)
        for (int n = 0; n < ulps; n++)
            *numbers[i] = nextafter(*numbers[i], i % 2 == 0 ? INFINITY : 0);
    return outcome_of(&simulation);
}

// When the first of some neighbours has parted from the run, INFINITY if none.
static double parting(const Outcome *outcome, const PaperBuffer *buffer, int kind, bool is_impulse,
                      double level) {
    const double *x = outcome->response.series.at[0].values;
    size_t first = SIZE_MAX;
    for (int ulps = 1; ulps <= NEIGHBOURS; ulps++) {
        Outcome *other = run(buffer, kind, is_impulse, level, ulps);
        const double *y = other->response.series.at[0].values;
        for (size_t i = 0; i < other->response.count && i < first; i++)
            if (fabs(x[i] - y[i]) > 1e-6 * outcome->summary.peak_displacement)
                first = i;
        outcome_unref(other);
    }
    return first == SIZE_MAX ? INFINITY : (double)first / 1000;
}

TEST(the_horizon_is_where_neighbours_part) {
    static const double levels[] = {0.3, 1};
    size_t parted = 0;
    for (size_t buffer = 0; buffer < COUNT(paper_buffers); buffer++)
        for (int choice = 0; choice < 2 * KINDS; choice++) {
            const int kind = choice % KINDS;
            const bool is_impulse = choice >= KINDS;
            const double level = levels[(buffer + (size_t)choice) % COUNT(levels)];
            Outcome *outcome = run(&paper_buffers[buffer], kind, is_impulse, level, 0);
            const double seen = parting(outcome, &paper_buffers[buffer], kind, is_impulse, level);
            const double told = outcome->summary.trust_horizon;
            const double estimate = outcome->summary.error_estimate;
            if (isfinite(seen)) {
                parted++;
                assert_true(told >= 0.5 * seen && told <= 1.3 * seen);
                assert_true(estimate >= 1e-6 && estimate <= 1);
            } else if (!isnan(told)) { // as near to it as that
                assert_true(told >= 15 && told <= 30);
            } else {
                assert_true(estimate > 0 && estimate < 1e-6);
            }
            outcome_unref(outcome);
        }
    assert_true(parted >= 10);
}

TEST(a_free_vibration_is_trusted_to_its_end) {
    for (size_t i = 0; i < COUNT(paper_buffers); i++) {
        Simulation simulation;
        paper_scene(&simulation, paper_buffers[i].restitution, paper_buffers[i].contact_time, 10);
        paper_free(&simulation, 0.015);
        Outcome *outcome = outcome_of(&simulation);
        assert_true(isnan(outcome->summary.trust_horizon));
        assert_true(outcome->summary.error_estimate > 1e-16);
        assert_true(outcome->summary.error_estimate < 1e-6);
        outcome_unref(outcome);
    }
}

TEST(without_a_damper_only_the_phase_drifts) {
    Simulation simulation;
    paper_scene(&simulation, 0.5, 0.01, 60);
    simulation.scene.dampers.count = 0;
    paper_sine(&simulation, 1, 1);
    Outcome *outcome = outcome_of(&simulation);
    assert_true(isnan(outcome->summary.trust_horizon));
    assert_true(outcome->summary.error_estimate > 1e-15);
    assert_true(outcome->summary.error_estimate < 1e-12);
    outcome_unref(outcome);
}

TEST(what_does_not_move_has_no_error) {
    Simulation simulation;
    paper_scene(&simulation, 0.5, 0.01, 1);
    paper_free(&simulation, 0);
    Outcome *outcome = outcome_of(&simulation);
    assert_true(isnan(outcome->summary.trust_horizon));
    assert_true(outcome->summary.error_estimate == 0);
    outcome_unref(outcome);
}
