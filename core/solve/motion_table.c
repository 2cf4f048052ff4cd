// Over the system of Motion the Taylor coefficients follow from each other, in s = t / length:
//   (k + 1)(k + 2) x_{k+2} = -a_k - s_k + share n_k,   (k + 1)(k + 2) r_{k+2} = s_k - n_k
// with a, s and n times length^2. No eigenvalues are taken, so underdamped, critical, overdamped
// and singular systems are all the same.
#include "core/solve/motion_table.h"

#include <string.h>

// Coefficients of one start.
static void motion_table_column(MotionTable *table, int column) {
    const Motion *m = &table->motion;
    const double T = table->length, square = T * T;
    const double damping = m->damping * T, omega2 = m->omega2 * square;
    const double contact_damping = m->contact_damping * T, contact2 = m->contact_omega2 * square;
    const size_t degree = linear_motion_degree(table->rho);
    double *x = table->x[column], *r = table->r[column], *n = table->n[column];
    double base[PIECE_TERMS] = {0};
    if (column >= 4) {
        const Slice slice = {column == 4, column == 5, table->base_omega};
        linear_motion_base_series(base, degree, &slice, T);
        memcpy(table->base[column - 4], base, sizeof base);
    }
    x[0] = column == 0;
    x[1] = column == 1 ? T : 0;
    r[0] = column == 2;
    r[1] = column == 3 ? T : 0;
    for (size_t k = 0; k < degree; k++) {
        const double next = (double)(k + 1);
        const double push = damping * next * x[k + 1] + omega2 * x[k];
        n[k] = contact_damping * next * r[k + 1] + contact2 * r[k];
        if (k + 2 <= degree) {
            const double scale = 1 / (next * (next + 1));
            x[k + 2] = (m->share * n[k] - push - square * base[k]) * scale;
            r[k + 2] = (push - n[k]) * scale;
        }
    }
    double *gain = table->gain[column];
    for (size_t k = degree; k > 1; k--) { // small terms first; v's and w's own are no gains
        gain[0] += x[k];
        gain[1] += (double)k * x[k];
        gain[2] += r[k];
        gain[3] += (double)k * r[k];
    }
    gain[0] += x[1];
    gain[1] /= T;
    gain[2] += r[1];
    gain[3] /= T;
}

void motion_table_make(MotionTable *table, const Motion *motion, double base_omega, double length) {
    memset(table, 0, sizeof *table);
    table->is_made = true;
    table->motion = *motion;
    table->length = length;
    table->base_omega = base_omega;
    table->rho = length * fmax(motion->rate, base_omega);
    table->terms = (linear_motion_degree(table->rho) + 4) / 4 * 4;
    for (int i = 0; i < START_SIZE; i++)
        motion_table_column(table, i);
    const double turn = base_omega * length;
    table->turn[0] = cos(turn);
    table->turn[1] = sin(turn);
    table->speed[0] = turn > 0 ? sin(turn) / base_omega : length;
    table->speed[1] =
        turn > 0 ? 2 * sin(turn / 2) * sin(turn / 2) / base_omega : length * length / 2;
}

const unsigned char form_pairs[FORM_PAIRS][2] = {
    {0, 0}, {0, 1}, {1, 1}, {0, 2}, {1, 2}, {2, 2}, {0, 3}, {1, 3}, {2, 3}, {3, 3}, {0, 4}, {1, 4},
    {2, 4}, {3, 4}, {4, 4}, {0, 5}, {1, 5}, {2, 5}, {3, 5}, {4, 5}, {5, 5}, {5, 5}, {5, 5}, {5, 5}};

void motion_table_make_forms(MotionTable *table) {
    enum { PAIRS = START_SIZE * (START_SIZE + 1) / 2 };
    const Quadrature *rule = linear_motion_quadrature(table->rho);
    const size_t degree = table->terms - 1;
    for (size_t q = 0; q < rule->count; q++) {
        const double s = rule->node[q], weight = rule->weight[q] * table->length;
        double v[START_SIZE], w[START_SIZE], a[START_SIZE] = {0};
        for (int i = 0; i < START_SIZE; i++) {
            v[i] = polynomial_slope(table->x[i], degree, s) / table->length;
            w[i] = polynomial_slope(table->r[i], degree, s) / table->length;
            if (i >= 4)
                a[i] = polynomial_value(table->base[i - 4], degree, s);
        }
        for (int pair = 0; pair < PAIRS; pair++) {
            const int i = form_pairs[pair][0], j = form_pairs[pair][1];
            const double both = i == j ? weight / 2 : weight;
            table->forms[FORM_VV][pair] += both * (v[i] * v[j] + v[j] * v[i]);
            table->forms[FORM_WW][pair] += both * (w[i] * w[j] + w[j] * w[i]);
            table->forms[FORM_AV][pair] += both * (a[i] * v[j] + a[j] * v[i]);
            table->forms[FORM_AW][pair] += both * (a[i] * w[j] + a[j] * w[i]);
        }
    }
}

// One more length from y = unit + gain.
static void motion_table_advance(const MotionTable *table, const double *unit, double value,
                                 double slope, double *gain) {
    double next[4];
    for (int c = 0; c < 4; c++) {
        double sum = table->gain[4][c] * value + table->gain[5][c] * slope;
        for (int i = 0; i < 4; i++)
            sum += table->gain[i][c] * (unit[i] + gain[i]);
        next[c] = gain[c] + sum;
    }
    memcpy(gain, next, sizeof next);
}

void motion_table_make_block(MotionTable *table) {
    const bool is_sine = table->base_omega > 0;
    for (int i = 0; i < 4; i++) {
        const double unit[4] = {i == 0, i == 1, i == 2, i == 3};
        double gain[4] = {0};
        for (int j = 0; j < BLOCK_SAMPLES; j++) {
            motion_table_advance(table, unit, 0, 0, gain);
            for (int c = 0; c < 4; c++)
                table->from_state[c][i][j] = gain[c];
        }
    }
    const double none[4] = {0};
    for (int half = 0; half < 2; half++) {
        double gain[4] = {0}, value = half == 0, slope = half == 1;
        for (int j = 0; j < BLOCK_SAMPLES; j++) {
            motion_table_advance(table, none, value, slope, gain);
            for (int c = 0; c < 4; c++)
                table->from_slice[c][half][j] = gain[c];
            const double old = value;
            value = is_sine ? table->turn[0] * old + table->turn[1] * slope
                            : old + slope * table->length;
            slope = is_sine ? table->turn[0] * slope - table->turn[1] * old : slope;
        }
    }
    for (int tap = 0; tap < BLOCK_TAPS && !is_sine; tap++) {
        double gain[4] = {0};
        for (int j = 0; j < BLOCK_SAMPLES; j++) {
            motion_table_advance(table, none, j == tap,
                                 ((j + 1 == tap) - (j == tap)) / table->length, gain);
            for (int c = 0; c < 4; c++)
                table->from_base[c][tap][j] = gain[c];
        }
    }
    motion_table_make_forms(table);
    table->has_block = true;
}
