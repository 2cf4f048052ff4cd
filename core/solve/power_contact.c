// N ~ p^n is not smooth in time where p = 0. With Y = p^(1/root) and dt = root Y^(root - 1) dtau
// the motion is analytic in tau wherever root n is an integer. Y' = p' is the speed, which is not 0
// at the start and at the end of a contact. For Hertz's law and its relatives (n = 3/2, root 2)
//
//   Y' = w,   t' = 2 Y,   w' = 2 Y (s - (k / m_e) Y^3 (1 + a w)),   x' = 2 Y v,  ...
//
// whose Taylor coefficients follow from each other by products of series. If no small root makes
// root n an integer, root = 4 makes N ~ Y^(4n) so smooth that a step may pass the end of the
// contact within the error. Powers u = Y^n then follow from u' Y = n u Y', which holds while Y > 0.
//
// An integration step is as long as the truncation error allows, at most as long as requested, and
// ends where p of a contact falls to 0 (the release), p' passes the kink of the law, N is no more
// negligible, or the gap of a mass in flight closes (a touch): roots of the polynomials. The
// contact nearest to its start or end leads: its p defines the transformed time, and the other
// forces are smooth enough meanwhile. N is left out below the penetration where it would change the
// mass's speed by less than the error. This starts contacts that have no series: a touch without
// speed, or an exponent that no root makes an integer.
#include "core/solve/engine.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/contact/power_law.h"
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
INLINE void power_series_force(PowerContact *power, SeriesContact *contact, size_t k,
                               bool is_leader) {
    const SeriesLaw *law = &contact->law;
    if (!contact->has_force) {
        contact->force[k] = 0;
        return;
    }
    SeriesFactor *elastic = &contact->elastic, *viscous = &contact->viscous;
    contact->speeds.now = contact->sign * power->z[k * power->stride + contact->damper];
    if (is_leader && law->is_integer) {
        elastic = &power->powers[law->elastic];
        viscous = &power->powers[law->viscous];
    } else {
        // Powers of Y of the leader, and of p of the others.
        double own[SERIES_ROW];
        const double root = is_leader ? law->root : 1;
        if (is_leader) {
            memcpy(own, power->powers[1].up, k * sizeof *own);
            own[k] = power->powers[1].now;
        }
        for (size_t j = 0; j <= k && !is_leader; j++)
            own[j] = contact->sign * power->z[j * power->stride + power->at_r + contact->damper];
        elastic->now = power_series_power(own, root * law->exponents[0], elastic->up, k);
        viscous->now = law->exponents[1] == law->exponents[0]
                           ? elastic->now
                           : power_series_power(own, root * law->exponents[1], viscous->up, k);
    }
    double force = contact->terms.stiffness * elastic->now;
    if (contact->is_damped && contact->terms.viscous > 0)
        force += contact->terms.viscous * series_factor_product(&contact->speeds, viscous, k);
    else if (!contact->is_damped && !contact->terms.is_elastic_below)
        force = 0;
    contact->force[k] = force;
}

// D p + W^2 q.
INLINE void power_series_elastic(PowerContact *power, const ModalState *state, const double *row,
                                 size_t n) {
    const double *q = row + power->at_q, *p = row + power->at_p;
    double *restrict out = power->elastic;
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
INLINE void power_series_rate(PowerContact *power, const ModalState *state, const Slice *slice,
                              size_t k, size_t n, size_t m) {
    const double *row = power->z + k * power->stride;
    double *restrict rate = power->rate + k * power->stride;
    const double *elastic = power->elastic;
    const double base = power->is_sine ? row[power->at_a]
                        : k == 0       ? slice->value
                                       : slice->slope * row[power->at_t];
    power_series_elastic(power, state, row, n);
    for (size_t i = 0; i < n; i++) {
        rate[power->at_q + i] = row[power->at_p + i];
        rate[power->at_p + i] = -elastic[i] - state->participation[i] * base;
    }
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        double acceleration = damper->base_coupling * base;
        for (size_t i = 0; i < n; i++)
            acceleration += damper->shape[i] * elastic[i];
        rate[d] = acceleration;
        if (m > 1)
            rate[power->at_r + d] = row[d];
    }
    for (size_t c = 0; c < (m == 1 ? 1 : power->contact_count); c++) {
        const SeriesContact *contact = power->contact[c];
        const double force = contact->sign * contact->force[k];
        const double *shape = state->damper[contact->damper].shape;
        for (size_t i = 0; i < n; i++)
            rate[power->at_p + i] += shape[i] * force;
        for (size_t d = 0; d < m; d++)
            rate[d] -= state->delassus[d * m + contact->damper] * force;
    }
    rate[power->at_t] = k == 0;
    if (power->is_sine) {
        rate[power->at_a] = slice->omega * row[power->at_a + 1];
        rate[power->at_a + 1] = -slice->omega * row[power->at_a];
    }
}

