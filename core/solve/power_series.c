// N ~ p^n is not smooth in time where p = 0. With Y = p^(1/root) and dt = root Y^(root - 1) dtau
// the motion is analytic in tau wherever root n is an integer. Y' = p' is the speed, which is not 0
// at the start and at the end of a contact. For Hertz's law and its relatives (n = 3/2, root 2)
//
//   Y' = w,   t' = 2 Y,   w' = 2 Y (s - (k / m_e) Y^3 (1 + a w)),   x' = 2 Y v,  ...
//
// whose Taylor coefficients follow from each other by products of series. If no small root makes
// root n an integer, root = 4 makes N ~ Y^(4n) so smooth that a step may pass the end of the
// contact within the error. Powers u = Y^n then follow from u' Y = n u Y', which holds while Y > 0.
#include "core/solve/power_series.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/wide.h"

// Pairs fill the registers that every processor has.
typedef double Two __attribute__((vector_size(16), aligned(8), may_alias));
#define TWO(values) (*(const Two *)(values))
#define PUT_TWO(values, two) (*(Two *)(values) = (two))

enum { ROOT_MAX = 4, POWER_MAX = 18, WINDOW_MIN = 3 };
static const double NEAR = 0.3; // relative Y, below which coefficients are as sparse as at Y = 0

static bool series_law_is_integer(double value) {
    return fabs(value - nearbyint(value)) <= 1e-12 * value;
}

// The entry of Y^power, which is added if it is missing.
static int series_law_power(SeriesLaw *law, int power) {
    for (int i = 0; i < law->count; i++)
        if (law->power[i] == power)
            return i;
    const int left = series_law_power(law, power - power / 2),
              right = series_law_power(law, power / 2);
    law->power[law->count] = power;
    law->left[law->count] = left;
    law->right[law->count] = right;
    return law->count++;
}

void series_law_make(SeriesLaw *law, const ContactTerms *terms) {
    const double n = terms->exponent, viscous = terms->viscous > 0 ? terms->viscous_exponent : n;
    *law = (SeriesLaw){.exponents = {n, viscous}, .count = 2, .power = {0, 1}};
    for (law->root = 1; law->root <= ROOT_MAX; law->root++)
        if (series_law_is_integer(law->root * n) && series_law_is_integer(law->root * viscous) &&
            law->root * n <= POWER_MAX)
            break;
    law->is_integer = law->root <= ROOT_MAX;
    if (!law->is_integer)
        law->root = n < 3.5 ? ROOT_MAX : n < 8 ? 2 : 1;
    law->time_factor = series_law_power(law, law->root - 1);
    if (!law->is_integer)
        return;
    law->elastic = series_law_power(law, (int)nearbyint(law->root * n));
    law->viscous = series_law_power(law, (int)nearbyint(law->root * viscous));
}

