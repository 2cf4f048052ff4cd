// One linear contact in closed form: two damped oscillations, a slow one of the whole and a fast
// one of the buffer, about what a linear base or a sine makes of both. is_usable is false for
// contacts that are no two oscillations; those go by Taylor pieces.
#ifndef CORE_SOLVE_CONTACT_MODES_H
#define CORE_SOLVE_CONTACT_MODES_H

#include "core/solve/arc.h"
#include "core/solve/wide.h"

enum { MODES_TABLE = 160, MODES_TABLE_UNIT = 64 };

// What can be seen: the state, n = N / m_e and its derivatives, further derivatives of r.
typedef enum ModesRow {
    MODES_X,
    MODES_V,
    MODES_R,
    MODES_W,
    MODES_N,
    MODES_N1,
    MODES_N2,
    MODES_R2,
    MODES_N3,
    MODES_N4,
    MODES_R3,
    MODES_R4,
    MODES_ROWS
} ModesRow;

// And from what: two complex amplitudes d, slow and fast, each as two reals, and the base at that
// time: a_g = a, with slope s, or under a sine its other half.
enum { MODES_A = 4, MODES_S, MODES_COLUMNS };

// The integral of the square of a velocity.
typedef struct ModesForm {
    double of[4][4]; // of d d'
    double jump[4],
        jump2;   // what it gains as the base's slope does: slope (jump . d) + slope^2 jump2
    double slow; // times contact_modes_slow(...): the slow oscillation's mean square, kept apart
                 // from a difference that would lose it where that hardly decays
} ModesForm;

// What a sine adds to an integral's value at one time: a (by[0] . d) + s (by[1] . d) + a s both +
// a^2 one, and steadily `steady` times the amplitude's square and the time.
typedef struct ModesSine {
    double by[2][4], both, one, steady;
} ModesSine;

typedef struct ContactModes {
    bool is_usable;
    double base_omega;                     // of the sine, else 0
    double into[MODES_COLUMNS][4];         // d from (x, v, r, w, a, s), by columns
    double see[MODES_COLUMNS][MODES_ROWS]; // from (d, a, s), by columns
    double jump[4];                        // of d per unit that the slope of the base gains
    double middle[4], middle_a, middle_s;  // the integral of x + share r
    ModesForm vv, ww;                      // less what the base's constants add
    ModesSine sine_vv, sine_ww, sine_work; // the last: of a_g times the speed of x + share r
    double sigma[4], omega[4];             // of the oscillations, each twice [1/s], [rad/s]
    double near;                           // what contact_modes_nudge is right for [s]
    double slow_sigma, fast;               // sigma of the first, omega of the other
    double size2[2];                       // |lambda|^2
    double sway, n_sway;                   // what a sine of amplitude 1 makes of r'' and n''
    double unit, per_unit;                 // of the table [s], [1/s]
    double time;                           // T_c of an isolated contact [s]
    double peak_time;                      // of its largest force
    double contact_omega;                  // pi / T_c [rad/s]
    double growth;                         // e^(c T_c / (2 m_e))
    double damping;                        // c / m_e
    double table[MODES_TABLE + 1][4];      // the oscillations over i / MODES_TABLE_UNIT of T_c
    double peak[4];                        // over peak_time
    double interval[4];                    // and over a sample interval
} ContactModes;

// `base_omega` is a sine's (0: linear).
void contact_modes_make(ContactModes *modes, const Motion *touching, double base_omega,
                        double interval);

static const double contact_modes_signs[4] = {-1, 1, -1, 1};

// Both amplitudes times complex numbers.
INLINE void contact_modes_multiply(const double turn[4], const Four *d, Four *out) {
    const Four all = FOUR(turn), re = __builtin_shufflevector(all, all, 0, 0, 2, 2);
    const Four im = __builtin_shufflevector(all, all, 1, 1, 3, 3) * FOUR(contact_modes_signs);
    *out = re * *d + im * __builtin_shufflevector(*d, *d, 1, 0, 3, 2);
}

