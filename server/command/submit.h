// impactd submit: a scene to a daemon. Runs nothing itself. Used by commands.c.
#ifndef SERVER_COMMAND_SUBMIT_H
#define SERVER_COMMAND_SUBMIT_H

#include "server/command/command.h"

extern const Command command_submit;

#endif
