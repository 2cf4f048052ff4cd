// impactd materials: the lab's materials database of a daemon, from a shell.
// The daemon judges and keeps; this asks and shows. Used by commands.c.
#ifndef SERVER_COMMAND_MATERIALS_H
#define SERVER_COMMAND_MATERIALS_H

#include "server/command/command.h"

extern const Command command_materials;

#endif
