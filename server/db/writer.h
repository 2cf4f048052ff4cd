// The thread that writes: all that is queued becomes one transaction (group commit).
#ifndef SERVER_DB_WRITER_H
#define SERVER_DB_WRITER_H

#include "server/db/db_private.h"

typedef struct Writer Writer;

// Starts the thread. Where `shared` is not NULL, its connections are the only ones: the writer
// takes one from there for each transaction. Otherwise `database` is the writer's own, borrowed
// until writer_stop.
Status writer_start(Sqlite *database, Db *shared, Writer **writer, Problem *problem);
// Writes what is queued, then ends the thread. NULL is accepted. Nothing may be enqueued any more.
void writer_stop(Writer *writer);

// As db_write and db_enqueue.
Status writer_do(Writer *writer, StoreApply *apply, const void *work, Problem *problem);
void writer_enqueue(Writer *writer, StoreApply *apply, const void *work, WritePriority priority,
                    PendingWrite *write);

const DbStats *writer_totals(const Writer *writer);

#endif
