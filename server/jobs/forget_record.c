// A record is deleted while no scene that names one is being accepted: those that were are in the
// store by then, and count.
#include "server/db/records.h"
#include "server/jobs/jobs_private.h"

Status jobs_record_delete(JobManager *manager, const char *name, Problem *problem) {
    RecordUses uses;
    db_flush(manager->db); // most of it with the scenes let in
    naming_close(&manager->naming);
    db_flush(manager->db);
    const Status status = db_record_delete(manager->db, name, &uses, problem);
    naming_open(&manager->naming);
    return status;
}
