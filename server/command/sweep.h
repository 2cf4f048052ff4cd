// The command `impactd sweep`: one scene at many points. Not the study itself
// (core/study/sweep.h) and not the daemon's, which has many workers. Used by commands.c.
#ifndef SERVER_COMMAND_SWEEP_H
#define SERVER_COMMAND_SWEEP_H

#include "server/command/command.h"

extern const Command command_sweep;

#endif
