// One linear contact in closed form: two damped oscillations, a slow one of the whole and a fast
// one of the buffer, about what a linear base or a sine makes of both. Not for contacts that are no
// oscillation or hardly two: is_usable says so, and arcs do. Used by the exact solver.
#ifndef CORE_SOLVE_PULSE_H
#define CORE_SOLVE_PULSE_H

#include "core/solve/arc.h"
#include "core/solve/wide.h"

enum { PULSE_TABLE = 160, PULSE_TABLE_UNIT = 64, PULSE_RIDE = 8 };

// What can be seen: the state, n = N / m_e and its derivatives, further derivatives of r.
typedef enum PulseRow {
    PULSE_X,
    PULSE_V,
    PULSE_R,
    PULSE_W,
    PULSE_N,
    PULSE_N1,
    PULSE_N2,
    PULSE_R2,
    PULSE_N3,
    PULSE_N4,
    PULSE_R3,
    PULSE_R4,
    PULSE_ROWS
} PulseRow;

// And from what: two complex amplitudes d, slow and fast, each as two reals, and the base at that
// time: a_g = a, with slope s, or under a sine its other half.
enum { PULSE_A = 4, PULSE_S, PULSE_COLUMNS };

// The integral of the square of a velocity.
typedef struct PulseForm {
    double of[4][4]; // of d d'
    double jump[4],
        jump2;   // what it gains as the base's slope does: slope (jump . d) + slope^2 jump2
    double slow; // times pulse_slow(...): the slow oscillation's mean square, kept apart from a
                 // difference that would lose it where that hardly decays
} PulseForm;

// What a sine adds to an integral's value at one time: a (by[0] . d) + s (by[1] . d) + a s both +
// a^2 one, and steadily `steady` times the amplitude's square and the time.
typedef struct PulseSine {
    double by[2][4], both, one, steady;
} PulseSine;

typedef struct Pulse {
    bool is_usable;
    double base_omega;                     // of the sine, else 0
    double into[PULSE_COLUMNS][4];         // d from (x, v, r, w, a, s), by columns
    double see[PULSE_COLUMNS][PULSE_ROWS]; // from (d, a, s), by columns
    double jump[4];                        // of d per unit that the slope of the base gains
    double middle[4], middle_a, middle_s;  // the integral of x + share r
    PulseForm vv, ww;                      // less what the base's constants add
    PulseSine sine_vv, sine_ww, sine_work; // the last: of a_g times the speed of x + share r
    double sigma[4], omega[4];             // of the oscillations, each twice [1/s], [rad/s]
    double near;                           // what pulse_nudge is right for [s]
    double slow_sigma, fast;               // sigma of the first, omega of the other
    double size2[2];                       // |lambda|^2
    double sway, n_sway;                   // what a sine of amplitude 1 makes of r'' and n''
    double unit, per_unit;                 // of the table [s], [1/s]
    double time;                           // T_c of an isolated contact [s]
    double peak_time;                      // of its largest force
    double contact_omega;                  // pi / T_c [rad/s]
    double growth;                         // e^(c T_c / (2 m_e))
    double damping;                        // c / m_e
    double table[PULSE_TABLE + 1][4];      // the oscillations over i / PULSE_TABLE_UNIT of T_c
    double peak[4];                        // over peak_time
    double interval[4];                    // and over a sample interval
    double ride[4][PULSE_RIDE];            // and over 1 to PULSE_RIDE of them
    double jumps[4][2 * PULSE_RIDE];       // what jump comes to after as many: from the middle on
    double cosine[PULSE_RIDE], sine[PULSE_RIDE]; // of the sine's turn over 1 to PULSE_RIDE of them
} Pulse;

// `base_omega` is a sine's (0: linear).
void pulse_make(Pulse *pulse, const Motion *touching, double base_omega, double interval);

static const double pulse_signs[4] = {-1, 1, -1, 1};

// Both amplitudes times complex numbers.
INLINE void pulse_multiply(const double turn[4], const Four *d, Four *out) {
    const Four all = FOUR(turn), re = __builtin_shufflevector(all, all, 0, 0, 2, 2);
    const Four im = __builtin_shufflevector(all, all, 1, 1, 3, 3) * FOUR(pulse_signs);
    *out = re * *d + im * __builtin_shufflevector(*d, *d, 1, 0, 3, 2);
}

