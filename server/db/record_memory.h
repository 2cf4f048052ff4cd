// Samples of records that scenes named of late, or that somebody still holds: each is in memory
// once. Locked. Used by store.c and record_rows.c.
#ifndef SERVER_DB_RECORD_MEMORY_H
#define SERVER_DB_RECORD_MEMORY_H

#include "core/excitation/recorded_motion.h"

typedef struct RecordMemory RecordMemory;

RecordMemory *record_memory_new(void); // NULL without memory
void record_memory_free(RecordMemory *memory);

// A hold for the caller; NULL where it is not there. A digest of NULL: what the name was last known
// to stand for under that generation of the catalogue. Else what it stands for under it.
NamedRecord *record_memory_find(RecordMemory *memory, uint64_t catalog_version, const char *name,
                                const char *digest);
// Keeps it, for the caller too: what comes back, a hold for the caller, is `named` or, where
// another was quicker, the same from before, in place of `named`.
NamedRecord *record_memory_put(RecordMemory *memory, uint64_t catalog_version, NamedRecord *named);

#endif
