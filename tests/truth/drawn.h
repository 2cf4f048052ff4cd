// Scenes drawn at random for the judges of whole runs, and the same scenes as the product takes
// them. Not a judge and not a solver. Used by the truth tests and the benchmarks.
#ifndef TESTS_TRUTH_DRAWN_H
#define TESTS_TRUTH_DRAWN_H

#include <stdint.h>

#include "core/simulation/simulation.h"
#include "tests/truth/reference.h"

// SplitMix64: the same everywhere.
typedef struct Draws {
    uint64_t state;
} Draws;

uint64_t draws_bits(Draws *draws);
double draws_uniform(Draws *draws, double a, double b);
double draws_scattered(Draws *draws, double a, double b); // its logarithm is uniform
bool draws_chance(Draws *draws, double p);

// A scene of its own for each number: any stiffness, damping, mass, clearance, e of 0.1 to 0.97 and
// T_c of 3e-5 s to 5e-2 s, still, sine and record. Cleared by drawn_clear.
void drawn_scene(ReferenceScene *scene, uint64_t number, double duration);
void drawn_clear(ReferenceScene *scene);

// Has half of the scenes with buffers end their contacts by zero_force, where the product can.
bool drawn_zero_force(ReferenceScene *scene, uint64_t number);

void drawn_print(const ReferenceScene *scene);

// The scene as the product takes it, not completed; all channels of the reference, or none.
void drawn_simulation(const ReferenceScene *scene, bool has_channels, Simulation *simulation);

// Through simulation_run; NULL, and a line printed, if it is refused.
Outcome *drawn_run(const ReferenceScene *scene, bool has_channels);

// An outcome of drawn_run with channels, in the reference's form. Cleared by reference_clear.
bool drawn_answer(const Outcome *outcome, ReferenceAnswer *answer);

#endif
