// impactd records: the ground motions that a daemon keeps.
// Not the reader of a file for one scene: that is import.c. Used by commands.c.
#ifndef SERVER_COMMAND_RECORDS_H
#define SERVER_COMMAND_RECORDS_H

#include "server/command/command.h"

extern const Command command_records;

#endif
