// A record is deleted while no scene that names one is being accepted: those that were are in the
// store by then, and count.
#include "server/db/records.h"
#include "server/jobs/jobs_private.h"

Status intake_record_delete(Intake *intake, const char *name, Problem *problem) {
    RecordUses uses;
    store_settle(intake->store); // most of it with the scenes let in
    naming_close(&intake->naming);
    store_settle(intake->store);
    const Status status = store_record_delete(intake->store, name, &uses, problem);
    naming_open(&intake->naming);
    return status;
}
