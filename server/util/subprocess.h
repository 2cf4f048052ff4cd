// Other programs, run without a shell.
#ifndef SERVER_UTIL_SUBPROCESS_H
#define SERVER_UTIL_SUBPROCESS_H

#include "core/base/status.h"
#include "server/util/bytes.h"

// Runs a program of the PATH with these arguments (NULL-terminated, the first is its name) and
// waits for its end. What it prints is added to `output`, with its messages. STATUS_NOT_FOUND:
// there is no such program; STATUS_TIMEOUT: it was killed after `seconds`; STATUS_IO: it failed,
// and the problem has the first line that it printed.
Status subprocess_run(const char *const *arguments, double seconds, Bytes *output,
                      Problem *problem);

#endif
