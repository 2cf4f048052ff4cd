// The one thread that writes: it takes whatever is queued into one transaction, so that many
// callers share the cost of making it durable. Not for reading. Used by store.c.
#ifndef SERVER_DB_WRITER_H
#define SERVER_DB_WRITER_H

#include "core/base/status.h"
#include "server/db/db_private.h"

typedef struct Writer Writer;

// Starts the thread. Where `shared` is not NULL, its connections are the only ones: the writer
// takes one from there for each transaction. Otherwise `database` is the writer's own, borrowed
// until writer_stop.
Status writer_start(Sqlite *database, Db *shared, Writer **writer, Problem *problem);
// Writes what is queued, tells those who wait for it, then ends the thread. NULL is fine. Nobody
// may write any more.
void writer_stop(Writer *writer);

// As db_write, db_enqueue, db_cancel_write and db_expedite.
Status writer_do(Writer *writer, StoreApply *apply, const void *work, Problem *problem);
Status writer_enqueue(Writer *writer, StoreApply *apply, const void *work, size_t size,
                      WritePriority turn, const WriteDone *done, PendingWrite **ticket);
bool writer_cancel(Writer *writer, PendingWrite *ticket);
void writer_expedite(Writer *writer, PendingWrite *ticket);
// Returns when all that was posted before, but what is low, is durable or could not be made so.
void writer_flush(Writer *writer);

const DbStats *writer_totals(const Writer *writer);

#endif
