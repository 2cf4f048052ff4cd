// The thread that keeps to the rules of retention, in the background and in small steps. Not the
// rules: those are db/retention.h's. Used by cli/serve.c.
#ifndef SERVER_JOBS_MAINTENANCE_H
#define SERVER_JOBS_MAINTENANCE_H

#include "server/db/retention.h"
#include "server/jobs/jobs.h"

typedef struct Keeper Keeper;

// Borrows store and intake until keeper_stop.
Status keeper_start(Store *store, Intake *intake, const KeepRules *rules, Keeper **keeper,
                    Problem *problem);
void keeper_stop(Keeper *keeper); // NULL is fine

#endif
