// Plain structs to JSON text by their Field rows, streamed into Bytes, shortest digits.
// Used by api/, store/ and the commands.
#ifndef SERVER_JSON_ENCODE_H
#define SERVER_JSON_ENCODE_H

#include "core/base/field.h"
#include "server/util/bytes.h"

typedef enum EncodeStyle {
    WRITE_REPORT, // absent members are null: results, plans
    WRITE_SCENE,  // absent members are left out: canonical scenes, anything that can be submitted
                  // again
} EncodeStyle;

void encode_item(Bytes *bytes, const Field *fields, const void *item, EncodeStyle style);
// Only "name": value, ... without braces, to put rows beside other members. Returns the number of
// members.
size_t encode_members(Bytes *bytes, const Field *fields, const void *item, EncodeStyle style);
void encode_list(Bytes *bytes, const Field *fields, const void *at, size_t count, size_t size,
                 EncodeStyle style);

// The HTTP status that stands for a Status; the one table of them.
int encode_problem_code(Status status);

// problem+json (RFC 9457). `status_code` is HTTP's; `instance` may be NULL.
void encode_problem(Bytes *bytes, const Problem *problem, int status_code, const char *instance);

#endif
