// impactd run: one scene, here and now, without a daemon.
// Not a client: nothing is stored or cached. Used by commands.c.
#ifndef SERVER_COMMAND_RUN_H
#define SERVER_COMMAND_RUN_H

#include "server/command/command.h"

extern const Command command_run;

#endif