Status power_series_make(PowerSeries *series, const ModalState *state, Problem *problem) {
    const size_t n = state->mode_count, m = state->dampers;
    memset(series, 0, sizeof *series);
    series->modes = n;
    series->dampers = m;
    series->is_sine = state->base.base->omega > 0;
    series->at_t = m;
    series->at_q = m + 1;
    series->at_p = series->at_q + n;
    series->at_a = series->at_p + n;
    series->at_r = series->at_a + (series->is_sine ? 2 : 0);
    series->stride = (series->at_r + (m > 1 ? m : 0) + 3) / 4 * 4;
    series->block =
        calloc(simd_kernels_room(2 * SERIES_ROW * series->stride + n + 8), sizeof *series->block);
    series->contact = calloc(m, sizeof *series->contact);
    if (series->block == NULL || series->contact == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for contacts of %zu dampers", m);
    series->z = simd_kernels_start(series->block);
    series->rate = series->z + SERIES_ROW * series->stride;
    series->elastic = series->rate + SERIES_ROW * series->stride;
    for (size_t i = 0; i < ARC_RULES; i++)
        for (size_t node = 0; node < arc_rules[i].count; node++)
            for (size_t k = 0; k < SERIES_ROW; k++)
                series->node_power[i][k * SERIES_NODES + node] =
                    pow(arc_rules[i].node[node], (double)k);
    return STATUS_OK;
}

void power_series_clear(PowerSeries *series) {
    free(series->contact);
    free(series->block);
}

// Starts a series whose order 0 is `first`.
INLINE void series_factor_start(SeriesFactor *factor, double first) {
    memset(factor->up, 0, sizeof factor->up);
    memset(factor->down, 0, sizeof factor->down);
    factor->now = first;
}

// A coefficient is stored only when its order is complete. Until then it is in `now`: loading a
// pair that was just stored one by one stalls the processor.
INLINE void series_factor_store(SeriesFactor *factor, size_t k) {
    factor->up[k] = factor->down[SERIES_ROW - 1 - k] = factor->now;
}

// Order k of a product.
INLINE double series_factor_product(const SeriesFactor *a, const SeriesFactor *b, size_t k) {
    if (k == 0)
        return a->now * b->now;
    const double *up = a->up, *down = b->down + SERIES_ROW - 1 - k;
    Two sum[2] = {{0}};
    for (size_t j = 0; j < k; j += 4) {
        sum[0] += TWO(up + j) * TWO(down + j);
        sum[1] += TWO(up + j + 2) * TWO(down + j + 2);
    }
    sum[0] += sum[1];
    return (sum[0][0] + sum[0][1]) + (a->up[0] * b->now + a->now * b->up[0]);
}

// Order k of b^exponent, b[0] > 0, from its lower orders.
static double power_series_power(const double *b, double exponent, const double *power, size_t k) {
    if (k == 0)
        return exponent == 0 ? 1 : pow(b[0], exponent);
    double sum = 0;
    for (size_t j = 0; j < k; j++)
        sum += (exponent * (double)(k - j) - (double)j) * b[k - j] * power[j];
    return sum / ((double)k * b[0]);
}

// Order k of N.
INLINE void power_series_force(PowerSeries *series, SeriesContact *contact, size_t k,
                               bool is_leader) {
    const SeriesLaw *law = contact->law;
    if (!contact->has_force) {
        contact->force[k] = 0;
        return;
    }
    SeriesFactor *elastic = &contact->elastic, *viscous = &contact->viscous;
    contact->speed.now = contact->sign * series->z[k * series->stride + contact->damper];
    if (is_leader && law->is_integer) {
        elastic = &series->powers[law->elastic];
        viscous = &series->powers[law->viscous];
    } else {
        // Powers of Y of the leader, and of p of the others.
        double own[SERIES_ROW];
        const double root = is_leader ? law->root : 1;
        for (size_t j = 0; j < k && is_leader; j++)
            own[j] = series->powers[1].up[j];
        if (is_leader)
            own[k] = series->powers[1].now;
        for (size_t j = 0; j <= k && !is_leader; j++)
            own[j] = contact->sign * series->z[j * series->stride + series->at_r + contact->damper];
        elastic->now = power_series_power(own, root * law->exponents[0], elastic->up, k);
        viscous->now = law->exponents[1] == law->exponents[0]
                           ? elastic->now
                           : power_series_power(own, root * law->exponents[1], viscous->up, k);
    }
    double force = contact->terms.stiffness * elastic->now;
    if (contact->is_damped && contact->terms.viscous > 0)
        force += contact->terms.viscous * series_factor_product(&contact->speed, viscous, k);
    else if (!contact->is_damped && !contact->terms.is_elastic_below)
        force = 0;
    contact->force[k] = force;
}

// D p + W^2 q.
INLINE void power_series_elastic(PowerSeries *series, const ModalState *state, const double *row,
                                 size_t n) {
    const double *q = row + series->at_q, *p = row + series->at_p;
    double *restrict out = series->elastic;
    if (n == 1 || state->diagonal != NULL) {
        for (size_t i = 0; i < n; i++)
            out[i] =
                (n == 1 ? state->damping[0] : state->diagonal[i]) * p[i] + state->omega2[i] * q[i];
        return;
    }
    for (size_t i = 0; i < n; i++)
        out[i] = state->omega2[i] * q[i];
    for (size_t j = 0; j < n; j++) {
        const double *column = state->coupled + j * state->padded;
        for (size_t i = 0; i < n; i++)
            out[i] += column[i] * p[j];
    }
}

// Order k of the derivative in t.
INLINE void power_series_rate(PowerSeries *series, const ModalState *state, const Slice *slice,
                              size_t k, size_t n, size_t m) {
    const double *row = series->z + k * series->stride;
    double *restrict rate = series->rate + k * series->stride;
    const double *elastic = series->elastic;
    const double base = series->is_sine ? row[series->at_a]
                        : k == 0        ? slice->value
                                        : slice->slope * row[series->at_t];
    power_series_elastic(series, state, row, n);
    for (size_t i = 0; i < n; i++) {
        rate[series->at_q + i] = row[series->at_p + i];
        rate[series->at_p + i] = -elastic[i] - state->participation[i] * base;
    }
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        double acceleration = damper->base_coupling * base;
        for (size_t i = 0; i < n; i++)
            acceleration += damper->shape[i] * elastic[i];
        rate[d] = acceleration;
        if (m > 1)
            rate[series->at_r + d] = row[d];
    }
    for (size_t c = 0; c < (m == 1 ? 1 : series->contact_count); c++) {
        const SeriesContact *contact = &series->contact[c];
        const double force = contact->sign * contact->force[k];
        const double *shape = state->damper[contact->damper].shape;
        for (size_t i = 0; i < n; i++)
            rate[series->at_p + i] += shape[i] * force;
        for (size_t d = 0; d < m; d++)
            rate[d] -= state->delassus[d * m + contact->damper] * force;
    }
    rate[series->at_t] = k == 0;
    if (series->is_sine) {
        rate[series->at_a] = slice->omega * row[series->at_a + 1];
        rate[series->at_a + 1] = -slice->omega * row[series->at_a];
    }
}

