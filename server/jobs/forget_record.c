// A record is deleted while no scene that names one is being accepted: those that were are in the
// store by then, and count.
#include "server/db/records.h"
#include "server/jobs/jobs_private.h"

Status jobs_record_delete(JobManager *intake, const char *name, Problem *problem) {
    RecordUses uses;
    db_flush(intake->store); // most of it with the scenes let in
    naming_close(&intake->naming);
    db_flush(intake->store);
    const Status status = db_record_delete(intake->store, name, &uses, problem);
    naming_open(&intake->naming);
    return status;
}
