// impactd watch: follows a daemon's job to its end. Stops nothing. Used by commands.c.
#ifndef SERVER_COMMAND_WATCH_H
#define SERVER_COMMAND_WATCH_H

#include "server/command/command.h"

extern const Command command_watch;

#endif
