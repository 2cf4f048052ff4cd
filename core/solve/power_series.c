// In time the motion is not smooth where p = 0: N ~ p^n. With Y = p^(1/root) and dt = root
// Y^(root-1) dtau all of it is analytic in tau wherever n root is a whole number, Y' = p' being the
// speed itself, which neither touch nor release stops: for Hertz and all like him (n = 3/2, root 2)
//
//   Y' = w,   t' = 2 Y,   w' = 2 Y (s - (k / m_e) Y^3 (1 + a w)),   x' = 2 Y v,  ...
//
// whose Taylor coefficients follow from each other by products of series. Where no small root does,
// root = 4 makes N ~ Y^(4n) so smooth that steps which keep their error run over its end; powers
// follow then from u Y' n = u' Y, which holds while Y > 0.
#include "core/solve/power_series.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/wide.h"

// Pairs fill the registers that every processor has.
typedef double Two __attribute__((vector_size(16), aligned(8), may_alias));
#define TWO(values) (*(const Two *)(values))
#define PUT_TWO(values, two) (*(Two *)(values) = (two))

enum { GAP_MIN = 3 };
static const double NEAR = 0.3; // Y, of its scale: nearer it is as if it were 0

Status power_series_room(PowerSeries *series, const ModalState *state, Problem *problem) {
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

// What is computed of an order goes into its series when the order is over: until then it stands
// beside them in `now`, for a processor is slow to read as a pair what was written singly a moment
// ago.
INLINE void put(Series *series, size_t k) {
    series->up[k] = series->down[SERIES_ROW - 1 - k] = series->now;
}

// Zeros behind order 0.
INLINE void begin(Series *series, double first) {
    memset(series->up, 0, sizeof series->up);
    memset(series->down, 0, sizeof series->down);
    series->now = first;
}

// Order k of a product.
INLINE double product(const Series *a, const Series *b, size_t k) {
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

// Order k of b^exponent, b[0] > 0, from the orders before.
static double power_order(const double *b, double exponent, const double *power, size_t k) {
    if (k == 0)
        return exponent == 0 ? 1 : pow(b[0], exponent);
    double sum = 0;
    for (size_t j = 0; j < k; j++)
        sum += (exponent * (double)(k - j) - (double)j) * b[k - j] * power[j];
    return sum / ((double)k * b[0]);
}

INLINE void contact_order(PowerSeries *series, SeriesContact *contact, size_t k, bool is_leader) {
    const SeriesLaw *law = contact->law;
    if (!contact->is_felt) {
        contact->force[k] = 0;
        return;
    }
    Series *spring = &contact->spring, *viscous = &contact->viscous;
    contact->speed.now = contact->sign * series->z[k * series->stride + contact->damper];
    if (is_leader && law->is_whole) {
        spring = &series->powers[law->spring];
        viscous = &series->powers[law->viscous];
    } else {
        double own[SERIES_ROW];
        const double root = is_leader ? law->root : 1;
        for (size_t j = 0; j < k && is_leader; j++)
            own[j] = series->powers[1].up[j];
        if (is_leader)
            own[k] = series->powers[1].now;
        for (size_t j = 0; j <= k && !is_leader; j++)
            own[j] = contact->sign * series->z[j * series->stride + series->at_r + contact->damper];
        spring->now = power_order(own, root * law->exponents[0], spring->up, k);
        viscous->now = law->exponents[1] == law->exponents[0]
                           ? spring->now
                           : power_order(own, root * law->exponents[1], viscous->up, k);
    }
    double force = contact->terms.stiffness * spring->now;
    if (contact->is_damped && contact->terms.viscous > 0)
        force += contact->terms.viscous * product(&contact->speed, viscous, k);
    else if (!contact->is_damped && !contact->terms.is_elastic_below)
        force = 0;
    contact->force[k] = force;
}

INLINE void put_contact(SeriesContact *contact, size_t k, bool is_whole) {
    put(&contact->speed, k);
    if (is_whole)
        return;
    put(&contact->spring, k);
    put(&contact->viscous, k);
}

// D p + W^2 q.
INLINE void elastic_order(PowerSeries *series, const ModalState *state, const double *row,
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

// The derivatives in t.
INLINE void rate_order(PowerSeries *series, const ModalState *state, const Slice *slice, size_t k,
                       size_t n, size_t m) {
    const double *row = series->z + k * series->stride;
    double *restrict rate = series->rate + k * series->stride;
    const double *elastic = series->elastic;
    const double base = series->is_sine ? row[series->at_a]
                        : k == 0        ? slice->value
                                        : slice->slope * row[series->at_t];
    elastic_order(series, state, row, n);
    for (size_t i = 0; i < n; i++) {
        rate[series->at_q + i] = row[series->at_p + i];
        rate[series->at_p + i] = -elastic[i] - state->participation[i] * base;
    }
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        double push = damper->base_coupling * base;
        for (size_t i = 0; i < n; i++)
            push += damper->shape[i] * elastic[i];
        rate[d] = push;
        if (m > 1)
            rate[series->at_r + d] = row[d];
    }
    for (size_t c = 0; c < (m == 1 ? 1 : series->contacts); c++) {
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

// Order k + 1 of the state: what is between is times Y^(root - 1).
INLINE void state_order(PowerSeries *series, const Series *pace, size_t k, size_t stride) {
    const double scale = series->length * series->root / (double)(k + 1);
    double *restrict next = series->z + (k + 1) * stride;
    const double *rate = series->rate, *last = rate + k * stride;
    const double *down = pace->down + SERIES_ROW - 1 - k;
    if (series->root == 1 || k == 0) {
        const double times = series->root == 1 ? scale : scale * pace->now;
        for (size_t i = 0; i < stride; i++)
            next[i] = times * last[i];
        return;
    }
    const double first = pace->up[0], now = pace->now;
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

// The largest coefficient of order k, over its scale.
INLINE double size_of(const PowerSeries *series, const SeriesScale *scale, size_t k, size_t n,
                      size_t m) {
    const double *row = series->z + k * series->stride;
    double most = impact_log_larger(fabs(series->powers[1].now) * scale->per_root,
                                    fabs(row[series->at_t]) * scale->per_time);
    for (size_t c = 0; c < (m == 1 ? 1 : series->contacts); c++) {
        const size_t d = series->contact[c].damper;
        most = impact_log_larger(most, fabs(row[d]) * scale->per_speed[d]);
        // Powers that follow from those before them spread their rounding, of which w need not
        // tell.
        if (c > 0 || !series->contact[c].law->is_whole)
            most = impact_log_larger(most, fabs(series->contact[c].force[k - 1]) *
                                               series->contact[c].per_force);
    }
    for (size_t i = 0; i < n; i++)
        most = impact_log_larger(most, fabs(row[series->at_p + i]) * scale->per_modal[i]);
    return most;
}

INLINE double make(PowerSeries *series, const ModalState *state, const Slice *slice,
                   const SeriesScale *scale, size_t n, size_t m, size_t stride) {
    const SeriesContact *leader = &series->contact[0];
    const SeriesLaw *law = leader->law;
    const Series *pace = &series->powers[series->root == 1 ? 0 : law->pace];
    // From Y = 0 only each so-manieth order has anything in it.
    const size_t gap =
        leader->is_felt && law->is_whole ? (size_t)(law->power[law->spring] + law->root) : GAP_MIN;
    const size_t window =
        series->powers[1].now * scale->per_root > NEAR || gap < GAP_MIN ? GAP_MIN : gap;
    const size_t order = scale->order > window ? scale->order : window + 1;
    size_t small = 0; // orders in a row
    double size[SERIES_ROW];
    const int powers = leader->is_felt ? law->count : 2;
    for (int i = 2; i < powers; i++)
        begin(&series->powers[i], 0);
    for (size_t c = 0; c < (m == 1 ? 1 : series->contacts); c++) {
        begin(&series->contact[c].speed, 0);
        if (c == 0 && law->is_whole)
            continue; // its powers are those of Y
        begin(&series->contact[c].spring, 0);
        begin(&series->contact[c].viscous, 0);
    }
    size_t k = 0;
    for (; k < order; k++) {
        for (int i = 2; i < powers; i++)
            series->powers[i].now =
                product(&series->powers[law->left[i]], &series->powers[law->right[i]], k);
        for (size_t c = 0; c < (m == 1 ? 1 : series->contacts); c++)
            contact_order(series, &series->contact[c], k, c == 0);
        rate_order(series, state, slice, k, n, m);
        state_order(series, pace, k, stride);
        for (int i = 0; i < powers; i++)
            put(&series->powers[i], k);
        for (size_t c = 0; c < (m == 1 ? 1 : series->contacts); c++)
            put_contact(&series->contact[c], k, c == 0 && law->is_whole);
        series->powers[0].now = 0;
        series->powers[1].now = series->length / (double)(k + 1) * leader->sign *
                                series->z[k * stride + leader->damper];
        size[k + 1] = size_of(series, scale, k + 1, n, m);
        small = size[k + 1] <= scale->error ? small + 1 : 0;
        if (small >= window) {
            k++;
            break;
        }
    }
    put(&series->powers[1], k);
    series->degree = k;
    // Coefficients fall as powers of 1 / R; the first one left out is to be small enough.
    double wide = INFINITY;
    for (size_t j = k - window + 1; j <= k; j++)
        wide = fmin(wide, -log(size[j]) / (double)j);
    return exp(fmin(wide + log(scale->error) / (double)(k + 1), 1));
}

double power_series_make(PowerSeries *series, const ModalState *state, const Slice *slice, double Y,
                         double length, const SeriesScale *scale) {
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
    begin(&series->powers[0], 1);
    begin(&series->powers[1], Y);
    // The usual case is made for its own numbers.
    if (n == 1 && m == 1 && series->stride == 4)
        return make(series, state, slice, scale, 1, 1, 4);
    if (n == 1 && m == 1 && series->stride == 8)
        return make(series, state, slice, scale, 1, 1, 8);
    return make(series, state, slice, scale, n, m, series->stride);
}

void power_series_cut(PowerSeries *series, double s) {
    double power = s;
    series->length *= s;
    for (size_t k = 1; k <= series->degree; k++, power *= s) {
        double *row = series->z + k * series->stride;
        for (size_t i = 0; i < series->stride; i++)
            row[i] *= power;
        series->powers[1].up[k] *= power;
        for (size_t c = 0; c < series->contacts && k < series->degree; c++)
            series->contact[c].force[k] *= power;
    }
}

void power_series_of(const PowerSeries *series, size_t place, double *out) {
    for (size_t k = 0; k <= series->degree; k++)
        out[k] = series->z[k * series->stride + place];
}

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

void power_series_end(const PowerSeries *series, double *row) {
    const size_t stride = series->stride;
    for (size_t i = 0; i < stride; i += 4) {
        const double *at = series->z + series->degree * stride + i;
        Two sum[2] = {TWO(at), TWO(at + 2)};
        for (size_t k = series->degree; k > 0; k--) { // small terms first
            at -= stride;
            sum[0] += TWO(at);
            sum[1] += TWO(at + 2);
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
