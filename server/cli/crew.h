// A study made by this process alone, its members by as many threads as there are processors. Not
// the daemon's way, whose workers have other jobs too: jobs/study.h. Used by study.c.
#ifndef SERVER_CLI_CREW_H
#define SERVER_CLI_CREW_H

#include "core/study/study.h"

// study_run with many threads: the same bytes. `watch` may be NULL, and is called by one thread at
// a time.
Status crew_run(const Variant *study, const Simulation *simulation, const SimulationLimits *limits,
                const Progress *watch, Variant **answer, Problem *problem);

#endif
