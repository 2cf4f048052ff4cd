// Storeys x and free masses z, both relative to the base:
//   x'' = M^-1 (-C x' - K x + sum of e_j N_d) - r a_g,   m z'' = -m a_g - N_d
// as dense power series over steps so short that the fastest rate turns half a radian. Every
// condition is a polynomial; its first zero is isolated by halving the step until one sign of one
// derivative decides, and bisected. Impulses are found by trying every set of pressed stops.
#include "tests/truth/frame_reference.h"

#include <math.h>
#include <quadmath.h>
#include <stdlib.h>
#include <string.h>

__extension__ typedef __float128 Quad;

enum { TERMS = 40, IMPACTS_MOST = 20000, N = TRUTH_STOREYS, D = TRUTH_DAMPERS };
enum { FLYING, TOUCHING, INSIDE, RESTING };

static const Quad STRIDE = 0.5, NOTHING = 1e-29, CLOSING = 1e-18;

typedef struct Mass {
    int phase, side;
    int zeros; // leading coefficients of the condition that are exactly 0
    int at;    // the stop it was last at: there the gap is 0; -1: none
    Quad u, w; // relative to the storey; u from that stop, else from the middle of the stops
    Quad k, c, e;
    Quad force, impulse, lost, peak;
    TruthImpact open;
    bool is_open;
} Mass;

typedef struct Walk {
    const Plan *plan;
    const Base *base;
    FrameTruth *truth;
    size_t n, m;
    Quad inverse[N][N], stiff[N][N], viscous[N][N]; // M^-1, M^-1 K, M^-1 C
    Quad yield[D][D];
    Quad x[N], v[N], t;
    Mass mass[D];
    int degree;
    Quad h, xs[N][TERMS], us[D][TERMS], ns[D][TERMS], as[TERMS];
    double flight_rate;
} Walk;

static Quad value(const Quad *f, int degree, Quad s) {
    Quad sum = f[degree];
    for (int i = degree; i-- > 0;)
        sum = sum * s + f[i];
    return sum;
}

static Quad slope(const Quad *f, int degree, Quad s) {
    Quad sum = 0;
    for (int i = degree; i > 0; i--)
        sum = sum * s + i * f[i];
    return sum;
}

// f on [a, b]: where it first goes below 0. f(a) >= 0.
static bool first_below(const Quad *f, int degree, Quad a, Quad b, int depth, Quad *s) {
    // Around the middle: f = sum of g_k t^k with |t| <= w.
    Quad g[TERMS], w = (b - a) / 2, middle = (a + b) / 2;
    memcpy(g, f, sizeof(Quad) * (size_t)(degree + 1));
    for (int i = 0; i < degree; i++)
        for (int j = degree; j-- > i;)
            g[j] += middle * g[j + 1];
    Quad power = w, rest = 0, bend = 0;
    for (int i = 1; i <= degree; i++, power *= w) {
        rest += fabsq(g[i]) * power;
        if (i > 1)
            bend += i * fabsq(g[i]) * power / w;
    }
    if (g[0] > rest)
        return false;
    const bool is_monotone = fabsq(g[1]) > bend;
    if (is_monotone || depth == 0) {
        if (value(f, degree, b) >= 0)
            return false;
        for (int i = 0; i < 130; i++) {
            const Quad c = (a + b) / 2;
            if (value(f, degree, c) < 0)
                b = c;
            else
                a = c;
        }
        *s = b;
        return true;
    }
    return first_below(f, degree, a, middle, depth - 1, s) ||
           first_below(f, degree, middle, b, depth - 1, s);
}

// The first zero of f on [0, 1], whose first `zeros` coefficients are exactly 0.
static bool crossing(const Quad *f, int degree, int zeros, Quad *s) {
    f += zeros;
    degree -= zeros;
    if (f[0] < 0 || (f[0] == 0 && degree > 0 && f[1] < 0)) {
        *s = 0;
        return true;
    }
    return first_below(f, degree, 0, 1, 60, s);
}

static Quad room(const Walk *walk, size_t d, int side) {
    const Quad clearance = walk->plan->dampers[d].clearance;
    return walk->mass[d].at < 0 ? clearance / 2 : walk->mass[d].at == side ? 0 : clearance;
}

