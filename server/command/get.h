// impactd get: what a daemon has of a result, to a file or standard output.
// Computes and converts nothing. Used by commands.c.
#ifndef SERVER_COMMAND_GET_H
#define SERVER_COMMAND_GET_H

#include "server/command/command.h"

extern const Command command_get;

#endif
