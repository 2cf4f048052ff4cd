// With x = X e^(lambda t), r = R e^(lambda t), D = C / M, W = K / M, c and k of the contact:
//   (lambda^2 + D lambda + W) X = share (c lambda + k) R
//   (lambda^2 + c lambda + k) R = (D lambda + W) X
// The quadratic pencil's left vectors p = (D lambda + W, lambda^2 + D lambda + W) take a state
// apart into amplitudes, scaled here so that r is the sum of their real parts. Made in long double:
// the rows' sizes differ by the square of the contact's frequency.
#include "core/solve/contact_modes.h"

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
static void put(double row[4], int mode, Complex factor) {
    row[2 * mode] = (double)creall(factor);
    row[2 * mode + 1] = (double)-cimagl(factor);
}

static void put_seen(ContactModes *modes, ModesRow row, int mode, Complex factor) {
    modes->see[2 * mode][row] = (double)creall(factor);
    modes->see[2 * mode + 1][row] = (double)-cimagl(factor);
}

static long double square(Complex z) {
    return creall(z) * creall(z) + cimagl(z) * cimagl(z);
}

// The integral of (Re(g1 d1) + Re(g2 d2))^2.
static void make_form(ModesForm *form, const Complex g[2], const Complex l[2],
                      const double jump[4]) {
    double(*of)[4] = form->of;
    for (int i = 0; i < 2; i++) {
        const long double mean = i == 0 ? 0 : square(g[i]) / (4 * creall(l[i]));
        const Complex turning = g[i] * g[i] / (4 * l[i]);
        of[2 * i][2 * i] = (double)(mean + creall(turning));
        of[2 * i][2 * i + 1] = (double)-cimagl(turning);
        of[2 * i + 1][2 * i + 1] = (double)(mean - creall(turning));
    }
    form->slow = (double)square(g[0]);
    const Complex e = g[0] * g[1] / (l[0] + l[1]), f = g[0] * conjl(g[1]) / (l[0] + conjl(l[1]));
    of[0][2] = (double)(creall(e) + creall(f)) / 2;
    of[0][3] = (double)(cimagl(f) - cimagl(e)) / 2;
    of[1][2] = (double)(-cimagl(e) - cimagl(f)) / 2;
    of[1][3] = (double)(creall(f) - creall(e)) / 2;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < i; j++)
            of[i][j] = of[j][i];
    form->jump2 = 0;
    for (int i = 0; i < 4; i++) {
        form->jump[i] = 0;
        for (int j = 0; j < 4; j++)
            form->jump[i] += 2 * of[i][j] * jump[j];
        form->jump2 += form->jump[i] * jump[i] / 2;
    }
}

