// Names of ground-motion records in scenes become what they stand for: samples that all who named
// them share. Not where records are kept: that is db/records.h. Used by prepare.c,
// submit.c, worker.c, uses.c and sweep_rows.c.
#ifndef SERVER_JOBS_RESOLVE_RECORD_H
#define SERVER_JOBS_RESOLVE_RECORD_H

#include "core/study/study.h"
#include "server/db/db.h"
#include "server/util/bytes.h"

// That of the scene's excitation. STATUS_INVALID: unknown, or no longer the one whose digest stands
// beside the name.
Status resolve_record_motion(Db *db, Simulation *simulation, Problem *problem);
// Those that a sweep's axes name, and those that it has pinned; nothing of any other inquiry.
// STATUS_LIMIT, with the fault told: they have more samples than one sweep may hold, and not all
// were found.
Status resolve_sweep_records(Db *db, StudyRequest *inquiry, Problem *problem);

// Of a prepared inquiry. The first lets go of the samples, for as long as it only waits; the other
// has them again, as resolve_record_motion would, or finds that each is still what its digest says.
void resolve_records_drop(StudyRequest *inquiry);
Status resolve_records_again(Db *db, StudyRequest *inquiry, Problem *problem);

// What of the records a result of it was made with, a line each: "record:elcentro\n".
void resolve_record_uses(const StudyRequest *inquiry, Bytes *uses);

#endif
