// A document as a list of segments: headers, and numbers as they lie in memory or are counted up.
// Its size is known, and any part of it can be read alone, without a copy of the whole.
#ifndef SERVER_FORMATS_SEGMENTS_H
#define SERVER_FORMATS_SEGMENTS_H

#include <stdint.h>

#include "server/util/bytes.h"

// Bytes that are elsewhere: `read` copies `size` of them from `offset` of column `column` on, and
// remembers itself where it cannot.
typedef struct SegmentSource {
    void (*read)(void *context, size_t column, uint64_t offset, void *target, size_t size);
    void *context;
} SegmentSource;

typedef struct Segment {
    uint64_t start, size;        // in the document
    const double *values;        // borrowed; NULL: text, or counted
    size_t text;                 // where it begins in `text` of Segments
    double first, step, rate;    // counted: number i is (first + i step) / rate; else rate 0
    const SegmentSource *source; // borrowed; NULL: not from there
    size_t column;               // of the source
} Segment;

// All zero is empty. Once it failed (memory) it stays so, like Bytes.
typedef struct Segments {
    Segment *at;
    size_t count, room;
    uint64_t size;
    Bytes text;
    bool is_failed;
} Segments;

void segments_clear(Segments *segments);
void segments_put(Segments *segments, const void *data, size_t size); // copied
void segments_text(Segments *segments, Bytes *text);                  // copied, and cleared
void segments_number(Segments *segments, uint64_t value,
                     size_t size); // its `size` lowest bytes, lowest first
void segments_fill(Segments *segments, char with, size_t count);
void segments_values(Segments *segments, const double *values, size_t count); // borrowed
// (first + i step) / rate for i = 0 ... count - 1.
void segments_counted(Segments *segments, size_t first, size_t step, double rate, size_t count);
// All `size` bytes of a column of `source`, which is borrowed.
void segments_source(Segments *segments, const SegmentSource *source, size_t column, uint64_t size);
void segments_join(Segments *segments,
                   const Segments *other); // behind; borrows what `other` borrows

// Copies `size` bytes from `start` on; both within the document.
void segments_read(const Segments *segments, uint64_t start, void *target, size_t size);
void segments_write(const Segments *segments, Bytes *bytes); // appends the whole
uint32_t segments_crc32(const Segments *segments);           // of the whole

#endif
