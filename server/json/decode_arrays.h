// JSON arrays of numbers and texts into members. Not lists of objects: those are walk.c's. Used by
// walk.c alone.
#ifndef SERVER_JSON_DECODE_ARRAYS_H
#define SERVER_JSON_DECODE_ARRAYS_H

#include "server/json/decode_errors.h"

void decode_no_memory(Decoder *reader);
double decode_number(const json_t *value);

// False, and told, where an array has more than its row allows.
bool decode_allows(Decoder *reader, const json_t *value, const Field *field, size_t has,
                   const char *what, const char *pointer);

// Replace what `target` holds; what cannot be read as an array leaves it as it was.
void decode_reals(Decoder *reader, const json_t *value, const Field *field, Reals *target,
                  const char *pointer);
void decode_rows(Decoder *reader, const json_t *value, const Field *field, Rows *target,
                 const char *pointer);
void decode_texts(Decoder *reader, const json_t *value, const Field *field, Texts *target,
                  const char *pointer);

#endif
