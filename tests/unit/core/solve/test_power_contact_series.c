// Taylor series of a contact under a power law: their coefficients, their convergence, and the
// error of a whole contact of two free bodies against closed forms, over the tolerance.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/engine.h"
#include "tests/support/frames.h"
#include "tests/support/test.h"

static Problem problem;

// Two free bodies of 1 kg and 1 kg: m_e = 0.5 kg; k = 1, v0 = 1.
typedef struct Pair {
    Plan *plan;
    Base base;
    Run run;
    Response response;
    ModalState frame;
    PowerContact power;
} Pair;

static void pair_make(Pair *pair, const ContactLaw *law, double exponent, double factor,
                      double tolerance) {
    memset(pair, 0, sizeof *pair);
    pair->plan = frames_new(1, 1, 100, 1);
    const double mass = 1, none = 0;
    frames_shear(pair->plan, &mass, &none, &none);
    frames_damper(pair->plan, 0, 0, 1, 1, 0.5, NAN);
    pair->plan->law = law;
    pair->plan->form = CONTACT_POWER;
    pair->run = (Run){.plan = pair->plan, .base = &pair->base};
    assert_int_equal(modal_state_make(&pair->frame, &pair->run, &problem), STATUS_OK);
    const EnergyState still = {0};
    impact_log_start(&pair->frame.impacts, &pair->response, 0, &still);
    assert_int_equal(power_contact_make(&pair->power, &pair->frame, tolerance, &problem),
                     STATUS_OK);
    DamperState *damper = &pair->frame.damper[0];
    damper->phase = PHASE_CONTACT;
    damper->side = SIDE_RIGHT;
    damper->origin = FROM_RIGHT;
    damper->r = 0;
    damper->w = 1;
    damper->contact = (ContactParameters){
        .stiffness = 1, .exponent = exponent, .factor = factor, .speed = 1, .mass = 0.5};
    impact_log_open(&damper->row, IMPACT_IMPACT, 0, 0, SIDE_RIGHT, 1);
}

static void pair_clear(Pair *pair) {
    power_contact_clear(&pair->power);
    modal_state_clear(&pair->frame);
    response_clear(&pair->response);
    plan_free(pair->plan);
}

// Runs to the end of the contact. Returns the number of steps; *time is its duration [s].
static int pair_run(Pair *pair, double *time) {
    const Slice still = {0, 0, 0};
    PowerContactStep step = {0};
    int count = 0;
    *time = 0;
    do {
        power_contact_step(&pair->power, &still, 1e3, &step);
        *time += step.length;
    } while (++count < 10000 && !step.is_event);
    assert_true(step.is_event && pair->frame.damper[0].r == 0);
    return count;
}

// Length of the contact's units: m_e = 1/2 makes it (1/2)^(1/(n+1)).
static double unit_of(double exponent) {
    return pow(0.5, 1 / (exponent + 1));
}

TEST(roots_make_exponents_whole) {
    static const struct {
        double exponent, viscous;
        int root;
        bool is_integer;
    } cases[] = {{1, 1, 1, true},
                 {2, 2, 1, true},
                 {1.5, 1.5, 2, true},
                 {2.5, 2.5, 2, true},
                 {4.0 / 3, 4.0 / 3, 3, true},
                 {1.5, 0.25, 4, true},
                 {3, 1, 1, true},
                 {1.37, 1.37, 4, false},
                 {1.37, 0.185, 4, false},
                 {9.7, 9.7, 1, false},
                 {1.25, 1.25, 4, true}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        const ContactTerms terms = {
            .exponent = cases[i].exponent, .viscous = 1, .viscous_exponent = cases[i].viscous};
        SeriesLaw law;
        series_law_make(&law, &terms);
        assert_int_equal(law.root, cases[i].root);
        assert_int_equal(law.is_integer, cases[i].is_integer);
        assert_int_equal(law.power[law.time_factor], law.root - 1);
        for (int k = 2; k < law.count; k++)
            assert_int_equal(law.power[k], law.power[law.left[k]] + law.power[law.right[k]]);
        if (law.is_integer)
            assert_true(fabs(law.power[law.elastic] - law.root * terms.exponent) < 1e-9);
    }
}

