// The command "tradeoff": error against CPU time of one scene, without a daemon. Used by
// commands.c.
#ifndef SERVER_COMMAND_TRADEOFF_H
#define SERVER_COMMAND_TRADEOFF_H

#include "server/command/command.h"

extern const Command command_tradeoff;

#endif
