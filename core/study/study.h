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
    const Watch *watch;             // may be NULL
    Workspace *workspace;           // may be NULL
    double (*cpu)(void *context);   // CPU time that this thread has taken [s]
    void *cpu_context;
} StudyTools;

typedef struct StudyKind {
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
    // Fills `answer`, which holds its defaults; the caller frees it, also after a failure. Stops
    // with STATUS_CANCELLED when the watch says so.
    Status (*run)(const Study *study, const Simulation *simulation, const StudyTools *tools,
                  Variant *answer, Problem *problem);
} StudyKind;

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

// Runs a completed study of a completed simulation. The answer is freed by variant_free; NULL after
// a failure.
Status study_run(const Variant *study, const Simulation *simulation, const StudyTools *tools,
                 Variant **answer, Problem *problem);

#endif
