// What is said of a JSON value that its row cannot take: where, what it is, what would be right,
// what may be meant. Ranges are not judged here but by core/base/field.h. Used by walk.c alone.
#ifndef SERVER_JSON_DECODE_ERRORS_H
#define SERVER_JSON_DECODE_ERRORS_H

#include <jansson.h>

#include "core/base/field.h"

typedef struct Decoder {
    Problem *problem; // NULL: what is wrong is not worth telling
    bool is_faulty, is_out_of_memory;
} Decoder;

// The value as JSON text, cut to fit; "" for what would be long: arrays and objects.
void decode_error_text(const json_t *value, char *target, size_t size);

// Counts a fault that need not be spelt out and returns false: nobody listens, or there are too
// many already.
bool decode_error_has_detail(Decoder *reader);

// A fault about `value` at `pointer`; `unit` and `meant` may be NULL.
void decode_error_value(Decoder *reader, const char *pointer, const json_t *value, const char *unit,
                        const char *meant, const char *format, ...)
    __attribute__((format(printf, 6, 7)));

// "must be a number [kg], is a string"; the unit is the row's, which may be NULL.
void decode_error_type(Decoder *reader, const char *pointer, const json_t *value,
                       const Field *field, const char *wanted);

// "is required, one of a, b, c" of a name that is not there.
void decode_error_unnamed(Decoder *reader, const char *pointer, const char *const *names);

// "must be one of a, b, c, is "x"" of a string, with the nearest of the names, which is returned
// (NULL if none is near).
const char *decode_error_name(Decoder *reader, const char *pointer, const json_t *value,
                              const char *const *names);

#endif