// At the touch N ~ t^(3/2) has no third derivative in time. In transformed time the coefficients
// still fall at a constant rate, as those of an analytic function.
TEST(the_motion_is_smooth_at_the_touch) {
    Pair pair;
    pair_make(&pair, &contact_hertz, 1.5, 0, POWER_CONTACT_TOLERANCE);
    const Slice still = {0, 0, 0};
    PowerContactStep step;
    power_contact_step(&pair.power, &still, 1e3, &step);
    const PowerContact *series = &pair.power;
    const double *Y = power_series_leader(series);
    assert_int_equal(series->root, 2);
    // Y'' = -(2 / m_e) Y^4: orders 1, 6, 11, 16, 21 and no others.
    for (size_t k = 0; k <= series->degree; k++)
        assert_true(k % 5 == 1 ? Y[k] != 0 : fabs(Y[k]) < 1e-30);
    const double rate = Y[6] / Y[1], last = Y[21] / Y[16];
    assert_true(fabs(last) < 2 * fabs(rate) && fabs(last) > 0.2 * fabs(rate));
    assert_true(fabs(Y[21]) < 1e-15 * Y[1]);
    // The exact second term: Y = tau - (2 / (5 6)) (2 / 1) tau^6 with m_e = 1/2.
    const double tau = series->length;
    assert_true(fabs(Y[1] / tau - 1) < 1e-15);
    assert_true(fabs(Y[6] / (-4.0 / 30 * pow(tau, 6)) - 1) < 1e-13);
    pair_clear(&pair);
}

TEST(a_contact_takes_few_steps_and_ends_as_it_should) {
    static const double exponents[] = {1, 4.0 / 3, 1.37, 1.5, 2, 2.5, 3};
    for (size_t l = 0; contacts[l] != NULL; l++)
        for (size_t i = 0; i < COUNT(exponents) && contacts[l]->form == CONTACT_POWER; i++) {
            const double n = exponents[i];
            const double factor = contacts[l]->factor != NULL ? contacts[l]->factor(0.6) : 0;
            Pair pair;
            double time;
            pair_make(&pair, contacts[l], n, factor, POWER_CONTACT_TOLERANCE);
            const int steps = pair_run(&pair, &time);
            const double e = contacts[l]->restitution(factor, n),
                         T = contacts[l]->duration(factor, n) * unit_of(n);
            assert_true(fabs(-pair.frame.damper[0].w - e) < 3e-14);
            assert_true(fabs(time / T - 1) < 3e-14);
            assert_true(steps <= 45);
            if (n == 1.5)
                assert_true(steps <= 22);
            pair_clear(&pair);
        }
}

// The error at the end of a contact is below the tolerance, and a larger tolerance needs fewer
// steps.
TEST(a_contact_keeps_its_tolerance) {
    static const double exponents[] = {1, 1.37, 1.5, 2, 3};
    double worst = 0;
    for (size_t l = 0; contacts[l] != NULL; l++)
        for (size_t i = 0; i < COUNT(exponents) && contacts[l]->form == CONTACT_POWER; i++) {
            const double n = exponents[i];
            const double factor = contacts[l]->factor != NULL ? contacts[l]->factor(0.6) : 0;
            const double e = contacts[l]->restitution(factor, n),
                         T = contacts[l]->duration(factor, n) * unit_of(n);
            int last = 10000;
            for (double tolerance = 1e-13; tolerance < 0.2; tolerance *= 100) {
                Pair pair;
                double time;
                pair_make(&pair, contacts[l], n, factor, tolerance);
                const int steps = pair_run(&pair, &time);
                const double error = fmax(fabs(-pair.frame.damper[0].w - e), fabs(time / T - 1));
                worst = fmax(worst, error / tolerance);
                assert_true(error <= tolerance);
                assert_true(steps <= last + 2);
                last = steps;
                pair_clear(&pair);
            }
            assert_true(last <= 12);
        }
    print_message("worst error over tolerance %.2f\n", worst);
}