static Quad sign_of(int side) {
    return side == SIDE_RIGHT ? 1 : -1;
}

static Quad ground(const Walk *walk, Quad *rate, Quad *until) {
    const Base *base = walk->base;
    *rate = 0;
    *until = INFINITY;
    if (base->form == BASE_SINE) {
        *rate = base->amplitude * cosq(base->omega * walk->t);
        return base->amplitude * sinq(base->omega * walk->t);
    }
    if (base->form != BASE_SAMPLED)
        return 0;
    size_t i = (size_t)(walk->t / (Quad)base->interval);
    while (walk->t >= (Quad)(i + 1) * base->interval)
        i++;
    if (i + 1 >= base->count)
        return 0;
    *until = (Quad)(i + 1) * base->interval;
    *rate = ((Quad)base->values[i + 1] - base->values[i]) / base->interval;
    return base->values[i] + *rate * (walk->t - (Quad)i * base->interval);
}

// Constraint forces of those that rest, from what they would do without: elimination.
static void constrain(const Walk *walk, const Quad *without, Quad *force) {
    size_t who[D], count = 0;
    for (size_t d = 0; d < walk->m; d++)
        if (walk->mass[d].phase == RESTING)
            who[count++] = d;
    Quad A[D][D + 1];
    for (size_t i = 0; i < count; i++) {
        for (size_t j = 0; j < count; j++)
            A[i][j] = walk->yield[who[i]][who[j]];
        A[i][count] = without[who[i]];
    }
    for (size_t k = 0; k < count; k++)
        for (size_t i = 0; i < count; i++) {
            if (i == k)
                continue;
            const Quad factor = A[i][k] / A[k][k];
            for (size_t j = k; j <= count; j++)
                A[i][j] -= factor * A[k][j];
        }
    for (size_t i = 0; i < count; i++)
        force[who[i]] = A[i][count] / A[i][i];
}

static double rate_of(const Walk *walk) {
    double rate = walk->flight_rate;
    for (size_t d = 0; d < walk->m; d++)
        if (walk->mass[d].phase == TOUCHING)
            rate += fmax(sqrt((double)(walk->mass[d].k * walk->yield[d][d])),
                         (double)(walk->mass[d].c * walk->yield[d][d]));
    return rate;
}

static void series(Walk *walk, Quad h, Quad a, Quad rate) {
    const size_t n = walk->n, m = walk->m;
    const double rho = (double)h * rate_of(walk);
    walk->h = h;
    walk->degree = 6;
    double tail = 1;
    for (int i = 1; i < TERMS - 6 && tail > 1e-38; i++, walk->degree = i + 5)
        tail *= 2 * rho / i;
    memset(walk->as, 0, sizeof walk->as);
    walk->as[0] = a;
    walk->as[1] = (walk->base->form == BASE_SINE ? walk->base->omega * rate : rate) * h;
    const Quad turn2 = walk->base->omega * walk->base->omega * h * h;
    for (int i = 0; i + 2 <= walk->degree && walk->base->form == BASE_SINE; i++)
        walk->as[i + 2] = -turn2 * walk->as[i] / ((i + 1) * (i + 2));
    for (size_t j = 0; j < n; j++) {
        walk->xs[j][0] = walk->x[j];
        walk->xs[j][1] = walk->v[j] * h;
    }
    for (size_t d = 0; d < m; d++) {
        walk->us[d][0] = walk->mass[d].u;
        walk->us[d][1] = walk->mass[d].w * h;
    }
    for (int i = 0; i < walk->degree; i++) {
        Quad pull[N], without[D], force[D] = {0};
        for (size_t j = 0; j < n; j++) {
            pull[j] = 0;
            for (size_t k = 0; k < n; k++)
                pull[j] -= walk->stiff[j][k] * walk->xs[k][i] +
                           walk->viscous[j][k] * (i + 1) * walk->xs[k][i + 1] / h;
        }
        for (size_t d = 0; d < m; d++) {
            const Mass *mass = &walk->mass[d];
            const size_t storey = walk->plan->dampers[d].storey;
            without[d] = ((Quad)walk->plan->influence[storey] - 1) * walk->as[i] - pull[storey];
            if (mass->phase == TOUCHING)
                force[d] = mass->k * walk->us[d][i] + mass->c * (i + 1) * walk->us[d][i + 1] / h;
        }
        constrain(walk, without, force);
        for (size_t d = 0; d < m; d++)
            walk->ns[d][i] = force[d];
        if (i + 2 > walk->degree)
            break;
        const Quad scale = h * h / ((i + 1) * (i + 2));
        for (size_t j = 0; j < n; j++) {
            Quad sum = pull[j] - walk->plan->influence[j] * walk->as[i];
            for (size_t d = 0; d < m; d++)
                sum += walk->inverse[j][walk->plan->dampers[d].storey] * force[d];
            walk->xs[j][i + 2] = sum * scale;
        }
        for (size_t d = 0; d < m; d++) {
            Quad sum = without[d];
            for (size_t e = 0; e < m; e++)
                sum -= walk->yield[d][e] * force[e];
            walk->us[d][i + 2] = walk->mass[d].phase == RESTING ? 0 : sum * scale;
        }
    }
}

