// How the tables' files reach the database: writes go to the one writer thread, reads take a
// connection. Not for the rest of the server, which knows store.h alone. Used inside store/.
#ifndef SERVER_DB_DB_PRIVATE_H
#define SERVER_DB_DB_PRIVATE_H

#include <stdatomic.h>

#include "server/db/db.h"
#include "server/db/row.h"
#include "server/db/sqlite.h"

// Does one write on the writer's thread. May be called again with the same `work` if the first time
// came to nothing.
typedef Status StoreApply(Sqlite *database, const void *work, Problem *problem);

// Has `apply` done within the next transaction and returns when that is durable, or with what went
// wrong; a failed apply leaves no trace.
Status db_write(Db *db, StoreApply *apply, const void *work, Problem *problem);

// The same without waiting: `done` is told. `size` bytes of `work` are copied; 0: it is borrowed
// until then. *ticket (may be NULL) is set before `done` can be told. STATUS_NO_MEMORY: nothing was
// queued.
Status db_enqueue(Db *db, StoreApply *apply, const void *work, size_t size, WritePriority turn,
                  const WriteDone *done, PendingWrite **ticket);

atomic_uint_fast64_t *db_evictions(Db *db); // of series
struct MaterialMemory *db_material_memory(Db *db);
struct RecordMemory *db_record_memory(Db *db);

// A connection for reading, to be put back soon: there are few. Waits for one.
Sqlite *db_take(Db *db);
void db_put(Db *db, Sqlite *database);

// The first row of a query: its columns into `target` (all zero before), *is_found whether there is
// one.
Status db_first(Db *db, const char *sql, const RowColumn *key_columns, const void *key,
                const RowColumn *columns, void *target, bool *is_found, Problem *problem);

// All rows of a query as an array of items of `size` bytes, to be freed by the caller, also on
// failure.
Status db_all(Db *db, const char *sql, const RowColumn *key_columns, const void *key,
              const RowColumn *columns, size_t size, void **at, size_t *count, Problem *problem);

// Within a transaction: `sql` with each of the lines as :name.
Status use_lines_add(Sqlite *database, const char *sql, const char *lines, Problem *problem);

#endif
