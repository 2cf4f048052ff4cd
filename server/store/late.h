// Rows that follow their answer: kept in a small file that is mapped into memory, found at once,
// and written to the database by the hundred. Not for what must outlast the machine. Used by
// store.c, job_rows.c and backup.c.
//
// What may be lost: nothing when the process ends or is killed, for the file's pages are the
// kernel's, and the next start writes them to the database. When the machine itself stops (power,
// kernel), those of about the last 20 ms: that a known answer was given once more, no result and no
// job that computed anything.
#ifndef SERVER_STORE_LATE_H
#define SERVER_STORE_LATE_H

#include "server/store/access.h"

typedef struct Late Late;

enum { LATE_BYTES = 4 << 20 }; // of the file

// Opens or makes the file at `path` (NULL: memory alone), has what an earlier life left in it
// written to `target` by `write`, and starts the thread that does so from now on. `write` gets rows
// that lie in the file; those that are in the database already are passed over. Without room on the
// disk for the file no row is ever taken.
typedef Status LateWrite(void *target, const void *const *rows, size_t count, Problem *problem);
Status late_open(const char *path, void *target, const RowColumn *columns, size_t row_size,
                 LateWrite *write, Late **late, Problem *problem);
// Writes what is there, or leaves it to the next start. NULL is fine.
void late_close(Late *late);

// False where there is no room now: it is to be written the usual way.
bool late_add(Late *late, const void *row);
// A row by its first column, with texts of its own. `row` is all zero before.
bool late_find(Late *late, const char *name, void *row);
// Returns when what was added before is in the database, or could not be written.
void late_flush(Late *late);

// Has the rows in the bytes of such a file written, which another process may have been filling
// while they were read: all that were in it when that began and that were not in the database by
// its end.
Status late_replay(char *bytes, size_t size, void *target, const RowColumn *columns,
                   size_t row_size, LateWrite *write, Problem *problem);

#endif
