// impactd serve: the daemon from its settings to its clean end.
// Not the rooms it opens. Used by commands.c.
#ifndef SERVER_COMMAND_SERVE_H
#define SERVER_COMMAND_SERVE_H

#include "server/command/command.h"

extern const Command command_serve;

#endif
