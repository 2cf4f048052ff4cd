// One number, text or truth value, as it stands in a scene's JSON. Not a reader of JSON
// (server/codec) and not where a value goes (pointer.h). Used by studies that run a scene with some
// of its members changed.
#ifndef CORE_BASE_JSON_SCALAR_H
#define CORE_BASE_JSON_SCALAR_H

#include <stdbool.h>
#include <stdint.h>

// One number, text or truth value. The text is borrowed.
typedef enum ScalarKind { SCALAR_NUMBER, SCALAR_TEXT, SCALAR_FLAG } ScalarKind;
typedef struct Scalar {
    ScalarKind kind;
    double number;
    uint64_t whole; // the number, where it is whole and at least 0; else COUNT_ABSENT
    const char *text;
    bool flag;
} Scalar;

Scalar scalar_number(double number);

// Reads JSON text as codec/ keeps it under FIELD_SCALARS. A text's characters go to `room`, which
// is as long as `json`. False if it is none.
bool scalar_read(const char *json, Scalar *value, char *room);

#endif
