// A connection to SQLite, and how structs are stored: one table of columns per struct, from which
// INSERT, SELECT and UPDATE are generated and by which members are bound, read, copied and cleared.
#ifndef SERVER_DB_SQLITE_H
#define SERVER_DB_SQLITE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/progress.h"
#include "core/base/status.h"
#include "server/util/embedded.h"

typedef struct Sqlite Sqlite;

typedef struct StoredBytes {
    void *at;
    size_t size;
} StoredBytes;

typedef enum ColumnKind {
    COLUMN_TEXT,    // char *, owned; NULL is NULL
    COLUMN_NAME,    // char[size]; "" is never NULL
    COLUMN_REAL,    // double; NAN is NULL
    COLUMN_INTEGER, // int64_t
    COLUMN_COUNT,   // uint64_t
    COLUMN_CHOICE,  // int; negative is NULL
    COLUMN_FLAG,    // bool
    COLUMN_BYTES,   // StoredBytes, owned
    COLUMN_NONE,    // no member: written by an expression, not read
} ColumnKind;

enum {
    COLUMN_LONG = 1,    // not part of {head}
    COLUMN_MUTABLE = 2, // part of {set}
    // Its CRC-32 is stored in the row's column `checks` and compared whenever both are read. Where
    // they differ, or there is none, the row cannot be read, unless it has a member `is_damaged`,
    // which is set then.
    COLUMN_CHECKED = 4,
    COLUMN_ID = 8,    // names the row in reports of damage; never NULL
    COLUMN_KEPT = 16, // {set} leaves it as it is where the member is NULL
    // Like COLUMN_CHECKED, never NULL, never changed, and stored behind those: rows of earlier
    // versions lack it. For names, so that a damaged index does not lead to the row of another one
    // unnoticed.
    COLUMN_BOUND = 32,
};

// One member of a stored struct.
typedef struct SqlColumn {
    const char *name;
    ColumnKind kind;
    int flags;
    size_t offset, size;
    const char *read;  // the expression that it is read by; it is never written. NULL: a column
    const char *write; // the expression that {insert} writes; NULL: the member
} SqlColumn;

// The kind follows from the member's type; a type that is none of these does not compile: the array
// has a negative size.
// clang-format off
#define COLUMN_KIND(Type, member) _Generic(&((Type *)0)->member, \
    char **: COLUMN_TEXT, const char **: COLUMN_TEXT, double *: COLUMN_REAL, int64_t *: COLUMN_INTEGER, \
    uint64_t *: COLUMN_COUNT, int *: COLUMN_CHOICE, bool *: COLUMN_FLAG, StoredBytes *: COLUMN_BYTES, \
    default: _Generic(((Type *)0)->member, char *: COLUMN_NAME, default: -1))
#define COLUMN_OF(Type, member, name_, flags_, read_) \
    {.name = name_, .kind = COLUMN_KIND(Type, member), .flags = flags_, \
     .offset = offsetof(Type, member) + 0 * sizeof(char[COLUMN_KIND(Type, member) >= 0 ? 1 : -1]), \
     .size = sizeof(((Type *)0)->member), .read = read_}
#define COLUMN(Type, member) COLUMN_OF(Type, member, #member, 0, NULL)
#define COLUMN_WITH(Type, member, flags) COLUMN_OF(Type, member, #member, flags, NULL)
#define COLUMN_READ(Type, member, read) COLUMN_OF(Type, member, #member, 0, read)
#define COLUMN_WRITE(name_, write_) {.name = name_, .kind = COLUMN_NONE, .write = write_}
#define COLUMN_END {.name = NULL}
// clang-format on

typedef enum SqliteMode {
    DATABASE_WRITER, // creates the file if it is missing
    DATABASE_READER,
    DATABASE_COPY, // an empty file of this process alone, to be filled; not durable by itself
} SqliteMode;

// Opens the file at `path`; NULL is a private database in memory. Each connection is used by one
// thread at a time.
Status sqlite_open(const char *path, SqliteMode mode, Sqlite **database, Problem *problem);
void sqlite_close(Sqlite *database);

// A table whose rows have checksums.
typedef struct CheckedTable {
    const char *name, *sql; // "SELECT {checked} FROM name"
    const SqlColumn *columns;
    size_t size; // of the struct
} CheckedTable;
#define CHECKED_TABLE(name_, columns_, Type) CHECKED_TABLE_WITH(name_, columns_, Type, "")
// `more`: further columns, from other tables.
#define CHECKED_TABLE_WITH(name_, columns_, Type, more)                                            \
    {                                                                                              \
        .name = name_, .sql = "SELECT {checked}" more " FROM " name_, .columns = columns_,         \
        .size = sizeof(Type)                                                                       \
    }

