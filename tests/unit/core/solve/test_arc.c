// Arcs against closed forms and against the dense exponential.
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/solve/arc.h"
#include "tests/support/matrix_forms.h"

enum { X, V, R, W, A, B, SIZE };

static Motion contact_motion(double contact_omega, double contact_ratio) {
    Motion motion = {.omega2 = 640,
                     .damping = 0.81,
                     .share = 0.0758,
                     .contact_omega2 = contact_omega * contact_omega,
                     .contact_damping = 2 * contact_ratio * contact_omega};
    motion.rate =
        sqrt(motion.omega2) + motion.damping + fmax(contact_omega, motion.contact_damping);
    return motion;
}

// The state after `length` by exp(A t) in long double.
static State by_exponential(const Motion *m, const State *start, const Slice *slice,
                            double length) {
    long double system[SIZE * SIZE] = {0}, transition[SIZE * SIZE], end[SIZE];
    const long double share = m->share, rest = m->is_resting;
    system[X * SIZE + V] = 1;
    system[V * SIZE + X] = -(long double)m->omega2 * (1 - rest * share);
    system[V * SIZE + V] = -(long double)m->damping * (1 - rest * share);
    system[V * SIZE + R] = share * (long double)m->contact_omega2;
    system[V * SIZE + W] = share * (long double)m->contact_damping;
    system[V * SIZE + A] = -1;
    system[R * SIZE + W] = 1;
    system[W * SIZE + X] = m->omega2 * (1 - rest);
    system[W * SIZE + V] = m->damping * (1 - rest);
    system[W * SIZE + R] = -(long double)m->contact_omega2;
    system[W * SIZE + W] = -(long double)m->contact_damping;
    system[A * SIZE + B] = slice->omega > 0 ? slice->omega : 1;
    system[B * SIZE + A] = -(long double)slice->omega;
    matrix_exponential(system, SIZE, length, transition);
    const double y[SIZE] = {start->x, start->v, start->r, start->w, slice->value, slice->slope};
    for (int i = 0; i < SIZE; i++) {
        end[i] = 0;
        for (int j = 0; j < SIZE; j++)
            end[i] += transition[i * SIZE + j] * (long double)y[j];
    }
    return (State){(double)end[X], (double)end[V], (double)end[R], (double)end[W]};
}

static void assert_close(double value, double wanted, double scale) {
    if (!(fabs(value - wanted) <= 8 * DBL_EPSILON * scale))
        fail_msg("%.17g is not %.17g (scale %g)", value, wanted, scale);
}

static void assert_state(const State *state, const State *wanted, double rate) {
    const double scale =
        fabs(wanted->x) + fabs(wanted->r) + (fabs(wanted->v) + fabs(wanted->w)) / rate + 1e-3;
    assert_close(state->x, wanted->x, scale);
    assert_close(state->r, wanted->r, scale);
    assert_close(state->v, wanted->v, scale * rate);
    assert_close(state->w, wanted->w, scale * rate);
}

static void an_arc_ends_where_the_exponential_does(void **state) {
    (void)state;
    const double ratios[] = {0, 0.155, 0.8, 1, 3}, omegas[] = {0, 127, 10858, 1e6};
    const Slice slices[] = {{0, 0, 0}, {1.5, -300, 0}, {0.4, 0.9, 6.28}, {-3, 2, 500}};
    const State start = {0.003, -0.2, 0.0001, 0.31};
    for (size_t i = 0; i < 5; i++)
        for (size_t j = 0; j < 4; j++)
            for (size_t k = 0; k < 4; k++)
                for (int resting = 0; resting < 2; resting++) {
                    Motion motion = contact_motion(omegas[j], ratios[i]);
                    motion.rate = fmax(motion.rate, slices[k].omega);
                    motion.is_resting = resting;
                    const State begin = resting ? (State){start.x, start.v, 0, 0} : start;
                    if (resting)
                        motion.contact_omega2 = motion.contact_damping = 0;
                    for (double rho = 1; rho > 1e-3; rho /= 7) {
                        Arc arc;
                        arc_make(&arc, &motion, &begin, &slices[k], rho / motion.rate);
                        const State end = arc_end(&arc);
                        const State wanted =
                            by_exponential(&motion, &begin, &slices[k], rho / motion.rate);
                        assert_state(&end, &wanted, motion.rate);
                    }
                }
}

