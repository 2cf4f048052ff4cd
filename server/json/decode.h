// From jansson's tree to plain structs, by their rows.
// Not the text's syntax (read.c) and not ranges (core/base/field.h).
// Used by read.c alone.
#ifndef SERVER_JSON_DECODE_H
#define SERVER_JSON_DECODE_H

#include "server/json/decode_errors.h"

// Reads the members of `object` into `item`, which has its defaults, adding what is wrong below
// `pointer`.
void decode_object(Decoder *reader, const json_t *object, const Field *fields, void *item,
                   const char *pointer);

// Reads `value`, which stands at `pointer`, into the member under `field` of `item`.
void decode_value(Decoder *reader, const json_t *value, const Field *field, void *item,
                  const char *pointer);

#endif
