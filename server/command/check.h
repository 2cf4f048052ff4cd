// impactd check: judges a scene and shows its plan.
// Runs nothing. Used by commands.c.
#ifndef SERVER_COMMAND_CHECK_H
#define SERVER_COMMAND_CHECK_H

#include "server/command/command.h"

extern const Command command_check;

#endif
