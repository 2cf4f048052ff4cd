// The list of executors, and how members are cut into chunks for any of them.
#include <math.h>

#include "server/jobs/executor.h"

enum { CHUNKS_PER_SLOT = 4 };

const Executor *const executors[] = {
    &executor_threads,
    NULL,
};

Chunk chunk_deal(size_t from, size_t to, size_t chunks, size_t index) {
    const size_t first = from + index;
    return (Chunk){first, chunks, first >= to ? 0 : (to - first + chunks - 1) / chunks};
}

size_t executor_chunks(const ExecutorLimits *limits, size_t members, double seconds) {
    const double all = (double)members;
    double chunks = fmin(ceil(seconds * all / limits->chunk_seconds), (double)limits->chunks);
    chunks = fmax(chunks, ceil(all / (double)limits->chunk_members));
    chunks = fmax(chunks, (double)(CHUNKS_PER_SLOT * limits->slots));
    return (size_t)fmin(chunks, all);
}
