// What the system says of this process, and how it deals with its memory. Not what is in that
// memory: every cache has a budget of its own. Used by api/metrics.c, cli/serve.c and the
// keeper.
#ifndef SERVER_UTIL_PROCESS_H
#define SERVER_UTIL_PROCESS_H

#include <stdint.h>

typedef struct ProcessFacts {
    uint64_t resident_bytes, open_files, open_files_most;
    double cpu_seconds;
} ProcessFacts;
void process_facts(ProcessFacts *facts); // 0 where the system does not tell

// From here on large blocks that are freed go back to the system, whichever thread freed them.
void process_return_memory(void);
// Gives back whole pages between blocks in use, if enough pages were taken since the last time;
// that is `*taken`, 0 at first.
void process_trim_memory(uint64_t *taken);

#endif
