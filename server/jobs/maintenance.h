// The thread that keeps to the rules of retention, in the background and in small steps. Not the
// rules: those are db/db.h's. Used by cli/serve.c.
#ifndef SERVER_JOBS_MAINTENANCE_H
#define SERVER_JOBS_MAINTENANCE_H

#include "server/db/db.h"
#include "server/jobs/jobs.h"

typedef struct Maintenance Maintenance;

// Borrows store and intake until maintenance_stop.
Status maintenance_start(Db *db, JobManager *manager, const KeepRules *rules, Maintenance **keeper,
                         Problem *problem);
void maintenance_stop(Maintenance *keeper); // NULL is fine

#endif
