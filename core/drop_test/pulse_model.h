// One linear contact with damping and gravity: its force over the time since it began, without
// dimensions; the effect of gravity on e and T_c of a drop, and its correction.
#ifndef CORE_DROP_TEST_PULSE_MODEL_H
#define CORE_DROP_TEST_PULSE_MODEL_H

#include "core/contact/contact.h"

// Of an isolated pair, in units of its T_c, with L = -ln(e):
//
//   F / (m_e v0 / T_c) = pull + e^(-L s) (sine S(s) + cosine C(s)),  s = t / T_c
//
// C and S are cos(sqrt(turn) s) and sin(sqrt(turn) s) / sqrt(turn), hyperbolic where turn < 0.
typedef struct PulseModel {
    double decay;        // L; below 0 the contact gains energy, which noise can imitate
    double turn;         // square of the damped angular frequency times T_c
    double pull;         // g T_c / v0
    double sine, cosine; // coefficients, as above
    double length;       // of the contact with gravity [T_c]; 1 without, INFINITY: it does not end
} PulseModel;

// `pull` is g T_c / v0 of the gravity that acts during contact, 0: none; or, if is_total, g / v0
// times the duration of the contact, length * T_c.
PulseModel pulse_model_make(double decay, double pull, bool is_total, int separation);

// F at s [m_e v0 / T_c].
double pulse_model_force(const PulseModel *model, double s);

// The integral of the force over the contact [m_e v0].
double pulse_model_impulse(const PulseModel *model);

// The interval in which the magnitude of the force exceeds `level` of its maximum [T_c]; `pressed`
// is its end without the tensile part.
typedef struct PulseVisible {
    double from, pressed, to;
} PulseVisible;
PulseVisible pulse_model_visible(const PulseModel *model, double level);

// Gravity that presses the impactor into the buffer, and how the rebound was read.
typedef struct GravityLoad {
    double gravity; // [m/s^2]
    double speed;   // of approach [m/s]
    Separation separation;
    bool is_by_height; // the rebound speed is that above the buffer at rest, not at separation
} GravityLoad;

// e and T_c [s] with gravity; e is 0 and T_c INFINITY where the contact does not end.
typedef struct GravityContact {
    double restitution, contact_time;
} GravityContact;
GravityContact gravity_apply(const GravityLoad *load, double restitution, double contact_time);

// e and T_c [s] of the isolated pair from those that were read, with relative standard
// uncertainties, which may be NAN. False: no contact with 0 < e <= 1 has these readings.
typedef struct GravityCorrected {
    double restitution, contact_time;
    double restitution_uncertainty, contact_time_uncertainty; // relative
} GravityCorrected;
bool gravity_correct(const GravityLoad *load, const GravityCorrected *read,
                     GravityCorrected *isolated);

// T_c or e of the isolated pair from the reading of it and the isolated pair's value of the other.
bool gravity_correct_one(const GravityLoad *load, bool is_time, double read, double other,
                         double *isolated);

#endif