static void open_row(Walk *walk, size_t d, bool is_resting, Quad approach) {
    Mass *mass = &walk->mass[d];
    mass->is_open = true;
    mass->impulse = mass->lost = mass->peak = 0;
    mass->open = (TruthImpact){.is_resting = is_resting,
                               .damper = d,
                               .side = mass->side,
                               .start = (double)walk->t,
                               .end = NAN,
                               .approach = is_resting ? NAN : (double)approach,
                               .separation = NAN};
}

static void close_row(Walk *walk, size_t d, double end, double separation) {
    Mass *mass = &walk->mass[d];
    mass->open.end = end;
    mass->open.separation = separation;
    mass->open.impulse = fabs((double)mass->impulse);
    mass->open.lost = (double)mass->lost;
    mass->open.peak = (double)mass->peak;
    mass->is_open = false;
    if (walk->truth->impact_count < IMPACTS_MOST)
        walk->truth->impacts[walk->truth->impact_count++] = mass->open;
}

static void push(Walk *walk, const Quad *impulses) {
    for (size_t d = 0; d < walk->m; d++) {
        for (size_t j = 0; j < walk->n; j++)
            walk->v[j] += walk->inverse[j][walk->plan->dampers[d].storey] * impulses[d];
        for (size_t e = 0; e < walk->m; e++)
            walk->mass[e].w -= walk->yield[e][d] * impulses[d];
    }
}

// Every set of pressed stops is tried until one meets all conditions.
static void collide(Walk *walk, const bool *is_met, const Quad *parting, Quad *impulses) {
    for (unsigned set = (1U << walk->m); set-- > 0;) {
        Walk trial = *walk;
        Quad want[D] = {0};
        bool is_good = true;
        for (size_t d = 0; d < walk->m; d++) {
            const bool is_in = (set >> d & 1) != 0;
            const bool is_held = is_met[d] && walk->plan->dampers[d].clearance == 0;
            is_good = is_good && (is_met[d] || !is_in) && (is_in || !is_held);
            trial.mass[d].phase = is_in ? RESTING : FLYING;
            want[d] = walk->mass[d].w + sign_of(walk->mass[d].side) * parting[d];
            impulses[d] = 0;
        }
        if (!is_good)
            continue;
        constrain(&trial, want, impulses);
        push(&trial, impulses);
        for (size_t d = 0; d < walk->m; d++) {
            const Quad sign = sign_of(walk->mass[d].side);
            if ((set >> d & 1) != 0)
                is_good =
                    is_good && (sign * impulses[d] >= 0 || walk->plan->dampers[d].clearance == 0);
            else if (is_met[d])
                is_good = is_good && -sign * trial.mass[d].w >= parting[d] - (Quad)1e-28;
        }
        if (is_good)
            break;
    }
    push(walk, impulses);
}

static Quad acceleration(Walk *walk, size_t d) {
    Quad rate, until;
    const Quad a = ground(walk, &rate, &until);
    series(walk, (Quad)1e-3 / rate_of(walk), a, rate);
    return walk->us[d][2] * 2 / (walk->h * walk->h);
}

static void rest(Walk *walk, size_t d) {
    Mass *mass = &walk->mass[d];
    mass->phase = RESTING;
    mass->zeros = 0;
    mass->w = mass->u = 0;
    open_row(walk, d, true, 0);
}

