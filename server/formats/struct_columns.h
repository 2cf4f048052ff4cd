// Plain structs as columns of numbers, by their Field rows: a row for each struct. Not JSON and not
// texts: a choice is its number in the list of choices, from 0; what is absent is NAN. Used by
// api/impacts.c.
#ifndef SERVER_FORMATS_STRUCT_COLUMNS_H
#define SERVER_FORMATS_STRUCT_COLUMNS_H

#include "core/base/columns.h"
#include "core/base/field.h"

// Of `count` structs of `size` bytes, one behind the other. The rows are REAL, COUNT and CHOICE;
// others are passed over. Cleared by columns_clear.
Status struct_columns(const Field *fields, const void *items, size_t count, size_t size,
                      Columns *columns, Problem *problem);

#endif
