// impactd backup: a copy of a daemon's database, while it runs or without one.
// The copying is server/store/backup.h's. Used by commands.c.
#ifndef SERVER_COMMAND_BACKUP_H
#define SERVER_COMMAND_BACKUP_H

#include "server/command/command.h"

extern const Command command_backup;

#endif
