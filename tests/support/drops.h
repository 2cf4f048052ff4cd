// Drop tests for tests: read from JSON, made by a run of the core, blurred by noise.
// Not a lab's. Used by the unit tests of core/measure.
#ifndef TESTS_SUPPORT_DROPS_H
#define TESTS_SUPPORT_DROPS_H

#include "core/contact/contact.h"
#include "core/drop_test/drop_test.h"

// One contact of an impactor of 0.11 kg with a buffer on a base that does not move.
typedef struct DropMade {
    double approach, separation; // speeds [m/s]
    double duration;             // [s]
} DropMade;

// Simulated by the exact solver; `gravity` pulls the impactor all the time [m/s^2]. The test fails
// where there is no contact.
DropMade drops_simulate(double restitution, double contact_time, Separation separation,
                        double speed, double gravity);

// A test with so many empty drops; cleared by fields_clear.
void drops_make(DropTest *test, size_t count);

// The test as JSON, judged: what drop_test_validate and the reader say.
Status drops_read(const char *text, DropTest *test, Problem *problem);

// A normal number of mean 0 and deviation 1, the next of that seed.
double drops_noise(uint64_t seed, uint64_t *next);

#endif
