// The canonical form: the bytes that stand for a struct in a digest. Rows in table order, absent
// members and notes left out, names written, numbers as little-endian IEEE doubles with -0 as 0.
// Equal meaning, equal bytes. Not for people and never parsed. Used by whoever hashes a scene.
#ifndef CORE_BASE_CANONICAL_H
#define CORE_BASE_CANONICAL_H

#include <stddef.h>

#include "core/base/field.h"

// Hands the canonical bytes to `take`, piece by piece.
void canonical_write(const Field *fields, const void *item,
                     void (*take)(void *context, const void *bytes, size_t size), void *context);

#endif
