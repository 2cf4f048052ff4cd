// What ONE study is; studies.c lists all. A study asks one completed scene many ways and folds what
// comes of it into an answer. Not a run of a scene: that is simulation/. Used by inquiry.c, by the
// jobs room and by the commands.
#ifndef CORE_STUDY_STUDY_H
#define CORE_STUDY_STUDY_H

#include "core/simulation/simulation.h"

// First member of every study's struct: what was asked. The scene's "study" object.
typedef struct Study {
    Variant variant; // kind is a StudyKind's
} Study;

// What a study is given to work with.
typedef struct StudyTools {
    const SimulationLimits *limits; // of every run, and of the steps of all; may be NULL
    const Progress *progress;       // may be NULL
    Workspace *workspace;           // may be NULL
    double (*cpu)(void *context);   // CPU time that this thread has taken [s]
    void *cpu_context;
} StudyTools;

typedef struct StudyKind StudyKind;

// A study made ready for its members, first member of each kind's own struct: runs that know
// nothing of one another, made by any threads in any order, and folded in theirs.
typedef struct StudyWork {
    const StudyKind *kind;
    size_t members;    // at most
    size_t wanted;     // these first ones: with the last of them folded it is at its end
    size_t expected;   // so many will be wanted, as far as can be told
    size_t bytes;      // that it holds, about
    size_t part_bytes; // and each part, at most
} StudyWork;

typedef struct StudyMembers {
    // Makes ready: judges, runs what all members stand beside, fills what is known of `answer`,
    // which it borrows with `study` and `simulation`. *work is freed by `free`, NULL after a
    // failure.
    Status (*begin)(const Study *study, const Simulation *simulation, const StudyTools *tools,
                    Variant *answer, StudyWork **work, Problem *problem);
    // Makes a member, from 0, beside others: `work` does not change. A member that fails is a part
    // too; the status tells what ends the study. *part is freed by `drop`. `problem` is not NULL.
    Status (*make)(const StudyWork *work, size_t member, const StudyTools *tools, void **part,
                   Problem *problem);
    // Takes what it needs out of a part, member after member. May change what is wanted.
    Status (*fold)(StudyWork *work, size_t member, void *part, Problem *problem);
    void (*drop)(void *part); // NULL is fine, as is one that could not be made
    // All that were wanted are folded: what remains to be told. NULL: nothing.
    Status (*end)(StudyWork *work, const StudyTools *tools, Problem *problem);
    void (*free)(StudyWork *work);
} StudyMembers;

#define STUDY_BEGUN 0.1 // of its progress, until members are made

struct StudyKind {
    Kind kind;
    const Kind *answer; // of the same name; its value struct begins with a Variant
    const char *lessen; // what makes it shorter: "ask for fewer runs"
    bool is_measured;   // its answer holds CPU times, which another time will differ
    double most_runs;   // it may take as long as so many runs may; 0: ten
    // Judges what rows cannot say and completes defaults, below "/study", for a completed scene.
    Status (*complete)(Study *study, const Simulation *simulation, const SimulationLimits *limits,
                       Problem *problem);
    // What it will cost, in solver steps.
    Status (*cost)(const Study *study, const Simulation *simulation, const SimulationLimits *limits,
                   double *steps, Problem *problem);
    const StudyMembers *members; // NULL: it is made by `run`, on one thread
    // Fills `answer`, which holds its defaults; the caller frees it, also after a failure. Stops
    // with STATUS_CANCELLED when the progress says so.
    Status (*run)(const Study *study, const Simulation *simulation, const StudyTools *tools,
                  Variant *answer, Problem *problem);
};

extern const StudyKind *const studies[]; // NULL-terminated
extern const KindTable study_kinds, study_answer_kinds;
extern const StudyKind study_tradeoff, study_ensemble, study_compare, study_sensitivity,
    study_sweep;

static inline const StudyKind *study_kind(const Variant *study) {
    return (const StudyKind *)(const void *)study->kind;
}

// An answer on its own, as it is kept: {"study": {"kind": ...}}. Cleared by fields_clear.
typedef struct StudyAnswer {
    Variant *study;
} StudyAnswer;
extern const Field study_answer_fields[];

// Runs a completed study of a completed simulation, member after member. The answer is freed by
// variant_free; NULL after a failure. `problem` is empty.
Status study_run(const Variant *study, const Simulation *simulation, const StudyTools *tools,
                 Variant **answer, Problem *problem);

// The same in steps, for those who make members side by side: until there is work to share out. The
// work borrows all three, the answer too. NULL both after a failure.
Status study_begin(const Variant *study, const Simulation *simulation, const StudyTools *tools,
                   Variant **answer, StudyWork **work, Problem *problem);
Status study_end(StudyWork *work, const StudyTools *tools, Problem *problem);
void study_free(StudyWork *work); // NULL is fine

// All that a document asks: a scene, and perhaps a study of it.
typedef struct StudyRequest {
    Simulation simulation;
    Variant *study; // a Study; NULL: none
} StudyRequest;

// Without a study, to the byte what simulation_fields are: in JSON and in the canonical form.
extern const Field study_request_fields[];

void study_request_clear(StudyRequest *request);

// simulation_complete, and the same for the study: validates and completes it, and refuses one
// whose estimated cost is above its limit, a multiple of limits->steps.
Status study_request_complete(StudyRequest *request, const SimulationLimits *limits,
                              Warnings *warnings, Problem *problem);

// Estimated cost of the whole. `problem` may be NULL.
Status study_request_cost(const StudyRequest *request, const SimulationLimits *limits, Cost *cost,
                          Problem *problem);

#endif
