// What the system says of this process, and how it deals with its memory. Not what is in that
// memory: every cache has a budget of its own. Used by api/metrics.c and command/serve.c.
#ifndef SERVER_BASE_PROCESS_H
#define SERVER_BASE_PROCESS_H

#include <stdint.h>

typedef struct ProcessFacts {
    uint64_t resident_bytes, open_files, open_files_most;
    double cpu_seconds;
} ProcessFacts;
void process_facts(ProcessFacts *facts); // 0 where the system does not tell

// From here on what is freed soon goes back to the system, whichever thread it was that freed it.
void process_return_memory(void);

#endif
