// One linear contact in closed form: two damped oscillations, a slow one of the whole and a fast
// one of the buffer, about what a linear base makes of both. Not for contacts that are no
// oscillation or hardly two: is_usable says so, and arcs do. Used by the exact solver.
#ifndef CORE_SOLVE_PULSE_H
#define CORE_SOLVE_PULSE_H

#include "core/solve/arc.h"

enum { PULSE_TABLE = 40, PULSE_TABLE_UNIT = 16, PULSE_RIDE = 8 };

// Two complex amplitudes d, slow and fast, each as two reals; what can be seen is row . (d, a, s)
// with the base's a_g = a and slope s at that time.
typedef struct PulseRow {
    double d[4], a, s;
} PulseRow;
typedef struct PulseForm {
    double of[10]; // of d d', upper triangle by rows
    double jump[4],
        jump2;   // what it gains as the base's slope does: slope (jump . d) + slope^2 jump2
    double slow; // times pulse_slow(...): the slow oscillation's mean square, kept apart from a
                 // difference that would lose it where that hardly decays
} PulseForm;

typedef struct Pulse {
    bool is_usable;
    double into[4][6];                // d from (x, v, r, w, a, s)
    double jump[4];                   // of d per unit that the slope of the base gains
    PulseRow x, v, r, w, n;           // n = N / m_e
    PulseRow r_bend, n_rate, n_bend;  // derivatives
    PulseRow x_sum, r_sum;            // integrals
    PulseForm vv, ww;                 // integrals of the squares of v and w, less their constants'
    double sigma[2], omega[2];        // of the oscillations [1/s], [rad/s]
    double size2[2];                  // |lambda|^2
    double rate;                      // the larger |lambda|
    double unit, per_unit;            // of the table [s], [1/s]
    double time;                      // T_c of an isolated contact [s]
    double peak_time;                 // of its largest force
    double contact_omega;             // pi / T_c [rad/s]
    double growth;                    // e^(c T_c / (2 m_e))
    double damping;                   // c / m_e
    double table[PULSE_TABLE + 1][4]; // the oscillations over i / PULSE_TABLE_UNIT of T_c
    double peak[4];                   // over peak_time
    double interval[4];               // and over a sample interval
    double ride[4][PULSE_RIDE];       // and over 1 to PULSE_RIDE of them
    double jumps[4][2 * PULSE_RIDE];  // what jump comes to after as many: from the middle on
} Pulse;

void pulse_make(Pulse *pulse, const Motion *touching, double interval);

// What the oscillations are multiplied by over a time; quick up to PULSE_TABLE / PULSE_TABLE_UNIT
// of T_c.
void pulse_turn(const Pulse *pulse, double time, double turn[4]);

static inline void pulse_multiply(const double turn[4], const double d[4], double out[4]) {
    const double re1 = turn[0] * d[0] - turn[1] * d[1], im1 = turn[0] * d[1] + turn[1] * d[0];
    const double re2 = turn[2] * d[2] - turn[3] * d[3], im2 = turn[2] * d[3] + turn[3] * d[2];
    out[0] = re1;
    out[1] = im1;
    out[2] = re2;
    out[3] = im2;
}

// Amplitudes a little later; |lambda time| is at most PULSE_NEAR.
#define PULSE_NEAR 1e-3
static inline void pulse_nudge(const Pulse *pulse, double time, double d[4]) {
    for (int i = 0; i < 2; i++) {
        const double s = pulse->sigma[i] * time, w = pulse->omega[i] * time;
        const double s2 = s * s, w2 = w * w;
        const double size = s + s2 * ((1.0 / 2 + s * (1.0 / 6)) + s2 * (1.0 / 24)); // less 1
        const double cosine = w2 * (1.0 / 2 - w2 * (1.0 / 24));                     // 1 less it
        const double sine = w - w * w2 * (1.0 / 6 - w2 * (1.0 / 120));
        const double re = size - (cosine + size * cosine), im = sine + size * sine; // less 1
        const double x = d[2 * i], y = d[2 * i + 1];
        d[2 * i] = x + (re * x - im * y);
        d[2 * i + 1] = y + (re * y + im * x);
    }
}

static inline double pulse_dot(const double row[4], const double d[4]) {
    return (row[0] * d[0] + row[1] * d[1]) + (row[2] * d[2] + row[3] * d[3]);
}

static inline double pulse_see(const PulseRow *row, const double d[4], double a, double s) {
    return pulse_dot(row->d, d) + (row->a * a + row->s * s);
}

// Integral of |d|^2 / 2 of the slow oscillation over a time.
static inline double pulse_slow(const Pulse *pulse, const double d[4], double time) {
    const double s = pulse->sigma[0] * time;
    return time / 2 * (d[0] * d[0] + d[1] * d[1]) *
           (1 + s * (1 + s * (2.0 / 3 + s * (1.0 / 3 + s * (2.0 / 15 + s * (2.0 / 45))))));
}

static inline double pulse_form(const PulseForm *form, const double d[4]) {
    const double *f = form->of;
    return (d[0] * ((f[0] * d[0] + f[1] * d[1]) + (f[2] * d[2] + f[3] * d[3])) +
            d[1] * ((f[4] * d[1] + f[5] * d[2]) + f[6] * d[3])) +
           (d[2] * (f[7] * d[2] + f[8] * d[3]) + d[3] * f[9] * d[3]);
}

#endif
