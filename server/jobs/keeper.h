// The thread that keeps to the rules of retention, in the background and in small steps. Not the
// rules: those are store/retention.h's. Used by command/serve.c.
#ifndef SERVER_JOBS_KEEPER_H
#define SERVER_JOBS_KEEPER_H

#include "server/jobs/intake.h"
#include "server/store/retention.h"

typedef struct Keeper Keeper;

// Borrows store and intake until keeper_stop.
Status keeper_start(Store *store, Intake *intake, const KeepRules *rules, Keeper **keeper,
                    Problem *problem);
void keeper_stop(Keeper *keeper); // NULL is fine

#endif