// Amplitudes a little later or earlier, by at most `near`.
INLINE void pulse_nudge(const Pulse *pulse, double time, Four *d) {
    // In pairs, not by Horner: much waits for the last term.
    const Four s = FOUR(pulse->sigma) * time, w = FOUR(pulse->omega) * time;
    const Four s2 = s * s, w2 = w * w, s4 = s2 * s2, w4 = w2 * w2;
    const Four size = s + s2 * (((1.0 / 2 + s * (1.0 / 6)) + s2 * (1.0 / 24 + s * (1.0 / 120))) +
                                s4 * ((1.0 / 720 + s * (1.0 / 5040)) +
                                      s2 * (1.0 / 40320 + s * (1.0 / 362880)))); // less 1
    const Four cosine =
        w2 * ((1.0 / 2 - w2 * (1.0 / 24)) + w4 * (1.0 / 720 - w2 * (1.0 / 40320))); // 1 less it
    const Four sine = w - w * (w2 * ((1.0 / 6 - w2 * (1.0 / 120)) + w4 * (1.0 / 5040)));
    const Four re = size - (cosine + size * cosine); // less 1
    const Four im = (sine + size * sine) * FOUR(pulse_signs);
    *d += re * *d + im * __builtin_shufflevector(*d, *d, 1, 0, 3, 2);
}

// Amplitudes after a time; quick up to PULSE_TABLE / PULSE_TABLE_UNIT of T_c.
INLINE void pulse_go(const Pulse *pulse, const Four *from, double time, Four *d) {
    const double span = PULSE_TABLE * pulse->unit;
    Four here = *from;
    for (; time > span; time -= span) // seldom: a long way at once
        pulse_multiply(pulse->table[PULSE_TABLE], &here, &here);
    const int place = (int)(time * pulse->per_unit + 0.5);
    const double rest = time - place * pulse->unit;
    pulse_multiply(pulse->table[place], &here, d);
    if (rest != 0) // T_c, where a search begins, is a place
        pulse_nudge(pulse, rest, d);
}

// Four rows from `row` on.
INLINE void pulse_see(const Pulse *pulse, int row, const Four *d, double a, double s, Four *out) {
    const double(*c)[PULSE_ROWS] = pulse->see;
    const Four slow = FOUR(c[0] + row) * (*d)[0] + FOUR(c[1] + row) * (*d)[1];
    const Four fast = FOUR(c[2] + row) * (*d)[2] + FOUR(c[3] + row) * (*d)[3];
    *out = (slow + fast) + (FOUR(c[PULSE_A] + row) * a + FOUR(c[PULSE_S] + row) * s);
}

INLINE double pulse_dot(const double row[4], const Four *d) {
    const Four all = FOUR(row) * *d;
    return (all[0] + all[1]) + (all[2] + all[3]);
}

// Integral of |d|^2 / 2 of the slow oscillation over a time.
INLINE double pulse_slow(const Pulse *pulse, const Four *d, double time) {
    const double s = pulse->slow_sigma * time;
    return time / 2 * ((*d)[0] * (*d)[0] + (*d)[1] * (*d)[1]) *
           (1 + s * (1 + s * (2.0 / 3 + s * (1.0 / 3 + s * (2.0 / 15 + s * (2.0 / 45))))));
}

INLINE double pulse_form(const PulseForm *form, const Four *d) {
    const Four turned = (FOUR(form->of[0]) * (*d)[0] + FOUR(form->of[1]) * (*d)[1]) +
                        (FOUR(form->of[2]) * (*d)[2] + FOUR(form->of[3]) * (*d)[3]);
    const Four all = turned * *d;
    return (all[0] + all[1]) + (all[2] + all[3]);
}

INLINE double pulse_sine(const PulseSine *sine, const Four *d, double a, double s) {
    const Four all = (FOUR(sine->by[0]) * a + FOUR(sine->by[1]) * s) * *d;
    return ((all[0] + all[1]) + (all[2] + all[3])) + a * (s * sine->both + a * sine->one);
}

#endif
