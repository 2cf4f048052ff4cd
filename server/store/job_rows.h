// What a transaction over several tables needs of the jobs'. Everything else of them is in store.h.
// Not for the rest of the server. Used by result_rows.c and store.c.
#ifndef SERVER_STORE_JOB_ROWS_H
#define SERVER_STORE_JOB_ROWS_H

#include "server/store/access.h"

extern const RowColumn job_columns[];

// Jobs whole, passing over those that are there already.
Status job_rows_add(Store *store, const void *const *rows, size_t count, Problem *problem);

// Within a transaction: all that changes of a job, or the whole where it is_unsaved.
// STATUS_NOT_FOUND.
Status job_row_save(Database *database, const JobRow *row, Problem *problem);

#endif
