// What stands before the numbers of a ground motion: count, interval, unit, and where they begin.
// Reads no samples. Used by import.c.
#ifndef CORE_FORMATS_IMPORT_HEADER_H
#define CORE_FORMATS_IMPORT_HEADER_H

#include "core/formats/text_table.h"

typedef struct ImportHeader {
    const char *layout;   // of the line that tells the count; NULL: there is none
    size_t count_line;    // its number
    double count;         // NAN: not told
    double interval;      // [s]; NAN: not told
    int unit;             // AccelerationUnit; CHOICE_ABSENT: not told
    size_t unit_line;     // where it is told
    size_t conflict_line; // where another unit is told; 0: nowhere
    bool is_time;         // its last line begins with "time"
    char text[1001];      // lines joined by "; ", cut
    TextReader data;      // from the first number on
} ImportHeader;

Status import_header_read(TextReader reader, ImportHeader *header, Problem *problem);

#endif
