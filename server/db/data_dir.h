// The folder that a daemon keeps its data in, and the lock that keeps a second daemon out of it.
// Not the files in it. Used by store.c.
#ifndef SERVER_DB_DATA_DIR_H
#define SERVER_DB_DATA_DIR_H

#include "core/base/status.h"

// Makes `directory` and what is missing above it, for this user alone.
Status folder_make(const char *directory, Problem *problem);
// Makes `directory` and what is missing above it, for this user alone, and locks
// DIRECTORY/impactd.lock. *lock is to be given to folder_unlock. STATUS_CONFLICT if another process
// has it.
Status folder_lock(const char *directory, int *lock, Problem *problem);
void folder_unlock(int lock); // below 0: nothing

// Makes new names in `directory` durable.
Status folder_sync(const char *directory, Problem *problem);

#endif
