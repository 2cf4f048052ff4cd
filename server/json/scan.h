// One pass over JSON text without reading it: how deep it nests, and which member a byte belongs
// to. Not a parser: it takes any bytes, and is right up to the first byte that is not JSON. Memory
// is bounded by JSON_DEPTH_MAX..
#ifndef SERVER_JSON_SCAN_H
#define SERVER_JSON_SCAN_H

#include <stdbool.h>
#include <stddef.h>

enum {
    // A parsed container costs some hundred bytes where its text takes two: the number of them is
    // bounded too.
    SCAN_CONTAINERS = 1 << 17,
    // Of one object: more than any row table has, and a table of a million keys costs seconds.
    SCAN_MEMBERS = 1 << 12,
};

typedef struct ScanPlace {
    size_t line, column; // from 1; characters, not bytes
    char pointer[256];   // of the value or the key at that byte, cut to fit
} ScanPlace;

// The size of a byte order mark at the beginning; 0 where there is none. What follows is given to
// the two below.
size_t scan_mark(const char *text, size_t size);

// The place of text[position].
void scan_place(const char *text, size_t size, size_t position, ScanPlace *place);

// Whether the text may be parsed at all. If not, where not and why (a static sentence).
bool scan_allows(const char *text, size_t size, size_t *position, const char **sentence);

// The elements of one array, one after the other, as they stand in the text.
typedef struct ScanList {
    const char *text;
    size_t begin, end;   // what stands between the brackets
    size_t at;           // where the next element is looked for
    size_t first, count; // of the element: without the blanks around it
} ScanList;

// The array under the key `name` of a document that is an object. False where there is none, or a
// NUL byte or too deep a nesting before its end. One that is not closed ends with the text.
bool scan_list(const char *text, size_t size, const char *name, ScanList *list);

// The next element; false behind the last. What stands between two commas is one, also if it is
// nothing.
bool scan_element(ScanList *list);

#endif
