// With x = X e^(lambda t), r = R e^(lambda t), D = C / M, W = K / M, c and k of the contact:
//   (lambda^2 + D lambda + W) X = share (c lambda + k) R
//   (lambda^2 + c lambda + k) R = (D lambda + W) X
// The quadratic pencil's left vectors p = (D lambda + W, lambda^2 + D lambda + W) take a state
// apart into amplitudes, scaled here so that r is the sum of their real parts. Made in long double:
// the rows' sizes differ by the square of the contact's frequency.
#include "core/solve/pulse.h"

#include <complex.h>
#include <math.h>
#include <string.h>

typedef long double complex Complex;

enum { NEWTON_STEPS = 30 };
static const double PI = 3.14159265358979323846;

static double larger(double a, double b) {
    return a > b ? a : b;
}

static Complex complex_of(long double real, long double imaginary) {
    return real + imaginary * I;
}

typedef struct Pencil {
    long double D, W, c, k, share;
} Pencil;

static Complex characteristic(const Pencil *p, Complex l, Complex *slope) {
    const Complex own = (l + p->D) * l + p->W, contact = (l + p->c) * l + p->k;
    const Complex push = p->D * l + p->W, force = p->share * (p->c * l + p->k);
    *slope =
        (2 * l + p->D) * contact + own * (2 * l + p->c) - p->share * p->c * push - force * p->D;
    return own * contact - force * push;
}

static bool find_root(const Pencil *p, Complex *l) {
    for (int i = 0; i < NEWTON_STEPS; i++) {
        Complex slope;
        const Complex value = characteristic(p, *l, &slope);
        const Complex step = value / slope;
        *l -= step;
        const long double size = fabsl(creall(step)) + fabsl(cimagl(step));
        const long double whole = fabsl(creall(*l)) + fabsl(cimagl(*l));
        if (!(size > 1e-17L * whole))
            return isfinite((double)whole);
    }
    return false;
}

// Re(factor d) as two reals.
static void put(PulseRow *row, int mode, Complex factor) {
    row->d[2 * mode] = (double)creall(factor);
    row->d[2 * mode + 1] = (double)-cimagl(factor);
}

static long double square(Complex z) {
    return creall(z) * creall(z) + cimagl(z) * cimagl(z);
}

// The integral of (Re(g1 d1) + Re(g2 d2))^2.
static void make_form(PulseForm *form, const Complex g[2], const Complex l[2],
                      const double jump[4]) {
    double *of = form->of;
    static const int own[2][3] = {{0, 1, 4}, {7, 8, 9}};
    for (int i = 0; i < 2; i++) {
        const long double mean = i == 0 ? 0 : square(g[i]) / (4 * creall(l[i]));
        const Complex turning = g[i] * g[i] / (4 * l[i]);
        of[own[i][0]] = (double)(mean + creall(turning));
        of[own[i][1]] = (double)(-2 * cimagl(turning));
        of[own[i][2]] = (double)(mean - creall(turning));
    }
    form->slow = (double)square(g[0]);
    const Complex e = g[0] * g[1] / (l[0] + l[1]), f = g[0] * conjl(g[1]) / (l[0] + conjl(l[1]));
    of[2] = (double)(creall(e) + creall(f));
    of[3] = (double)(cimagl(f) - cimagl(e));
    of[5] = (double)(-cimagl(e) - cimagl(f));
    of[6] = (double)(creall(f) - creall(e));
    form->jump2 = pulse_form(form, jump);
    form->jump[0] = 2 * of[0] * jump[0] + of[1] * jump[1] + of[2] * jump[2] + of[3] * jump[3];
    form->jump[1] = of[1] * jump[0] + 2 * of[4] * jump[1] + of[5] * jump[2] + of[6] * jump[3];
    form->jump[2] = of[2] * jump[0] + of[5] * jump[1] + 2 * of[7] * jump[2] + of[8] * jump[3];
    form->jump[3] = of[3] * jump[0] + of[6] * jump[1] + of[8] * jump[2] + 2 * of[9] * jump[3];
}

// e^z by its series near 0, and squared. The C library's would give other last bits on other
// processors.
static Complex power_of_e(Complex z) {
    int halvings = 0;
    for (; square(z) > 1.0L / 64 && halvings < 64; halvings++)
        z /= 2;
    Complex less = z, term = z; // e^z - 1, as nothing else survives so many squarings
    for (int k = 2; k < 16; k++) {
        term *= z / k;
        less += term;
    }
    for (; halvings > 0; halvings--)
        less = less * (less + 2);
    return 1 + less;
}