static void bounce(Walk *walk, size_t d) {
    bool is_met[D] = {false};
    Quad parting[D] = {0}, closing[D] = {0}, impulses[D];
    for (size_t e = 0; e < walk->m; e++) {
        Mass *mass = &walk->mass[e];
        is_met[e] = mass->phase == RESTING || e == d;
        const int side = mass->w > 0 ? SIDE_RIGHT : SIDE_LEFT;
        // Masses that are to meet their stops at the same instant do so but for the last digits.
        if (mass->phase == FLYING && e != d && mass->w != 0 &&
            room(walk, e, side) - sign_of(side) * mass->u < (Quad)1e-20 * fabsq(mass->w)) {
            is_met[e] = true;
            mass->side = mass->at = side;
            mass->u = 0;
        }
        if (is_met[e] && mass->phase == FLYING) {
            closing[e] = sign_of(mass->side) * mass->w;
            mass->e = walk->plan->dampers[e].stops[mass->side].restitution;
            parting[e] = walk->plan->dampers[e].clearance > 0 ? mass->e * closing[e] : 0;
        }
    }
    collide(walk, is_met, parting, impulses);
    for (size_t e = 0; e < walk->m; e++) {
        Mass *mass = &walk->mass[e];
        const Quad sign = sign_of(mass->side);
        if (!is_met[e])
            continue;
        if (mass->phase == RESTING) {
            mass->impulse += impulses[e];
            if (impulses[e] == 0 && -sign * mass->w > 0) {
                close_row(walk, e, (double)walk->t, NAN);
                mass->phase = FLYING;
                mass->zeros = 1;
            } else {
                mass->w = 0;
            }
            continue;
        }
        if (impulses[e] != 0)
            mass->w = -sign * parting[e];
        mass->zeros = 1;
        if (walk->plan->dampers[e].clearance == 0) {
            rest(walk, e);
            mass->impulse = impulses[e];
            mass->lost = fabsq(impulses[e]) * closing[e] / 2;
            continue;
        }
        open_row(walk, e, false, closing[e]);
        mass->impulse = impulses[e];
        mass->lost = fabsq(impulses[e]) * (closing[e] - parting[e]) / 2;
        close_row(walk, e, (double)walk->t, (double)parting[e]);
        walk->truth->impacts[walk->truth->impact_count - 1].peak = NAN;
    }
    for (size_t e = 0; e < walk->m; e++) {
        Mass *mass = &walk->mass[e];
        if (!is_met[e] || mass->phase != FLYING || mass->u != 0 || closing[e] == 0)
            continue;
        const Quad pull = sign_of(mass->side) * acceleration(walk, e);
        if (pull > 0 && 2 * parting[e] / (pull * (1 - mass->e)) < CLOSING) {
            Quad last[D] = {0};
            last[e] = mass->w / walk->yield[e][e];
            push(walk, last);
            rest(walk, e);
        }
    }
}

static void touch(Walk *walk, size_t d, int side) {
    Mass *mass = &walk->mass[d];
    const PlanStop *stop = &walk->plan->dampers[d].stops[side];
    mass->side = mass->at = side;
    mass->u = 0;
    if (walk->plan->form != CONTACT_LINEAR) {
        bounce(walk, d);
        return;
    }
    mass->phase = TOUCHING;
    mass->k = stop->stiffness;
    mass->c = stop->damping;
    mass->zeros = 1;
    open_row(walk, d, false, fabsq(mass->w));
    mass->peak = fabsq(mass->c * mass->w);
}

static Quad spring(const Mass *mass) {
    return mass->k * mass->u * mass->u / 2;
}

