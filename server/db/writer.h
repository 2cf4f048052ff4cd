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
Status writer_start(Database *database, Store *shared, Writer **writer, Problem *problem);
// Writes what is queued, tells those who wait for it, then ends the thread. NULL is fine. Nobody
// may write any more.
void writer_stop(Writer *writer);

// As store_write, store_post, store_withdraw and store_hurry.
Status writer_do(Writer *writer, StoreApply *apply, const void *work, Problem *problem);
Status writer_post(Writer *writer, StoreApply *apply, const void *work, size_t size, StoreTurn turn,
                   const StoreDone *done, StoreTicket **ticket);
bool writer_withdraw(Writer *writer, StoreTicket *ticket);
void writer_hurry(Writer *writer, StoreTicket *ticket);
// Returns when all that was posted before, but what is low, is durable or could not be made so.
void writer_settle(Writer *writer);

const StoreTotals *writer_totals(const Writer *writer);

#endif
