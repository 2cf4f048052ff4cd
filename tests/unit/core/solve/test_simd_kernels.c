// Loops over modes against plain ones, and every width of vector against the others.
#include <math.h>
#include <string.h>

#include "core/solve/simd_kernels.h"
#include "tests/support/test.h"

enum { MODES = 21, PADDED = 24, COUNT_MAX = 7, ROWS = COUNT_MAX + 1, COLUMNS = 6, LARGE = 72 };

typedef struct Results {
    double q[ROWS][PADDED], p[ROWS][PADDED], moved[ROWS][PADDED], sped[ROWS][PADDED];
    double sums[FLIGHT_SUMS][PADDED], mixed[ROWS][PADDED];
    double dots[ROWS], weighed[ROWS], reached[ROWS];
    double elastic[PADDED], after[PADDED], push[2];
    double series[4][PADDED], squares[PADDED][PADDED];
    double sizes[PADDED], product[PADDED], large[LARGE], four[FLIGHT_ROWS][PADDED];
} Results;

typedef struct Given {
    double gains[8][PADDED], a[COUNT_MAX], b[COUNT_MAX];
    double rows[ROWS][PADDED], others[ROWS][PADDED], weights[2][PADDED];
    double factors[4][ROWS], matrix[COLUMNS][PADDED], y[FLIGHT_ROWS][COLUMNS];
    double large[LARGE][LARGE], many[LARGE];
} Given;

static uint64_t drawn = 1;
static double draw(void) {
    drawn = drawn * 6364136223846793005U + 1442695040888963407U;
    return (double)(drawn >> 11) * 0x1p-53 - 0.5;
}

static void fill(double *values, size_t rows, size_t width, size_t used) {
    for (size_t i = 0; i < rows * width; i++)
        values[i] = i % width < used ? draw() : 0;
}

static void make(Given *given) {
    fill(given->gains[0], 8, PADDED, MODES);
    fill(given->a, 1, COUNT_MAX, COUNT_MAX);
    fill(given->b, 1, COUNT_MAX, COUNT_MAX);
    fill(given->rows[0], ROWS, PADDED, MODES);
    fill(given->others[0], ROWS, PADDED, MODES);
    fill(given->weights[0], 2, PADDED, MODES);
    fill(given->factors[0], 4, ROWS, ROWS);
    fill(given->matrix[0], COLUMNS, PADDED, MODES);
    fill(given->y[0], FLIGHT_ROWS, COLUMNS, COLUMNS);
    fill(given->large[0], LARGE, LARGE, LARGE);
    fill(given->many, 1, LARGE, LARGE);
}

static void solve(Given *given, const SimdKernels *lanes, Results *out) {
    memset(out, 0, sizeof *out);
    FlightGains gains;
    for (size_t i = 0; i < 4; i++) {
        gains.q[i] = given->gains[i];
        gains.p[i] = given->gains[4 + i];
    }
    memcpy(out->q[0], given->rows[0], sizeof out->q[0]);
    memcpy(out->p[0], given->rows[1], sizeof out->p[0]);
    lanes->fly(&gains, PADDED, COUNT_MAX, given->a, given->b, out->q[0], out->p[0], out->moved[0],
               out->sped[0]);
    lanes->sum(PADDED, COUNT_MAX, given->a, given->b, given->rows[0], given->others[0],
               out->sums[0]);
    lanes->mix(PADDED, ROWS, given->weights[0], given->rows[0], given->weights[1], given->others[0],
               out->mixed[0]);
    lanes->dot(PADDED, ROWS, given->weights[0], given->rows[0], out->dots);
    lanes->weigh(PADDED, ROWS, given->weights[0], given->rows[0], out->weighed);
    lanes->weighted_abs(PADDED, ROWS, given->weights[0], given->rows[0], out->reached);
    const TaylorOrder order = {.padded = PADDED,
                               .dampers = 2,
                               .viscous = given->gains[0],
                               .omega2 = given->gains[1],
                               .share = given->gains[2],
                               .shapes = given->weights[0],
                               .q = given->rows[0],
                               .per_time = 3,
                               .base = 0.7,
                               .scale = 0.1,
                               .elastic = out->elastic,
                               .after = out->after,
                               .push = out->push};
    lanes->order(&order);
    lanes->series(PADDED, COUNT_MAX, given->rows[0], 4, given->factors[0], ROWS, out->series[0]);
    lanes->largest(PADDED, ROWS, given->rows[0], out->sizes);
    lanes->square(MODES, PADDED, ROWS, given->rows[0], out->squares[0]);
    for (size_t i = 0; i < PADDED; i++)
        memset(out->squares[i] + i + 1, 0, (PADDED - i - 1) * sizeof(double)); // of no use
    lanes->multiply(given->matrix[0], PADDED, given->y[0], COLUMNS, out->product);
    lanes->multiply(given->large[0], LARGE, given->many, LARGE, out->large);
    lanes->multiply_four(given->matrix[0], PADDED, given->y[0], COLUMNS, COLUMNS, out->four[0]);
}