// Order k + 1 of the state, which is that of the integral of rate * time_factor * root * length.
INLINE void power_series_state(PowerContact *power, const SeriesFactor *time_factor, size_t k,
                               size_t stride) {
    const double scale = power->length * power->root / (double)(k + 1);
    double *restrict next = power->z + (k + 1) * stride;
    const double *rate = power->rate, *last = rate + k * stride;
    const double *down = time_factor->down + SERIES_ROW - 1 - k;
    if (power->root == 1 || k == 0) {
        const double times = power->root == 1 ? scale : scale * time_factor->now;
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
INLINE double power_series_largest(const PowerContact *power, size_t k, size_t n, size_t m) {
    const double *row = power->z + k * power->stride;
    double largest = impact_log_larger(fabs(power->powers[1].now) * power->inverse_root,
                                       fabs(row[power->at_t]) * power->inverse_time);
    for (size_t c = 0; c < (m == 1 ? 1 : power->contact_count); c++) {
        const SeriesContact *contact = power->contact[c];
        largest = impact_log_larger(largest, fabs(row[contact->damper]) * contact->inverse_speed);
        // Powers by recurrence spread their rounding errors, which w need not show.
        if (c > 0 || !contact->law.is_integer)
            largest =
                impact_log_larger(largest, fabs(contact->force[k - 1]) * contact->inverse_force);
    }
    for (size_t i = 0; i < n; i++)
        largest = impact_log_larger(largest, fabs(row[power->at_p + i]) * power->inverse_modal[i]);
    return largest;
}

INLINE double power_series_orders(PowerContact *power, const ModalState *state, const Slice *slice,
                                  size_t n, size_t m, size_t stride) {
    const SeriesContact *leader = power->contact[0];
    const SeriesLaw *law = &leader->law;
    const SeriesFactor *time_factor = &power->powers[power->root == 1 ? 0 : law->time_factor];
    const size_t contact_count = m == 1 ? 1 : power->contact_count;
    // From Y = 0 only one order in `gap` is not 0. As many in a row have to be small.
    const size_t gap = leader->has_force && law->is_integer
                           ? (size_t)(law->power[law->elastic] + law->root)
                           : WINDOW_MIN;
    const size_t window =
        power->powers[1].now * power->inverse_root > NEAR || gap < WINDOW_MIN ? WINDOW_MIN : gap;
    const size_t order = power->order_max > window ? power->order_max : window + 1;
    size_t small = 0; // orders in a row
    double size[SERIES_ROW];
    const int powers = leader->has_force ? law->count : 2;
    for (int i = 2; i < powers; i++)
        series_factor_start(&power->powers[i], 0);
    for (size_t c = 0; c < contact_count; c++) {
        series_factor_start(&power->contact[c]->speeds, 0);
        if (c == 0 && law->is_integer)
            continue; // its powers are those of Y
        series_factor_start(&power->contact[c]->elastic, 0);
        series_factor_start(&power->contact[c]->viscous, 0);
    }
    size_t k = 0;
    for (; k < order; k++) {
        for (int i = 2; i < powers; i++)
            power->powers[i].now = series_factor_product(&power->powers[law->left[i]],
                                                         &power->powers[law->right[i]], k);
        for (size_t c = 0; c < contact_count; c++)
            power_series_force(power, power->contact[c], k, c == 0);
        power_series_rate(power, state, slice, k, n, m);
        power_series_state(power, time_factor, k, stride);
        for (int i = 0; i < powers; i++)
            series_factor_store(&power->powers[i], k);
        for (size_t c = 0; c < contact_count; c++) {
            series_factor_store(&power->contact[c]->speeds, k);
            if (c == 0 && law->is_integer)
                continue;
            series_factor_store(&power->contact[c]->elastic, k);
            series_factor_store(&power->contact[c]->viscous, k);
        }
        power->powers[0].now = 0;
        power->powers[1].now =
            power->length / (double)(k + 1) * leader->sign * power->z[k * stride + leader->damper];
        size[k + 1] = power_series_largest(power, k + 1, n, m);
        small = size[k + 1] <= power->error ? small + 1 : 0;
        if (small >= window) {
            k++;
            break;
        }
    }
    series_factor_store(&power->powers[1], k);
    power->degree = k;
    // Coefficients fall like R^-k. The first order left out shall be below the error.
    double log_radius = INFINITY;
    for (size_t j = k - window + 1; j <= k; j++)
        log_radius = fmin(log_radius, -log(size[j]) / (double)j);
    return exp(fmin(log_radius + log(power->error) / (double)(k + 1), 1));
}

double power_series_expand(PowerContact *power, const Slice *slice, double Y, double length) {
    const ModalState *state = power->state;
    double *row = power->z;
    const size_t n = state->mode_count, m = state->dampers;
    power->length = length;
    memset(row, 0, power->stride * sizeof *row);
    for (size_t d = 0; d < m; d++) {
        row[d] = state->damper[d].w;
        if (m > 1)
            row[power->at_r + d] = state->damper[d].r;
    }
    memcpy(row + power->at_q, state->q, n * sizeof *row);
    memcpy(row + power->at_p, state->p, n * sizeof *row);
    if (power->is_sine) {
        row[power->at_a] = slice->value;
        row[power->at_a + 1] = slice->slope;
    }
    series_factor_start(&power->powers[0], 1);
    series_factor_start(&power->powers[1], Y);
    // Constant sizes make contacts of one mode and one damper some 5 % faster (bench_power).
    if (n == 1 && m == 1 && power->stride == 4)
        return power_series_orders(power, state, slice, 1, 1, 4);
    if (n == 1 && m == 1 && power->stride == 8)
        return power_series_orders(power, state, slice, 1, 1, 8);
    return power_series_orders(power, state, slice, n, m, power->stride);
}

void power_series_cut(PowerContact *power, double s) {
    double share = s;
    power->length *= s;
    for (size_t k = 1; k <= power->degree; k++, share *= s) {
        double *row = power->z + k * power->stride;
        for (size_t i = 0; i < power->stride; i++)
            row[i] *= share;
        power->powers[1].up[k] *= share;
        for (size_t c = 0; c < power->contact_count && k < power->degree; c++)
            power->contact[c]->force[k] *= share;
    }
}

// Copies the coefficients of one column, degree + 1 values.
static void power_series_column(const PowerContact *power, size_t column, double *out) {
    for (size_t k = 0; k <= power->degree; k++)
        out[k] = power->z[k * power->stride + column];
}

// Horner's scheme. At s = 1 it adds the small terms first.
void power_series_at(const PowerContact *power, double s, double *row) {
    const size_t stride = power->stride;
    for (size_t i = 0; i < stride; i += 4) {
        const double *at = power->z + power->degree * stride + i;
        Two sum[2] = {TWO(at), TWO(at + 2)};
        for (size_t k = power->degree; k > 0; k--) {
            at -= stride;
            sum[0] = sum[0] * s + TWO(at);
            sum[1] = sum[1] * s + TWO(at + 2);
        }
        PUT_TWO(row + i, sum[0]);
        PUT_TWO(row + i + 2, sum[1]);
    }
}

enum { ORDER_MAX = 22, KINKS_MAX = 8 };

static const double STEP_PART = 0.1; // truncation error of a step over the contact's tolerance
static const double ROUNDING = DBL_EPSILON / 4;
static const double STEP_COST = 800; // of a step besides its orders, in multiplications
static const double ORDER_BASE = 2.5,
                    ORDER_SLOPE = 0.55; // cheapest order = base - slope log(error)
static const double SPAN = 0.3;         // usual step, in (root of depth) / speed
static const double ONSET_MARGIN = 0.9; // N is left out below this part of the onset

Status power_contact_make(PowerContact *power, ModalState *state, double tolerance,
                          Problem *problem) {
    memset(power, 0, sizeof *power);
    power->state = state;
    power->tolerance = tolerance;
    if (state->plan->form != CONTACT_POWER || state->dampers == 0)
        return STATUS_OK;
    const size_t n = state->mode_count, m = state->dampers;
    power->error = fmax(STEP_PART * tolerance, ROUNDING);
    const double order = ORDER_BASE - ORDER_SLOPE * log(power->error);
    power->order_max = order > ORDER_MAX ? ORDER_MAX : (size_t)order;
    power->is_sine = state->base.base->omega > 0;
    power->at_t = m;
    power->at_q = m + 1;
    power->at_p = power->at_q + n;
    power->at_a = power->at_p + n;
    power->at_r = power->at_a + (power->is_sine ? 2 : 0);
    power->stride = (power->at_r + (m > 1 ? m : 0) + 3) / 4 * 4;
    power->all = calloc(m, sizeof *power->all);
    power->contact = calloc(m, sizeof *power->contact);
    const SimdArray arrays[] = {
        {&power->z, SERIES_ROW * power->stride},
        {&power->rate, SERIES_ROW * power->stride},
        {&power->row, power->stride},
        {&power->elastic, state->padded},
        {&power->inverse_modal, n},
    };
    power->block = simd_kernels_allocate(arrays, COUNT(arrays));
    if (power->all == NULL || power->contact == NULL || power->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for contacts of %zu dampers", m);
    for (size_t d = 0; d < m; d++)
        power->all[d].damper = d;
    return STATUS_OK;
}

void power_contact_clear(PowerContact *power) {
    free(power->all);
    free(power->contact);
    free(power->block);
}

bool power_contact_is_active(const PowerContact *power) {
    for (size_t d = 0; power->block != NULL && d < power->state->dampers; d++)
        if (power->state->damper[d].phase == PHASE_CONTACT)
            return true;
    return false;
}

static double power_contact_root(double value, int root) {
    return root == 1   ? value
           : root == 2 ? sqrt(value)
           : root == 3 ? cbrt(value)
                       : sqrt(sqrt(value));
}

static double power_contact_penetration(const DamperState *damper) {
    return fmax(modal_state_sign(damper->side) * damper->r, 0);
}

// Penetration at which k p^n is `force`.
static double power_contact_depth(const ContactTerms *terms, double force) {
    return pow(force / terms->stiffness, 1 / terms->exponent);
}

// Energy in the buffer [J].
static double power_contact_strain(const SeriesContact *at, double p) {
    const double n = at->terms.exponent;
    return at->terms.stiffness * power_law_pow(p, n) * p / (n + 1);
}

// Penetration up to which N changes the speed of an impact by at most the part `error`.
static double power_contact_impact_onset(const SeriesContact *at, double error) {
    const double n = at->terms.exponent, m = at->terms.viscous_exponent;
    return at->depth * pow(error, 1 / ((at->terms.viscous > 0 ? fmin(n, m) : n) + 1));
}

// Penetration below which N is negligible in a contact with the present speed w.
static double power_contact_onset(const SeriesContact *at, double error, double w, double mass) {
    const double m = at->terms.viscous_exponent;
    double p = at->law.is_integer ? 0 : power_contact_impact_onset(at, error);
    // A mass that is pressed in almost without speed: p = acceleration t^2 / 2.
    if (!(at->acceleration > 0) || !(w * w < 1e-3 * at->acceleration * at->depth))
        return p;
    double pressed = power_contact_depth(&at->terms, error * mass * at->acceleration);
    if (at->terms.viscous > 0)
        pressed = fmin(
            pressed, pow(error * mass * sqrt(at->acceleration) / at->terms.viscous, 1 / (m + 0.5)));
    return w * w < 2 * at->acceleration * pressed ? fmax(p, pressed) : p;
}

// Updates the scales of a damper's contact to the present state.
static void power_contact_update(PowerContact *power, size_t d) {
    const ModalState *state = power->state;
    const DamperState *damper = &state->damper[d];
    SeriesContact *at = &power->all[d];
    const double mass = damper->effective_mass, w = modal_state_sign(damper->side) * damper->w;
    const ContactParameters *now = &damper->contact;
    at->sign = modal_state_sign(damper->side);
    if (memcmp(now, &at->parameters, sizeof *now) != 0) {
        at->parameters = *now;
        at->terms = state->plan->law->terms(now);
        series_law_make(&at->law, &at->terms);
        at->speed = 0;
    }
    at->acceleration = modal_state_sign(damper->side) *
                       (damper->base_coupling * state->base_acceleration +
                        modal_state_dot(damper->shape, power->elastic, state->mode_count));
    const double p = power_contact_penetration(damper);
    const double speed = fmax(fabs(w), damper->row.impact.approach_speed);
    if (!(speed <= at->speed) || !(speed >= at->speed / 4) || !(at->speed > 0)) {
        at->speed = speed;
        at->depth = pow(mass * speed * speed / at->terms.stiffness, 1 / (at->terms.exponent + 1));
    }
    // The acceleration may lead deeper than the speed of the touch.
    const double force = mass * fabs(at->acceleration);
    if (force * at->depth > mass * at->speed * at->speed || !(at->speed > 0)) {
        at->depth = power_contact_depth(&at->terms, force);
        at->speed = fmax(speed, sqrt(2 * fabs(at->acceleration) * at->depth));
    }
    at->depth = fmax(at->depth, p);
    at->onset = power_contact_onset(at, power->error, w, mass);
    at->strain = power_contact_strain(at, p);
}

// On which side of the law's kink the motion is. At a kink just passed w shows only rounding.
static bool power_contact_is_damped(const SeriesContact *at, const DamperState *damper) {
    const double w = modal_state_sign(damper->side) * damper->w, above = w - at->terms.turn;
    if (fabs(above) > 4 * DBL_EPSILON * fabs(w))
        return above > 0;
    if (at->kink_passed != 0)
        return at->kink_passed > 0;
    const double p = power_contact_penetration(damper);
    const double elastic =
        at->terms.is_elastic_below ? at->terms.stiffness * power_law_pow(p, at->terms.exponent) : 0;
    return at->acceleration - elastic / damper->effective_mass > 0;
}

// Lists the contacts, the leading one first: of those with a force the one with the smallest p in
// its scale. Returns its Y.
static double power_contact_list(PowerContact *power) {
    const ModalState *state = power->state;
    SeriesContact **const list = power->contact;
    size_t leader = 0;
    double smallest = INFINITY;
    power->contact_count = 0;
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        SeriesContact *at = &power->all[d];
        if (damper->phase != PHASE_CONTACT)
            continue;
        const double p = power_contact_penetration(damper);
        at->has_force = p >= ONSET_MARGIN * at->onset;
        at->is_damped = power_contact_is_damped(at, damper);
        const double relative = at->has_force ? p / at->depth : 0x1p1000;
        if (relative < smallest) {
            smallest = relative;
            leader = power->contact_count;
        }
        list[power->contact_count++] = at;
    }
    SeriesContact *const first = list[leader];
    list[leader] = list[0];
    list[0] = first;
    // Another contact at p = 0 has no series in the leader's time before its onset.
    for (size_t c = 1; c < power->contact_count; c++) {
        if (power_contact_penetration(&state->damper[list[c]->damper]) > 0)
            continue;
        list[c]->has_force = false;
        list[c]->onset = fmax(list[c]->onset, power_contact_impact_onset(list[c], power->error));
    }
    power->root = first->has_force ? first->law.root : 1;
    return power_contact_root(power_contact_penetration(&state->damper[first->damper]),
                              power->root);
}

// Updates the scales of the series. Returns the length in tau to try.
static double power_contact_scale(PowerContact *power, double Y, double length) {
    const ModalState *state = power->state;
    const size_t n = state->mode_count;
    const int root = power->root;
    double time = INFINITY;
    for (size_t i = 0; i < n; i++)
        power->inverse_modal[i] = fabs(state->p[i]) + DBL_MIN;
    for (size_t c = 0; c < power->contact_count; c++) {
        SeriesContact *at = power->contact[c];
        const DamperState *damper = &state->damper[at->damper];
        const double speed = at->speed + DBL_MIN, own = at->depth / speed;
        for (size_t i = 0; i < n; i++)
            power->inverse_modal[i] += fabs(damper->shape[i]) * damper->effective_mass * speed;
        at->inverse_speed = 1 / speed;
        at->inverse_force = own / (damper->effective_mass * speed);
        time = own < time ? own : time;
    }
    for (size_t i = 0; i < n; i++)
        power->inverse_modal[i] = 1 / power->inverse_modal[i];
    const SeriesContact *leader = power->contact[0];
    const double w = leader->sign * state->damper[leader->damper].w;
    const double Y_scale = power_contact_root(leader->depth, root) + DBL_MIN;
    power->inverse_root = 1 / Y_scale;
    power->inverse_time = 1 / (time + DBL_MIN);
    // `length` at constant speed is (E - Y) / w in tau, E^root = Y^root + w length. Division by the
    // sum of Y^i E^(root - 1 - i) avoids the cancellation.
    double p = Y;
    for (int i = 1; i < root; i++)
        p *= Y;
    const double E = power_contact_root(impact_log_larger(p + w * length, 0), root);
    double sum = 0, next = 1;
    for (int i = 0; i < root; i++, next *= Y)
        sum = sum * E + next;
    const double usual = SPAN * Y_scale * leader->inverse_speed;
    const double reach =
        root == power->last_root && power->last_length > usual ? power->last_length : usual;
    return fmin(reach, 1.02 * length / sum);
}

// Cuts the step where the leading contact is released: t would decrease beyond. Returns whether it
// is.
static bool power_contact_cut_release(PowerContact *power) {
    double s;
    const bool is_released = polynomial_root_first(power_series_leader(power), power->degree, &s);
    if (is_released)
        power_series_cut(power, s);
    return is_released;
}

// Cuts the step where t is `length`. Returns whether it reaches `length`; *is_cut: it was longer.
static bool power_contact_cut_time(PowerContact *power, double length, bool *is_cut) {
    double left[SERIES_ROW], s, t = 0;
    power_series_column(power, power->at_t, left);
    for (size_t k = power->degree; k > 0; k--) {
        t += left[k];
        left[k] = -left[k];
    }
    *is_cut = false;
    if (t <= length)
        return t >= length * (1 - 4 * DBL_EPSILON);
    left[0] = length;
    *is_cut = polynomial_root_first(left, power->degree, &s);
    if (*is_cut)
        power_series_cut(power, s);
    return true;
}

// The release of a contact that does not lead, and the onset of a force that is left out.
static void power_contact_find_release(const PowerContact *power, size_t c, ContactEvent *first) {
    const SeriesContact *at = power->contact[c];
    ContactEvent event = {.damper = at->damper, .side = power->state->damper[at->damper].side};
    double r[SERIES_ROW];
    if (c > 0) {
        power_series_column(power, power->at_r + at->damper, r);
        contact_event_locate(r, power->degree, at->sign, 0, 0, event, first);
    }
    event.is_onset = true;
    if (!at->has_force)
        contact_event_locate(c > 0 ? r : power_series_leader(power), power->degree,
                             c > 0 ? -at->sign : -1, at->onset, 0, event, first);
}

static void power_contact_find_kink(const PowerContact *power, const SeriesContact *at,
                                    ContactEvent *first) {
    double w[SERIES_ROW];
    if (!(at->terms.viscous > 0) || !at->has_force || power->kinks > KINKS_MAX)
        return;
    const int sign = at->is_damped ? 1 : -1;
    power_series_column(power, at->damper, w);
    const bool is_here = fabs(at->sign * w[0] - at->terms.turn) <= 4 * DBL_EPSILON * fabs(w[0]);
    contact_event_locate(w, power->degree, sign * at->sign, -sign * at->terms.turn, is_here,
                         (ContactEvent){.damper = at->damper, .kink = -sign}, first);
}

// A contact that is over already: the gap opens from the first instant on.
static bool power_contact_find_open(const PowerContact *power, PowerContactStep *step) {
    const ModalState *state = power->state;
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        const double sign = modal_state_sign(damper->side), w = sign * damper->w;
        if (damper->phase != PHASE_CONTACT || sign * damper->r > 0 ||
            !(w < 0 || (w == 0 && !(power->all[d].acceleration > 0))))
            continue;
        step->is_event = true;
        step->event = (ContactEvent){.damper = d, .s = 1, .side = damper->side};
        return true;
    }
    return false;
}

// What ends the step first; s is INFINITY if nothing does. is_released: the leading contact is at
// its end.
static ContactEvent power_contact_find(const PowerContact *power, bool is_released) {
    const ModalState *state = power->state;
    const size_t leader = power->contact[0]->damper;
    ContactEvent first = {
        .damper = leader, .s = is_released ? 1 : INFINITY, .side = state->damper[leader].side};
    for (size_t c = 0; c < power->contact_count; c++) {
        power_contact_find_release(power, c, &first);
        power_contact_find_kink(power, power->contact[c], &first);
    }
    for (size_t d = 0; d < state->dampers; d++) {
        double r[SERIES_ROW];
        if (state->damper[d].phase != PHASE_FLIGHT)
            continue;
        power_series_column(power, power->at_r + d, r);
        contact_event_find_touch(state, d, r, power->degree, &first);
    }
    return first;
}

// Sets the state to that at s. is_released: the leading contact's p is exactly 0 there.
static void power_contact_state(PowerContact *power, const Slice *slice, double s,
                                bool is_released) {
    ModalState *state = power->state;
    const SeriesContact *leader = power->contact[0];
    const double *row = power->row;
    power_series_at(power, s, power->row);
    memcpy(state->q, row + power->at_q, state->mode_count * sizeof *state->q);
    memcpy(state->p, row + power->at_p, state->mode_count * sizeof *state->p);
    for (size_t d = 0; d < state->dampers; d++) {
        state->damper[d].w = row[d];
        if (state->dampers > 1)
            state->damper[d].r = row[power->at_r + d];
    }
    const double Y = fmax(polynomial_value(power_series_leader(power), power->degree, s), 0);
    double r = Y;
    for (int i = 1; i < power->root; i++)
        r *= Y;
    state->damper[leader->damper].r = is_released ? 0 : leader->sign * r;
    state->base_acceleration = slice_at(slice, row[power->at_t]);
}

// Horner's scheme at all nodes of a rule.
static void power_contact_nodes(const Quadrature *rule, const double *c, size_t degree,
                                double *values) {
    for (size_t k = 0; k < COUNT(rule->node); k++)
        values[k] = c[degree];
    for (size_t i = degree; i-- > 0;)
        for (size_t k = 0; k < COUNT(rule->node); k++)
            values[k] = values[k] * rule->node[k] + c[i];
}

// p' D p.
static double power_contact_loss(const ModalState *state, const double *p) {
    const size_t n = state->mode_count;
    double loss = 0;
    for (size_t i = 0; i < n; i++)
        loss += p[i] * (state->diagonal != NULL ? state->diagonal[i] * p[i]
                                                : modal_state_dot(state->damping + i * n, p, n));
    return loss;
}

// Integrates over the step by Gauss-Legendre quadrature: the work of the base, the losses, and
// impulse and work of each N.
static void power_contact_integrate(PowerContact *power, const Slice *slice, StepWork *work) {
    const ModalState *state = power->state;
    const Quadrature *rule =
        &linear_motion_rules[power->error > 1e-8 ? 0 : LINEAR_MOTION_RULES - 1];
    const double *w = power->row, *p = w + power->at_p;
    double Y[COUNT(rule->node)];
    power_contact_nodes(rule, power_series_leader(power), power->degree, Y);
    for (size_t c = 0; c < power->contact_count; c++) {
        SeriesContact *at = power->contact[c];
        at->impulse = at->work = 0;
        power_contact_nodes(rule, at->force, power->degree - 1, at->node_force);
    }
    for (size_t k = 0; k < rule->count; k++) {
        power_series_at(power, rule->node[k], power->row);
        const double ground = power->is_sine ? w[power->at_a] : slice_at(slice, w[power->at_t]);
        double weight = rule->weight[k] * power->length * power->root;
        for (int i = 1; i < power->root; i++)
            weight *= Y[k];
        double momentum = modal_state_dot(state->momentum_weights, p, state->mode_count);
        for (size_t d = 0; d < state->dampers; d++)
            momentum += state->damper[d].plan->mass * w[d];
        work->input -= weight * ground * momentum;
        work->damping += weight * power_contact_loss(state, p);
        work->ground += weight * ground;
        for (size_t c = 0; c < power->contact_count; c++) {
            SeriesContact *at = power->contact[c];
            const double impulse = weight * at->sign * at->node_force[k];
            at->impulse += impulse;
            at->work += impulse * w[at->damper];
        }
    }
}

// Peak forces on the step, and peak accelerations at their instants. Changes the state.
static void power_contact_peaks(PowerContact *power, const Slice *slice) {
    ModalState *state = power->state;
    for (size_t c = 0; c < power->contact_count; c++) {
        const SeriesContact *of = power->contact[c];
        DamperState *damper = &state->damper[of->damper];
        double s = -1;
        if (!of->has_force)
            continue;
        const double peak =
            linear_motion_largest(of->force, power->degree - 1,
                                  impact_log_least_force(&state->impacts, &damper->row), &s);
        impact_log_force(&state->impacts, &damper->row, peak);
        if (!(s > 0 && s < 1))
            continue;
        power_contact_state(power, slice, s, false);
        modal_state_forces(state);
        recorder_acceleration(state);
    }
}

// Adds the step to the impact rows; the state is that of its end.
static void power_contact_log(PowerContact *power, double length) {
    ModalState *state = power->state;
    for (size_t c = 0; c < power->contact_count; c++) {
        const SeriesContact *at = power->contact[c];
        DamperState *damper = &state->damper[at->damper];
        const double strain = power_contact_strain(at, power_contact_penetration(damper));
        impact_log_stretch(&state->impacts, &damper->row, length, at->impulse,
                           at->work - (strain - at->strain));
    }
}

void power_contact_step(PowerContact *power, const Slice *slice, double length,
                        PowerContactStep *step) {
    ModalState *state = power->state;
    *step = (PowerContactStep){0};
    modal_state_elastic(state, state->q, state->p, power->elastic);
    for (size_t d = 0; d < state->dampers; d++)
        if (state->damper[d].phase == PHASE_CONTACT)
            power_contact_update(power, d);
    if (power_contact_find_open(power, step))
        return;
    const double Y = power_contact_list(power);
    const double span = power_contact_scale(power, Y, length);
    power_series_cut(power, power_series_expand(power, slice, Y, span));
    power->last_length = power->length;
    power->last_root = power->root;
    const bool is_released = power_contact_cut_release(power);
    bool is_cut;
    const bool is_whole = power_contact_cut_time(power, length, &is_cut);
    const ContactEvent end = power_contact_find(power, is_released && !is_cut);
    const bool is_found = end.s <= 1;
    if (end.s < 1)
        power_series_cut(power, end.s);
    if (!state->is_shadow) {
        power_contact_integrate(power, slice, &step->work);
        power_contact_peaks(power, slice);
    }
    step->is_event = is_found && !end.is_onset && end.kink == 0;
    step->event = end;
    step->event.s = 1;
    power_contact_state(power, slice, 1, step->is_event && end.damper == power->contact[0]->damper);
    step->length = is_whole && !is_found ? length : power->row[power->at_t];
    if (!state->is_shadow)
        power_contact_log(power, step->length);
    power->kinks = step->length > 0 ? 0 : power->kinks + 1;
    for (size_t c = 0; c < power->contact_count; c++)
        if (step->length > 0)
            power->contact[c]->kink_passed = 0;
    if (end.kink != 0) {
        DamperState *damper = &state->damper[end.damper];
        SeriesContact *at = &power->all[end.damper];
        damper->w = modal_state_sign(damper->side) * at->terms.turn;
        at->kink_passed = end.kink;
    }
    const double k = (double)power->degree, n = (double)state->mode_count;
    step->cost = STEP_COST +
                 k * k / 2 * ((double)power->stride + 4 * (double)power->contact_count) +
                 (state->diagonal == NULL ? k * n * n : 0) + 12 * k * (double)power->stride;
}
