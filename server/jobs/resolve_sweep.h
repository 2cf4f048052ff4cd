// A sweep made ready: names on its axes become revisions, materials are pinned, all is judged and
// completed. Not its points (core/study/sweep.h). Used by prepare.c.
#ifndef SERVER_JOBS_RESOLVE_SWEEP_H
#define SERVER_JOBS_RESOLVE_SWEEP_H

#include "core/study/study.h"
#include "server/db/db.h"

// Behind resolve_materials, in place of study_request_complete, of an inquiry whose study is a
// sweep. Adds all faults, those of names among them.
Status resolve_sweep_axes(Db *db, StudyRequest *inquiry, const SimulationLimits *limits,
                          Warnings *warnings, Problem *problem);

#endif