// Amplitudes a little later or earlier, by at most `near`.
INLINE void contact_modes_nudge(const ContactModes *modes, double time, Four *d) {
    // In pairs, not by Horner: much waits for the last term.
    const Four s = FOUR(modes->sigma) * time, w = FOUR(modes->omega) * time;
    const Four s2 = s * s, w2 = w * w, s4 = s2 * s2, w4 = w2 * w2;
    const Four size = s + s2 * (((1.0 / 2 + s * (1.0 / 6)) + s2 * (1.0 / 24 + s * (1.0 / 120))) +
                                s4 * ((1.0 / 720 + s * (1.0 / 5040)) +
                                      s2 * (1.0 / 40320 + s * (1.0 / 362880)))); // less 1
    const Four cosine =
        w2 * ((1.0 / 2 - w2 * (1.0 / 24)) + w4 * (1.0 / 720 - w2 * (1.0 / 40320))); // 1 less it
    const Four sine = w - w * (w2 * ((1.0 / 6 - w2 * (1.0 / 120)) + w4 * (1.0 / 5040)));
    const Four re = size - (cosine + size * cosine); // less 1
    const Four im = (sine + size * sine) * FOUR(contact_modes_signs);
    *d += re * *d + im * __builtin_shufflevector(*d, *d, 1, 0, 3, 2);
}

// Amplitudes after a time; quick up to MODES_TABLE / MODES_TABLE_UNIT of T_c.
INLINE void contact_modes_go(const ContactModes *modes, const Four *from, double time, Four *d) {
    const double span = MODES_TABLE * modes->unit;
    Four here = *from;
    for (; time > span; time -= span) // seldom: a long way at once
        contact_modes_multiply(modes->table[MODES_TABLE], &here, &here);
    const int place = (int)(time * modes->per_unit + 0.5);
    const double rest = time - place * modes->unit;
    contact_modes_multiply(modes->table[place], &here, d);
    if (rest != 0) // T_c, where a search begins, is a place
        contact_modes_nudge(modes, rest, d);
}

// Four rows from `row` on.
INLINE void contact_modes_see(const ContactModes *modes, int row, const Four *d, double a, double s,
                              Four *out) {
    const double(*c)[MODES_ROWS] = modes->see;
    const Four slow = FOUR(c[0] + row) * (*d)[0] + FOUR(c[1] + row) * (*d)[1];
    const Four fast = FOUR(c[2] + row) * (*d)[2] + FOUR(c[3] + row) * (*d)[3];
    *out = (slow + fast) + (FOUR(c[MODES_A] + row) * a + FOUR(c[MODES_S] + row) * s);
}

INLINE double contact_modes_dot(const double row[4], const Four *d) {
    const Four all = FOUR(row) * *d;
    return (all[0] + all[1]) + (all[2] + all[3]);
}

// Integral of |d|^2 / 2 of the slow oscillation over a time.
INLINE double contact_modes_slow(const ContactModes *modes, const Four *d, double time) {
    const double s = modes->slow_sigma * time;
    return time / 2 * ((*d)[0] * (*d)[0] + (*d)[1] * (*d)[1]) *
           (1 + s * (1 + s * (2.0 / 3 + s * (1.0 / 3 + s * (2.0 / 15 + s * (2.0 / 45))))));
}

INLINE double contact_modes_form(const ModesForm *form, const Four *d) {
    const Four turned = (FOUR(form->of[0]) * (*d)[0] + FOUR(form->of[1]) * (*d)[1]) +
                        (FOUR(form->of[2]) * (*d)[2] + FOUR(form->of[3]) * (*d)[3]);
    const Four all = turned * *d;
    return (all[0] + all[1]) + (all[2] + all[3]);
}

INLINE double contact_modes_sine(const ModesSine *sine, const Four *d, double a, double s) {
    const Four all = (FOUR(sine->by[0]) * a + FOUR(sine->by[1]) * s) * *d;
    return ((all[0] + all[1]) + (all[2] + all[3])) + a * (s * sine->both + a * sine->one);
}

#endif
