// JSON text to plain structs by their Field rows; every fault with its JSON Pointer, all at once.
// Judges types, unknown and missing names; ranges are core/base/field.h's. jansson lives in this
// room alone. Used by http/body.c, the store and the commands.
#ifndef SERVER_JSON_PARSE_H
#define SERVER_JSON_PARSE_H

#include "core/base/field.h"

enum { JSON_DEPTH_MAX = 32 };

// Reads `text[size]`, which may begin with a byte order mark that counts for no column, into
// `item`, which gets its defaults first (so it may be uninitialised; on failure it is still
// clearable by fields_clear). STATUS_UNREADABLE: not JSON, duplicate keys, NaN, too deep, not
// UTF-8, with line, column and where known a pointer. STATUS_INVALID: the faults, one at "" where
// it is no object at all; what could be read has been read, so that fields_validate and others can
// add theirs to the same problem.
Status json_parse(const char *text, size_t size, const Field *fields, void *item, Problem *problem);

// The same of `count` bytes of the text from `first` on, which are a document by themselves and
// stand at `pointer` of the whole.
Status json_parse_part(const char *text, size_t size, size_t first, size_t count,
                       const char *pointer, const Field *fields, void *item, Problem *problem);

// A text that is one value, into the member of `item` under `field`; `item` has its defaults, and
// the value stands at `pointer`. STATUS_INVALID also where it is not JSON.
Status json_parse_value(const char *text, size_t size, const Field *field, void *item,
                        const char *pointer, Problem *problem);

#endif