static void near(double value, double wanted) {
    assert_true(fabs(value - wanted) < 1e-14);
}

TEST(rows_are_what_plain_loops_make_of_them) {
    static Given given;
    static Results got;
    make(&given);
    solve(&given, &simd_kernels_kinds[0], &got);
    for (size_t i = 0; i < MODES; i++) {
        double(*g)[PADDED] = given.gains, x = given.rows[0][i], v = given.rows[1][i];
        double sums[FLIGHT_SUMS] = {0}, series = 0;
        for (size_t k = 0; k < COUNT_MAX; k++) {
            const double a = given.a[k], b = given.b[k];
            const double dx = g[0][i] * x + g[1][i] * v + g[2][i] * a + g[3][i] * b;
            const double dv = g[4][i] * x + g[5][i] * v + g[6][i] * a + g[7][i] * b;
            x += dx;
            v += dv;
            near(got.q[k + 1][i], x);
            near(got.p[k + 1][i], v);
            near(got.moved[k + 1][i], x - given.rows[0][i]);
            near(got.sped[k + 1][i], v - given.rows[1][i]);
            const double q = given.rows[k][i], p = given.others[k][i];
            const double terms[FLIGHT_SUMS] = {q * q, q * p, p * p, q * a, q * b, p * a, p * b};
            for (size_t j = 0; j < FLIGHT_SUMS; j++)
                sums[j] += terms[j];
        }
        for (size_t j = 0; j < FLIGHT_SUMS; j++)
            near(got.sums[j][i], sums[j]);
        for (size_t k = 0; k < ROWS; k++) {
            near(got.mixed[k][i],
                 given.weights[0][i] * given.rows[k][i] + given.weights[1][i] * given.others[k][i]);
            series += given.factors[3][k] * given.rows[k][i];
        }
        near(got.series[3][i], series);
        near(got.elastic[i], g[0][i] * 3 * given.rows[1][i] + g[1][i] * given.rows[0][i]);
        near(got.after[i], -0.1 * (got.elastic[i] + g[2][i] * 0.7));
        for (size_t j = 0; j <= i; j++) {
            double square = 0;
            for (size_t k = 0; k < ROWS; k++)
                square += given.rows[k][i] * given.rows[k][j];
            near(got.squares[i][j], square);
        }
        double product = 0, fourth = 0;
        for (size_t j = 0; j < COLUMNS; j++) {
            product += given.matrix[j][i] * given.y[0][j];
            fourth += given.matrix[j][i] * given.y[3][j];
        }
        near(got.product[i], product);
        near(got.four[3][i], fourth);
    }
}

TEST(job_metrics_are_what_plain_loops_make_of_them) {
    static Given given;
    static Results got;
    make(&given);
    solve(&given, &simd_kernels_kinds[0], &got);
    for (size_t k = 0; k < ROWS; k++) {
        double dot = 0, weighed = 0, reached = 0;
        for (size_t i = 0; i < MODES; i++) {
            dot += given.weights[0][i] * given.rows[k][i];
            weighed += given.weights[0][i] * given.rows[k][i] * given.rows[k][i];
            reached += given.weights[0][i] * fabs(given.rows[k][i]);
        }
        near(got.dots[k], dot);
        near(got.weighed[k], weighed);
        near(got.reached[k], reached);
    }
    for (size_t i = 0; i < MODES; i++) {
        double size = 0;
        for (size_t k = 0; k < ROWS; k++)
            size = fmax(size, fabs(given.rows[k][i]));
        assert_true(got.sizes[i] == size);
    }
    for (size_t d = 0; d < 2; d++) {
        double push = 0;
        for (size_t i = 0; i < MODES; i++)
            push += given.weights[d][i] * got.elastic[i];
        near(got.push[d], push);
    }
    for (size_t i = 0; i < LARGE; i++) {
        double product = 0;
        for (size_t j = 0; j < LARGE; j++)
            product += given.large[j][i] * given.many[j];
        near(got.large[i], product);
    }
}

TEST(all_widths_give_the_same_bytes) {
    static Given given;
    static Results plain, wide;
    make(&given);
    solve(&given, &simd_kernels_kinds[0], &plain);
    for (size_t kind = 1; kind <= simd_kernels_widest(); kind++) {
        solve(&given, &simd_kernels_kinds[kind], &wide);
        assert_memory_equal(&plain, &wide, sizeof plain);
    }
}
