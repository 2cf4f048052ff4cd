// One line on standard error for what an operator should know. Texts of others come in escaped, so
// that nobody writes a line of their own. Not counters (tally.h). Used by http/access.c, jobs/
// and cli/serve.c.
#ifndef SERVER_UTIL_LOG_H
#define SERVER_UTIL_LOG_H

#include "server/util/bytes.h"

// `text` as name="..." with a blank before it: control characters, quotes, backslashes and bytes
// beyond ASCII become \xNN, and what is longer than `most` bytes is cut and marked. NULL: nothing.
void log_put(Bytes *bytes, const char *name, const char *text, size_t most);
// "impactd: " and the line, in one write. Never waits: a line that finds no room is dropped and
// counted.
void log_write(const Bytes *line);

#endif