// Order k + 1 of the state, which is that of the integral of rate * time_factor * root * length.
INLINE void power_series_state(PowerSeries *series, const SeriesFactor *time_factor, size_t k,
                               size_t stride) {
    const double scale = series->length * series->root / (double)(k + 1);
    double *restrict next = series->z + (k + 1) * stride;
    const double *rate = series->rate, *last = rate + k * stride;
    const double *down = time_factor->down + SERIES_ROW - 1 - k;
    if (series->root == 1 || k == 0) {
        const double times = series->root == 1 ? scale : scale * time_factor->now;
        for (size_t i = 0; i < stride; i++)
            next[i] = times * last[i];
        return;
    }
    const double first = time_factor->up[0], now = time_factor->now;
    for (size_t i = 0; i < stride; i += 4) {
        const double *at = rate + i;
        Two sum[4] = {now * TWO(at), now * TWO(at + 2), {0}, {0}};
        size_t j = 1;
        for (at += stride; j + 2 <= k; j += 2, at += 2 * stride) {
            sum[0] += down[j] * TWO(at);
            sum[1] += down[j] * TWO(at + 2);
            sum[2] += down[j + 1] * TWO(at + stride);
            sum[3] += down[j + 1] * TWO(at + stride + 2);
        }
        if (j < k) {
            sum[2] += down[j] * TWO(at);
            sum[3] += down[j] * TWO(at + 2);
        }
        sum[0] += sum[2];
        sum[1] += sum[3];
        next[i] = scale * (sum[0][0] + first * last[i]);
        next[i + 1] = scale * (sum[0][1] + first * last[i + 1]);
        next[i + 2] = scale * (sum[1][0] + first * last[i + 2]);
        next[i + 3] = scale * (sum[1][1] + first * last[i + 3]);
    }
}

// The largest scaled coefficient of order k.
INLINE double power_series_largest(const PowerSeries *series, const SeriesScale *scale, size_t k,
                                   size_t n, size_t m) {
    const double *row = series->z + k * series->stride;
    double largest = impact_log_larger(fabs(series->powers[1].now) * scale->inverse_root,
                                       fabs(row[series->at_t]) * scale->inverse_time);
    for (size_t c = 0; c < (m == 1 ? 1 : series->contact_count); c++) {
        const SeriesContact *contact = &series->contact[c];
        const size_t d = contact->damper;
        largest = impact_log_larger(largest, fabs(row[d]) * scale->inverse_speed[d]);
        // Powers by recurrence spread their rounding errors, which w need not show.
        if (c > 0 || !contact->law->is_integer)
            largest =
                impact_log_larger(largest, fabs(contact->force[k - 1]) * contact->inverse_force);
    }
    for (size_t i = 0; i < n; i++)
        largest = impact_log_larger(largest, fabs(row[series->at_p + i]) * scale->inverse_modal[i]);
    return largest;
}