static void make_tables(Pulse *pulse, const Complex l[2], double interval) {
    pulse->unit = pulse->time / PULSE_TABLE_UNIT;
    pulse->per_unit = PULSE_TABLE_UNIT / pulse->time;
    for (int mode = 0; mode < 2; mode++) {
        const Complex step = power_of_e(l[mode] * (long double)pulse->time / PULSE_TABLE_UNIT);
        const Complex whole = power_of_e(l[mode] * interval);
        const Complex peak = power_of_e(l[mode] * pulse->peak_time);
        Complex power = 1;
        for (int i = 0; i <= PULSE_TABLE; i++, power *= step) {
            pulse->table[i][2 * mode] = (double)creall(power);
            pulse->table[i][2 * mode + 1] = (double)cimagl(power);
        }
        const Complex jump = complex_of(pulse->jump[2 * mode], pulse->jump[2 * mode + 1]);
        power = 1;
        for (int i = 0; i < PULSE_RIDE; i++) {
            pulse->jumps[2 * mode][PULSE_RIDE + i] = (double)creall(power * jump);
            pulse->jumps[2 * mode + 1][PULSE_RIDE + i] = (double)cimagl(power * jump);
            power *= whole;
            pulse->ride[2 * mode][i] = (double)creall(power);
            pulse->ride[2 * mode + 1][i] = (double)cimagl(power);
        }
        pulse->peak[2 * mode] = (double)creall(peak);
        pulse->peak[2 * mode + 1] = (double)cimagl(peak);
        pulse->interval[2 * mode] = (double)creall(whole);
        pulse->interval[2 * mode + 1] = (double)cimagl(whole);
    }
}

// Where the oscillations are, or false if there are not two well apart.
static bool find_oscillations(const Pencil *p, Complex l[2]) {
    // The whole swinging with its buffer shut, and the pair against each other.
    const long double rest = 1 - p->share;
    const long double slow_damping = rest * p->D / 2,
                      slow2 = rest * p->W - slow_damping * slow_damping;
    const long double fast_damping = (p->c + p->share * p->D) / 2;
    const long double fast2 = p->k + p->share * p->W - fast_damping * fast_damping;
    if (!(slow2 > 0) || !(fast2 > 0))
        return false;
    l[0] = complex_of(-slow_damping, sqrtl(slow2));
    l[1] = complex_of(-fast_damping, sqrtl(fast2));
    if (!find_root(p, &l[0]) || !find_root(p, &l[1]))
        return false;
    for (int i = 0; i < 2; i++)
        if (!(creall(l[i]) < 0) || !(cimagl(l[i]) > 0.05L * -creall(l[i])))
            return false;
    return square(l[1]) > 4 * square(l[0]);
}

