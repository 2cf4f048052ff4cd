// Plain structs to JSON text by their Field rows, streamed into Bytes, shortest digits.
// Used by api/, store/ and the commands.
#ifndef SERVER_JSON_ENCODE_H
#define SERVER_JSON_ENCODE_H

#include "core/base/field.h"
#include "server/util/bytes.h"

typedef enum WriteStyle {
    WRITE_REPORT, // absent members are null: results, plans
    WRITE_SCENE,  // absent members are left out: canonical scenes, anything that can be submitted
                  // again
} WriteStyle;

void write_item(Bytes *bytes, const Field *fields, const void *item, WriteStyle style);
// Only "name": value, ... without braces, to put rows beside other members. Returns the number of
// members.
size_t write_members(Bytes *bytes, const Field *fields, const void *item, WriteStyle style);
void write_list(Bytes *bytes, const Field *fields, const void *at, size_t count, size_t size,
                WriteStyle style);

// The HTTP status that stands for a Status; the one table of them.
int write_problem_code(Status status);

// problem+json (RFC 9457). `status_code` is HTTP's; `instance` may be NULL.
void write_problem(Bytes *bytes, const Problem *problem, int status_code, const char *instance);

#endif
