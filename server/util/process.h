// This process: its memory and figures, its log, and systemd's protocol for a service of
// Type=notify, which does nothing without systemd (no NOTIFY_SOCKET); other programs that it runs.
#ifndef SERVER_UTIL_PROCESS_H
#define SERVER_UTIL_PROCESS_H

#include <stdint.h>

#include "core/base/status.h"
#include "server/util/bytes.h"

typedef struct ProcessFacts {
    uint64_t resident_bytes, open_files, open_files_most;
    double cpu_seconds;
} ProcessFacts;
void process_facts(ProcessFacts *facts); // 0 where the system does not say

// From here on large blocks that are freed go back to the system, whichever thread freed them.
void process_return_memory(void);
// Gives back whole pages between blocks in use, if enough pages were taken since the last time;
// that is `*taken`, 0 at first.
void process_trim_memory(uint64_t *taken);

// Sends "READY=1", "STOPPING=1", "WATCHDOG=1" and the like; a datagram that is not taken is lost.
void process_notify_systemd(const char *state);
// How often "WATCHDOG=1" is to be sent: half of WATCHDOG_USEC. 0: not asked for.
int64_t process_watchdog_ms(void);

// Log lines on standard error. Texts of clients are escaped, so that they cannot write lines of
// their own: `text` becomes name="..." behind a blank, with control characters, quotes, backslashes
// and bytes beyond ASCII as \\xNN; what is longer than `max` bytes is cut and marked. NULL:
// nothing.
void log_put(Bytes *bytes, const char *name, const char *text, size_t max);
// "impactd: " and the line, in one write. Never waits: a line that finds no room is dropped and
// counted.
void log_write(const Bytes *line);

// Runs a program of the PATH, without a shell, with these arguments (NULL-terminated, the first is
// its name) and waits for its end. What it prints is added to `output`, with its messages.
// STATUS_NOT_FOUND: there is no such program; STATUS_TIMEOUT: it was killed after `seconds`, with
// all that it started; STATUS_IO: it failed, and the problem has the first line that it printed.
Status process_run(const char *const *arguments, double seconds, Bytes *output, Problem *problem);

#endif