// The integral of (Re(g1 d1) + Re(g2 d2)) (f0 a + f1 s) under a sine, twice that if `is_square`,
// and then with that of (f0 a + f1 s)^2; else with that of (own[0] a + own[1] s) a.
static void make_sine(ModesSine *sine, const Complex g[2], const Complex l[2], double omega,
                      const double f[2], const double *own) {
    const bool is_square = own == NULL;
    for (int i = 0; i < 2; i++) {
        const Complex size =
            (is_square ? 2 : 1) * g[i] / (l[i] * l[i] + (long double)omega * omega);
        put(sine->by[0], i, size * (f[0] * l[i] + f[1] * (long double)omega));
        put(sine->by[1], i, size * (f[1] * l[i] - f[0] * (long double)omega));
    }
    const double a = is_square ? f[0] : own[0], s = is_square ? f[1] : own[1];
    sine->both = is_square ? (s * s - a * a) / (2 * omega) : -a / (2 * omega);
    sine->one = is_square ? a * s / omega : s / (2 * omega);
    sine->steady = is_square ? (a * a + s * s) / 2 : a / 2;
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

static void make_tables(ContactModes *modes, const Complex l[2], double interval) {
    modes->unit = modes->time / MODES_TABLE_UNIT;
    modes->per_unit = MODES_TABLE_UNIT / modes->time;
    for (int mode = 0; mode < 2; mode++) {
        const Complex step = power_of_e(l[mode] * (long double)modes->time / MODES_TABLE_UNIT);
        const Complex whole = power_of_e(l[mode] * interval);
        const Complex peak = power_of_e(l[mode] * modes->peak_time);
        Complex power = 1;
        for (int i = 0; i <= MODES_TABLE; i++, power *= step) {
            modes->table[i][2 * mode] = (double)creall(power);
            modes->table[i][2 * mode + 1] = (double)cimagl(power);
        }
        modes->peak[2 * mode] = (double)creall(peak);
        modes->peak[2 * mode + 1] = (double)cimagl(peak);
        modes->interval[2 * mode] = (double)creall(whole);
        modes->interval[2 * mode + 1] = (double)cimagl(whole);
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
    // Faster decays of the buffer's would want more terms of contact_modes_nudge than there are.
    for (int i = 0; i < 2; i++)
        if (!(creall(l[i]) < 0) || !(cimagl(l[i]) > (i == 0 ? 0.05L : 0.25L) * -creall(l[i])))
            return false;
    return square(l[1]) > 4 * square(l[0]);
}

// What the particular motion shows a derivative later.
static void put_derivative(ContactModes *modes, ModesRow row, ModesRow of) {
    double *a = modes->see[MODES_A], *s = modes->see[MODES_S];
    const double omega = modes->base_omega;
    a[row] = omega > 0 ? -omega * s[of] : 0;
    s[row] = omega > 0 ? omega * a[of] : a[of];
}

void contact_modes_make(ContactModes *modes, const Motion *m, double base_omega, double interval) {
    memset(modes, 0, sizeof *modes);
    const Pencil p = {m->damping, m->omega2, m->contact_damping, m->contact_omega2, m->share};
    const double half = m->contact_damping / 2, contact2 = m->contact_omega2 - half * half;
    const long double omega = base_omega;
    Complex l[2], g[2], centre[2];
    if (!(contact2 > 0) || !find_oscillations(&p, l))
        return;
    modes->base_omega = base_omega;
    modes->contact_omega = sqrt(contact2);
    modes->time = PI / modes->contact_omega;
    modes->damping = m->contact_damping;
    modes->growth = (double)creall(power_of_e(half * (long double)modes->time));
    // In an isolated contact of damping ratio Z = sin b the force is largest after a right angle
    // less 3 b; a guess.
    const double Z = half / sqrt(m->contact_omega2),
                 b = Z * (1 + Z * Z * (1.0 / 6 + Z * Z * 0.075));
    modes->peak_time = larger(PI / 2 - 3 * b, 0) / modes->contact_omega;
    static const ModesRow r_rows[] = {MODES_R, MODES_W, MODES_R2, MODES_R3, MODES_R4};
    static const ModesRow n_rows[] = {MODES_N, MODES_N1, MODES_N2, MODES_N3, MODES_N4};
    Complex fixed[2] = {0, 0}; // what x and r are under a_g = 1, and what its slope adds
    Complex fixed_slope[2] = {0, 0};
    bool is_apart = true; // from the sine
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
        const Complex apart = l[i] * l[i] + omega * omega, base = -into[1];
        const Complex value = base * l[i] / apart;
        const Complex slope = omega > 0 ? base * omega / apart : value / l[i];
        const Complex columns[MODES_COLUMNS] = {into[0], into[1], into[2], into[3], value, slope};
        is_apart = is_apart && square(apart) > 1e-8L * square(l[i]) * square(l[i]);
        for (int j = 0; j < MODES_COLUMNS; j++) {
            modes->into[j][2 * i] = (double)creall(columns[j]);
            modes->into[j][2 * i + 1] = (double)cimagl(columns[j]);
        }
        modes->jump[2 * i] = (double)creall(slope);
        modes->jump[2 * i + 1] = (double)cimagl(slope);
        Complex power = 1;
        for (int j = 0; j < 5; j++, power *= l[i]) {
            put_seen(modes, r_rows[j], i, power);
            put_seen(modes, n_rows[j], i, force * power);
        }
        put_seen(modes, MODES_X, i, X);
        put_seen(modes, MODES_V, i, X * l[i]);
        put(modes->middle, i, (X + p.share) / l[i]);
        fixed[0] -= X * value;
        fixed[1] -= value;
        fixed_slope[0] -= X * slope;
        fixed_slope[1] -= slope;
        g[i] = X * l[i];
        centre[i] = (X + p.share) * l[i];
        for (int j = 0; j < 2; j++) {
            modes->sigma[2 * i + j] = (double)creall(l[i]);
            modes->omega[2 * i + j] = (double)cimagl(l[i]);
        }
        modes->size2[i] = (double)square(l[i]);
    }
    modes->slow_sigma = modes->sigma[0];
    modes->fast = modes->omega[2];
    const double turn = 0.05 / modes->fast, decay = -0.1 / modes->sigma[2];
    modes->near = turn < decay ? turn : decay;
    double *a = modes->see[MODES_A], *s = modes->see[MODES_S];
    a[MODES_X] = (double)creall(fixed[0]);
    s[MODES_X] = (double)creall(fixed_slope[0]);
    a[MODES_R] = (double)creall(fixed[1]);
    s[MODES_R] = (double)creall(fixed_slope[1]);
    put_derivative(modes, MODES_V, MODES_X);
    for (int j = 1; j < 5; j++)
        put_derivative(modes, r_rows[j], r_rows[j - 1]);
    a[MODES_N] = m->contact_omega2 * a[MODES_R] + m->contact_damping * a[MODES_W];
    s[MODES_N] = m->contact_omega2 * s[MODES_R] + m->contact_damping * s[MODES_W];
    for (int j = 1; j < 5; j++)
        put_derivative(modes, n_rows[j], n_rows[j - 1]);
    modes->middle_a = a[MODES_X] + m->share * a[MODES_R];
    modes->middle_s = s[MODES_X] + m->share * s[MODES_R];
    make_form(&modes->vv, g, l, modes->jump);
    make_form(&modes->ww, l, l, modes->jump);
    if (omega > 0) {
        const double v[2] = {a[MODES_V], s[MODES_V]}, w[2] = {a[MODES_W], s[MODES_W]};
        const double both[2] = {v[0] + m->share * w[0], v[1] + m->share * w[1]};
        static const double one[2] = {1, 0};
        make_sine(&modes->sine_vv, g, l, base_omega, v, NULL);
        make_sine(&modes->sine_ww, l, l, base_omega, w, NULL);
        make_sine(&modes->sine_work, centre, l, base_omega, one, both);
        modes->sway = fabs(a[MODES_R2]) + fabs(s[MODES_R2]);
        modes->n_sway = fabs(a[MODES_N2]) + fabs(s[MODES_N2]);
    }
    make_tables(modes, l, interval);
    const double longest = 2 * modes->time < interval ? 2 * modes->time : interval;
    modes->is_usable = is_apart && -modes->slow_sigma * longest < 0.01;
}
