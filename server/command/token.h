// impactd token: makes, lists and revokes access tokens, beside a running daemon or without one.
// Used by commands.c.
#ifndef SERVER_COMMAND_TOKEN_H
#define SERVER_COMMAND_TOKEN_H

#include "server/command/command.h"

extern const Command command_token;

#endif