static void a_cut_arc_is_the_arc_up_to_there(void **state) {
    (void)state;
    const Motion motion = contact_motion(127, 0.155);
    const Slice slice = {1, 20, 0};
    const State start = {0.003, -0.2, 0, 0.31};
    Arc arc;
    arc_make(&arc, &motion, &start, &slice, 1 / motion.rate);
    const State inside = arc_at(&arc, 0.37);
    const double force =
        polynomial_value(arc.force, arc.degree - 1, 0.37) / (arc.length * arc.length);
    arc_cut(&arc, 0.37);
    const State end = arc_end(&arc);
    assert_state(&end, &inside, motion.rate);
    assert_close(polynomial_value(arc.force, arc.degree - 1, 1) / (arc.length * arc.length), force,
                 1e4);
    assert_close(arc.length, 0.37 / motion.rate, 1);
    assert_close(polynomial_value(arc.base, arc.degree, 1), slice_at(&slice, arc.length), 1);
}

// Quadrature against exact integrals of the same motion, by the quadratic form.
static void integrals_are_exact(void **state) {
    (void)state;
    const Slice slices[] = {{0, 0, 0}, {1.5, -300, 0}};
    const State start = {0.003, -0.2, 0, 0.31};
    for (size_t k = 0; k < 2; k++)
        for (double rho = 1; rho > 1e-3; rho /= 3) {
            const Motion m = contact_motion(127, 0.155);
            const double length = rho / m.rate;
            Arc arc;
            arc_make(&arc, &m, &start, &slices[k], length);
            const ArcIntegrals integrals = arc_integrals(&arc);
            long double system[SIZE * SIZE] = {0}, form[SIZE * SIZE];
            system[X * SIZE + V] = system[R * SIZE + W] = system[A * SIZE + B] = 1;
            system[V * SIZE + X] = -(long double)m.omega2;
            system[V * SIZE + V] = -(long double)m.damping;
            system[V * SIZE + R] = (long double)m.share * m.contact_omega2;
            system[V * SIZE + W] = (long double)m.share * m.contact_damping;
            system[V * SIZE + A] = -1;
            system[W * SIZE + X] = m.omega2;
            system[W * SIZE + V] = m.damping;
            system[W * SIZE + R] = -(long double)m.contact_omega2;
            system[W * SIZE + W] = -(long double)m.contact_damping;
            const long double y[SIZE] = {start.x, start.v,         start.r,
                                         start.w, slices[k].value, slices[k].slope};
            const long double rows[3][SIZE] = {{[V] = 1}, {[W] = 1}, {[A] = 1}};
            const int pairs[4][2] = {{0, 0}, {1, 1}, {2, 0}, {2, 1}};
            const double values[4] = {integrals.vv, integrals.ww, integrals.av, integrals.aw};
            for (int p = 0; p < 4; p++) {
                matrix_exponential_forms(
                    system, SIZE, length, 1,
                    (const long double *const[1][2]){{rows[pairs[p][0]], rows[pairs[p][1]]}}, form);
                long double sum = 0;
                for (int i = 0; i < SIZE; i++)
                    for (int j = 0; j < SIZE; j++)
                        sum += y[i] * form[i * SIZE + j] * y[j];
                // The worst of each rule is at the long end of its range.
                if (!(fabs(values[p] - (double)sum) <= 1e-13 * fabs((double)sum) + 1e-18))
                    fail_msg("pair %d, rho %g: %.17g is not %.17g", p, rho, values[p], (double)sum);
            }
        }
}

static void the_peak_force_is_found_inside_an_arc(void **state) {
    (void)state;
    const Motion motion = contact_motion(127, 0.155);
    const Slice slice = {0, 0, 0};
    State at = {0, 0, 0, 0.3};
    double peak = 0, scanned = 0;
    for (int i = 0; i < 4; i++) {
        Arc arc;
        double s = -1;
        arc_make(&arc, &motion, &at, &slice, 1 / motion.rate);
        peak = arc_peak_force(&arc, peak, &s);
        for (int j = 0; j <= 10000; j++)
            scanned = fmax(scanned, fabs(polynomial_value(arc.force, arc.degree - 1, j / 1e4)) /
                                        (arc.length * arc.length));
        at = arc_end(&arc);
    }
    assert_true(peak >= scanned * (1 - 1e-14) && peak <= scanned * (1 + 1e-7));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_arc_ends_where_the_exponential_does),
        cmocka_unit_test(a_cut_arc_is_the_arc_up_to_there),
        cmocka_unit_test(integrals_are_exact),
        cmocka_unit_test(the_peak_force_is_found_inside_an_arc),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
