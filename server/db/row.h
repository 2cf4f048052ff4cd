// How a struct's members lie in columns: one table per stored struct, walked to bind and to read by
// name. Not core/base/field.h: a stored row has names of fixed size and times in whole
// milliseconds, and no faults to tell a person. Used inside store/ alone.
#ifndef SERVER_DB_ROW_H
#define SERVER_DB_ROW_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "server/db/sqlite.h"

typedef enum ColumnKind {
    COLUMN_END,
    COLUMN_TEXT,    // char *, owned; NULL is NULL
    COLUMN_NAME,    // char[size]; "" is never NULL
    COLUMN_REAL,    // double; NAN is NULL
    COLUMN_INTEGER, // int64_t
    COLUMN_COUNT,   // uint64_t, size_t
    COLUMN_CHOICE,  // int; negative is NULL
    COLUMN_FLAG,    // bool
    COLUMN_BYTES,   // StoredBytes, owned
} ColumnKind;

typedef struct RowColumn {
    const char *name;
    ColumnKind kind;
    size_t offset, size;
} RowColumn;

// clang-format off
#define ROW_COLUMN(Type, member, kind_) \
    {.name = #member, .kind = kind_, .offset = offsetof(Type, member), .size = sizeof(((Type *)0)->member)}
// A member of a nested struct under a column's name of its own.
#define ROW_COLUMN_AS(Type, member, name_, kind_) \
    {.name = name_, .kind = kind_, .offset = offsetof(Type, member), .size = sizeof(((Type *)0)->member)}
#define ROW_END {.kind = COLUMN_END}
// clang-format on

// Which columns a statement's parameters ":name" stand for, found once and kept with the statement.
// All zero at first.
enum { ROW_PARAMETERS = 40 };
typedef struct RowMap {
    const RowColumn *columns; // it holds for these; NULL: for none yet
    int count;
    const RowColumn *of[ROW_PARAMETERS];
} RowMap;

// Binds every parameter ":name" of the statement to the member of that name. `columns` may be NULL
// where it has none. Texts are borrowed until the statement ends.
Status row_bind(Statement *statement, RowMap *map, const RowColumn *columns, const void *item,
                Problem *problem);

// Reads the current row into the members of its columns' names; the others stay as they are. `item`
// holds no texts. On failure it is cleared.
Status row_read(Statement *statement, const RowColumn *columns, void *item, Problem *problem);

// A copy with texts of its own of what the columns name; the rest of `copy`, of `size` bytes, is
// zero. False without memory, and then it is all zero.
bool row_copy(const RowColumn *columns, const void *item, void *copy, size_t size);

// Frees the texts and sets all of `item`, of `size` bytes, to zero.
void row_clear(const RowColumn *columns, void *item, size_t size);

#endif
