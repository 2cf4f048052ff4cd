// Pieces and blocks of linear motion against the dense exponential.
#include <float.h>
#include <math.h>

#include "core/solve/motion_table.h"
#include "tests/support/matrix_forms.h"
#include "tests/support/test.h"

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

// y' = A y for y = (x, v, r, w) and the base's value and slope.
static void make_system(const Motion *m, double omega, long double *system) {
    const long double share = m->share;
    for (int i = 0; i < SIZE * SIZE; i++)
        system[i] = 0;
    system[X * SIZE + V] = 1;
    system[V * SIZE + X] = -(long double)m->omega2;
    system[V * SIZE + V] = -(long double)m->damping;
    system[V * SIZE + R] = share * (long double)m->contact_omega2;
    system[V * SIZE + W] = share * (long double)m->contact_damping;
    system[V * SIZE + A] = -1;
    system[R * SIZE + W] = 1;
    system[W * SIZE + X] = m->omega2;
    system[W * SIZE + V] = m->damping;
    system[W * SIZE + R] = -(long double)m->contact_omega2;
    system[W * SIZE + W] = -(long double)m->contact_damping;
    system[A * SIZE + B] = omega > 0 ? omega : 1;
    system[B * SIZE + A] = -(long double)omega;
}

// The state after `length` by exp(A t) in long double.
static State by_exponential(const Motion *m, const State *start, const Slice *slice,
                            double length) {
    long double system[SIZE * SIZE], transition[SIZE * SIZE], end[SIZE];
    make_system(m, slice->omega, system);
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

static void make(MotionTable *table, const Motion *m, double omega, double rho) {
    motion_table_make(table, m, omega, rho / fmax(m->rate, omega));
}

TEST(a_piece_is_where_the_exponential_is) {
    const double ratios[] = {0, 0.155, 0.8, 1, 3}, omegas[] = {0, 127, 10858, 1e6};
    const Slice slices[] = {{0, 0, 0}, {1.5, -300, 0}, {0.4, 0.9, 6.28}, {-3, 2, 500}};
    const State start = {0.003, -0.2, 0.0001, 0.31};
    for (size_t i = 0; i < 5; i++)
        for (size_t j = 0; j < 4; j++)
            for (size_t k = 0; k < 4; k++)
                for (double rho = 1; rho > 1e-3; rho /= 7) {
                    const Motion motion = contact_motion(omegas[j], ratios[i]);
                    static MotionTable table;
                    make(&table, &motion, slices[k].omega, rho);
                    Piece piece;
                    piece_make(&piece, &table, &start, &slices[k]);
                    for (double s = 1; s > 0.01; s *= 0.37) {
                        State at;
                        const State wanted =
                            by_exponential(&motion, &start, &slices[k], s * table.length);
                        piece_at(&piece, s, &at);
                        assert_state(&at, &wanted, motion.rate);
                        if (s < 1)
                            continue;
                        piece_end(&table, piece.start, &at);
                        assert_state(&at, &wanted, motion.rate);
                    }
                }
}

// Over a short length a state changes little: the change must have digits of its own.
TEST(gains_are_exact_to_their_own_rounding) {
    const Motion motion = contact_motion(127, 0.155);
    for (double rho = 1; rho > 1e-4; rho /= 10) {
        static MotionTable table;
        make(&table, &motion, 0, rho);
        long double system[SIZE * SIZE], transition[SIZE * SIZE];
        make_system(&motion, 0, system);
        matrix_exponential(system, SIZE, table.length, transition);
        for (int column = 0; column < 4; column++)
            for (int c = 0; c < 4; c++) {
                const double wanted = (double)(transition[c * SIZE + column] - (c == column));
                // The reference has 1, too, and so the rounding of a long double.
                assert_close(table.gain[column][c], wanted, fabs(wanted) + 1e-4);
            }
    }
}

// Lengths side by side against the same lengths one after the other.
TEST(a_block_is_so_many_pieces) {
    const Slice slices[] = {{0, 0, 0}, {1.5, -300, 0}, {0.4, 0.9, 6.28}};
    const Motion motion = contact_motion(127, 0.155);
    for (size_t k = 0; k < 3; k++) {
        static MotionTable table;
        make(&table, &motion, slices[k].omega, 0.8);
        motion_table_make_block(&table);
        const State start = {0.003, -0.2, 0.0001, 0.31};
        const double from[4] = {start.x, start.v, start.r, start.w};
        const double values[] = {1.5, -2, 0.3, 0.1, 4};
        State at[2] = {start, start};
        Slice slice = slices[k];
        for (size_t j = 0; j < BLOCK_SAMPLES; j++) {
            const double slope = (values[j + 1] - values[j]) / table.length;
            at[0] = by_exponential(&motion, &at[0], &slice, table.length);
            at[1] = by_exponential(&motion, &at[1], &(Slice){values[j], slope, 0}, table.length);
            slice = (Slice){slice_at(&slice, table.length),
                            slice.omega > 0 ? slice.slope * cos(slice.omega * table.length) -
                                                  slice.value * sin(slice.omega * table.length)
                                            : slice.slope,
                            slice.omega};
            double gain[2][4];
            for (int i = 0; i < 4; i++) {
                double by_state = 0;
                for (int c = 0; c < 4; c++)
                    by_state += table.from_state[i][c][j] * from[c];
                gain[0][i] = gain[1][i] = by_state;
                gain[0][i] += table.from_slice[i][0][j] * slices[k].value +
                              table.from_slice[i][1][j] * slices[k].slope;
                for (size_t tap = 0; tap < BLOCK_TAPS; tap++)
                    gain[1][i] += table.from_base[i][tap][j] * values[tap];
            }
            for (int way = 0; way < (slices[k].omega > 0 ? 1 : 2); way++) {
                const State end = {start.x + gain[way][0], start.v + gain[way][1],
                                   start.r + gain[way][2], start.w + gain[way][3]};
                assert_state(&end, &at[way], motion.rate);
            }
        }
    }
}

// Quadrature against exact integrals of the same motion, by the quadratic form.
TEST(integrals_are_exact) {
    const Slice slices[] = {{0, 0, 0}, {1.5, -300, 0}};
    const State start = {0.003, -0.2, 0, 0.31};
    for (size_t k = 0; k < 2; k++)
        for (double rho = 1; rho > 1e-3; rho /= 3) {
            const Motion m = contact_motion(127, 0.155);
            static MotionTable table;
            make(&table, &m, 0, rho);
            motion_table_make_block(&table);
            const double length = table.length;
            Piece piece;
            PieceSums integrals;
            piece_make(&piece, &table, &start, &slices[k]);
            piece_sums(&piece, 1, &integrals);
            long double system[SIZE * SIZE], form[SIZE * SIZE];
            make_system(&m, 0, system);
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
                double by_form = 0, size = 0;
                for (size_t i = 0; i < FORM_PAIRS; i++) {
                    const double term = table.forms[p][i] * piece.start[form_pairs[i][0]] *
                                        piece.start[form_pairs[i][1]];
                    by_form += term;
                    size += fabs(term);
                }
                if (!(fabs(by_form - (double)sum) <= 1e-13 * size + 1e-18))
                    fail_msg("form %d, rho %g: %.17g is not %.17g", p, rho, by_form, (double)sum);
            }
        }
}

