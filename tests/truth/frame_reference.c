// Steps so short that the fastest rate turns half a radian, each up to the first condition that
// fails on it.
#include "tests/truth/frame_reference_walk.h"

#include <stdlib.h>
#include <string.h>

static const Quad STRIDE = 0.5, NOTHING = 1e-29;

// Which condition of damper d fails first on the series; *what: side met, or 1 for inwards.
static bool look(const ImportContext *walk, size_t d, Quad *s, int *what) {
    const Mass *mass = &walk->mass[d];
    Quad f[TERMS], at;
    bool is_found = false;
    const Quad sign = walk_sign(mass->side);
    const int degree = walk->degree;
    *what = 0;
    if (mass->phase == FLYING) {
        for (int side = 0; side < 2; side++) {
            for (int i = 0; i <= degree; i++)
                f[i] = -walk_sign(side) * walk->us[d][i];
            f[0] += walk_room(walk, d, side);
            if (quad_crossing(f, degree, mass->at == side ? mass->zeros : 0, &at) &&
                (!is_found || at < *s)) {
                *s = at;
                *what = side;
                is_found = true;
            }
        }
        return is_found;
    }
    const bool by_force = mass->phase == RESTING || mass->phase == INSIDE ||
                          walk->plan->separation == SEPARATION_ZERO_FORCE;
    for (int i = 0; i < degree; i++)
        f[i] = mass->phase == INSIDE ? -sign * (mass->k * walk->us[d][i] +
                                                mass->c * (i + 1) * walk->us[d][i + 1] / walk->h)
               : by_force            ? sign * walk->ns[d][i]
                                     : sign * walk->us[d][i];
    const int zeros = by_force && mass->phase == TOUCHING && walk->us[d][0] == 0 ? 0 : mass->zeros;
    if (quad_crossing(f, degree - 1, zeros, &at)) {
        *s = at;
        *what = 1;
        is_found = true;
    }
    if (mass->phase == INSIDE) {
        for (int i = 0; i <= degree; i++)
            f[i] = sign * walk->us[d][i];
        if (quad_crossing(f, degree, 0, &at) && (!is_found || at < *s)) {
            *s = at;
            *what = 0;
            is_found = true;
        }
    }
    return is_found;
}

// ImpactLog and state over the part up to s.
static void pass(ImportContext *walk, Quad s) {
    const int degree = walk->degree;
    for (size_t d = 0; d < walk->m; d++) {
        Mass *mass = &walk->mass[d];
        if (!mass->is_open)
            continue;
        Quad turn[TERMS] = {0}, at, power = s;
        const Quad *force = walk->ns[d];
        for (int i = 0; i < degree; i++, power *= s)
            mass->impulse += walk->h * force[i] * power / (i + 1);
        const Quad down = force[1] < 0 ? -1 : 1;
        for (int i = 0; i + 1 < degree; i++)
            turn[i] = down * (i + 1) * force[i + 1];
        const Quad inner = quad_crossing(turn, degree - 2, 0, &at) && at < s ? at : s;
        mass->peak = fmaxq(mass->peak, fabsq(quad_value(force, degree - 1, inner)));
        mass->peak = fmaxq(mass->peak, fabsq(quad_value(force, degree - 1, s)));
        mass->peak = fmaxq(mass->peak, fabsq(force[0]));
        for (int i = 1; i <= degree && mass->phase == TOUCHING; i++)
            for (int j = 1; j <= degree && i + j < TERMS; j++)
                mass->lost += mass->c / walk->h * i * j * walk->us[d][i] * walk->us[d][j] *
                              powq(s, i + j - 1) / (i + j - 1);
    }
    for (size_t j = 0; j < walk->n; j++) {
        walk->x[j] = quad_value(walk->xs[j], degree, s);
        walk->v[j] = quad_slope(walk->xs[j], degree, s) / walk->h;
    }
    for (size_t d = 0; d < walk->m; d++) {
        Mass *mass = &walk->mass[d];
        mass->u = quad_value(walk->us[d], degree, s);
        mass->w = quad_slope(walk->us[d], degree, s) / walk->h;
        if (s > 0 && mass->phase != INSIDE)
            mass->zeros = 0;
        if (s > 0 && mass->phase == INSIDE)
            mass->zeros = 0;
    }
    walk->t += s * walk->h;
}

