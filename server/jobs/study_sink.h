// What ONE way to gather a study's members is: what becomes of the parts that its chunks come to.
// Rows of a sweep are kept by the store, chunk by chunk, and outlive the daemon; what else there is
// is folded in memory, member by member in their order. Not who makes them (executor.h,
// study_chunk.c). Used by study.c and study_chunk.c.
#ifndef SERVER_JOBS_STUDY_SINK_H
#define SERVER_JOBS_STUDY_SINK_H

#include "server/jobs/study.h"

typedef struct StudySink {
    bool is_kept; // what it has outlives the daemon, and waits where the store has no room
    // Makes ready, before the study is launched.
    Status (*open)(Worker *worker, StudyRun *run, Problem *problem);
    // Hands chunks to the executor: those that are not there and that nobody is at.
    Status (*submit)(StudyRun *run, Problem *problem);
    // Takes the part that the chunk_run's next member came to, in any case.
    Status (*take)(StudyRun *run, ChunkRun *chunk_run, StudyPart *part, Problem *problem);
    void (*free)(StudyRun *run);
    // What follows is NULL where there is nothing to be done. Before the first member of a chunk:
    Status (*begin)(StudyRun *run, ChunkRun *chunk_run, Problem *problem);
    // Whether the chunk_run's next member is there already.
    bool (*has)(const StudyRun *run, const ChunkRun *chunk_run);
    // After the last member of a chunk, again where there was no room.
    Status (*end)(StudyRun *run, ChunkRun *chunk_run, Problem *problem);
    // When all that was wanted is there: what remains to be told.
    Status (*finish)(StudyRun *run, const StudyTools *tools, Problem *problem);
    void (*drop)(ChunkRun *chunk_run); // what it holds of a chunk
} StudySink;

extern const StudySink gather_rows, gather_fold;

#endif
