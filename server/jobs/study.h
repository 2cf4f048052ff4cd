// A study of the daemon: its scene has run, the workers make its members turn by turn, and the
// worker of the last turn ends its jobs.
#ifndef SERVER_JOBS_STUDY_H
#define SERVER_JOBS_STUDY_H

#include "server/jobs/jobs_private.h"
#include "server/jobs/study_engine.h"
#include "server/jobs/sweep.h"

typedef struct StudyRun {
    struct StudyRun *next; // in the manager's list
    JobManager *manager;
    Task *task;
    StudyWork *work;
    StudyEngine engine;
    SweepRun *sweep; // its rows go to the database; NULL: the parts are folded in memory
    RunResult run_result;
    // Under the manager's lock:
    double member_seconds; // that a member takes, about
    bool is_paused;        // until the database takes its rows
    bool is_pause_logged;
    bool is_failed; // run_result says how
} StudyRun;

// What a worker does for a study in one turn: it begins with a member or a chunk of rows, or ends
// the study.
typedef struct StudyTurn {
    StudyRun *run;
    size_t member;
    SweepChunk *chunk; // NULL: the members are folded
    bool is_end;
} StudyTurn;

// Begins the study of a task whose scene has run, and takes task and run_result unless it fails.
// The caller has a turn of it then, which study_leave ends.
Status study_start(Worker *worker, Task *task, RunResult *run_result, Problem *problem);
void study_leave(Worker *worker, StudyRun *run, Problem *problem);
// Makes members or ends the study. Both may be freed afterwards.
void study_work(Worker *worker, const StudyTurn *turn, Problem *problem);
void study_run_free(StudyRun *run); // NULL is fine

// With the manager's lock held:
// Begins the turn that was taken from the queue. False: there is nothing to do in it.
bool study_take(StudyRun *run, StudyTurn *turn);
// Those that wait for the database try again.
void studies_resume(JobManager *manager);

#endif
