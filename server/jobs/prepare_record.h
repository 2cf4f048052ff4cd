// Names of ground-motion records in scenes become what they stand for: samples that all who named
// them share. Not where records are kept: that is store/record_rows.h. Used by prepare.c, uses.c
// and sweep_rows.c.
#ifndef SERVER_JOBS_PREPARE_RECORD_H
#define SERVER_JOBS_PREPARE_RECORD_H

#include "core/study/inquiry.h"
#include "server/base/bytes.h"
#include "server/store/store.h"

// That of the scene's excitation. STATUS_INVALID: unknown, or no longer the one whose digest stands
// beside the name.
Status prepare_record(Store *store, Simulation *simulation, Problem *problem);
// Those that a sweep's axes name, and those that it has pinned; nothing of any other inquiry.
Status prepare_sweep_records(Store *store, Inquiry *inquiry, Problem *problem);

// What of the records a result of it was made with, a line each: "record:elcentro\n".
void prepare_record_uses(const Inquiry *inquiry, Bytes *uses);

#endif
