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
Status prepare_record(Store *store, Simulation *simulation, Problem *problem);
// Those that a sweep's axes name, and those that it has pinned; nothing of any other inquiry.
// STATUS_LIMIT, with the fault told: they have more samples than one sweep may hold, and not all
// were found.
Status prepare_sweep_records(Store *store, StudyRequest *inquiry, Problem *problem);

// Of a prepared inquiry. The first lets go of the samples, for as long as it only waits; the other
// has them again, as prepare_record would, or finds that each is still what its digest says.
void prepare_records_drop(StudyRequest *inquiry);
Status prepare_records_again(Store *store, StudyRequest *inquiry, Problem *problem);

// What of the records a result of it was made with, a line each: "record:elcentro\n".
void prepare_record_uses(const StudyRequest *inquiry, Bytes *uses);

#endif
