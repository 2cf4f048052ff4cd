// What ONE executor of studies is: something that makes chunks of members, and says how they fare.
// executors.c lists all. It knows neither what a member is nor what becomes of it (gather.h), and
// only says what is worth waiting for. Not the study itself (study.h). Used by study.c and those
// who gather.
#ifndef SERVER_JOBS_EXECUTOR_H
#define SERVER_JOBS_EXECUTOR_H

#include "server/jobs/jobs.h"

typedef struct StudyRun StudyRun;

// Members of one study: first, first + stride, ... count of them. Cost varies along an axis, so
// that those that lie apart make chunks of like cost.
typedef struct Chunk {
    size_t first, stride, count;
} Chunk;

// One of `chunks` that members from ... to - 1 are dealt out to.
Chunk chunk_deal(size_t from, size_t to, size_t chunks, size_t index);

typedef enum ChunkState {
    CHUNK_LIVE,    // waits or runs: its members will come
    CHUNK_DEAD,    // will not come unless it is submitted again
    CHUNK_UNKNOWN, // cannot be told now; never submitted again for that
} ChunkState;

typedef struct ExecutorLimits {
    size_t slots;         // chunks that run side by side
    double chunk_seconds; // of CPU that a chunk is to take, where that makes no more chunks than
    size_t chunks;        // so many
    size_t chunk_members; // that it has at most
} ExecutorLimits;

// Into how many chunks so many members go that take so many seconds each.
size_t executor_chunks(const ExecutorLimits *limits, size_t members, double seconds);

typedef struct Executor {
    const char *name, *doc;
    // Whether it can take work, and its limits.
    Status (*probe)(JobManager *manager, ExecutorLimits *limits, Problem *problem);
    // Takes chunks. One may be submitted twice: equal bytes make that harmless. After a failure
    // none was taken.
    Status (*submit)(StudyRun *run, const Chunk *chunks, size_t count, Problem *problem);
    ChunkState (*poll)(StudyRun *run, const Chunk *chunk);
    // Lets all of its chunks go that no slot has in hand; those end soon by themselves.
    void (*cancel)(StudyRun *run);
} Executor;

extern const Executor *const executors[]; // NULL-terminated; the first that can takes the study
extern const Executor executor_threads;

#endif