static void end_phase(Walk *walk, size_t d, bool is_inwards) {
    Mass *mass = &walk->mass[d];
    const Quad sign = sign_of(mass->side);
    if (mass->phase == RESTING) {
        close_row(walk, d, (double)walk->t, NAN);
        mass->phase = FLYING;
        mass->zeros = 3;
        mass->u = mass->w = 0;
        if (walk->plan->dampers[d].clearance == 0) {
            mass->side = mass->at = 1 - mass->side;
            rest(walk, d);
        }
        return;
    }
    if (mass->phase == INSIDE && is_inwards) {
        mass->phase = TOUCHING;
        mass->zeros = 1;
        open_row(walk, d, false, sign * mass->w > 0 ? sign * mass->w : 0);
        mass->lost = -spring(mass);
        return;
    }
    const bool was_touching = mass->phase == TOUCHING;
    const bool stays = was_touching && walk->plan->separation == SEPARATION_ZERO_FORCE;
    if (stays)
        mass->lost += spring(mass);
    mass->zeros = 1;
    mass->phase = stays ? INSIDE : FLYING;
    if (!stays)
        mass->u = 0;
    if (was_touching)
        close_row(walk, d, (double)walk->t, fabs((double)mass->w));
}

// Which condition of damper d fails first on the series; *what: side met, or 1 for inwards.
static bool look(const Walk *walk, size_t d, Quad *s, int *what) {
    const Mass *mass = &walk->mass[d];
    Quad f[TERMS], at;
    bool is_found = false;
    const Quad sign = sign_of(mass->side);
    const int degree = walk->degree;
    *what = 0;
    if (mass->phase == FLYING) {
        for (int side = 0; side < 2; side++) {
            for (int i = 0; i <= degree; i++)
                f[i] = -sign_of(side) * walk->us[d][i];
            f[0] += room(walk, d, side);
            if (crossing(f, degree, mass->at == side ? mass->zeros : 0, &at) &&
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
    if (crossing(f, degree - 1, zeros, &at)) {
        *s = at;
        *what = 1;
        is_found = true;
    }
    if (mass->phase == INSIDE) {
        for (int i = 0; i <= degree; i++)
            f[i] = sign * walk->us[d][i];
        if (crossing(f, degree, 0, &at) && (!is_found || at < *s)) {
            *s = at;
            *what = 0;
            is_found = true;
        }
    }
    return is_found;
}

// Ledger and state over the part up to s.
static void pass(Walk *walk, Quad s) {
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
        const Quad inner = crossing(turn, degree - 2, 0, &at) && at < s ? at : s;
        mass->peak = fmaxq(mass->peak, fabsq(value(force, degree - 1, inner)));
        mass->peak = fmaxq(mass->peak, fabsq(value(force, degree - 1, s)));
        mass->peak = fmaxq(mass->peak, fabsq(force[0]));
        for (int i = 1; i <= degree && mass->phase == TOUCHING; i++)
            for (int j = 1; j <= degree && i + j < TERMS; j++)
                mass->lost += mass->c / walk->h * i * j * walk->us[d][i] * walk->us[d][j] *
                              powq(s, i + j - 1) / (i + j - 1);
    }
    for (size_t j = 0; j < walk->n; j++) {
        walk->x[j] = value(walk->xs[j], degree, s);
        walk->v[j] = slope(walk->xs[j], degree, s) / walk->h;
    }
    for (size_t d = 0; d < walk->m; d++) {
        Mass *mass = &walk->mass[d];
        mass->u = value(walk->us[d], degree, s);
        mass->w = slope(walk->us[d], degree, s) / walk->h;
        if (s > 0 && mass->phase != INSIDE)
            mass->zeros = 0;
        if (s > 0 && mass->phase == INSIDE)
            mass->zeros = 0;
    }
    walk->t += s * walk->h;
}

static void sample(Walk *walk, size_t i) {
    FrameTruth *truth = walk->truth;
    Quad rate, until;
    const Quad a = ground(walk, &rate, &until);
    series(walk, (Quad)1e-3 / rate_of(walk), a, rate);
    for (size_t j = 0; j < walk->n; j++) {
        truth->x[j * truth->count + i] = (double)walk->x[j];
        truth->v[j * truth->count + i] = (double)walk->v[j];
        truth->a[j * truth->count + i] =
            (double)(walk->xs[j][2] * 2 / (walk->h * walk->h) + walk->plan->influence[j] * a);
    }
    for (size_t d = 0; d < walk->m; d++) {
        const Mass *mass = &walk->mass[d];
        const PlanDamper *planned = &walk->plan->dampers[d];
        const Quad stop = mass->at < 0 ? 0 : sign_of(mass->at) * planned->clearance / 2;
        truth->z[d * truth->count + i] =
            (double)(walk->x[planned->storey] + mass->u + stop + planned->offset);
        truth->y[d * truth->count + i] = (double)(walk->v[planned->storey] + mass->w);
        truth->force[d * truth->count + i] = (double)walk->ns[d][0];
    }
}

static void invert(const double *matrix, size_t n, Quad inverse[N][N]) {
    Quad A[N][N];
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            A[i][j] = matrix[i * n + j];
            inverse[i][j] = i == j;
        }
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < n; i++) {
            const Quad factor = i == k ? 1 - 1 / A[k][k] : A[i][k] / A[k][k];
            for (size_t j = 0; j < n; j++) {
                inverse[i][j] -= factor * inverse[k][j];
                if (i != k)
                    A[i][j] -= factor * A[k][j];
            }
            if (i == k)
                for (size_t j = 0; j < n; j++)
                    A[i][j] -= factor * A[k][j];
        }
}

