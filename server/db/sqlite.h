// One connection to SQLite: opening, settings, statements kept ready, transactions, migration.
// Not thread-safe and not the tables: each connection belongs to one thread at a time (store.c),
// and the SQL of the tables is in *_rows.c. Used inside store/ alone.
#ifndef SERVER_DB_SQLITE_H
#define SERVER_DB_SQLITE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/progress.h"
#include "core/base/status.h"
#include "server/util/embedded.h"

typedef struct Database Database;
typedef struct sqlite3_stmt Statement;
struct RowColumn;

typedef enum DatabaseMode {
    DATABASE_WRITER, // makes the file if it is missing
    DATABASE_READER,
    DATABASE_COPY, // an empty file that nobody else has, to be filled; not durable by itself
} DatabaseMode;

// Opens the file at `path`; NULL is a private database in memory.
Status database_open(const char *path, DatabaseMode mode, Database **database, Problem *problem);
void database_close(Database *database);

// Brings the schema to the last of `files`, NNN_WHAT.sql counted from 1 without a gap, each step in
// a transaction of its own. STATUS_CONFLICT for a newer schema and for a file that is not
// impactd's.
Status database_migrate(Database *database, const EmbeddedFile *files, Problem *problem);

// Whether the schema is at the last of `files` already (NULL: no matter). STATUS_CONFLICT for a
// newer one.
Status database_is_current(Database *database, const EmbeddedFile *files, bool *is_current,
                           Problem *problem);

// Runs SQL that has neither parameters nor rows; any number of statements.
Status database_execute(Database *database, const char *sql, Problem *problem);
// Writes the first page as it is, to see whether writing works. Within a transaction.
Status database_touch(Database *database, Problem *problem);
// Whether a transaction is open. A failed write may have ended it.
bool database_is_in_transaction(Database *database);

// STATUS_IO where the file was deleted, renamed or replaced since it was opened: what is written to
// it then is found by nobody.
Status database_check_place(Database *database, Problem *problem);

// How many rows this connection has changed, ever.
uint64_t database_rows_changed(Database *database);

// Runs one statement with the members of `item` bound to its parameters. *changes (may be NULL):
// rows changed.
Status database_change(Database *database, const char *sql, const struct RowColumn *columns,
                       const void *item, int *changes, Problem *problem);

// A statement, made once per connection, ready to be stepped through. `sql` is a constant text: it
// is known by its address. To be ended before the next one of the same text.
Status statement_begin(Database *database, const char *sql, const struct RowColumn *columns,
                       const void *item, Statement **statement, Problem *problem);
// *has_row is false at the end.
Status statement_step(Statement *statement, bool *has_row, Problem *problem);
void statement_end(Statement *statement); // NULL is fine

// Bytes `offset` ... of the blob in a column of the row that is `number`: `size`, or as many as it
// has there. The rest of it is not read.
Status database_read_part(Database *database, const char *table, const char *column, int64_t number,
                          size_t offset, size_t size, void *target, Problem *problem);

// Fills `to` with all that is in `from` at this moment, while others write to that. `watch` (NULL:
// nobody) is told how far it is. STATUS_CANCELLED when it wants no more.
Status database_copy(Database *from, Database *to, const Progress *watch, Problem *problem);

// Until NULL is given, `watch` is asked now and then whether a statement that takes long shall go
// on; where not it is STATUS_CANCELLED.
void database_watch(Database *database, const Progress *watch);

#endif
