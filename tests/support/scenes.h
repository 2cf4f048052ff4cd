// The paper's scene as a plain struct, for tests that change one thing of it.
// Not read from a file. Used by unit tests.
#ifndef TESTS_SUPPORT_SCENES_H
#define TESTS_SUPPORT_SCENES_H

#include "core/simulation/simulation.h"

// M = 1.35 kg, K = 865 N/m, C = 1.092 N s/m in free vibration from 15 mm, 10 s at 1 kHz, without a
// damper; not completed. `simulation` may be uninitialised.
void scene_without_damper(Simulation *simulation);

// The same with the paper's damper of 0.1107 kg and 15 mm and a buffer of e and T_c (NAN: not
// given).
void scene_with_damper(Simulation *simulation, double restitution, double contact_time);

// The state at the start of a structure of one storey.
void scene_start(Simulation *simulation, double displacement, double velocity);

// Replaces a variant by one of another kind with its defaults.
void scene_choose(Variant **variant, const KindTable *kinds, const char *name);

#endif
