// The force of one contact of the model's over the time since it began, whatever its size and
// length. Not a contact law (contact/) and not a fit (pulse_fit_run.h). Used by trace*.c.
#ifndef CORE_DROP_TEST_PULSE_MODEL_H
#define CORE_DROP_TEST_PULSE_MODEL_H

#include <stdbool.h>

#include "core/contact/contact.h"

// Of an isolated pair, in units of its T_c, with L = -ln(e):
//
//   F / (m_e v0 / T_c) = pull + e^(-L s) (sine S(s) + cosine C(s)),  s = t / T_c
//
// C and S are cos(sqrt(turn) s) and sin(sqrt(turn) s) / sqrt(turn), hyperbolic where turn < 0.
typedef struct PulseModel {
    double decay;        // L; below 0 a contact that gains energy, which noise can look like
    double turn;         // the square of the damped frequency times T_c
    double pull;         // g T_c / v0
    double sine, cosine; // as above
    double length; // of the contact under that pull, in T_c; 1 without, INFINITY: it never ends
} PulseModel;

// `pull` is g T_c / v0 of what pulls the pair together during contact, 0: nothing.
PulseModel pulse_model_make(double decay, double pull, int separation);

// `pull` is g / v0 times the time that the contact lasts, as a trace shows it.
PulseModel pulse_model_make_lasting(double decay, double pull, int separation);

double pulse_model_force(const PulseModel *shape, double s);

// The integral of the force over the contact [m_e v0].
double pulse_model_impulse(const PulseModel *shape);

// From when to when in T_c the size of the force is above `level` of its largest; pressed: until
// when without the tensile end.
typedef struct PulseVisible {
    double from, pressed, to;
} PulseVisible;
PulseVisible pulse_model_visible(const PulseModel *shape, double level);

#endif