// Against a scan, on pieces of all kinds; also where the fast way gives up.
TEST(the_first_root_is_found) {
    uint64_t seed = 1;
    size_t found = 0;
    for (int i = 0; i < 20000; i++) {
        double c[PIECE_TERMS + 1] = {0};
        for (size_t k = 0; k < 12; k++) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            c[k] = ((double)(seed >> 11) / 0x1p52 - 1) * pow(i % 3 == 0 ? 1 : 0.5, (double)k);
        }
        c[0] = i % 7 == 0 ? 0 : fabs(c[0]);
        const double end = i % 2 == 0 ? 1 : 0.3;
        double s = -1, first = INFINITY;
        const bool is_root = piece_root(c, 12, end, EVENT_TOLERANCE, &s);
        for (int j = 1; j <= 3000 && first > 1; j++)
            if (polynomial_value(c, 11, end * j / 3000) < 0)
                first = end * j / 3000;
        if (is_root) {
            found++;
            assert_true(s >= 0 && s <= end && s <= first);
            assert_true(s == 0 || fabs(polynomial_value(c, 11, s)) < 1e-12);
        } else {
            assert_true(isinf(first));
        }
        // Nothing is missed, and what is found early is a dip between two places of the scan.
        if (is_root && s < first - end / 1500)
            assert_true(fabs(polynomial_slope(c, 11, s)) < 0.02);
    }
    assert_true(found > 4000);
}
