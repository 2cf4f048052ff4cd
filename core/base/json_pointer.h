// A JSON Pointer into a struct by its Field rows: what stands there, and setting it to one value.
// Not a reader of JSON (server/codec) and not a judge of ranges (field.h). Used by studies that run
// a scene with some of its members changed.
#ifndef CORE_BASE_JSON_POINTER_H
#define CORE_BASE_JSON_POINTER_H

#include "core/base/field.h"
#include "core/base/json_scalar.h"

enum { POINTER_SENTENCE = 240 };

// The row of what `pointer` leads to; of an element of an array the array's. NULL, and why, where
// there is nothing, or nothing that one value could replace. `*is_tag`: it is the name of a kind.
const Field *pointer_find(const Field *fields, const void *item, const char *pointer, bool *is_tag,
                          char why[POINTER_SENTENCE]);

// Puts `value` there. A kind's name makes it that kind: members that both kinds have stay, the
// others get defaults. A text in place of an item with a shorthand replaces the whole item; a
// change of one of its members takes that name away, for it would be untrue. STATUS_INVALID with a
// sentence, STATUS_NO_MEMORY.
Status pointer_set(const Field *fields, void *item, const char *pointer, const Scalar *value,
                   char why[POINTER_SENTENCE]);

#endif
