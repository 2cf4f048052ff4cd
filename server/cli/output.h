// A file that appears whole or not at all: written beside its name, renamed at the end, removed
// when the program is interrupted. Not a stream to a terminal.
#ifndef SERVER_CLI_OUTPUT_H
#define SERVER_CLI_OUTPUT_H

#include <stddef.h>

#include "core/base/status.h"

// Opens a new file beside `path`. One output at a time. STATUS_IO, with the reason.
Status output_open(const char *path, Problem *problem);
Status output_write(const void *bytes, size_t size, Problem *problem);
// Makes it durable and gives it its name; removes it if that fails.
Status output_close(Problem *problem);
// Removes what was written so far; fine if nothing is open.
void output_drop(void);

// From here on Ctrl-C and SIGTERM remove the open output and end the program at once with exit code
// 130.
void output_guard(void);

// What those two say on stderr from here on, a whole line; NULL: nothing.
void output_farewell(const char *text);

#endif
