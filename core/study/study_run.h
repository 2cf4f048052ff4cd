// One run of a study: the completed scene with something changed and nothing sampled that nobody
// looks at. Not the study. Used by the studies whose runs are scenes.
#ifndef CORE_STUDY_STUDY_RUN_H
#define CORE_STUDY_STUDY_RUN_H

#include "core/study/study.h"

// The scene without sampled channels; spectra and ledger as there. `target` is cleared by
// simulation_clear in any case.
Status study_run_copy(const Simulation *simulation, Simulation *target, Problem *problem);

// Where an error is aimed at, each run could take another way to it, and runs would differ by their
// ways: takes the solver that is chosen without a target.
Status study_run_fix_solver(Simulation *target, Problem *problem);

// Whether contacts of the simulation have a force.
bool study_run_has_force(const Simulation *simulation);

// Whether a fault of one run ends the whole study.
static inline bool study_run_ends_all(Status status) {
    return status == STATUS_CANCELLED || status == STATUS_NO_MEMORY;
}

// What a fault says, with its place, as a text of the caller's. NULL without memory.
char *study_run_why(const Problem *fault);

// All of a run that is folded. All zero is empty.
typedef struct StudyPart {
    Status status;
    char *why;    // it failed; NULL: it did not
    double steps; // solver steps; NAN where it failed, as all of the summary is absent
    Summary summary;
    Spectrum spectrum;
} StudyPart;

// Runs a member. One that fails is a part too, unless that ends all. `part` is cleared by
// study_run_clear in any case; `problem` is not NULL.
Status study_run_make(const Simulation *member, const StudyTools *tools, StudyPart *part,
                      Problem *problem);
void study_run_clear(StudyPart *part);

#endif
