// The command "ensemble": many seeds of one scene, without a daemon. Used by commands.c.
#ifndef SERVER_COMMAND_ENSEMBLE_H
#define SERVER_COMMAND_ENSEMBLE_H

#include "server/command/command.h"

extern const Command command_ensemble;

#endif
