// The folder that a daemon keeps its data in, and the lock that keeps a second daemon out of it.
// Not the files in it. Used by store.c.
#ifndef SERVER_DB_DATA_DIR_H
#define SERVER_DB_DATA_DIR_H

#include "core/base/status.h"

// Makes `directory` and what is missing above it, for this user alone.
Status data_dir_make(const char *directory, Problem *problem);
// Makes `directory` and what is missing above it, for this user alone, and locks
// DIRECTORY/impactd.lock. *lock is to be given to data_dir_unlock. STATUS_CONFLICT if another
// process has it.
Status data_dir_lock(const char *directory, int *lock, Problem *problem);
void data_dir_unlock(int lock); // below 0: nothing

// Makes new names in `directory` durable.
Status data_dir_sync(const char *directory, Problem *problem);

#endif
