// impactd cancel: stops a daemon's job. Used by commands.c.
// Not an end to a daemon: that is SIGTERM.
#ifndef SERVER_COMMAND_CANCEL_H
#define SERVER_COMMAND_CANCEL_H

#include "server/command/command.h"

extern const Command command_cancel;

#endif
