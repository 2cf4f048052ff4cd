// What ONE executor of sweeps is: something that makes chunks of points, and says how they fare.
// executors.c lists all. It makes rows and keeps none: what is in the store is done, an executor
// only says what is worth waiting for. Not the sweep itself (sweep.h). Used by sweep.c.
#ifndef SERVER_JOBS_EXECUTOR_H
#define SERVER_JOBS_EXECUTOR_H

#include "server/jobs/intake.h"

typedef struct SweepRun SweepRun;

typedef enum ChunkState {
    CHUNK_LIVE,    // waits or runs: its rows will come
    CHUNK_DEAD,    // will not come unless it is submitted again
    CHUNK_UNKNOWN, // cannot be told now; never submitted again for that
} ChunkState;

typedef struct ExecutorLimits {
    size_t slots;         // chunks that run side by side
    double chunk_seconds; // of CPU that a chunk is to take, where that makes no more chunks than
    size_t chunks;        // so many
    size_t chunk_points;  // that it has at most
} ExecutorLimits;

typedef struct Executor {
    const char *name, *doc;
    // Whether it can take work, and its limits.
    Status (*probe)(Intake *intake, ExecutorLimits *limits, Problem *problem);
    // Takes chunks of a sweep that is written down. A chunk may be submitted twice: equal bytes
    // make that harmless. After a failure none was taken.
    Status (*submit)(SweepRun *run, const size_t *chunks, size_t count, Problem *problem);
    ChunkState (*poll)(SweepRun *run, size_t chunk);
    // Lets all of its chunks go that no slot has in hand; those end soon by themselves.
    void (*cancel)(SweepRun *run);
} Executor;

extern const Executor *const executors[]; // NULL-terminated; the first that can takes the sweep
extern const Executor executor_threads;

#endif
