// The subcommand `import`: a ground motion's file as an excitation to paste into a scene.
// Knows no layout itself. Used by commands.c.
#ifndef SERVER_COMMAND_IMPORT_H
#define SERVER_COMMAND_IMPORT_H

#include "server/command/command.h"

extern const Command command_import;

#endif
