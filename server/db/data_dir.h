// The folder of a daemon's data, and the lock that keeps a second daemon out of it.
#ifndef SERVER_DB_DATA_DIR_H
#define SERVER_DB_DATA_DIR_H

#include "core/base/status.h"

// Makes `directory` and what is missing above it, for this user alone. STATUS_FORBIDDEN where every
// user may replace files in it.
Status data_dir_make(const char *directory, Problem *problem);
// The same, and locks it. *lock is to be given to data_dir_unlock. STATUS_CONFLICT if another
// process has it.
Status data_dir_lock(const char *directory, int *lock, Problem *problem);
void data_dir_unlock(int lock); // below 0: nothing

// Makes new names in `directory` durable.
Status data_dir_sync(const char *directory, Problem *problem);

#endif