void pulse_make(Pulse *pulse, const Motion *m, double interval) {
    memset(pulse, 0, sizeof *pulse);
    const Pencil p = {m->damping, m->omega2, m->contact_damping, m->contact_omega2, m->share};
    const double half = m->contact_damping / 2, contact2 = m->contact_omega2 - half * half;
    Complex l[2], g[2];
    if (!(contact2 > 0) || !find_oscillations(&p, l))
        return;
    pulse->contact_omega = sqrt(contact2);
    pulse->time = PI / pulse->contact_omega;
    pulse->damping = m->contact_damping;
    pulse->growth = (double)creall(power_of_e(half * (long double)pulse->time));
    // In an isolated contact of damping ratio Z = sin b the force is largest after a right angle
    // less 3 b; a guess.
    const double Z = half / sqrt(m->contact_omega2),
                 b = Z * (1 + Z * Z * (1.0 / 6 + Z * Z * 0.075));
    pulse->peak_time = larger(PI / 2 - 3 * b, 0) / pulse->contact_omega;
    PulseRow *const rows[] = {&pulse->r, &pulse->w, &pulse->r_bend};
    Complex fixed[2] = {0, 0}; // what x and r are under a_g = 1, and what its slope adds
    Complex fixed_slope[2] = {0, 0};
    for (int i = 0; i < 2; i++) {
        const Complex own2 = (l[i] + p.D) * l[i] + p.W, push = p.D * l[i] + p.W;
        const Complex force = p.c * l[i] + p.k, contact = (l[i] + p.c) * l[i] + p.k;
        // X / R from the equation that loses no digits for this one.
        const Complex X = i == 0 ? contact / push : p.share * force / own2;
        const Complex left[2] = {push, own2};
        const Complex norm = left[0] * ((2 * l[i] + p.D) * X - p.share * p.c) +
                             left[1] * (-p.D * X + 2 * l[i] + p.c);
        const Complex scale = 2 / norm;
        const Complex into[4] = {scale * (left[0] * (l[i] + p.D) - left[1] * p.D), scale * left[0],
                                 scale * (left[1] * (l[i] + p.c) - left[0] * p.share * p.c),
                                 scale * left[1]};
        const Complex base = -into[1], value = base / l[i], slope = value / l[i];
        const Complex columns[6] = {into[0], into[1], into[2], into[3], value, slope};
        for (int j = 0; j < 6; j++) {
            pulse->into[2 * i][j] = (double)creall(columns[j]);
            pulse->into[2 * i + 1][j] = (double)cimagl(columns[j]);
        }
        pulse->jump[2 * i] = (double)creall(slope);
        pulse->jump[2 * i + 1] = (double)cimagl(slope);
        Complex power = 1;
        for (int j = 0; j < 3; j++, power *= l[i])
            put(rows[j], i, power);
        put(&pulse->x, i, X);
        put(&pulse->v, i, X * l[i]);
        put(&pulse->n, i, force);
        put(&pulse->n_rate, i, force * l[i]);
        put(&pulse->n_bend, i, force * l[i] * l[i]);
        put(&pulse->x_sum, i, X / l[i]);
        put(&pulse->r_sum, i, 1 / l[i]);
        fixed[0] -= X * value;
        fixed[1] -= value;
        fixed_slope[0] -= X * slope;
        fixed_slope[1] -= slope;
        g[i] = X * l[i];
        pulse->sigma[i] = (double)creall(l[i]);
        pulse->omega[i] = (double)cimagl(l[i]);
        pulse->size2[i] = (double)square(l[i]);
        pulse->rate = sqrt(pulse->size2[i]); // the fast one comes last
    }
    pulse->x.a = (double)creall(fixed[0]);
    pulse->x.s = (double)creall(fixed_slope[0]);
    pulse->r.a = (double)creall(fixed[1]);
    pulse->r.s = (double)creall(fixed_slope[1]);
    pulse->v.s = pulse->x.a;
    pulse->w.s = pulse->r.a;
    pulse->n.a = m->contact_omega2 * pulse->r.a;
    pulse->n.s = m->contact_omega2 * pulse->r.s + m->contact_damping * pulse->r.a;
    pulse->n_rate.s = m->contact_omega2 * pulse->r.a;
    make_form(&pulse->vv, g, l, pulse->jump);
    make_form(&pulse->ww, l, l, pulse->jump);
    make_tables(pulse, l, interval);
    const double longest = 2 * pulse->time < interval ? 2 * pulse->time : interval;
    pulse->is_usable = -pulse->sigma[0] * longest < 0.01;
}

void pulse_turn(const Pulse *pulse, double time, double turn[4]) {
    const double unit = pulse->unit, span = PULSE_TABLE * unit;
    if (time > span) { // seldom: a long way at once
        pulse_turn(pulse, time - span, turn);
        pulse_multiply(pulse->table[PULSE_TABLE], turn, turn);
        return;
    }
    const int place = (int)(time * pulse->per_unit + 0.5);
    const double rest = time - place * unit;
    if (rest == 0 || time == pulse->peak_time) { // where a search begins: T_c is a place too
        memcpy(turn, rest == 0 ? pulse->table[place] : pulse->peak, 4 * sizeof *turn);
        return;
    }
    double small[4];
    for (int i = 0; i < 2; i++) {
        // |lambda rest| is at most 0.2: these are right to rounding. In pairs, not by Horner: here
        // one waits for the last term.
        const double s = pulse->sigma[i] * rest, w = pulse->omega[i] * rest;
        const double s2 = s * s, s4 = s2 * s2, w2 = w * w, w4 = w2 * w2;
        const double size =
            1 + (s + s2 * (((1.0 / 2 + s * (1.0 / 6)) + s2 * (1.0 / 24 + s * (1.0 / 120))) +
                           s4 * ((1.0 / 720 + s * (1.0 / 5040)) +
                                 s2 * (1.0 / 40320 + s * (1.0 / 362880)))));
        const double sine =
            w - w * (w2 * ((1.0 / 6 - w2 * (1.0 / 120)) + w4 * (1.0 / 5040 - w2 * (1.0 / 362880))));
        const double cosine =
            1 - w2 * ((1.0 / 2 - w2 * (1.0 / 24)) +
                      w4 * ((1.0 / 720 - w2 * (1.0 / 40320)) + w4 * (1.0 / 3628800)));
        small[2 * i] = size * cosine;
        small[2 * i + 1] = size * sine;
    }
    pulse_multiply(small, pulse->table[place], turn);
}
