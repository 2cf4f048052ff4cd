// A stored row as bytes, by its columns: how it lies in a file beside the database until it is in
// there. Not a format for others: a program with other columns reads none of it (pack_layout).
// Used by late.c.
#ifndef SERVER_STORE_PACK_H
#define SERVER_STORE_PACK_H

#include <stdbool.h>
#include <stdint.h>

#include "server/store/row.h"

// Bytes written, 0 where `room` is too small.
size_t pack_row(const RowColumn *columns, const void *item, char *target, size_t room);
// Into `item`, all zero before; its texts lie in the packed bytes. False for what is no such row.
bool pack_read(const RowColumn *columns, const char *at, size_t size, void *item);
// Gives `item` texts of its own. False without memory, and then it has none.
bool pack_own(const RowColumn *columns, void *item);
// Tells one set of columns from another.
uint32_t pack_layout(const RowColumn *columns);

#endif