INLINE double power_series_orders(PowerSeries *series, const ModalState *state, const Slice *slice,
                                  const SeriesScale *scale, size_t n, size_t m, size_t stride) {
    const SeriesContact *leader = &series->contact[0];
    const SeriesLaw *law = leader->law;
    const SeriesFactor *time_factor = &series->powers[series->root == 1 ? 0 : law->time_factor];
    const size_t contact_count = m == 1 ? 1 : series->contact_count;
    // From Y = 0 only one order in `gap` is not 0. As many in a row have to be small.
    const size_t gap = leader->has_force && law->is_integer
                           ? (size_t)(law->power[law->elastic] + law->root)
                           : WINDOW_MIN;
    const size_t window =
        series->powers[1].now * scale->inverse_root > NEAR || gap < WINDOW_MIN ? WINDOW_MIN : gap;
    const size_t order = scale->order_max > window ? scale->order_max : window + 1;
    size_t small = 0; // orders in a row
    double size[SERIES_ROW];
    const int powers = leader->has_force ? law->count : 2;
    for (int i = 2; i < powers; i++)
        series_factor_start(&series->powers[i], 0);
    for (size_t c = 0; c < contact_count; c++) {
        series_factor_start(&series->contact[c].speed, 0);
        if (c == 0 && law->is_integer)
            continue; // its powers are those of Y
        series_factor_start(&series->contact[c].elastic, 0);
        series_factor_start(&series->contact[c].viscous, 0);
    }
    size_t k = 0;
    for (; k < order; k++) {
        for (int i = 2; i < powers; i++)
            series->powers[i].now = series_factor_product(&series->powers[law->left[i]],
                                                          &series->powers[law->right[i]], k);
        for (size_t c = 0; c < contact_count; c++)
            power_series_force(series, &series->contact[c], k, c == 0);
        power_series_rate(series, state, slice, k, n, m);
        power_series_state(series, time_factor, k, stride);
        for (int i = 0; i < powers; i++)
            series_factor_store(&series->powers[i], k);
        for (size_t c = 0; c < contact_count; c++) {
            series_factor_store(&series->contact[c].speed, k);
            if (c == 0 && law->is_integer)
                continue;
            series_factor_store(&series->contact[c].elastic, k);
            series_factor_store(&series->contact[c].viscous, k);
        }
        series->powers[0].now = 0;
        series->powers[1].now = series->length / (double)(k + 1) * leader->sign *
                                series->z[k * stride + leader->damper];
        size[k + 1] = power_series_largest(series, scale, k + 1, n, m);
        small = size[k + 1] <= scale->error ? small + 1 : 0;
        if (small >= window) {
            k++;
            break;
        }
    }
    series_factor_store(&series->powers[1], k);
    series->degree = k;
    // Coefficients fall like R^-k. The first order left out shall be below the error.
    double log_radius = INFINITY;
    for (size_t j = k - window + 1; j <= k; j++)
        log_radius = fmin(log_radius, -log(size[j]) / (double)j);
    return exp(fmin(log_radius + log(scale->error) / (double)(k + 1), 1));
}

double power_series_expand(PowerSeries *series, const ModalState *state, const Slice *slice,
                           double Y, double length, const SeriesScale *scale) {
    double *row = series->z;
    const size_t n = series->modes, m = series->dampers;
    series->length = length;
    memset(row, 0, series->stride * sizeof *row);
    for (size_t d = 0; d < m; d++) {
        row[d] = state->damper[d].w;
        if (m > 1)
            row[series->at_r + d] = state->damper[d].r;
    }
    memcpy(row + series->at_q, state->q, n * sizeof *row);
    memcpy(row + series->at_p, state->p, n * sizeof *row);
    if (series->is_sine) {
        row[series->at_a] = slice->value;
        row[series->at_a + 1] = slice->slope;
    }
    series_factor_start(&series->powers[0], 1);
    series_factor_start(&series->powers[1], Y);
    // Constant sizes make contacts of one mode and one damper some 5 % faster (bench_power).
    if (n == 1 && m == 1 && series->stride == 4)
        return power_series_orders(series, state, slice, scale, 1, 1, 4);
    if (n == 1 && m == 1 && series->stride == 8)
        return power_series_orders(series, state, slice, scale, 1, 1, 8);
    return power_series_orders(series, state, slice, scale, n, m, series->stride);
}

void power_series_cut(PowerSeries *series, double s) {
    double power = s;
    series->length *= s;
    for (size_t k = 1; k <= series->degree; k++, power *= s) {
        double *row = series->z + k * series->stride;
        for (size_t i = 0; i < series->stride; i++)
            row[i] *= power;
        series->powers[1].up[k] *= power;
        for (size_t c = 0; c < series->contact_count && k < series->degree; c++)
            series->contact[c].force[k] *= power;
    }
}

void power_series_column(const PowerSeries *series, size_t column, double *out) {
    for (size_t k = 0; k <= series->degree; k++)
        out[k] = series->z[k * series->stride + column];
}

// Horner's scheme. At s = 1 it adds the small terms first.
void power_series_at(const PowerSeries *series, double s, double *row) {
    const size_t stride = series->stride;
    for (size_t i = 0; i < stride; i += 4) {
        const double *at = series->z + series->degree * stride + i;
        Two sum[2] = {TWO(at), TWO(at + 2)};
        for (size_t k = series->degree; k > 0; k--) {
            at -= stride;
            sum[0] = sum[0] * s + TWO(at);
            sum[1] = sum[1] * s + TWO(at + 2);
        }
        PUT_TWO(row + i, sum[0]);
        PUT_TWO(row + i + 2, sum[1]);
    }
}

void power_series_nodes(const PowerSeries *series, size_t rule, const double *c, size_t stride,
                        size_t degree, double *out) {
    const double *power = series->node_power[rule];
    Two sum[SERIES_NODES / 2] = {{0}};
    for (size_t k = 0; k <= degree; k++, power += SERIES_NODES) {
        const double of = c[k * stride];
        sum[0] += of * TWO(power);
        sum[1] += of * TWO(power + 2);
        sum[2] += of * TWO(power + 4);
        sum[3] += of * TWO(power + 6);
    }
    for (size_t i = 0; i < SERIES_NODES / 2; i++)
        PUT_TWO(out + 2 * i, sum[i]);
}
