// An outline as aligned text on standard output: names and values, tables with heads.
// Reads no document (codec/outline.h). Used by the commands that show what a daemon tells.
#ifndef SERVER_COMMAND_SHEET_H
#define SERVER_COMMAND_SHEET_H

#include "server/codec/outline.h"

// Control characters do not reach the terminal: the cells are changed.
void sheet_print(Outline *outline);

#endif
