// What a transaction over several tables needs of the jobs'. Everything else of them is in store.h.
// Not for the rest of the server. Used by result_rows.c and job_search.c.
#ifndef SERVER_DB_JOBS_H
#define SERVER_DB_JOBS_H

#include "server/db/db_private.h"

extern const RowColumn job_columns[];

// All but the scene and what is only searched by.
#define JOB_SHORT                                                                                  \
    "id, state, result, is_cached, created_unix_ms, started_unix_ms, finished_unix_ms, queued, "   \
    "run, total, title, problem, warnings, labels, study, client"
// Of a row that is read.
#define JOB_SHOWN JOB_SHORT ", EXISTS (SELECT 1 FROM results WHERE id = jobs.result) AS has_result"
// Within a transaction: all that changes of a job, or the whole where it is_unsaved.
// STATUS_NOT_FOUND.
Status job_row_save(Sqlite *database, const JobRow *row, Problem *problem);

#endif