static void start(Walk *walk) {
    const Plan *plan = walk->plan;
    const size_t n = walk->n;
    invert(plan->mass, n, walk->inverse);
    double stiff = 0, viscous = 0;
    for (size_t i = 0; i < n; i++) {
        double rows[2] = {0, 0};
        for (size_t j = 0; j < n; j++) {
            for (size_t k = 0; k < n; k++) {
                walk->stiff[i][j] += walk->inverse[i][k] * plan->stiffness[k * n + j];
                walk->viscous[i][j] += walk->inverse[i][k] * plan->damping[k * n + j];
            }
            rows[0] += fabs((double)walk->stiff[i][j]);
            rows[1] += fabs((double)walk->viscous[i][j]);
        }
        stiff = fmax(stiff, rows[0]);
        viscous = fmax(viscous, rows[1]);
        walk->x[i] = plan->displacement[i];
        walk->v[i] = plan->velocity[i];
    }
    walk->flight_rate = fmax(fmax(fmax(sqrt(stiff), viscous), walk->base->omega), 1e-3);
    for (size_t d = 0; d < walk->m; d++) {
        const PlanDamper *planned = &plan->dampers[d];
        for (size_t e = 0; e < walk->m; e++)
            walk->yield[d][e] = walk->inverse[planned->storey][plan->dampers[e].storey] +
                                (d == e ? 1 / (Quad)planned->mass : 0);
        walk->mass[d].at = -1;
        walk->mass[d].u = planned->position;
        walk->mass[d].w = planned->velocity;
    }
}

static bool go(Walk *walk, double most) {
    const Plan *plan = walk->plan;
    size_t next = 0, idle = 0;
    for (double steps = 0; next < plan->count; steps++) {
        Quad rate, until;
        const Quad target = (Quad)next / plan->sample_rate;
        const Quad a = ground(walk, &rate, &until);
        if (steps > most || walk->truth->impact_count + 8 > IMPACTS_MOST || idle > 5000)
            return false;
        Quad h = STRIDE / rate_of(walk);
        const bool is_cut = walk->t + h < target && walk->t + h < until;
        const Quad end = target < until ? target : until;
        if (!is_cut)
            h = end - walk->t;
        const bool is_still = h <= 0; // a sample is due; what happens at t = 0 comes before it
        if (is_still && next > 0) {
            sample(walk, next++);
            continue;
        }
        series(walk, is_still ? (Quad)1e-3 / rate_of(walk) : h, a, rate);
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
            touch(walk, who, what);
        } else {
            end_phase(walk, who, what == 1);
        }
    }
    for (size_t d = 0; d < walk->m; d++)
        if (walk->mass[d].is_open)
            close_row(walk, d, NAN, NAN);
    return true;
}

void frame_truth(const Plan *plan, const Base *base, double most, FrameTruth *truth) {
    Walk *walk = calloc(1, sizeof *walk);
    memset(truth, 0, sizeof *truth);
    const size_t n = plan->storeys, m = plan->damper_count;
    truth->count = plan->count;
    truth->x = calloc((3 * n + 3 * m) * plan->count, sizeof(double));
    truth->impacts = calloc(IMPACTS_MOST, sizeof *truth->impacts);
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
    start(walk);
    truth->is_whole = go(walk, most);
    free(walk);
}

void frame_truth_clear(FrameTruth *truth) {
    free(truth->x);
    free(truth->impacts);
    memset(truth, 0, sizeof *truth);
}
