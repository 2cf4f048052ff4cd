// From jansson's tree to plain structs by their Field rows. Private to json/.
#ifndef SERVER_JSON_DECODE_H
#define SERVER_JSON_DECODE_H

#include <jansson.h>

#include "core/base/field.h"

typedef struct Decoder {
    Problem *problem; // NULL: faults are not described
    bool is_faulty, is_out_of_memory;
} Decoder;

// Reads the members of `root` into `item`, which has its defaults. Faults are added at or below
// `pointer`; a root that is not an object is one of them.
void decode_root(Decoder *decoder, const json_t *root, const Field *fields, void *item,
                 const char *pointer);

// Reads `value`, which is at `pointer`, into the member of `item` under `field`.
void decode_value(Decoder *decoder, const json_t *value, const Field *field, void *item,
                  const char *pointer);

#endif
