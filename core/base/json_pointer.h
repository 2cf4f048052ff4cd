// JSON Pointers (RFC 6901): joining them, and finding and replacing the member of a struct that one
// designates by its Field rows. Ranges are not checked here (fields_validate).
#ifndef CORE_BASE_JSON_POINTER_H
#define CORE_BASE_JSON_POINTER_H

#include "core/base/field.h"

// Writes "pointer/name" with ~ and / escaped; truncated to `size`.
void json_pointer_join(char *target, size_t size, const char *pointer, const char *name);
void json_pointer_index(char *target, size_t size, const char *pointer, size_t index);

// The same by value, as long as a fault's: json_pointer_of("", "dampers").at.
typedef struct JsonPointer {
    char at[sizeof((Fault){0}.pointer)];
} JsonPointer;
JsonPointer json_pointer_of(const char *pointer, const char *name);
JsonPointer json_pointer_at(const char *pointer, size_t index);

// Whether one pointer is the other or above it.
bool json_pointer_overlaps(const char *a, const char *b);

// Adds a fault at "pointer/name", as problem_add and problem_add_real. Returns STATUS_INVALID.
Status json_pointer_fault(Problem *problem, const char *pointer, const char *name,
                          const char *format, ...) __attribute__((format(printf, 4, 5)));
Status json_pointer_fault_real(Problem *problem, const char *pointer, const char *name,
                               double value, const char *unit, const char *format, ...)
    __attribute__((format(printf, 6, 7)));
// Whether there is a fault at "pointer/name" or below.
bool json_pointer_concerns(const Problem *problem, const char *pointer, const char *name);

// One number, text or truth value. The text is borrowed.
typedef enum JsonScalarKind {
    JSON_SCALAR_NUMBER,
    JSON_SCALAR_TEXT,
    JSON_SCALAR_FLAG
} JsonScalarKind;
typedef struct JsonScalar {
    JsonScalarKind kind;
    double number;
    uint64_t whole; // the number if it is an integer of at least 0, else COUNT_ABSENT
    const char *text;
    bool flag;
} JsonScalar;

JsonScalar json_scalar_number(double number);

// Reads a scalar of JSON text as stored under FIELD_SCALARS. The characters of a text are written
// to `buffer`, which must be as long as `json`. False if `json` is not a scalar.
bool json_scalar_read(const char *json, JsonScalar *value, char *buffer);

enum { JSON_POINTER_MESSAGE_MAX = 240 };

// The row of the member at `pointer`; for an element of an array, the array's row. *is_tag is set
// if the pointer designates the name of a kind. NULL and a message if nothing is there, or nothing
// that one scalar can replace.
const Field *json_pointer_find(const Field *fields, const void *item, const char *pointer,
                               bool *is_tag, char message[JSON_POINTER_MESSAGE_MAX]);

// The same of any member, also if only an object or a list can replace it.
const Field *json_pointer_row(const Field *fields, const void *item, const char *pointer,
                              bool *is_tag, char message[JSON_POINTER_MESSAGE_MAX]);

// Sets the member at `pointer` to `value`. Setting the name of a kind keeps members that both kinds
// have and sets the others to defaults. A text for an item with a shorthand replaces the whole
// item. Setting another member of such an item removes its name, which no longer describes the
// item. STATUS_INVALID with a message, or STATUS_NO_MEMORY.
Status json_pointer_set(const Field *fields, void *item, const char *pointer,
                        const JsonScalar *value, char message[JSON_POINTER_MESSAGE_MAX]);

#endif
