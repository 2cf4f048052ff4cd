// impactd compare: two results of a daemon, side by side.
// The daemon compares; this prints. Used by commands.c.
#ifndef SERVER_COMMAND_COMPARE_H
#define SERVER_COMMAND_COMPARE_H

#include "server/command/command.h"

extern const Command command_compare;

#endif
