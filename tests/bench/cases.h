// The scenes of the benchmarks and what this project's solver takes for them: smallest CPU times of
// several repeats, into one warm buffer. Not the other solvers (peers.h). Used by bench_*.c.
#ifndef TESTS_BENCH_CASES_H
#define TESTS_BENCH_CASES_H

#include "core/simulation/simulation.h"

enum { BENCH_CHANNELS = 5, BENCH_REPEATS = 20 };

typedef struct BenchCase {
    const char *name;
    double restitution, contact_time;
    bool is_random, has_contact;
    double duration;    // [s]
    double sample_rate; // [Hz]
} BenchCase;
extern const BenchCase bench_cases[];
extern const size_t bench_case_count;

// A case made ready; the block holds BENCH_CHANNELS columns one after the other, written once.
typedef struct BenchScene {
    Simulation simulation; // completed
    Plan *plan;
    Base base;
    size_t count; // samples
    double *block;
    Workspace workspace;
} BenchScene;

// False, and a line printed, if it cannot be made. Cleared by bench_close, also after that.
bool bench_open(const BenchCase *bench, BenchScene *scene);
void bench_close(BenchScene *scene);

// ns of CPU per sample of the block's bytes set, and copied.
double bench_memset(BenchScene *scene);
double bench_memcpy(BenchScene *scene);

// ns of CPU per sample, but for the plan; the solver alone, and the whole from scene to response.
typedef struct BenchTimes {
    double run, base, whole;
    double plan_us;
    size_t impacts;
} BenchTimes;
bool bench_run(BenchScene *scene, BenchTimes *times);

#endif
