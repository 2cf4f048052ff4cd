// Plans of frames as plain numbers, built without a scene: for tests and benchmarks of the general
// engine alone. Not how the program makes them (core/plan/plan.c).
#ifndef TESTS_SUPPORT_FRAMES_H
#define TESTS_SUPPORT_FRAMES_H

#include "core/plan/plan.h"

// Zero matrices of that size, influence 1, at rest; freed by plan_free. Aborts without memory.
Plan *frames_new(size_t storeys, size_t dampers, double duration, double sample_rate);

// Storey 1 at the ground, storey j on a spring k_j and a dashpot c_j.
void frames_shear(Plan *plan, const double *mass, const double *stiffness, const double *damping);

// Equal storeys with Rayleigh damping, of this ratio in the first mode and at ten times its
// frequency.
void frames_uniform(Plan *plan, double mass, double stiffness, double damping_ratio);

// A damper whose two buffers are alike; effective_mass is for a diagonal mass matrix. A contact
// time of NAN means impulse.
void frames_damper(Plan *plan, size_t index, size_t storey, double mass, double clearance,
                   double restitution, double contact_time);

#endif
