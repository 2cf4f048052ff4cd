// The canonical form of a struct: the bytes from which its digest is computed. Rows are in table
// order with their names; absent members and notes are omitted; numbers are little-endian IEEE
// doubles, -0 as 0. Equal meaning gives equal bytes. It is written only, never parsed.
#ifndef CORE_BASE_CANONICAL_H
#define CORE_BASE_CANONICAL_H

#include <stddef.h>

#include "core/base/field.h"

// Calls `append` for each piece of the canonical form of `item`, in order.
void canonical_write(const Field *fields, const void *item,
                     void (*append)(void *context, const void *bytes, size_t size), void *context);

#endif
