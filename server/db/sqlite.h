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

typedef struct Sqlite Sqlite;
typedef struct sqlite3_stmt Statement;
struct RowColumn;

typedef enum SqliteMode {
    DATABASE_WRITER, // makes the file if it is missing
    DATABASE_READER,
    DATABASE_COPY, // an empty file that nobody else has, to be filled; not durable by itself
} SqliteMode;

// Opens the file at `path`; NULL is a private database in memory.
Status sqlite_open(const char *path, SqliteMode mode, Sqlite **database, Problem *problem);
void sqlite_close(Sqlite *database);

// Brings the schema to the last of `files`, NNN_WHAT.sql counted from 1 without a gap, each step in
// a transaction of its own. STATUS_CONFLICT for a newer schema and for a file that is not
// impactd's.
Status sqlite_migrate(Sqlite *database, const EmbeddedFile *files, Problem *problem);

// Whether the schema is at the last of `files` already (NULL: no matter). STATUS_CONFLICT for a
// newer one.
Status sqlite_is_current(Sqlite *database, const EmbeddedFile *files, bool *is_current,
                         Problem *problem);

// Runs SQL that has neither parameters nor rows; any number of statements.
Status sqlite_execute(Sqlite *database, const char *sql, Problem *problem);
// Writes the first page as it is, to see whether writing works. Within a transaction.
Status sqlite_touch(Sqlite *database, Problem *problem);
// Whether a transaction is open. A failed write may have ended it.
bool sqlite_is_in_transaction(Sqlite *database);

// STATUS_IO where the file was deleted, renamed or replaced since it was opened: what is written to
// it then is found by nobody.
Status sqlite_check_place(Sqlite *database, Problem *problem);

// How many rows this connection has changed, ever.
uint64_t sqlite_rows_changed(Sqlite *database);

// Runs one statement with the members of `item` bound to its parameters. *changes (may be NULL):
// rows changed.
Status sqlite_change(Sqlite *database, const char *sql, const struct RowColumn *columns,
                     const void *item, int *changes, Problem *problem);

// A statement, made once per connection, ready to be stepped through. `sql` is a constant text: it
// is known by its address. To be ended before the next one of the same text.
Status statement_begin(Sqlite *database, const char *sql, const struct RowColumn *columns,
                       const void *item, Statement **statement, Problem *problem);
// *has_row is false at the end.
Status statement_step(Statement *statement, bool *has_row, Problem *problem);
void statement_end(Statement *statement); // NULL is fine

// Bytes `offset` ... of the blob in a column of the row that is `number`: `size`, or as many as it
// has there. The rest of it is not read.
Status sqlite_read_part(Sqlite *database, const char *table, const char *column, int64_t number,
                        size_t offset, size_t size, void *target, Problem *problem);

// Fills `to` with all that is in `from` at this moment, while others write to that. `watch` (NULL:
// nobody) is told how far it is. STATUS_CANCELLED when it wants no more.
Status sqlite_copy(Sqlite *from, Sqlite *to, const Progress *watch, Problem *problem);

// Until NULL is given, `watch` is asked now and then whether a statement that takes long shall go
// on; where not it is STATUS_CANCELLED.
void sqlite_watch(Sqlite *database, const Progress *watch);

#endif
