// What the system says of this process. Used by api/metrics.c.
#ifndef SERVER_BASE_PROCESS_H
#define SERVER_BASE_PROCESS_H

#include <stdint.h>

typedef struct ProcessFacts {
    uint64_t resident_bytes, open_files, open_files_most;
    double cpu_seconds;
} ProcessFacts;
void process_facts(ProcessFacts *facts); // 0 where the system does not tell

#endif