static void sample(ImportContext *walk, size_t i) {
    FrameTruth *truth = walk->truth;
    Quad rate, until;
    const Quad a = walk_ground(walk, &rate, &until);
    walk_series(walk, (Quad)1e-3 / walk_rate(walk), a, rate);
    for (size_t j = 0; j < walk->n; j++) {
        truth->x[j * truth->count + i] = (double)walk->x[j];
        truth->v[j * truth->count + i] = (double)walk->v[j];
        truth->a[j * truth->count + i] =
            (double)(walk->xs[j][2] * 2 / (walk->h * walk->h) + walk->plan->influence[j] * a);
    }
    for (size_t d = 0; d < walk->m; d++) {
        const Mass *mass = &walk->mass[d];
        const PlanDamper *planned = &walk->plan->dampers[d];
        const Quad stop = mass->at < 0 ? 0 : walk_sign(mass->at) * planned->clearance / 2;
        truth->z[d * truth->count + i] =
            (double)(walk->x[planned->storey] + mass->u + stop + planned->offset);
        truth->y[d * truth->count + i] = (double)(walk->v[planned->storey] + mass->w);
        truth->force[d * truth->count + i] = (double)walk->ns[d][0];
    }
}

static bool go(ImportContext *walk, double most) {
    const Plan *plan = walk->plan;
    size_t next = 0, idle = 0;
    for (double steps = 0; next < plan->count; steps++) {
        Quad rate, until;
        const Quad target = (Quad)next / plan->sample_rate;
        const Quad a = walk_ground(walk, &rate, &until);
        if (steps > most || walk->truth->impact_count + 8 > IMPACTS_MAX || idle > 5000)
            return false;
        Quad h = STRIDE / walk_rate(walk);
        const bool is_cut = walk->t + h < target && walk->t + h < until;
        const Quad end = target < until ? target : until;
        if (!is_cut)
            h = end - walk->t;
        const bool is_still = h <= 0; // a sample is due; what happens at t = 0 comes before it
        if (is_still && next > 0) {
            sample(walk, next++);
            continue;
        }
        walk_series(walk, is_still ? (Quad)1e-3 / walk_rate(walk) : h, a, rate);
        Quad s = 1, at;
        int what = 0, which;
        size_t who = D;
        for (size_t d = 0; d < walk->m; d++)
            if (look(walk, d, &at, &which) && (who == D || at < s)) {
                s = at;
                what = which;
                who = d;
            }
        if (is_still && (who == D || s > 0)) {
            sample(walk, next++);
            continue;
        }
        if (s > 0)
            pass(walk, s);
        idle = s * h > NOTHING ? 0 : idle + 1;
        if (who == D) {
            if (!is_cut)
                walk->t = end;
        } else if (walk->mass[who].phase == FLYING) {
            walk_touch(walk, who, what);
        } else {
            walk_end_phase(walk, who, what == 1);
        }
    }
    for (size_t d = 0; d < walk->m; d++)
        if (walk->mass[d].is_open)
            walk_close_row(walk, d, NAN, NAN);
    return true;
}

void frame_truth(const Plan *plan, const Base *base, double most, FrameTruth *truth) {
    ImportContext *walk = calloc(1, sizeof *walk);
    memset(truth, 0, sizeof *truth);
    const size_t n = plan->storeys, m = plan->damper_count;
    truth->count = plan->count;
    truth->x = calloc((3 * n + 3 * m) * plan->count, sizeof(double));
    truth->impacts = calloc(IMPACTS_MAX, sizeof *truth->impacts);
    if (walk == NULL || truth->x == NULL || truth->impacts == NULL || n > N || m > D)
        abort();
    truth->v = truth->x + n * plan->count;
    truth->a = truth->v + n * plan->count;
    truth->z = truth->a + n * plan->count;
    truth->y = truth->z + m * plan->count;
    truth->force = truth->y + m * plan->count;
    walk->plan = plan;
    walk->base = base;
    walk->truth = truth;
    walk->n = n;
    walk->m = m;
    walk_start(walk);
    truth->is_whole = go(walk, most);
    free(walk);
}

void frame_truth_clear(FrameTruth *truth) {
    free(truth->x);
    free(truth->impacts);
    memset(truth, 0, sizeof *truth);
}