// Brings the schema to the last of `files`, each a transaction of its own; the schema's version is
// the number of files applied. STATUS_CONFLICT for any other version and for a file that is not
// impactd's. The rows that the first file inserts into `tables`, which end with NULL, get their
// checksums; `tables` may be NULL.
Status sqlite_migrate(Sqlite *database, const EmbeddedFile *files,
                      const CheckedTable *const *tables, Problem *problem);
// Whether the schema is at the last of `files` already. STATUS_CONFLICT as above.
Status sqlite_is_current(Sqlite *database, const EmbeddedFile *files, bool *is_current,
                         Problem *problem);

// Runs SQL that has neither parameters nor rows; any number of statements.
Status sqlite_execute(Sqlite *database, const char *sql, Problem *problem);
// Prepares texts without parameters for sqlite_change, up to NULL: without memory later on, they
// still run.
Status sqlite_prepare(Sqlite *database, const char *const *texts, Problem *problem);
// Writes the first page as it is, to see whether writing works. Within a transaction.
Status sqlite_touch(Sqlite *database, Problem *problem);
// Whether a transaction is open. A failed write may have ended it.
bool sqlite_is_in_transaction(Sqlite *database);
// STATUS_IO where the file, its log or the index of it was deleted, renamed or replaced since it
// was opened: what is written to them then is lost.
Status sqlite_check_place(Sqlite *database, Problem *problem);
// How many rows this connection has changed since it was opened.
uint64_t sqlite_rows_changed(Sqlite *database);

// In the functions below `sql` is a constant text, which is prepared once per connection, found by
// its address and always used with the same tables. Every parameter ":name" is bound to the member
// of `item` that `keys` calls so; `keys` may be NULL where there are none. Rows are read into the
// members of the `columns` that the result has; the others stay as they are. Generated from the
// tables, which are the same each time:
//
//     {insert}    (a, b) VALUES (:a, :b)    all of `keys` but those with `read`, with their checks
//     {set}       a = :a, b = :b            those that are COLUMN_MUTABLE, with their checks; the
//                                           checked columns of `keys` are the first of the row's
//     {columns}   a, b                      all of `columns`, with their checks
//     {head}      a, b                      the same without those that are COLUMN_LONG
//     {checked}   number, a, b              those that are COLUMN_CHECKED, _BOUND or _ID, with
//                                           their checks

// Runs one statement without rows. *changes (may be NULL): rows changed.
Status sqlite_change(Sqlite *database, const char *sql, const SqlColumn *keys, const void *item,
                     int *changes, Problem *problem);
// The first row of a query into `target`; *is_found (may be NULL): whether there is one.
Status sqlite_first(Sqlite *database, const char *sql, const SqlColumn *keys, const void *item,
                    const SqlColumn *columns, void *target, bool *is_found, Problem *problem);
// All rows as a typed list of items of `size` bytes; on failure it is empty.
Status sqlite_list(Sqlite *database, const char *sql, const SqlColumn *keys, const void *item,
                   const SqlColumn *columns, size_t size, void *list, Problem *problem);

enum { DAMAGE_SIZE = 320 }; // of a sentence about a damaged row
// What was found in a table; `report` gets a sentence for each damaged row. NULL: the first one is
// STATUS_INTERNAL, as where it is read.
typedef struct TableCheck {
    const SqlColumn *keys; // of the parameters; NULL: there are none
    const void *key;
    bool stores; // the checksums are computed and stored, not compared
    uint64_t rows, damaged;
    void (*report)(void *context, const char *damage);
    void *context;
} TableCheck;
// Compares every row that table->sql selects with its checksums.
Status sqlite_check_table(Sqlite *database, const CheckedTable *table, TableCheck *check,
                          Problem *problem);

// Frees what the columns own and sets all of `item`, of `size` bytes, to zero.
void row_clear(const SqlColumn *columns, void *item, size_t size);
void rows_clear(const SqlColumn *columns, size_t size, void *list);

// Bytes `offset` ... of the blob in a column of the row that is `number`: `size`, or as many as it
// has there. The rest of it is not read.
Status sqlite_read_part(Sqlite *database, const char *table, const char *column, int64_t number,
                        size_t offset, size_t size, void *target, Problem *problem);

// Fills `to` with all that is in `from` at this moment, while others write to that. `watch` (NULL
// is allowed) gets the progress; STATUS_CANCELLED when it stops.
Status sqlite_copy(Sqlite *from, Sqlite *to, const Progress *watch, Problem *problem);
// SQLite's check of the whole file, indices included. `report` gets what it finds, at most a
// hundred sentences; *count is their number.
Status sqlite_check(Sqlite *database, void (*report)(void *context, const char *damage),
                    void *context, uint64_t *count, Problem *problem);
// Whether a read failed on this connection: what seems damaged may be whole.
bool sqlite_could_not_read(Sqlite *database);
// Until NULL is given, long statements ask `watch` whether to continue; STATUS_CANCELLED if not.
void sqlite_watch(Sqlite *database, const Progress *watch);

#endif
