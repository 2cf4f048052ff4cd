// The members of one study, made by several threads and folded in their order: the answer has the
// same bytes for any number of threads. It has no threads of its own: the daemon's workers and the
// threads of study_engine_run take members from it.
#ifndef SERVER_JOBS_STUDY_ENGINE_H
#define SERVER_JOBS_STUDY_ENGINE_H

#include <pthread.h>
#include <stdatomic.h>

#include "core/study/study.h"

//     folded | window: made and waiting, being made, or not begun | not yet to be begun
//
// The window bounds the memory of the parts that wait.
typedef struct StudyEngine {
    StudyWork *work;
    const SimulationLimits *limits;
    Progress progress;      // fraction of the members that are made; called by many threads at once
    atomic_bool is_over;    // all that is wanted is there, or the study ends without it
    atomic_size_t expected; // members
    atomic_uint_fast64_t millionths; // of members, that are made
    // Under the lock:
    pthread_mutex_t lock;
    pthread_cond_t changed; // a part was folded, or the study is over
    StudyPart **parts;      // member i's at i % window
    size_t window, wanted;  // members
    size_t folded, begun;   // of them, the first ones
    bool is_folding;
} StudyEngine;

// `slots` threads make members; 0: the parts are not folded. Borrows all. Closed by
// study_engine_close, also after a failure.
Status study_engine_open(StudyEngine *engine, StudyWork *work, const SimulationLimits *limits,
                         const Progress *progress, size_t slots, Problem *problem);
void study_engine_close(StudyEngine *engine);

// Takes the next member to be made. False: the study is over or, unless `may_wait`, there is none
// before others are folded.
bool study_engine_next(StudyEngine *engine, bool may_wait, size_t *member);
bool study_engine_has_next(StudyEngine *engine);
// Makes a member and folds it. An error ends the study: the caller stops it.
Status study_engine_make(StudyEngine *engine, size_t member, Workspace *workspace,
                         Problem *problem);
// Makes a member only. The part is freed by study_part_free in any case.
Status study_engine_part(StudyEngine *engine, size_t member, Workspace *workspace, StudyPart **part,
                         Problem *problem);
// Folds the part and all that wait behind it, or keeps it until those before it are there. Takes
// the part.
Status study_engine_fold(StudyEngine *engine, size_t member, StudyPart *part, Problem *problem);
// Counts members that were made before.
void study_engine_count(StudyEngine *engine, size_t members);
// Reports progress; false: the study is over or its progress requests a stop.
bool study_engine_continues(StudyEngine *engine);
void study_engine_stop(StudyEngine *engine);

// study_run with as many threads as there are processors. `watch` may be NULL and is called by one
// thread at a time.
Status study_engine_run(const Variant *study, const Simulation *simulation,
                        const SimulationLimits *limits, const Progress *watch, Variant **answer,
                        Problem *problem);

#endif