// With a fixed order half the step divides the error of a contact by 2^order, as for any smooth
// motion, though N is not smooth in time at its start and end.
TEST(the_order_is_integer_over_a_whole_contact) {
    static const size_t orders[] = {8, 12};
    for (size_t i = 0; i < COUNT(orders); i++) {
        double error[2];
        for (int half = 0; half < 2; half++) {
            Pair pair;
            double time = 0;
            pair_make(&pair, &contact_hertz, 1.5, 0, POWER_CONTACT_TOLERANCE);
            PowerContact *series = &pair.power;
            // Equal steps in tau; the last is cut where Y is 0.
            const ContactTerms terms = {.stiffness = 1, .exponent = 1.5};
            const double length = half ? 0.1 : 0.2;
            const Slice still = {0, 0, 0};
            series->error = 1e-300;
            series->order_max = orders[i];
            series->inverse_root = series->inverse_time = series->inverse_modal[0] = 1;
            series->contact_count = 1;
            series->root = 2;
            series->contact[0] = series->all;
            *series->all = (SeriesContact){.sign = 1,
                                           .terms = terms,
                                           .has_force = true,
                                           .is_damped = true,
                                           .inverse_speed = 1};
            series_law_make(&series->all->law, &terms);
            double Y = 0, s = 0;
            for (int step = 0; step < 100 && !(s > 0); step++) {
                double row[8];
                (void)power_series_expand(series, &still, Y, length);
                if (polynomial_root_first(power_series_leader(series), series->degree, &s))
                    power_series_cut(series, s);
                power_series_at(series, 1, row);
                Y = polynomial_value(power_series_leader(series), series->degree, 1);
                time += row[series->at_t];
                pair.frame.damper[0].w = row[0];
                pair.frame.q[0] = row[series->at_q];
                pair.frame.p[0] = row[series->at_p];
            }
            const double T = contact_hertz.duration(0, 1.5) * unit_of(1.5);
            error[half] = fmax(fabs(pair.frame.damper[0].w + 1), fabs(time / T - 1));
            pair_clear(&pair);
        }
        const double order = log2(error[0] / error[1]);
        print_message("order %zu: errors %.1e and %.1e, observed %.1f\n", orders[i], error[0],
                      error[1], order);
        assert_true(order > (double)orders[i] - 2.5);
    }
}

// A constant acceleration presses the mass into the buffer from rest.
TEST(a_mass_without_speed_is_pressed_in) {
    static const double exponents[] = {1, 1.37, 1.5, 2.2};
    for (size_t i = 0; i < COUNT(exponents); i++) {
        Pair pair;
        pair_make(&pair, &contact_hertz, exponents[i], 0, POWER_CONTACT_TOLERANCE);
        DamperState *damper = &pair.frame.damper[0];
        damper->w = 0;
        damper->row.impact.approach_speed = 0;
        damper->contact.speed = 1e-6;
        damper->base_coupling = 1e-3; // r'' = 1e-3 a_g, with a_g = 1
        pair.frame.base_acceleration = 1;
        const Slice push = {1, 0, 0};
        PowerContactStep step;
        double time = 0, deepest = 0;
        for (int k = 0; k < 1000 && time < 100; k++) {
            power_contact_step(&pair.power, &push, 100 - time, &step);
            assert_false(step.is_event && damper->r != 0);
            if (step.is_event)
                break;
            time += step.length;
            deepest = fmax(deepest, damper->r);
            // It oscillates about the equilibrium and conserves energy.
            const double p = damper->r, n = exponents[i];
            const double held = damper->w * damper->w / 2 + 2 * pow(p, n + 1) / (n + 1);
            const double most = 1e-3 * pow(1e-3 / 2 * (n + 1), 1 / n);
            assert_true(fabs(held - 1e-3 * p) < 1e-13 * held + 1e-14 * most);
        }
        const double n = exponents[i];
        assert_true(deepest > 0.5 * pow(1e-3 / 2 * (n + 1), 1 / n));
        pair_clear(&pair);
    }
}
