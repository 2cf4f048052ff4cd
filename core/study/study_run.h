// One run of a study: the completed scene with something changed and nothing sampled that nobody
// looks at. Not the study. Used by the studies whose runs are scenes.
#ifndef CORE_STUDY_STUDY_RUN_H
#define CORE_STUDY_STUDY_RUN_H

#include "core/study/study.h"

// The scene without sampled channels; spectra and ledger as there. `target` is cleared by
// simulation_clear in any case.
Status member_copy(const Simulation *simulation, Simulation *target, Problem *problem);

// Where an error is aimed at, each run could take another way to it, and runs would differ by their
// ways: takes the solver that is chosen without a target.
Status member_settle(Simulation *target, Problem *problem);

// Whether a fault of one run ends the whole study.
static inline bool member_ends_all(Status status) {
    return status == STATUS_CANCELLED || status == STATUS_NO_MEMORY;
}

// What a fault says, with its place, as a text of the caller's. NULL without memory.
char *member_why(const Problem *fault);

// All of a run that is folded. All zero is empty.
typedef struct MemberPart {
    Status status;
    char *why;    // it failed; NULL: it did not
    double steps; // solver steps; NAN where it failed, as all of the summary is absent
    Summary summary;
    Spectrum spectrum;
} MemberPart;

// Runs a member. One that fails is a part too, unless that ends all. `part` is cleared by
// member_clear in any case; `problem` is not NULL.
Status member_run(const Simulation *member, const StudyTools *tools, MemberPart *part,
                  Problem *problem);
void member_clear(MemberPart *part);

#endif
