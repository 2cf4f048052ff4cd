// All that a document asks: a scene, and perhaps a study of it. Not a run. Used by whoever reads a
// scene that may come with a study: the jobs room, the API and the commands.
#ifndef CORE_STUDY_STUDY_REQUEST_H
#define CORE_STUDY_STUDY_REQUEST_H

#include "core/study/study.h"

typedef struct StudyRequest {
    Simulation simulation;
    Variant *study; // a Study; NULL: none
} StudyRequest;

// Without a study, to the byte what simulation_fields are: in JSON and in the canonical form.
extern const Field study_request_fields[];

void study_request_clear(StudyRequest *inquiry);

// simulation_complete, and the same for the study: judges and completes it, and refuses one that is
// foretold to take more than ten times limits->steps.
Status study_request_complete(StudyRequest *inquiry, const SimulationLimits *limits,
                              Warnings *warnings, Problem *problem);

// Expected cost of the whole. `problem` may be NULL.
Status study_request_cost(const StudyRequest *inquiry, const SimulationLimits *limits, Cost *cost,
                          Problem *problem);

#endif
