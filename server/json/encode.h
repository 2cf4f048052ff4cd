// Plain structs to JSON text by their Field rows, with the shortest digits of numbers.
#ifndef SERVER_JSON_ENCODE_H
#define SERVER_JSON_ENCODE_H

#include "core/base/field.h"
#include "server/util/bytes.h"

typedef enum EncodeStyle {
    WRITE_REPORT, // absent members are null: results, plans
    WRITE_SCENE,  // absent members are left out: scenes and other documents that can be sent again
} EncodeStyle;

void encode_item(Bytes *bytes, const Field *fields, const void *item, EncodeStyle style);
// Only "name": value, ... without braces, to combine with other members. Returns their number.
size_t encode_members(Bytes *bytes, const Field *fields, const void *item, EncodeStyle style);
void encode_list(Bytes *bytes, const Field *fields, const void *at, size_t count, size_t size,
                 EncodeStyle style);

// The HTTP status code of a Status.
int encode_problem_code(Status status);

// Problem details (RFC 9457) with the HTTP status code; `instance` may be NULL.
void encode_problem(Bytes *bytes, const Problem *problem, int status_code, const char *instance);

#endif
