// JSON text to plain structs by their Field rows: all faults at once, each with its JSON Pointer.
// Types, unknown and missing names are checked here, ranges by core/base/field.h.
#ifndef SERVER_JSON_PARSE_H
#define SERVER_JSON_PARSE_H

#include "core/base/field.h"

enum {
    JSON_DEPTH_MAX = 32,
    // A parsed container takes some hundred bytes, its text two; a table of a million keys takes
    // seconds.
    JSON_CONTAINERS_MAX = 1 << 17, // objects and arrays of a document
    JSON_MEMBERS_MAX = 1 << 12,    // of one object
};

// Reads `text[size]`, which may begin with a byte order mark (it counts as no column), into `item`.
// The item gets its defaults first, so that it may be uninitialised; it is cleared by fields_clear
// in any case. STATUS_UNREADABLE: not JSON, duplicate keys, NaN, too deep, not UTF-8, with line,
// column and, where known, a pointer. STATUS_INVALID: faults; everything readable has been read, so
// that fields_validate can add its faults to the same problem.
Status json_parse(const char *text, size_t size, const Field *fields, void *item, Problem *problem);

// The same of text[first ... first + count - 1], a document at `pointer` of the whole text, without
// a byte order mark.
Status json_parse_part(const char *text, size_t first, size_t count, const char *pointer,
                       const Field *fields, void *item, Problem *problem);

// Reads a text that is one value into the member of `item` under `field`; `item` has its defaults,
// faults are at `pointer`. STATUS_INVALID also if the text is not JSON.
Status json_parse_value(const char *text, size_t size, const Field *field, void *item,
                        const char *pointer, Problem *problem);

// The tree of a text that is a JSON object within the limits above, else NULL. For files of json/
// alone: it is jansson's, released by json_decref.
struct json_t *json_parse_tree(const char *text, size_t size);
// The tree of a stored document, any value; NULL if it is damaged, or if memory ran out, which is
// set then.
struct json_t *json_parse_stored(const char *text, bool *is_out_of_memory);

// Where blocks of jansson's memory come from: malloc, except in tests.
extern void *(*json_memory_source)(size_t size);

// The size of a byte order mark at the start, which RFC 8259, section 8.1, allows to ignore.
size_t scan_mark(const char *text, size_t size);

// The elements of one array as they are in the text, one after the other.
typedef struct ScanList {
    const char *text;
    size_t begin, end;   // between the brackets
    size_t at;           // start of the next element
    size_t first, count; // of the element, without the white space around it
} ScanList;

// The array under the key `name` of a document that is an object. False if there is none, or a NUL
// byte or too deep a nesting before its end. An array that is not closed ends with the text.
bool scan_list(const char *text, size_t size, const char *name, ScanList *list);

// The next element, which may be empty; false behind the last.
bool scan_element(ScanList *list);

#endif
